//! Light that comes straight from the scene's emitters: exactly visible polygons, Lambert's formula for diffuse surfaces, and
//! highlights integrated over the same polygons. There is no ambient term: what no emitter reaches is black.

use crate::gloss::{self, Gloss, View, highlight};
use crate::lit_scene::LitScene;
use geometry::merge::merged_occluders;
use geometry::point_factor::above_horizon;
use geometry::polygon;
use geometry::visible_pieces::{self, VisiblePieces};
use glam::DVec3;
use interchange::ids::{ElementId, FaceId};
use std::collections::BTreeMap;

/// Elements cover their face where their areas add up to its own, to this part: rounding of many areas.
const COVERED: f64 = 1e-9;

/// The scene's emitters.
#[derive(Debug)]
pub struct Emitters {
    view: VisiblePieces,
    /// Radiance of each polygon.
    radiance: Vec<[f64; 3]>,
}

/// Working memory of [`Emitters`].
#[derive(Debug, Default)]
pub struct Scratch {
    view: visible_pieces::Scratch,
    gloss: gloss::Scratch,
}

/// Direct light at a point.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Direct {
    /// Irradiance, W m^-2.
    pub irradiance: [f64; 3],
    /// Radiance of the highlight towards the eye, W m^-2 sr^-1; for Phong without Ks.
    pub highlight: [f64; 3],
}

impl Emitters {
    /// The emitting faces; with `shadows` other faces block their light.
    pub fn new(scene: &LitScene, shadows: bool) -> Emitters {
        let mesh = &scene.mesh;
        let mut elements: BTreeMap<(FaceId, u32), Vec<ElementId>> = BTreeMap::new();
        for element in mesh.element_ids().filter(|&element| scene.material(element).emits()) {
            let side = (mesh.element_face(element), mesh.element_sides[element.index()]);
            elements.entry(side).or_default().push(element);
        }
        let mut pieces: BTreeMap<FaceId, Vec<usize>> = BTreeMap::new();
        for (piece, &face) in mesh.occluder_faces.iter().enumerate() {
            pieces.entry(face).or_default().push(piece);
        }
        let (mut sources, mut radiance) = (Vec::new(), Vec::new());
        for ((face, side), elements) in elements {
            // The few pieces of a face serve as well as its many elements, unless part of it is hidden.
            let corners: Vec<_> = elements.iter().map(|&element| mesh.element_corners(element)).collect();
            let mut whole: Vec<_> =
                pieces.get(&face).into_iter().flatten().map(|&piece| mesh.occluder_corners(piece)).collect();
            let area = |polygons: &[Vec<DVec3>]| polygons.iter().map(|p| polygon::area(p)).sum::<f64>();
            let covered = (area(&corners) - area(&whole)).abs() <= COVERED * area(&whole);
            if side == 1 {
                whole.iter_mut().for_each(|corners| corners.reverse());
            }
            let own = scene.material(elements[0]).radiance;
            for corners in if covered { whole } else { corners } {
                sources.push(corners);
                radiance.push(own);
            }
        }
        let blockers = if shadows {
            let pieces = mesh.occluders.rows().map(|row| row.iter().map(|v| v.0).collect()).collect();
            let positions: Vec<DVec3> = mesh.vertices.iter().copied().map(DVec3::from_array).collect();
            merged_occluders(pieces, &positions)
        } else {
            Vec::new()
        };
        Emitters { view: VisiblePieces::new(sources, blockers), radiance }
    }

    /// Number of polygons that emit.
    pub fn count(&self) -> usize {
        self.radiance.len()
    }

    /// Direct light at a point with a unit normal, and the highlight it makes for an eye.
    pub fn direct(&self, point: DVec3, gloss: Option<&Gloss>, view: &View, scratch: &mut Scratch) -> Direct {
        let mut direct = Direct::default();
        let Scratch { view: pieces, gloss: integral } = scratch;
        self.view.visit(point, view.normal, pieces, |source, piece| {
            let radiance = self.radiance[source];
            let factor = std::f64::consts::PI * above_horizon(DVec3::ZERO, view.normal, piece).max(0.0);
            let shine = gloss.map_or([0.0; 3], |gloss| highlight(gloss, view, piece, integral));
            for c in 0..3 {
                direct.irradiance[c] += factor * radiance[c];
                direct.highlight[c] += shine[c] * radiance[c];
            }
        });
        direct
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::phong::PhongForm;
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};
    use interchange::ids::MaterialId;
    use interchange::materials::Material;
    use std::f64::consts::FRAC_1_PI;

    /// A light of 2 x 2 elements over a blocker, exitance 1.
    fn light_and_blocker() -> LitScene {
        let mut mesh = empty_mesh();
        let corner = |half: f64, z: f64| DVec3::new(-half, -half, z);
        add_parallelogram(&mut mesh, corner(0.5, 4.0), DVec3::Y, DVec3::X, 2, 0);
        add_parallelogram(&mut mesh, corner(1.0, 2.0), 2.0 * DVec3::X, 2.0 * DVec3::Y, 1, 0);
        mesh.face_materials[1] = MaterialId(1);
        mesh.materials.push("black".into());
        let mut scene = lit(mesh);
        scene.materials[0].radiance = [FRAC_1_PI, 2.0 * FRAC_1_PI, 0.0];
        scene.materials.push(Material::default());
        scene
    }

    /// Known point values (as those of visible pieces), with and without the shadow.
    #[test]
    fn irradiance_is_that_of_the_visible_part_unless_shadows_are_off() {
        let scene = light_and_blocker();
        let view = View::new(DVec3::Z, DVec3::Z);
        let at = |emitters: &Emitters, x: f64, y: f64| {
            emitters.direct(DVec3::new(x, y, 0.0), None, &view, &mut Scratch::default()).irradiance
        };
        let [shaded, open] = [true, false].map(|shadows| Emitters::new(&scene, shadows));
        assert_eq!((shaded.count(), open.count()), (1, 1), "four elements are one polygon");
        assert!((at(&shaded, 2.0, 0.0)[0] - 0.006_946_576_463).abs() < 6e-13);
        assert!((at(&shaded, 1.75, 2.25)[1] - 2.0 * 0.007_382_268_251).abs() < 1.2e-12);
        assert_eq!(at(&shaded, 0.0, 0.0), [0.0; 3]);
        // Straight below a square of half side 1/2 at distance 4: four times the right angle's formula.
        let h = 0.5 / 4f64.hypot(0.5);
        let want = 4.0 * FRAC_1_PI * h * h.atan();
        assert!((at(&open, 0.0, 0.0)[0] - want).abs() < 1e-12, "{} {want}", at(&open, 0.0, 0.0)[0]);
    }

    /// Walls that emit radiance 1 all around: the highlight is the directional albedo, whatever the scene is cut into.
    #[test]
    fn furnace_highlight_is_the_albedo() {
        let mut scene = cube(3);
        scene.materials[0].radiance = [1.0; 3];
        let emitters = Emitters::new(&scene, true);
        let glossy = Material { specular: [1.0; 3], exponent: 10.0, ..Material::default() };
        let gloss = Gloss::phong(&glossy, PhongForm::Normalised);
        let (sine, cosine) = 60f64.to_radians().sin_cos();
        let view = View::new(DVec3::Y, DVec3::new(sine, cosine, 0.0));
        let point = DVec3::new(0.3, 0.0, 0.6);
        let direct = emitters.direct(point, gloss.as_ref(), &view, &mut Scratch::default());
        assert!((direct.highlight[2] - 0.50474).abs() < 5e-4, "{direct:?}");
        assert!((direct.irradiance[0] - std::f64::consts::PI).abs() < 1e-9, "{direct:?}");
    }
}
