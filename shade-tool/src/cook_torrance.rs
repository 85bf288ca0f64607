//! Highlight of a rough surface (Cook & Torrance 1982): facets with Beckmann's distribution of slopes that mirror by
//! Fresnel's law and shade each other in V-shaped grooves, f = F D G / (4 (N.L) (N.V)).
//!
//! The constant is 4, with D normalised such that the integral of D cos over the hemisphere is 1; the printed versions have
//! pi and another D. A furnace decides: with 4 nothing reflects more than it gets, and small slopes reflect all.
//! What large slopes lose is light that leaves a groove after more than one reflection, which the model leaves out.

use glam::DVec3;
use std::f64::consts::PI;

/// Slopes below this are as good as smooth; squares of smaller ones would lose digits.
pub const SMOOTHEST: f64 = 1e-4;

/// A rough surface, its facets' reflectance left to the caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CookTorrance {
    /// Root mean square slope m of the facets.
    pub slope: f64,
}

impl CookTorrance {
    /// Beckmann's distribution D of facets around the normal, sr^-1, by the cosine of the facet's tilt.
    pub fn distribution(&self, cos_tilt: f64) -> f64 {
        if cos_tilt <= 0.0 {
            return 0.0;
        }
        let (m2, cos2) = (self.slope * self.slope, cos_tilt * cos_tilt);
        (-(1.0 - cos2) / (cos2 * m2)).exp() / (PI * m2 * cos2 * cos2)
    }

    /// Radiance that leaves towards the eye per radiance and solid angle of the light (sr^-1), for facets that mirror all:
    /// f (N.L); and the cosine of the angle at which the facets mirror, for Fresnel's law.
    ///
    /// G / (N.V) is taken together: at grazing angles G falls with N.V and the quotient stays finite.
    pub fn reflected(&self, normal: DVec3, to_eye: DVec3, to_light: DVec3) -> (f64, f64) {
        let half = half_vector(normal, to_eye, to_light);
        let (cos_light, cos_eye) = (normal.dot(to_light), normal.dot(to_eye));
        let (cos_tilt, cos_facet) = (normal.dot(half), half.dot(to_eye));
        if cos_light <= 0.0 || cos_eye <= 0.0 || cos_facet <= 0.0 {
            return (0.0, 1.0);
        }
        let groove = 2.0 * cos_tilt / cos_facet;
        let masked = (1.0 / cos_eye).min(groove).min(groove * cos_light / cos_eye);
        (0.25 * self.distribution(cos_tilt) * masked, cos_facet.min(1.0))
    }

    /// Standard deviation of the tilt of the facets in radians: D is about exp(-x^2 / m^2).
    pub fn spread(&self) -> f64 {
        (self.slope * std::f64::consts::FRAC_1_SQRT_2).min(0.5)
    }
}

/// Direction half way between light and eye: the normal of the facets that mirror one to the other.
pub fn half_vector(normal: DVec3, to_eye: DVec3, to_light: DVec3) -> DVec3 {
    (to_eye + to_light).try_normalize().unwrap_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn direction(degrees: f64, azimuth: f64) -> DVec3 {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine)
    }

    fn brdf(slope: f64, light: DVec3, eye: DVec3) -> f64 {
        CookTorrance { slope }.reflected(DVec3::Z, eye, light).0 / light.z
    }

    /// In the plane of incidence, eye opposite to the light; values from an independent computation.
    #[test]
    fn reflectances_are_the_known_ones() {
        for (slope, light, eye, want) in [
            (0.2, 0.0, 0.0, 1.98943679),
            (0.2, 45.0, 30.0, 2.17999913),
            (0.2, 30.0, 60.0, 0.87686124),
            (0.4, 45.0, 45.0, 0.99471839),
        ] {
            let got = brdf(slope, direction(light, 0.0), direction(eye, PI));
            assert!((got - want).abs() < 5.1e-9, "m {slope} ({light}, {eye}): {got}, want {want}");
        }
        assert!((CookTorrance { slope: 0.2 }.distribution(1.0) - 7.95774715).abs() < 5.1e-9);
    }

    #[test]
    fn reciprocal_to_rounding() {
        for slope in [0.05, 0.3, 1.0] {
            for (a, b, azimuth) in [(0.0, 50.0, 1.0), (30.0, 60.0, 3.0), (80.0, 20.0, 2.0), (85.0, 88.0, 3.1)]
            {
                let (a, b) = (direction(a, 0.2), direction(b, azimuth));
                let (there, back) = (brdf(slope, a, b), brdf(slope, b, a));
                assert!((there - back).abs() <= 1e-12 * there, "{slope} {a} {b}: {there} {back}");
            }
        }
    }

    /// Reflected part of what comes from a direction, all facets mirroring: integral over tilts of the facets, which
    /// follows the lobe; a facet at solid angle dh sends light to dw = 4 (h.L) dh.
    fn albedo(slope: f64, degrees: f64) -> f64 {
        let light = direction(degrees, 0.0);
        let (n_tilt, n_azimuth) = (1500, 720);
        let mut sum = 0.0;
        for i in 0..n_tilt {
            let tilt = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(n_tilt);
            for j in 0..n_azimuth {
                let half = direction(tilt.to_degrees(), TAU * (f64::from(j) + 0.5) / f64::from(n_azimuth));
                let cos_facet = half.dot(light);
                let eye = 2.0 * cos_facet * half - light;
                if cos_facet > 0.0 && eye.z > 0.0 {
                    sum += brdf(slope, light, eye) * eye.z * 4.0 * cos_facet * tilt.sin();
                }
            }
        }
        sum * 0.5 * PI / f64::from(n_tilt) * TAU / f64::from(n_azimuth)
    }

    #[test]
    fn white_furnace_has_the_known_albedos() {
        for (slope, degrees, want) in [
            (0.2, 0.0, 0.99998),
            (0.2, 60.0, 0.96559),
            (0.2, 75.0, 0.92752),
            (0.6, 0.0, 0.79760),
            (0.6, 60.0, 0.87350),
            (1.0, 0.0, 0.45346),
        ] {
            let got = albedo(slope, degrees);
            assert!((got - want).abs() < 2e-5, "m {slope} at {degrees}: {got}, want {want}");
            assert!(got <= 1.0);
        }
    }

    #[test]
    fn grazing_light_and_eyes_give_numbers() {
        let surface = CookTorrance { slope: 0.3 };
        for (light, eye) in [(90.0, 90.0), (90.0, 10.0), (10.0, 90.0), (89.999999, 89.999999), (120.0, 10.0)]
        {
            let (value, cosine) = surface.reflected(DVec3::Z, direction(eye, PI), direction(light, 0.0));
            assert!(
                value.is_finite() && value >= 0.0 && (0.0..=1.0).contains(&cosine),
                "{light} {eye}: {value}"
            );
        }
        let exactly = surface.reflected(DVec3::Z, DVec3::X, -DVec3::X);
        assert_eq!(exactly, (0.0, 1.0));
    }
}
