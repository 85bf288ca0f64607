//! Numbers compared with a stated tolerance; a failure prints both, their difference and the place.

/// How far a number may lie from the wanted one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// Relative to the wanted number.
    Rel(f64),
    /// In the number's own unit.
    Abs(f64),
}

/// Panics unless `got` lies within `tolerance` of `want`; `what` says which number it is.
#[track_caller]
pub fn assert_close(what: &str, got: f64, want: f64, tolerance: Tolerance) {
    let difference = got - want;
    let limit = match tolerance {
        Tolerance::Rel(relative) => relative * want.abs(),
        Tolerance::Abs(absolute) => absolute,
    };
    // Written so that a NaN fails.
    assert!(
        difference.abs() <= limit,
        "{what}: got {got:.17e}, want {want:.17e}, difference {difference:.3e}, allowed {limit:.3e} ({tolerance:?})"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_numbers_pass() {
        assert_close("relative", 1.0 + 1e-13, 1.0, Tolerance::Rel(1e-12));
        assert_close("absolute", 1e-13, 0.0, Tolerance::Abs(1e-12));
    }

    #[test]
    #[should_panic(expected = "difference")]
    fn far_numbers_fail() {
        assert_close("far", 1.01, 1.0, Tolerance::Rel(1e-3));
    }

    #[test]
    #[should_panic(expected = "NaN")]
    fn not_a_number_fails() {
        assert_close("none", f64::NAN, 1.0, Tolerance::Abs(f64::INFINITY));
    }
}
