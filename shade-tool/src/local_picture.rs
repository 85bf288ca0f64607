//! The picture by a local model: what each sample sees, lit by emitters alone.

use crate::camera::Camera;
use crate::covered::Covered;
use crate::direct_light::{Emitters, Scratch};
use crate::gloss::{Gloss, View};
use crate::layers::{Layer, NOTHING, Pixel};
use crate::lit_scene::LitScene;
use crate::picture::Picture;
use crate::pixel_samples::{PixelSampler, Sample, Sampling};
use crate::shading::LocalModel;
use crate::visible::{Seen, VisibleSurface};
use geometry::plane::Plane;
use geometry::polygon;
use glam::DVec3;
use interchange::ids::ElementId;
use interchange::report::Report;
use interchange::tool::Common;
use rayon::prelude::*;
use std::f64::consts::FRAC_1_PI;

/// A scene ready to be seen by any number of cameras.
#[derive(Debug)]
pub struct LocalRenderer<'a> {
    scene: &'a LitScene,
    model: LocalModel,
    surface: VisibleSurface,
    emitters: Emitters,
    /// Plane of each element.
    planes: Vec<Option<Plane>>,
    /// Highlight of each material of the mesh.
    gloss: Vec<Option<Gloss>>,
    /// Irradiance at the middle of each element, where that is all that is asked.
    flat: Vec<[f64; 3]>,
}

impl<'a> LocalRenderer<'a> {
    /// Prepares the scene, whose elements must be drawn as they were solved.
    pub fn new(scene: &'a LitScene, model: LocalModel, report: &mut Report) -> LocalRenderer<'a> {
        let mesh = &scene.mesh;
        let surface = report.phase("hierarchy", || VisibleSurface::new(scene));
        let emitters = report.phase("emitters", || Emitters::new(scene, model.shadows));
        report.count("emitting_polygons", emitters.count());
        if emitters.count() == 0 {
            report.warn("nothing emits: the picture is black");
        }
        let planes: Vec<Option<Plane>> =
            mesh.element_ids().map(|element| Plane::of_polygon(&mesh.element_corners(element))).collect();
        let mut renderer = LocalRenderer {
            scene,
            model,
            surface,
            emitters,
            planes,
            gloss: scene.materials.iter().map(|material| model.gloss(material)).collect(),
            flat: Vec::new(),
        };
        if model.highlights.is_none() {
            renderer.flat = report.phase("middles of elements", || renderer.at_middles());
        }
        model.warn(scene, report);
        renderer
    }

    fn at_middles(&self) -> Vec<[f64; 3]> {
        (0..self.planes.len())
            .into_par_iter()
            .map_init(Scratch::default, |scratch, k| {
                let Some(plane) = self.planes[k] else { return [0.0; 3] };
                let middle = polygon::centroid(&self.scene.mesh.element_corners(ElementId::new(k)));
                let view = View::new(plane.normal, plane.normal);
                self.emitters.direct(plane.project(middle), None, &view, scratch).irradiance
            })
            .collect()
    }

    /// Renders with a camera, and reports phases and counters.
    pub fn render(
        &self,
        camera: &Camera,
        sampling: Sampling,
        layers: &[Layer],
        common: &Common,
        report: &mut Report,
    ) -> Picture {
        let [width, height] = camera.size.map(|n| n as usize);
        let bar = common.progress("render", height);
        let sampler = PixelSampler::new(&self.surface, camera, sampling);
        let rows: Vec<(Vec<Pixel>, usize, [usize; 2])> = report.phase("shading", || {
            (0..height)
                .into_par_iter()
                .map_init(Scratch::default, |scratch, row| {
                    bar.inc(1);
                    let samples = sampler.row(row, 0..width);
                    let pixels =
                        samples.pixels().map(|samples| self.pixel(camera, samples, scratch)).collect();
                    (pixels, samples.rays, [samples.borders, samples.lamp_borders])
                })
                .collect()
        });
        report.count("samples", rows.iter().map(|row| row.1).sum());
        report.count("border_pixels", rows.iter().map(|row| row.2[0]).sum());
        report.count("lamp_border_pixels", rows.iter().map(|row| row.2[1]).sum());
        let pixels: Vec<Pixel> = rows.into_iter().flat_map(|row| row.0).collect();
        bar.finish_and_clear();
        let mut layers = layers.to_vec();
        layers.sort_unstable();
        layers.dedup();
        let layers = layers.into_iter().map(|layer| (layer, layer.of(&pixels))).collect();
        let mut picture = Picture { width, height, layers, ..Picture::default() };
        picture.append(&pixels);
        for (channel, mean) in ["r", "g", "b"].iter().zip(picture.mean()) {
            report.estimate(&format!("mean_radiance_{channel}"), mean);
        }
        picture
    }

    /// Mean over the samples of a pixel.
    fn pixel(&self, camera: &Camera, samples: &[Sample], scratch: &mut Scratch) -> Pixel {
        let mesh = &self.scene.mesh;
        let mut pixel = Pixel { element: NOTHING, face: NOTHING, ..Pixel::default() };
        let mut covered = Covered::default();
        for sample in samples {
            let Seen::Surface(element, _, depth) = sample.seen else { continue };
            let Some(plane) = self.planes[element.index()] else { continue };
            let add =
                |sum: &mut [f64; 3], value: [f64; 3]| (0..3).for_each(|c| sum[c] += sample.share * value[c]);
            let (origin, direction) = camera.ray(sample.at[0], sample.at[1]);
            let point = plane.project(origin + depth * direction);
            let (radiance, irradiance) = self.shade(element, &plane, point, -direction, scratch);
            add(&mut pixel.radiance, radiance);
            if self.scene.material(element).emits() {
                pixel.lamp_share += sample.share;
                add(&mut pixel.lamp_radiance, radiance);
            }
            add(&mut pixel.irradiance, irradiance);
            add(&mut pixel.albedo, self.scene.material(element).diffuse);
            add(&mut pixel.normal, plane.normal.to_array());
            let face = mesh.face_inputs[mesh.element_face(element).index()];
            covered.add(self.scene.source_of[element.index()], face, depth, sample.share);
        }
        covered.tell(&mut pixel);
        pixel
    }

    /// Radiance towards the eye, and irradiance.
    fn shade(
        &self,
        element: ElementId,
        plane: &Plane,
        point: DVec3,
        to_eye: DVec3,
        scratch: &mut Scratch,
    ) -> ([f64; 3], [f64; 3]) {
        let material = self.scene.material(element);
        let mut highlight = [0.0; 3];
        let irradiance = if let Some(flat) = self.flat.get(element.index()) {
            *flat
        } else {
            let gloss = &self.gloss[self.scene.mesh.element_material(element).index()];
            let view = View::new(plane.normal, to_eye.normalize_or(plane.normal));
            let direct = self.emitters.direct(point, gloss.as_ref(), &view, scratch);
            let factor = self.model.highlight_factor(material);
            highlight = std::array::from_fn(|c| factor[c] * direct.highlight[c]);
            direct.irradiance
        };
        let radiance =
            |c: usize| material.radiance[c] + FRAC_1_PI * material.diffuse[c] * irradiance[c] + highlight[c];
        (std::array::from_fn(radiance), irradiance)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::camera::Lens;
    use crate::layers::Values;
    use crate::phong::PhongForm;
    use crate::shading::Highlights;
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};
    use interchange::ids::MaterialId;
    use interchange::materials::Material;

    const MODELS: [Option<Highlights>; 4] = [
        None,
        Some(Highlights::Phong(PhongForm::Normalised)),
        Some(Highlights::Phong(PhongForm::Original)),
        Some(Highlights::CookTorrance),
    ];

    fn rendered(scene: &LitScene, camera: &Camera, model: LocalModel, layers: &[Layer]) -> (Picture, Report) {
        let mut report = Report::new("shade-tool", "test");
        let common = Common { threads: None, quiet: true, verbose: false };
        let renderer = LocalRenderer::new(scene, model, &mut report);
        let picture = renderer.render(
            camera,
            Sampling { each: 2, in_cell: 2, at_lamps: 2 },
            layers,
            &common,
            &mut report,
        );
        (picture, report)
    }

    /// A room where all walls emit and reflect: radiance is L + rho L after the first bounce, and no more.
    #[test]
    fn furnace_has_one_bounce_in_every_model_without_highlights() {
        let mut scene = cube(2);
        scene.materials[0].radiance = [1.0, 2.0, 0.0];
        scene.materials[0].diffuse = [0.5, 0.25, 1.0];
        let eye = DVec3::new(0.5, 0.4, 0.3);
        let camera = Camera::new(eye, DVec3::ZERO, DVec3::Y, Lens::Vertical(80.0), [9, 7]).unwrap();
        for highlights in MODELS {
            let model = LocalModel { highlights, shadows: true };
            let (picture, report) = rendered(&scene, &camera, model, &[Layer::Irradiance, Layer::Element]);
            for pixel in &picture.pixels {
                for (got, want) in pixel.iter().zip([1.5, 2.5, 0.0]) {
                    assert!((got - want).abs() < 1e-9, "{highlights:?}: {got}, want {want}");
                }
            }
            assert_eq!(report.warnings.len(), usize::from(highlights.is_some()), "{:?}", report.warnings);
            let Some(Values::Triples(irradiance)) = picture.layer(Layer::Irradiance) else { unreachable!() };
            assert!((irradiance[5][0] - std::f64::consts::PI).abs() < 1e-9);
            let Some(Values::Indices(elements)) = picture.layer(Layer::Element) else { unreachable!() };
            assert!(elements.iter().all(|&element| element < 24));
        }
    }

    /// A floor under a small lamp, with a plate between: dark below the plate, and black, for nothing is ambient.
    fn floor_and_lamp() -> (LitScene, Camera) {
        let mut mesh = empty_mesh();
        let low = |half: f64, y: f64| DVec3::new(-half, y, -half);
        let side = |half: f64| (2.0 * half * DVec3::X, 2.0 * half * DVec3::Z);
        let (u, v) = side(4.0);
        add_parallelogram(&mut mesh, low(4.0, 0.0), v, u, 4, 0);
        let (u, v) = side(0.1);
        add_parallelogram(&mut mesh, low(0.1, 2.0), u, v, 1, 0);
        let (u, v) = side(0.3);
        add_parallelogram(&mut mesh, low(0.3, 1.0), u, v, 1, 0);
        mesh.face_materials = vec![MaterialId(0), MaterialId(1), MaterialId(2)];
        mesh.materials = ["floor", "lamp", "plate"].map(String::from).to_vec();
        let mut scene = lit(mesh);
        let dark = Material::default();
        scene.materials =
            vec![Material { diffuse: [0.5; 3], ..dark }, Material { radiance: [10.0; 3], ..dark }, dark];
        // Straight down from below the plate onto the floor, 4 x 4 wide.
        let eye = DVec3::new(0.0, 0.9, 0.0);
        let camera = Camera::new(eye, DVec3::ZERO, DVec3::Z, Lens::Orthographic(4.0), [40, 40]).unwrap();
        (scene, camera)
    }

    #[test]
    fn shadows_are_black_and_can_be_left_out() {
        let (scene, camera) = floor_and_lamp();
        for highlights in MODELS.into_iter().skip(1) {
            let [shaded, open] = [true, false]
                .map(|shadows| rendered(&scene, &camera, LocalModel { highlights, shadows }, &[]).0);
            let middle = 20 * 40 + 20;
            assert_eq!(shaded.pixels[middle], [0.0; 3]);
            // 10 * 0.04 / 4 of irradiance from straight above, to the lamp's size and the pixel's place.
            let want = 10.0 * 0.04 / 4.0 * 0.5 * FRAC_1_PI;
            assert!((open.pixels[middle][0] / want - 1.0).abs() < 0.01, "{:?} {want}", open.pixels[middle]);
            let corner = 2 * 40 + 2;
            assert!((shaded.pixels[corner][1] - open.pixels[corner][1]).abs() < 1e-15);
        }
        let flat = rendered(&scene, &camera, LocalModel { highlights: None, shadows: true }, &[]).0;
        let mut values: Vec<u64> = flat.pixels.iter().map(|pixel| pixel[0].to_bits()).collect();
        values.sort_unstable();
        values.dedup();
        // Four elements are seen, alike by symmetry; pixels at their borders are mixtures.
        assert!(values.len() <= 12, "{} values", values.len());
    }

    /// The highlight lies where the lamp is mirrored, and grows with Ks.
    #[test]
    fn highlights_lie_at_the_mirrored_lamp() {
        let (mut scene, _) = floor_and_lamp();
        let eye = DVec3::new(2.0, 2.0, 0.0);
        let camera =
            Camera::new(eye, DVec3::new(1.0, 0.0, 0.0), DVec3::Y, Lens::Vertical(60.0), [61, 61]).unwrap();
        for highlights in MODELS.into_iter().skip(1) {
            let model = LocalModel { highlights, shadows: false };
            let matt = rendered(&scene, &camera, model, &[]).0;
            let mut heights = Vec::new();
            for ks in [0.1, 0.4] {
                let glossy = Material { specular: [ks; 3], exponent: 200.0, ..scene.materials[0] };
                let before = std::mem::replace(&mut scene.materials[0], glossy);
                let shiny = rendered(&scene, &camera, model, &[]).0;
                scene.materials[0] = before;
                let gain: Vec<f64> =
                    shiny.pixels.iter().zip(&matt.pixels).map(|(a, b)| a[0] - b[0]).collect();
                let brightest = (0..gain.len()).max_by(|&a, &b| gain[a].total_cmp(&gain[b])).unwrap();
                let (x, y) = (brightest % 61, brightest / 61);
                assert!(x.abs_diff(30) <= 1 && y.abs_diff(30) <= 1, "{highlights:?}: {x} {y}");
                heights.push(gain[brightest]);
            }
            let ratio = heights[1] / heights[0];
            assert!((ratio - 4.0).abs() < 0.2, "{highlights:?}: {ratio}");
        }
    }
}
