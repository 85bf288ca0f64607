//! Energy balance of a channel: emitted = absorbed + escaped, up to the residual of the solution.

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
    /// |emitted - absorbed - escaped| / emitted; 0 where nothing is emitted.
    pub defect: f64,
}

impl Energy {
    /// Balance of radiosity B and irradiance H.
    pub fn of(system: &System<'_>, channel: &Channel, radiosity: &[f64], irradiance: &[f64]) -> Self {
        let areas = system.areas;
        let emitted = channel.emitted(areas);
        let (mut absorbed, mut escaped) = (0.0, 0.0);
        for i in 0..areas.len() {
            absorbed += areas[i] * (1.0 - channel.reflectance[i]) * irradiance[i];
            escaped += areas[i] * radiosity[i] * (1.0 - system.row_sums[i]);
        }
        let defect = if emitted > 0.0 { (emitted - absorbed - escaped).abs() / emitted } else { 0.0 };
        Self { emitted, absorbed, escaped, defect }
    }
}
