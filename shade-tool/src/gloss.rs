//! The highlight that a material's Ks, Ns, Ni and Pr describe, and its integral over a polygon of light.
//!
//! Ks is the reflectance at normal incidence, in every model, so that their pictures can be compared. Cook & Torrance's
//! facets get the index of refraction that gives it: with Ni the metal of that real index (or where Ni alone reflects more, a
//! dimmer dielectric), without Ni the dielectric that has it. Their slope is Pr squared (as the roughness of the PBR
//! extension is meant), or without Pr that of a highlight as wide as Phong's: m = 1 / sqrt(2 Ns + 1), because a facet tilted
//! by x turns the light by 2 x.

use crate::cook_torrance::{CookTorrance, SMOOTHEST, half_vector};
use crate::fresnel::Index;
use crate::phong::{Phong, PhongForm};
use geometry::quadrature::radon_rule;
use glam::DVec3;
use interchange::materials::Material;

/// Triangles of light are halved until the lobe's coordinate varies over them by less than its spread, or beside the lobe by
/// this part of the distance from its peak: there the integrand is small and falls evenly.
const BESIDE: f64 = 0.5;
/// Triangles seen under more than this angle, radians, are halved: the solid angle of near light varies over them.
const WIDEST: f64 = 0.5;
/// Halvings of a triangle at most: 2^-12 of the light is below any spread that is told from a mirror.
const DEEPEST: u32 = 12;

/// How a surface makes highlights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Gloss {
    /// Phong's.
    Phong(Phong),
    /// Cook & Torrance's, with the index of refraction and a factor for each channel.
    CookTorrance(CookTorrance, [(f64, Index); 3]),
}

impl Gloss {
    /// Phong's highlight of a material; `None` where it has none.
    pub fn phong(material: &Material, form: PhongForm) -> Option<Gloss> {
        let phong = Phong { form, exponent: material.exponent.max(0.0) };
        shines(material).then_some(Gloss::Phong(phong))
    }

    /// Cook & Torrance's highlight of a material; `None` where it has none.
    pub fn cook_torrance(material: &Material) -> Option<Gloss> {
        let slope = if material.roughness > 0.0 {
            material.roughness * material.roughness
        } else {
            1.0 / (2.0 * material.exponent.max(0.0) + 1.0).sqrt()
        };
        let surface = CookTorrance { slope: slope.max(SMOOTHEST) };
        let of_channel = |specular: f64| index(specular.clamp(0.0, 1.0), material.refraction);
        shines(material).then(|| Gloss::CookTorrance(surface, material.specular.map(of_channel)))
    }

    /// Radiance per radiance and solid angle of the light (sr^-1) in each channel, for Phong without Ks.
    fn reflected(&self, view: &View, to_light: DVec3) -> [f64; 3] {
        match self {
            Gloss::Phong(phong) => [phong.reflected(view.normal, view.mirrored, to_light); 3],
            Gloss::CookTorrance(surface, channels) => {
                let (value, cosine) = surface.reflected(view.normal, view.to_eye, to_light);
                if value == 0.0 {
                    return [0.0; 3];
                }
                channels.map(|(factor, index)| factor * index.reflectance(cosine) * value)
            }
        }
    }

    /// What the lobe is a function of, and where it peaks.
    fn coordinate(&self, view: &View, to_light: DVec3) -> DVec3 {
        match self {
            Gloss::Phong(_) => to_light,
            Gloss::CookTorrance(..) => half_vector(view.normal, view.to_eye, to_light),
        }
    }

    fn peak(&self, view: &View) -> DVec3 {
        match self {
            Gloss::Phong(_) => view.mirrored,
            Gloss::CookTorrance(..) => view.normal,
        }
    }

    fn spread(&self) -> f64 {
        match self {
            Gloss::Phong(phong) => phong.spread(),
            Gloss::CookTorrance(surface, _) => surface.spread(),
        }
    }
}

/// Whether the material has a highlight.
pub fn shines(material: &Material) -> bool {
    material.specular.iter().any(|&ks| ks > 0.0)
}

/// Factor and index of refraction of facets that reflect `specular` at normal incidence.
fn index(specular: f64, refraction: f64) -> (f64, Index) {
    if refraction <= 0.0 || refraction == 1.0 {
        return (1.0, Index::of_reflectance(specular));
    }
    match Index::of_metal(refraction, specular) {
        Some(metal) => (1.0, metal),
        None => {
            let dielectric = Index { n: refraction, k: 0.0 };
            (specular / dielectric.normal_reflectance(), dielectric)
        }
    }
}

/// A surface point as it is seen.
#[derive(Debug, Clone, Copy)]
pub struct View {
    /// Unit normal.
    pub normal: DVec3,
    /// Unit vector to the eye.
    pub to_eye: DVec3,
    /// The same, mirrored at the normal.
    pub mirrored: DVec3,
}

impl View {
    /// With the eye in direction `to_eye`.
    pub fn new(normal: DVec3, to_eye: DVec3) -> View {
        View { normal, to_eye, mirrored: 2.0 * normal.dot(to_eye) * normal - to_eye }
    }
}

/// Working memory of [`highlight`].
#[derive(Debug, Default)]
pub struct Scratch {
    stack: Vec<([DVec3; 3], u32)>,
    points: Vec<DVec3>,
    weights: Vec<f64>,
}

/// Radiance of the highlight of a convex polygon of light with radiance 1, whose corners are given from the point on and lie
/// above its horizon. For Phong without Ks.
///
/// Radon's rule of degree 5 on triangles that follow the lobe: smooth, the same for any neighbour, without noise.
pub fn highlight(gloss: &Gloss, view: &View, polygon: &[DVec3], scratch: &mut Scratch) -> [f64; 3] {
    let Scratch { stack, points, weights } = scratch;
    let mut sum = [0.0; 3];
    let spread = gloss.spread();
    stack.clear();
    stack.extend((2..polygon.len()).map(|k| ([polygon[0], polygon[k - 1], polygon[k]], 0)));
    while let Some((triangle, depth)) = stack.pop() {
        let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize_or_zero();
        if normal == DVec3::ZERO {
            continue;
        }
        let unit = triangle.map(|corner| corner.normalize_or(view.normal));
        let lobe = unit.map(|to_light| gloss.coordinate(view, to_light));
        let nearest = lobe.map(|l| l.distance(gloss.peak(view))).into_iter().fold(f64::INFINITY, f64::min);
        let fine = longest(&lobe) <= spread.max(BESIDE * nearest) && longest(&unit) <= WIDEST;
        if !fine && depth < DEEPEST {
            let [a, b, c] = triangle;
            let middles = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
            let [ab, bc, ca] = middles;
            stack.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], middles].map(|part| (part, depth + 1)));
            continue;
        }
        points.clear();
        weights.clear();
        radon_rule(triangle, points, weights);
        for (point, weight) in points.iter().zip(weights.iter()) {
            let square = point.length_squared();
            let to_light = *point / square.sqrt();
            let solid_angle = weight * normal.dot(to_light).abs() / square;
            let value = gloss.reflected(view, to_light);
            (0..3).for_each(|c| sum[c] += solid_angle * value[c]);
        }
    }
    sum
}

/// Longest side of a triangle.
fn longest([a, b, c]: &[DVec3; 3]) -> f64 {
    a.distance(*b).max(b.distance(*c)).max(c.distance(*a))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn material(specular: f64, exponent: f64) -> Material {
        Material { specular: [specular; 3], exponent, ..Material::default() }
    }

    /// The upper half of a cube around the point: all directions above the horizon.
    fn sky() -> Vec<Vec<DVec3>> {
        let mut faces = vec![
            [(-1.0, -1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, 1.0), (-1.0, 1.0, 1.0)]
                .map(DVec3::from)
                .to_vec(),
        ];
        for k in 0..4 {
            let turn = glam::DMat3::from_rotation_z(f64::from(k) * std::f64::consts::FRAC_PI_2);
            let side = [(1.0, -1.0, 0.0), (1.0, 1.0, 0.0), (1.0, 1.0, 1.0), (1.0, -1.0, 1.0)];
            faces.push(side.map(|corner| turn * DVec3::from(corner)).to_vec());
        }
        faces
    }

    fn furnace(gloss: &Gloss, degrees: f64) -> f64 {
        let (sine, cosine) = f64::to_radians(degrees).sin_cos();
        // Not along an axis of the cube.
        let to_eye = DVec3::new(sine * 0.7f64.cos(), sine * 0.7f64.sin(), cosine);
        let view = View::new(DVec3::Z, to_eye);
        let mut scratch = Scratch::default();
        sky().iter().map(|face| highlight(gloss, &view, face, &mut scratch)[1]).sum()
    }

    /// Under an even sky of radiance 1 a highlight's radiance is its directional albedo (by reciprocity).
    #[test]
    fn even_sky_gives_the_known_albedos_through_the_polygon_integral() {
        for (degrees, exponent, want) in [
            (0.0, 1.0, 1.0),
            (60.0, 10.0, 0.50474),
            (60.0, 100.0, 0.50000),
            (30.0, 100.0, 0.86603),
            (80.0, 100.0, 0.17523),
            (30.0, 10000.0, 0.86603),
        ] {
            let gloss = Gloss::phong(&material(1.0, exponent), PhongForm::Normalised).unwrap();
            let got = furnace(&gloss, degrees);
            assert!((got - want).abs() < 5e-4, "Phong {degrees} n {exponent}: {got}, want {want}");
        }
        for (degrees, slope, want) in [
            (0.0, 0.2, 0.99998),
            (60.0, 0.2, 0.96559),
            (75.0, 0.2, 0.92752),
            (0.0, 0.6, 0.79760),
            (60.0, 0.6, 0.87350),
            (0.0, 1.0, 0.45346),
        ] {
            let mirror = (1.0, Index::of_reflectance(1.0));
            let gloss = Gloss::CookTorrance(CookTorrance { slope }, [mirror; 3]);
            let got = furnace(&gloss, degrees);
            // Grooves shade with a kink, which no rule on smooth triangles follows.
            assert!((got - want).abs() < 2e-3, "Cook-Torrance {degrees} m {slope}: {got}, want {want}");
        }
    }

    /// Many times finer triangles change nothing that is seen: a lamp beside, across and in the middle of the lobe.
    #[test]
    fn triangles_follow_the_lobe() {
        let view = View::new(DVec3::Z, DVec3::new(0.6, 0.0, 0.8));
        let lamp = |x: f64, half: f64| {
            [(x - half, -half), (x - half, half), (x + half, half), (x + half, -half)]
                .map(|(x, y)| DVec3::new(x, y, 1.0))
                .to_vec()
        };
        for gloss in [
            Gloss::phong(&material(1.0, 50.0), PhongForm::Normalised).unwrap(),
            Gloss::phong(&material(1.0, 2000.0), PhongForm::Original).unwrap(),
            Gloss::cook_torrance(&material(0.5, 50.0)).unwrap(),
        ] {
            for (x, half) in [(-0.75, 0.3), (-0.4, 0.2), (0.5, 0.4)] {
                let mut scratch = Scratch::default();
                let got = highlight(&gloss, &view, &lamp(x, half), &mut scratch)[0];
                let n = 40;
                let small = half / f64::from(n);
                let mut want = 0.0;
                for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                    let at = |k: i32| f64::from(2 * k + 1 - n) * small;
                    let piece: Vec<DVec3> =
                        lamp(x + at(i), small).iter().map(|p| *p + DVec3::Y * at(j)).collect();
                    want += highlight(&gloss, &view, &piece, &mut scratch)[0];
                }
                let peak = highlight(&gloss, &view, &lamp(-0.75, 0.3), &mut scratch)[0];
                assert!((got - want).abs() < 2e-3 * want + 1e-5 * peak, "{gloss:?} {x}: {got}, want {want}");
            }
        }
    }

    #[test]
    fn materials_reflect_their_ks_at_normal_incidence() {
        for (specular, refraction) in
            [(0.04, 1.0), (0.5, 1.0), (0.9, 1.5), (0.02, 1.5), (0.92, 0.2), (1.0, 1.0)]
        {
            let (factor, index) = index(specular, refraction);
            let got = factor * index.reflectance(1.0);
            assert!((got - specular).abs() < 1e-8 && factor <= 1.0, "{specular} {refraction}: {got}");
        }
        assert_eq!(Gloss::phong(&material(0.0, 9.0), PhongForm::Original), None);
        let rough = Material { roughness: 0.5, ..material(0.1, 900.0) };
        let Some(Gloss::CookTorrance(surface, _)) = Gloss::cook_torrance(&rough) else { unreachable!() };
        assert_eq!(surface.slope, 0.25);
    }
}
