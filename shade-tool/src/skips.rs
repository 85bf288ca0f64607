//! Work that is left out, by name.

use geometry::source_tree::Opening;
use interchange::provenance::Provenance;

/// Something that is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Skip {
    /// Clusters of sources behind one blocker: not opened, as nothing of them is seen
    Hidden,
    /// Flat unblocked clusters seen under a small angle: counted by their moments
    Far,
}

/// Error of a sum in which flat clusters of radius below t times their distance count by their moments, over t^3: measured
/// at 2e-5, 2e-4 and 2e-3 for t = 0.1, 0.2 and 0.4 in a room with a box.
const ERROR_OF_FAR: f64 = 0.03;
/// Largest t: the series is not to be trusted beyond.
const FARTHEST: f64 = 0.4;
/// Part of a picture's tolerance that gathering may use up.
const SHARE: f64 = 0.02;

/// How sources are gathered: exactly, or to a share of the tolerance where one is given.
pub fn opening(turned_off: &[Skip], tolerance: Option<f64>) -> Opening {
    let far = tolerance.map_or(0.0, |tolerance| (SHARE * tolerance / ERROR_OF_FAR).cbrt().min(FARTHEST));
    Opening {
        far: if turned_off.contains(&Skip::Far) { 0.0 } else { far },
        hidden: !turned_off.contains(&Skip::Hidden),
    }
}

/// Adds to a provenance what changes the result.
pub fn sign(turned_off: &[Skip], provenance: Provenance) -> Provenance {
    // What is proved to give nothing changes no digit.
    if turned_off.contains(&Skip::Far) { provenance.flag("--no-skip far") } else { provenance }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skips_can_be_turned_off() {
        assert_eq!(opening(&[], None), Opening::EXACT);
        assert_eq!(opening(&[Skip::Far], Some(0.02)), Opening::EXACT);
        assert!(!opening(&[Skip::Hidden], Some(0.02)).hidden);
        assert!((opening(&[], Some(0.012)).far - 0.2).abs() < 1e-9);
    }
}
