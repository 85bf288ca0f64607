//! Bounce-limited results: after k bounces B_k = E + rho F B_(k-1), B_0 = E, the partial sums of Neumann's series. k
//! products, no solve.

use crate::channels::{Channel, Distinct};
use crate::energy::Energy;
use crate::equation::apply;
use crate::error_budget::MatrixError;
use crate::skips::{Skip, Skips};
use crate::solve::{ChannelSolution, Solved};
use crate::system::System;
use crate::work::End;

/// Radiosity after `bounces` reflections, 0 being the emission alone, and the irradiance that it reflects.
pub fn bounce(system: &System<'_>, channels: &[Channel; 3], bounces: u32, skips: &Skips) -> Solved {
    let distinct = match skips.has(Skip::EqualChannels) {
        true => Distinct::of(channels),
        false => Distinct::all(channels),
    };
    let areas = system.areas;
    let zero = || vec![0.0; areas.len()];
    let lit: Vec<usize> = (0..distinct.channels.len()).filter(|&d| distinct.channels[d].emits()).collect();
    let mut before: Vec<Vec<f64>> = distinct.channels.iter().map(|_| zero()).collect();
    let mut radiosities: Vec<Vec<f64>> = distinct.channels.iter().map(|c| c.exitance.clone()).collect();
    let mut irradiances: Vec<Vec<f64>> = distinct.channels.iter().map(|_| zero()).collect();
    let mut products = 0;
    for _ in 0..bounces {
        if lit.is_empty() {
            break;
        }
        let shot: Vec<Vec<f64>> = lit.iter().map(|&d| radiosities[d].clone()).collect();
        products += 1;
        for (&d, arriving) in lit.iter().zip(apply(&system.product, &shot)) {
            let channel = &distinct.channels[d];
            irradiances[d] = arriving.iter().zip(areas).map(|(power, area)| power / area).collect();
            let next =
                (0..areas.len()).map(|i| channel.exitance[i] + channel.reflectance[i] * irradiances[d][i]);
            before[d] = std::mem::replace(&mut radiosities[d], next.collect());
        }
    }

    let solution = |c: usize| {
        let (d, scale) = (distinct.index[c], distinct.scale[c]);
        let scaled = |values: &[f64]| -> Vec<f64> { values.iter().map(|x| scale * x).collect() };
        let (radiosity, irradiance) = (scaled(&radiosities[d]), scaled(&irradiances[d]));
        let energy = Energy::under_way(system, &channels[c], &scaled(&before[d]), &radiosity, &irradiance);
        ChannelSolution {
            energy,
            radiosity,
            irradiance,
            history: Vec::new(),
            bound: 0.0,
            end: End::Converged,
            amplification: 1.0,
            matrix_error: MatrixError::default(),
        }
    };
    let different = distinct.channels.len();
    Solved {
        channels: std::array::from_fn(solution),
        method: format!("partial sum of {bounces} bounces"),
        counters: vec![("distinct channels".into(), different), ("products".into(), products)],
        warnings: Vec::new(),
    }
}
