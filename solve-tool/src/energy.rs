//! Energy balance of a channel: emitted = absorbed + escaped + still under way, up to the residual of the solution.

use crate::channels::Channel;
use crate::system::System;
use serde::Serialize;

/// Powers of one channel, W.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Energy {
    /// Sum of A E.
    pub emitted: f64,
    /// Sum of A (1 - rho) H.
    pub absorbed: f64,
    /// Sum of A B (1 - row sum): what leaves the scene, or is lost to errors of the rows.
    pub escaped: f64,
    /// What has arrived and was not sent on: after k bounces, the next one's. 0 in a solution.
    pub under_way: f64,
    /// |emitted - absorbed - escaped - under way| / emitted, signs aside; 0 where nothing is emitted.
    pub defect: f64,
}

impl Energy {
    /// Balance of radiosity B and irradiance H of a solution.
    pub fn of(system: &System<'_>, channel: &Channel, radiosity: &[f64], irradiance: &[f64]) -> Self {
        Self::under_way(system, channel, radiosity, radiosity, irradiance)
    }

    /// Balance of a radiosity B = E + rho H with H = F `shot`, where the rest of B is still under way.
    pub fn under_way(
        system: &System<'_>,
        channel: &Channel,
        shot: &[f64],
        radiosity: &[f64],
        irradiance: &[f64],
    ) -> Self {
        let areas = system.areas;
        let emitted = channel.emitted(areas);
        let (mut absorbed, mut escaped, mut under_way, mut given) = (0.0, 0.0, 0.0, 0.0);
        for i in 0..areas.len() {
            absorbed += areas[i] * (1.0 - channel.reflectance[i]) * irradiance[i];
            escaped += areas[i] * shot[i] * (1.0 - system.row_sums[i]);
            under_way += areas[i] * (radiosity[i] - shot[i]);
            given += areas[i] * channel.exitance[i].abs();
        }
        let difference = (emitted - absorbed - escaped - under_way).abs();
        let defect = if given > 0.0 { difference / given } else { 0.0 };
        Self { emitted, absorbed, escaped, under_way, defect }
    }
}
