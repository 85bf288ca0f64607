//! What the report says of a solution: bounds, errors, energy, counters; and why a tolerance was missed.

use crate::bounds::Bounded;
use crate::channels::CHANNEL_NAMES;
use crate::error_budget::shortfall;
use crate::solve::Solved;
use crate::system::System;
use crate::work::End;
use interchange::ids::ElementId;
use interchange::matrix::{Matrix, MatrixRecord};
use interchange::mesh::Mesh;
use interchange::report::Report;

/// The largest bound of the channels.
pub fn worst_bound(solved: &Solved) -> f64 {
    solved.channels.iter().map(|c| c.bound).fold(0.0, f64::max)
}

/// Fills the report.
pub fn fill(report: &mut Report, solved: &Solved, system: &System<'_>, matrix: &Matrix) {
    report.count("elements", system.areas.len());
    report.count("stored entries", system.product.stored_entries());
    for (name, amount) in &solved.counters {
        report.count(name, *amount);
    }
    report.estimate("matrix tolerance asked", matrix.record().tolerance);
    report.estimate("row error by storage and summation", system.rounding);
    report.estimate("solver bound", worst_bound(solved));
    for (name, channel) in CHANNEL_NAMES.iter().zip(&solved.channels) {
        report.estimate(&format!("solver bound {name}"), channel.bound);
        report.estimate(&format!("row error {name}"), channel.matrix_error.row_error);
        report.estimate(&format!("row error amplification {name}"), channel.matrix_error.amplification);
        report.estimate(&format!("matrix error {name}"), channel.matrix_error.relative);
        report.estimate(&format!("power emitted {name}"), channel.energy.emitted);
        report.estimate(&format!("power absorbed {name}"), channel.energy.absorbed);
        report.estimate(&format!("power escaped {name}"), channel.energy.escaped);
        report.estimate(&format!("power under way {name}"), channel.energy.under_way);
        report.estimate(&format!("energy defect {name}"), channel.energy.defect);
    }
    for warning in &solved.warnings {
        report.warn(warning.as_str());
    }
}

/// Elements and links named in the report; all are in the solution file.
const NAMED: usize = 20;

/// Adds bounds, the three terms of error and the worst elements and links.
pub fn fill_bounds(report: &mut Report, bounded: &Bounded, mesh: &Mesh) {
    report.count("products for upper and lower bounds", bounded.products);
    for (c, name) in CHANNEL_NAMES.iter().enumerate() {
        let terms = &bounded.terms[c];
        for (what, term) in
            [("matrix", terms.matrix), ("solver", terms.solver), ("discretisation", terms.discretisation)]
        {
            report.estimate(&format!("error by {what} {name}, power norm"), term.power);
            report.estimate(&format!("error by {what} {name}, sup norm"), term.sup);
        }
        let widths = bounded.lower[c].iter().zip(&bounded.upper[c]).map(|(lower, upper)| upper - lower);
        report.estimate(&format!("widest bounds {name}"), widths.fold(0.0, f64::max));
        let unbounded = bounded.upper[c].iter().filter(|upper| upper.is_infinite()).count();
        report.count("radiosities without upper bound", unbounded);
        if unbounded > 0 {
            report.warn(format!(
                "{name} channel: errors of the matrix may grow without bound by interreflection; the upper bounds are \
                 infinite; run formfactor-tool compute with a smaller --tolerance"
            ));
        }
    }
    let place = |i: u32| {
        let element = ElementId(i);
        let face = mesh.face_inputs[mesh.element_face(element).index()] + 1;
        format!("element {} of face {face}, {}", i + 1, mesh.groups[mesh.element_group(element).index()])
    };
    for (rank, &i) in bounded.ranking.iter().take(NAMED).enumerate() {
        let sum: f64 = bounded.element_errors[i as usize].iter().sum();
        report.estimate(&format!("worst element {:02}: {}", rank + 1, place(i)), sum);
    }
    for (rank, link) in bounded.links.iter().take(NAMED).enumerate() {
        let name = format!("worst link {:02}: {} to {}", rank + 1, place(link.first), place(link.second));
        report.estimate(&name, link.error);
    }
}

/// Why the asked tolerance does not hold, if it does not: the solver's own bound first, else the matrix's errors.
pub fn missed(solved: &Solved, tolerance: f64, matrix: &MatrixRecord) -> Option<String> {
    let bounds = CHANNEL_NAMES.iter().zip(&solved.channels);
    let worst = bounds.max_by(|a, b| a.1.bound.total_cmp(&b.1.bound)).filter(|(_, c)| c.bound > tolerance);
    if let Some((name, channel)) = worst.filter(|(_, channel)| channel.bound.is_infinite()) {
        return Some(format!(
            "no bound on the solver's error could be proved in the {name} channel, so none below the asked {tolerance:e}: \
             light may grow by interreflection; the best iterate was written (its residual {}); darker materials, or a \
             matrix whose row sums are at most 1, have a bound",
            channel.end.describe()
        ));
    }
    if let Some((name, channel)) = worst {
        return Some(format!(
            "the bound on the solver's error {} at {:.1e} in the {name} channel, above the asked {tolerance:e}; the best \
             iterate was written; {}",
            channel.end.describe(),
            channel.bound,
            match channel.end {
                End::StepLimit => "more --max-steps or another --solver helps",
                _ => "a larger --tolerance or a smaller formfactor-tool --tolerance helps",
            }
        ));
    }
    let errors = CHANNEL_NAMES.iter().zip(&solved.channels);
    let (name, channel) =
        errors.max_by(|a, b| a.1.matrix_error.relative.total_cmp(&b.1.matrix_error.relative))?;
    shortfall(&channel.matrix_error, tolerance, matrix, name)
}
