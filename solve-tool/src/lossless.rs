//! Refusal of what has no solution: a lit component from which light can neither leave nor be absorbed.

use crate::channels::Channel;
use crate::components::Components;
use crate::system::System;

/// A lit component whose reflectances in one channel are all 1 and whose rows lose nothing beyond their own error.
#[derive(Debug, Clone, PartialEq)]
pub struct Lossless {
    /// Name of the channel.
    pub channel: &'static str,
    /// Elements of the component.
    pub elements: Vec<usize>,
    /// Largest escape, 1 less the row sum, of any of them.
    pub escape: f64,
    /// Estimated error of that row.
    pub row_error: f64,
    /// The elements in the user's words: faces and groups. Empty until somebody who knows the mesh fills it in.
    pub place: String,
}

impl std::fmt::Display for Lossless {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let place = match self.place.is_empty() {
            true => format!("{} connected elements", self.elements.len()),
            false => self.place.clone(),
        };
        write!(
            f,
            "no finite solution: light is emitted among {place}, where every Kd is 1 in the {} channel and no row of \
             the matrix loses more than its own error (largest escape {:.1e}, error of that row {:.1e}), so it can \
             neither leave nor be absorbed; give one of these faces a Kd below 1, or open the enclosure",
            self.channel,
            self.escape.max(0.0),
            self.row_error
        )
    }
}

/// The first component that has no solution in this channel, if there is one.
pub fn find(
    system: &System<'_>,
    components: &Components,
    channel: &Channel,
    name: &'static str,
) -> Option<Lossless> {
    let lit = components.any(|i| channel.exitance[i] != 0.0);
    let escape = |i: usize| 1.0 - system.row_sums[i];
    let losing = components.any(|i| channel.reflectance[i] < 1.0 || escape(i) > system.row_errors[i]);
    let component = (0..components.count).find(|&c| lit[c] && !losing[c])?;
    let elements: Vec<usize> =
        (0..system.areas.len()).filter(|&i| components.of_element[i] as usize == component).collect();
    let widest = elements.iter().copied().max_by(|&a, &b| escape(a).total_cmp(&escape(b)))?;
    let (escape, row_error) = (escape(widest), system.row_errors[widest]);
    Some(Lossless { channel: name, elements, escape, row_error, place: String::new() })
}
