//! Phong's highlight (Phong 1975): cos^n of the angle between the light's mirror direction and the eye.

use glam::DVec3;
use std::f64::consts::TAU;

/// Which constant, and whether the highlight is reflected light or added to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum PhongForm {
    /// f = Ks (n + 2) / (2 pi) cos^n: reflects at most Ks, whatever the exponent
    Normalised,
    /// As published: Ks cos^n of the light, however slantingly it comes; low exponents create energy
    #[value(name = "1975")]
    Original,
}

/// A highlight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phong {
    /// Form.
    pub form: PhongForm,
    /// Exponent n, at least 0.
    pub exponent: f64,
}

impl Phong {
    /// Radiance that leaves towards the eye per radiance and solid angle of the light (sr^-1), for Ks = 1: the bidirectional
    /// reflectance times the cosine of incidence. `mirrored` is the eye's direction mirrored at the normal.
    pub fn reflected(&self, normal: DVec3, mirrored: DVec3, to_light: DVec3) -> f64 {
        let (cos_light, cos_lobe) = (normal.dot(to_light), mirrored.dot(to_light));
        // A lobe that reaches below the horizon is cut there: light from behind makes no highlight.
        if cos_light <= 0.0 || cos_lobe <= 0.0 {
            return 0.0;
        }
        let lobe = cos_lobe.powf(self.exponent);
        match self.form {
            PhongForm::Normalised => (self.exponent + 2.0) / TAU * lobe * cos_light,
            PhongForm::Original => lobe,
        }
    }

    /// Standard deviation of the lobe in radians: cos^n x is about exp(-n x^2 / 2).
    pub fn spread(&self) -> f64 {
        1.0 / self.exponent.max(1.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn direction(degrees: f64, azimuth: f64) -> DVec3 {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        DVec3::new(sine * azimuth.cos(), sine * azimuth.sin(), cosine)
    }

    /// Reflected power per arriving one from a direction: integral of f cos over the eyes.
    fn albedo(phong: Phong, degrees: f64) -> f64 {
        let (n_theta, n_phi) = (4000, 360);
        let light = direction(degrees, 0.0);
        let mut sum = 0.0;
        for i in 0..n_theta {
            // Equal steps of sin^2: each cell has the same projected solid angle.
            let sine2 = (f64::from(i) + 0.5) / f64::from(n_theta);
            let theta = sine2.sqrt().asin().to_degrees();
            for j in 0..n_phi {
                let eye = direction(theta, TAU * (f64::from(j) + 0.5) / f64::from(n_phi));
                let mirrored = DVec3::new(-eye.x, -eye.y, eye.z);
                sum += phong.reflected(DVec3::Z, mirrored, light);
            }
        }
        // Per radiance that arrives the lobe gives f cos_i; per irradiance it is f.
        sum * std::f64::consts::PI / f64::from(n_theta * n_phi) / light.z
    }

    #[test]
    fn normalised_lobe_has_the_known_albedos() {
        for (degrees, exponent, want) in [
            (0.0, 1.0, 1.0),
            (0.0, 10.0, 1.0),
            (0.0, 100.0, 1.0),
            (60.0, 1.0, 0.60900),
            (60.0, 10.0, 0.50474),
            (60.0, 100.0, 0.50000),
            (30.0, 10.0, 0.86603),
            (30.0, 100.0, 0.86603),
            (80.0, 100.0, 0.17523),
        ] {
            let got = albedo(Phong { form: PhongForm::Normalised, exponent }, degrees);
            // Midpoints of steps h = 2.5e-4 of sin^2: (n h / 2)^2 / 24 = 7e-6 for n = 100; the values have five digits.
            assert!((got - want).abs() < 2e-5, "{degrees} n {exponent}: {got}, want {want}");
        }
    }

    #[test]
    fn form_of_1975_creates_energy_at_low_exponents() {
        for exponent in [1.0, 10.0, 100.0] {
            // 2.0944, 0.5236 and 0.0616 at normal incidence.
            let want = TAU / (exponent + 2.0);
            let got = albedo(Phong { form: PhongForm::Original, exponent }, 0.0);
            assert!((got - want).abs() < 2e-5, "n {exponent}: {got}, want {want}");
        }
    }

    #[test]
    fn normalised_lobe_is_reciprocal_and_ends_at_the_horizon() {
        let phong = Phong { form: PhongForm::Normalised, exponent: 20.0 };
        let f =
            |from: DVec3, to: DVec3| phong.reflected(DVec3::Z, DVec3::new(-to.x, -to.y, to.z), from) / from.z;
        for (a, b) in [(10.0, 35.0), (70.0, 80.0), (0.0, 20.0)] {
            let (a, b) = (direction(a, 0.3), direction(b, 3.0));
            assert!(f(a, b) > 0.0 && (f(a, b) / f(b, a) - 1.0).abs() < 1e-12);
        }
        let below = DVec3::new(0.8, 0.0, -0.6);
        assert_eq!(phong.reflected(DVec3::Z, direction(89.0, 0.0), below), 0.0);
    }
}
