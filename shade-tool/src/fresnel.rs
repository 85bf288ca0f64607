//! Reflectance of a smooth surface: Fresnel's equations for unpolarised light, with a complex index of refraction.

/// Index of refraction relative to the medium that light comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Index {
    /// Real part.
    pub n: f64,
    /// Extinction coefficient; 0 for dielectrics.
    pub k: f64,
}

/// A reflectance of 1 would need an infinite index.
const HIGHEST: f64 = 1.0 - 1e-9;

impl Index {
    /// Reflectance at normal incidence.
    pub fn normal_reflectance(self) -> f64 {
        let Index { n, k } = self;
        ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k)
    }

    /// The dielectric with that reflectance at normal incidence, as Cook & Torrance 1982 take it where nothing else is known:
    /// n = (1 + sqrt(r)) / (1 - sqrt(r)).
    pub fn of_reflectance(reflectance: f64) -> Index {
        let root = reflectance.clamp(0.0, HIGHEST).sqrt();
        Index { n: (1.0 + root) / (1.0 - root), k: 0.0 }
    }

    /// The metal with that real index and reflectance at normal incidence; `None` where the index alone reflects more.
    pub fn of_metal(n: f64, reflectance: f64) -> Option<Index> {
        let reflectance = reflectance.clamp(0.0, HIGHEST);
        let square = (reflectance * (n + 1.0).powi(2) - (n - 1.0).powi(2)) / (1.0 - reflectance);
        (square >= 0.0).then(|| Index { n, k: square.sqrt() })
    }

    /// Reflectance, mean of both polarisations, at an angle of incidence with this cosine (0 to 1).
    ///
    /// With a^2 + b^2 = |(n - ik)^2 - sin^2| and a its root's real part: R_s = ((a - c)^2 + b^2) / ((a + c)^2 + b^2) and
    /// R_p = R_s ((a - s^2/c)^2 + b^2) / ((a + s^2/c)^2 + b^2), both multiplied out so that c = 0 is no exception.
    pub fn reflectance(self, cosine: f64) -> f64 {
        let Index { n, k } = self;
        let c = cosine.clamp(0.0, 1.0);
        let (c2, s2) = (c * c, 1.0 - c * c);
        let real = n * n - k * k - s2;
        let modulus = real.hypot(2.0 * n * k);
        // Where the real part is negative the root's own would cancel: total reflection, a = 0 for k = 0.
        let a = (0.5 * (modulus + real)).max(0.0).sqrt();
        let perpendicular = (modulus - 2.0 * a * c + c2) / (modulus + 2.0 * a * c + c2);
        let (even, odd) = (modulus * c2 + s2 * s2, 2.0 * a * c * s2);
        let parallel = perpendicular * (even - odd) / (even + odd);
        0.5 * (perpendicular + parallel)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use geometry::quadrature::gauss;

    /// Values from an independent computation, to the digits given.
    #[test]
    fn reflectances_are_the_known_ones() {
        for (n, k, degrees, want) in [
            (1.5, 0.0, 0.0, 0.04),
            (1.5, 0.0, 30.0, 0.041522626),
            (1.5, 0.0, 45.0, 0.050239911),
            (1.5, 0.0, 60.0, 0.089186713),
            (1.5, 0.0, 75.0, 0.253060563),
            (0.2, 3.0, 0.0, 0.923371648),
            (0.2, 3.0, 60.0, 0.918411085),
            (0.2, 3.0, 85.0, 0.963598562),
            (1.5, 7.0, 0.0, 0.891402715),
            (1.5, 7.0, 80.0, 0.817554682),
            (1.5, 7.0, 81.5, 0.816024),
            (1.0 / 1.5, 0.0, 30.0, 0.055190167),
        ] {
            let got = Index { n, k }.reflectance(f64::to_radians(degrees).cos());
            // Half a unit of the last digit given.
            let tolerance = if want == 0.816024 { 5e-7 } else { 5.1e-10 };
            assert!((got - want).abs() < tolerance, "n {n} k {k} at {degrees}: {got}, want {want}");
        }
    }

    #[test]
    fn glass_reflects_all_beyond_the_critical_angle_and_at_grazing() {
        let inside = Index { n: 1.0 / 1.5, k: 0.0 };
        assert_eq!(inside.reflectance(45f64.to_radians().cos()), 1.0);
        for index in [inside, Index { n: 1.5, k: 0.0 }, Index { n: 0.2, k: 3.0 }] {
            assert!((index.reflectance(0.0) - 1.0).abs() < 1e-15);
        }
        assert_eq!(Index { n: 1.0, k: 0.0 }.reflectance(0.4), 0.0);
    }

    /// Integral of 2 F(c) c dc, piece by piece where it has a kink.
    fn hemispherical(index: Index, kink: f64) -> f64 {
        let mut sum = 0.0;
        for (low, high) in [(0.0, kink), (kink, 1.0)] {
            // The substitution low + (high - low) t^2 takes the root's singularity at the kink away.
            for (x, w) in gauss(24).points.iter().zip(&gauss(24).weights) {
                let t = 0.5 * (1.0 + x);
                let c = low + (high - low) * t * t;
                sum += w * t * (high - low) * 2.0 * c * index.reflectance(c);
            }
        }
        sum
    }

    #[test]
    fn hemispherical_reflectances_are_the_known_ones() {
        let critical = (1.0 - 1.0 / 2.25f64).sqrt();
        for (n, kink, want) in
            [(1.5, 0.0, 0.0917779593), (1.33, 0.0, 0.0659308493), (1.0 / 1.5, critical, 0.5963457597)]
        {
            let got = hemispherical(Index { n, k: 0.0 }, kink);
            assert!((got - want).abs() < 1e-9, "{n}: {got}, want {want}");
        }
    }

    #[test]
    fn indices_have_the_reflectance_they_were_made_for() {
        for reflectance in [0.0, 0.04, 0.5, 0.95] {
            let back = Index::of_reflectance(reflectance).normal_reflectance();
            assert!((back - reflectance).abs() < 1e-14, "{back}");
        }
        let silver = Index::of_metal(0.2, Index { n: 0.2, k: 3.0 }.normal_reflectance()).unwrap();
        assert!((silver.k - 3.0).abs() < 1e-12);
        assert_eq!(Index::of_metal(1.5, 0.03), None);
        assert!(Index::of_metal(1.5, 1.0).unwrap().reflectance(0.5) > 0.999_999);
    }
}
