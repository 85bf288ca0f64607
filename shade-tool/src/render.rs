//! The picture: visible surface per sample, irradiance at the nodes that are seen, interpolated between them
//! (Gouraud 1971) or gathered at the sample, mean over the samples of a pixel ([`crate::pixel_samples`]). Samples have fixed
//! places, so a picture has no noise and is the same for any number of threads.

use crate::camera::Camera;
use crate::covered::Covered;
use crate::extent::{Extent, extend};
use crate::interpolation::corner_weights;
use crate::judge::Scheme;
use crate::layers::{Layer, NOTHING, Pixel, Values};
use crate::light::Part;
use crate::lit_scene::LitScene;
use crate::nodes::NodeRadiosity;
use crate::picture::Picture;
use crate::pixel_samples::{PixelSampler, RowSamples, Sample, Sampling};
use crate::receiver::{Parts, total};
use crate::refined::Found;
use crate::refined_parts::RefinedParts;
use crate::visible::{Seen, VisibleSurface};
use geometry::gather::Scratch;
use geometry::polygon;
use geometry::source_tree::Opening;
use interchange::ids::ElementId;
use interchange::report::{Phase, Report};
use interchange::tool::{Common, ProgressBar};
use rayon::prelude::*;
use std::f64::consts::FRAC_1_PI;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// The picture is made in bands of rows with about this many samples: 40 MB of what they see are kept at a time.
const SAMPLES_PER_BAND: usize = 1 << 20;

/// How a picture is sampled and how well irradiance is interpolated.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// Samples of a pixel.
    pub sampling: Sampling,
    /// Interpolation over facets, `None` for the solution's own constant values.
    pub scheme: Option<Scheme>,
    /// Facets are cut while interpolation is off by more than this part of the value.
    pub tolerance: f64,
    /// Layers to make besides radiance.
    pub layers: Vec<Layer>,
}

/// A scene ready to be seen by any number of cameras: nodes are gathered once.
#[derive(Debug)]
pub struct Renderer<'a> {
    scene: &'a LitScene,
    surface: VisibleSurface,
    nodes: NodeRadiosity<'a>,
    /// Unit normal of each element.
    normals: Vec<[f64; 3]>,
}

/// Renders the scene with one camera.
pub fn render(
    scene: &LitScene,
    camera: &Camera,
    quality: &Quality,
    opening: Opening,
    common: &Common,
    report: &mut Report,
) -> Picture {
    let mut renderer = Renderer::new(scene, opening, report);
    let picture = renderer.render(camera, quality, common, report);
    renderer.count(report);
    picture
}

/// What is known of a sample before it is averaged.
struct Looks<'a> {
    scene: &'a LitScene,
    surface: &'a VisibleSurface,
    nodes: &'a NodeRadiosity<'a>,
    normals: &'a [[f64; 3]],
    refined: Option<&'a RefinedParts>,
    gathered: &'a AtomicU64,
}

impl<'a> Renderer<'a> {
    /// Prepares the scene; `opening` says how exactly is gathered.
    pub fn new(scene: &'a LitScene, opening: Opening, report: &mut Report) -> Renderer<'a> {
        let surface = report.phase("hierarchy", || VisibleSurface::new(scene));
        let nodes = report.phase("gatherer", || NodeRadiosity::new(scene, opening));
        let normal = |element| polygon::vector_area(&scene.mesh.element_corners(element)).normalize_or_zero();
        let normals = scene.mesh.element_ids().map(|element| normal(element).to_array()).collect();
        Renderer { scene, surface, nodes, normals }
    }

    /// Renders with a camera, and reports phases and counters.
    pub fn render(
        &mut self,
        camera: &Camera,
        quality: &Quality,
        common: &Common,
        report: &mut Report,
    ) -> Picture {
        let [width, height] = camera.size.map(|n| n as usize);
        let per_pixel = quality.sampling.each * quality.sampling.each;
        let rows_per_band = (SAMPLES_PER_BAND / (width * per_pixel)).max(1);
        let bands: Vec<Range<usize>> =
            (0..height).step_by(rows_per_band).map(|top| top..(top + rows_per_band).min(height)).collect();
        let surface = &self.surface;
        let sampler = PixelSampler::new(surface, camera, quality.sampling);
        let look = |band: &Range<usize>, bar: &ProgressBar| -> Vec<RowSamples> {
            let of_row = |row| {
                bar.inc(1);
                sampler.row(row, 0..width)
            };
            band.clone().into_par_iter().map(of_row).collect()
        };

        // Find what every sample sees, and so how far every facet reaches; a single band is kept for later.
        let mut kept = None;
        let mut extents = vec![Extent::default(); self.scene.mesh.element_count()];
        report.phase("visible surface", || {
            let bar = common.progress("visible surface", height);
            for band in &bands {
                let rows = look(band, &bar);
                band.clone().zip(&rows).for_each(|(row, samples)| extend(&mut extents, samples, row));
                kept = (bands.len() == 1).then_some(rows);
            }
        });

        // Gather at the nodes of the facets that are seen, and in between where interpolation does not serve.
        let elements: Vec<ElementId> =
            (0..extents.len()).filter(|&k| extents[k].is_seen()).map(ElementId::new).collect();
        let refined = quality.scheme.map(|scheme| {
            report.phase("gather at nodes", || {
                let bar = common.progress("gather at nodes", 0);
                self.nodes.gather(&elements, |points| bar.inc_length(points as u64), || bar.inc(1));
            });
            let facets: Vec<(ElementId, f64)> =
                elements.iter().map(|&e| (e, extents[e.index()].pixels())).collect();
            RefinedParts::new(&self.nodes, surface, &facets, (scheme, quality.tolerance), report)
        });

        // Interpolate, and average over each pixel.
        let mut picture = Picture { width, height, ..Picture::default() };
        let mut layers = quality.layers.clone();
        layers.sort_unstable();
        layers.dedup();
        let gathered = AtomicU64::new(0);
        let looks = Looks {
            scene: self.scene,
            surface,
            nodes: &self.nodes,
            normals: &self.normals,
            refined: refined.as_ref(),
            gathered: &gathered,
        };
        let start = Instant::now();
        let bar = common.progress("interpolation", height);
        let (mut rays, mut borders, mut lamps, mut background, mut back) = (0, 0, 0, 0.0, 0.0);
        for band in &bands {
            let rows = kept.take().unwrap_or_else(|| look(band, &ProgressBar::hidden()));
            let pixels: Vec<Vec<Pixel>> = rows
                .par_iter()
                .map_init(<(Vec<f64>, Scratch)>::default, |memory, row| {
                    bar.inc(1);
                    row.pixels().map(|samples| looks.pixel(samples, memory)).collect()
                })
                .collect();
            let pixels = pixels.concat();
            picture.append(&pixels);
            append_layers(&mut picture.layers, &layers, &pixels);
            for row in &rows {
                (rays, borders) = (rays + row.rays, borders + row.borders);
                lamps += row.lamp_borders;
                for sample in row.pixels().flatten() {
                    background += if sample.seen == Seen::Background { sample.share } else { 0.0 };
                    back += if sample.seen == Seen::Back { sample.share } else { 0.0 };
                }
            }
        }
        report.phases.push(Phase { name: "interpolation".into(), seconds: start.elapsed().as_secs_f64() });
        bar.finish_and_clear();
        report.count("samples", rays);
        report.count("border_pixels", borders);
        report.count("lamp_border_pixels", lamps);
        report.count("background_pixels", background.round() as usize);
        report.count("back_face_pixels", back.round() as usize);
        report.count("samples_gathered", gathered.load(Ordering::Relaxed) as usize);
        if let Some(refined) = &refined {
            refined.count(report);
        }
        for (channel, mean) in ["r", "g", "b"].iter().zip(picture.mean()) {
            report.estimate(&format!("mean_radiance_{channel}"), mean);
        }
        picture
    }

    /// Tells what was gathered, and what was not.
    pub fn count(&self, report: &mut Report) {
        let counts = self.nodes.counts;
        report.count("nodes_gathered", counts.whole);
        report.count("nodes_split", counts.split);
        report.count("node_edges_gathered", counts.edges);
        report.count("nodes_black_skipped", counts.black);
        report.count("nodes_unseen_skipped", counts.unseen);
        self.nodes.light().count(report);
    }
}

fn append_layers(all: &mut Vec<(Layer, Values)>, layers: &[Layer], pixels: &[Pixel]) {
    for (k, &layer) in layers.iter().enumerate() {
        let values = layer.of(pixels);
        match all.get_mut(k) {
            Some((_, values_before)) => values_before.append(values),
            None => all.push((layer, values)),
        }
    }
}

impl Looks<'_> {
    /// Mean over the samples of a pixel.
    fn pixel(&self, samples: &[Sample], (weights, scratch): &mut (Vec<f64>, Scratch)) -> Pixel {
        let mut pixel = Pixel { element: NOTHING, face: NOTHING, ..Pixel::default() };
        let add = |sum: &mut [f64; 3], value: [f64; 3], factor: f64| {
            (0..3).for_each(|c| sum[c] += factor * value[c]);
        };
        let mut covered = Covered::default();
        for sample in samples {
            let Seen::Surface(element, place, depth) = sample.seen else { continue };
            let (share, radiance) = (sample.share, sample.share * FRAC_1_PI);
            let (material, source) = (self.scene.material(element), self.scene.source_of[element.index()]);
            let (exitance, rho) = (material.exitance(), material.diffuse);
            let (parts, error) = self.irradiance(element, place, weights, scratch);
            let irradiance = total(&parts);
            // A constant element shows the solution's own radiosity.
            let radiosity = match self.refined {
                Some(_) => std::array::from_fn(|c| exitance[c] + rho[c] * irradiance[c]),
                None => self.scene.radiosity[source as usize],
            };
            add(&mut pixel.radiance, radiosity, radiance);
            if material.emits() {
                pixel.lamp_share += share;
                add(&mut pixel.lamp_radiance, radiosity, radiance);
            }
            add(&mut pixel.albedo, rho, share);
            add(&mut pixel.irradiance, irradiance, share);
            add(&mut pixel.direct, std::array::from_fn(|c| exitance[c] + rho[c] * parts[c]), radiance);
            add(&mut pixel.indirect, std::array::from_fn(|c| rho[c] * parts[c + 3]), radiance);
            add(&mut pixel.normal, self.normals[element.index()], share);
            pixel.error += radiance * error;
            let face = self.scene.mesh.face_inputs[self.scene.mesh.element_face(element).index()];
            covered.add(source, face, depth, share);
        }
        covered.tell(&mut pixel);
        pixel
    }

    /// Irradiance at a place of an element, and the estimated error of radiosity there.
    fn irradiance(
        &self,
        element: ElementId,
        place: glam::DVec2,
        weights: &mut Vec<f64>,
        scratch: &mut Scratch,
    ) -> (Parts, f64) {
        let Some(refined) = self.refined else {
            let h = self.scene.irradiance[self.scene.source_of[element.index()] as usize];
            return ([0.0, 0.0, 0.0, h[0], h[1], h[2]], 0.0);
        };
        let Some(found) = refined.at(element, place, weights) else {
            corner_weights(self.surface.corners(element), place, weights);
            return (self.nodes.interpolate(element, weights), 0.0);
        };
        let mut error = 0.0;
        let mut part = |part: Part, found: Found| match found.gather {
            Some(receiver) if self.nodes.reflects(element) => {
                self.gathered.fetch_add(1, Ordering::Relaxed);
                self.nodes.part(part, element, &receiver, scratch)
            }
            _ => {
                error += found.error;
                found.irradiance
            }
        };
        let [a, b, c] = part(Part::Direct, found[0]);
        let [d, e, f] = part(Part::Indirect, found[1]);
        ([a, b, c, d, e, f], error)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::camera::{Camera, Lens};
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};
    use crate::tone::{Curve, Exposure, Tone};
    use glam::DVec3;
    use interchange::mesh::FACE_TWO_SIDED;

    fn quiet() -> Common {
        Common { threads: None, quiet: true, verbose: false }
    }

    fn fine(samples: usize) -> Quality {
        Quality {
            sampling: Sampling { each: samples, in_cell: 2, at_lamps: 2 },
            scheme: Some(Scheme::Linear),
            tolerance: 0.01,
            layers: Vec::new(),
        }
    }

    fn rendered(scene: &LitScene, camera: &Camera, quality: &Quality, report: &mut Report) -> Picture {
        render(scene, camera, quality, Opening::EXACT, &quiet(), report)
    }

    fn report() -> Report {
        Report::new("shade-tool", "test")
    }

    #[test]
    fn furnace_pixels_are_one_over_pi() {
        for n in [1, 4] {
            let mut scene = cube(n);
            scene.materials[0].diffuse = [1.0, 0.5, 0.0];
            scene.materials[0].radiance = [0.0, 0.5 * FRAC_1_PI, FRAC_1_PI];
            let eye = DVec3::new(0.3, 0.4, 0.2);
            let camera = Camera::new(eye, DVec3::ONE, DVec3::Y, Lens::Vertical(100.0), [16, 12]).unwrap();
            let mut report = report();
            let picture = rendered(&scene, &camera, &fine(3), &mut report);
            assert_eq!(picture.pixels.len(), 16 * 12);
            for value in picture.pixels.iter().flatten() {
                assert!((value - FRAC_1_PI).abs() < 1e-9, "{value}");
            }
            let borders = report.counters["border_pixels"];
            assert!((20..120).contains(&borders), "{borders}");
            // 3 x 3 of a pixel, 2 at each end of a column in a row, 6 x 6 at a border.
            assert_eq!(report.counters["samples"], 16 * 12 * 9 + 17 * 2 * 12 + borders * 36);
            assert_eq!(report.counters["background_pixels"] + report.counters["back_face_pixels"], 0);
            let nodes = ["nodes_gathered", "nodes_split", "nodes_black_skipped", "nodes_unseen_skipped"];
            let total: u64 = nodes.iter().map(|name| report.counters[*name]).sum();
            assert_eq!(total as usize, scene.mesh.node_vertices.len());
        }
    }

    /// A framed cube shows its far inner walls through the near ones; a placed camera sees black backs.
    #[test]
    fn framing_skips_backs_and_a_placed_camera_sees_them_black() {
        let scene = cube(2);
        let camera = Camera::framing(scene.bounds(), DVec3::Y, Lens::Vertical(40.0), [32, 32]).unwrap();
        let mut framed = report();
        let picture = rendered(&scene, &camera, &fine(2), &mut framed);
        assert_eq!(framed.counters["back_face_pixels"], 0);
        assert!(framed.counters["background_pixels"] > 100);
        assert!((picture.pixels[16 * 32 + 16][0] - FRAC_1_PI).abs() < 1e-9);
        assert_eq!(picture.pixels[0], [0.0; 3]);

        let placed = Camera { framing: false, ..camera };
        let mut seen = report();
        let picture = rendered(&scene, &placed, &fine(2), &mut seen);
        assert_eq!(seen.counters["background_pixels"], framed.counters["background_pixels"]);
        // Each is rounded.
        let unlit = seen.counters["background_pixels"] + seen.counters["back_face_pixels"];
        assert!(unlit.abs_diff(32 * 32) <= 1, "{unlit}");
        assert!(picture.pixels.iter().all(|p| *p == [0.0; 3]));
        assert_eq!(seen.counters["nodes_gathered"], 0);
    }

    #[test]
    fn two_sided_face_shows_both_sides() {
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, DVec3::ZERO, DVec3::X, DVec3::Y, 2, FACE_TWO_SIDED);
        let mut scene = lit(mesh);
        scene.materials[0].diffuse = [0.0; 3];
        scene.materials[0].radiance = [1.0, 2.0, 3.0];
        for z in [1.0, -1.0] {
            let (eye, at) = (DVec3::new(0.5, 0.5, z), DVec3::new(0.5, 0.5, 0.0));
            let camera = Camera::new(eye, at, DVec3::Y, Lens::Vertical(10.0), [4, 4]).unwrap();
            let picture = rendered(&scene, &camera, &fine(1), &mut report());
            for (got, want) in picture.pixels.iter().flat_map(|p| p.iter().zip([1.0, 2.0, 3.0])) {
                assert!((got - want).abs() < 1e-12, "{got}, want {want}");
            }
        }
    }

    /// A floor lit by a wall at one of its edges, seen from above: its middle is the mean of its corners. Those at the
    /// wall are split, and give the middle the mean of 1/2 along the wall and 1/4 across.
    #[test]
    fn middle_of_an_element_is_the_mean_of_its_corners() {
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, DVec3::ZERO, DVec3::Z, DVec3::X, 1, 0);
        add_parallelogram(&mut mesh, DVec3::ZERO, DVec3::Y, DVec3::Z, 1, 0);
        let mut scene = lit(mesh);
        scene.radiosity = vec![[0.0; 3], [1.0; 3]];
        let above = DVec3::new(0.5, 1.0, 0.5);
        let camera =
            Camera::new(above, DVec3::new(0.5, 0.0, 0.5), DVec3::Z, Lens::Vertical(90.0), [9, 9]).unwrap();
        let picture = rendered(&scene, &camera, &fine(1), &mut report());
        // The mean value coordinates of a square are symmetric: its middle is the mean of its four corners.
        let far = (1f64.atan() - 0.5f64.sqrt() * 0.5f64.sqrt().atan()) / std::f64::consts::TAU;
        let want = 0.5 * (0.375 + far) * FRAC_1_PI;
        let middle = picture.pixels[4 * 9 + 4][0];
        // The limits are taken at 1e-4 of an edge's length.
        assert!((middle - want).abs() < 3e-4, "{middle}, want {want}");
    }

    /// All layers of a furnace: what a wall is, where it is, and light that adds up.
    #[test]
    fn layers_hold_what_is_seen() {
        let mut scene = cube(2);
        scene.materials[0].diffuse = [0.5, 0.25, 0.0];
        scene.materials[0].radiance = [0.5, 0.75, 1.0].map(|b| b * FRAC_1_PI);
        let eye = DVec3::new(0.5, 0.4, 0.2);
        let camera = Camera::new(eye, eye + DVec3::Z, DVec3::Y, Lens::Vertical(50.0), [9, 9]).unwrap();
        use clap::ValueEnum;
        for scheme in [Scheme::Linear, Scheme::Quadratic, Scheme::Gather] {
            let layers = Layer::value_variants().to_vec();
            let quality = Quality { scheme: Some(scheme), layers, ..fine(2) };
            let picture = rendered(&scene, &camera, &quality, &mut report());
            let triple = |layer: Layer| match picture.layer(layer) {
                Some(Values::Triples(values)) => values[40],
                other => unreachable!("{other:?}"),
            };
            assert_eq!(triple(Layer::Albedo), [0.5, 0.25, 0.0]);
            assert_eq!(triple(Layer::Normal), [0.0, 0.0, -1.0]);
            let close = |got: [f64; 3], want: [f64; 3]| {
                assert!((0..3).all(|c| (got[c] - want[c]).abs() < 1e-9), "{got:?} {want:?}");
            };
            close(triple(Layer::Irradiance), [1.0; 3]);
            // Half of what arrives is emitted, in the first channel; all is, in the last, which reflects nothing.
            close(triple(Layer::Direct), [0.75, 0.75 + 0.25 * 0.75, 1.0].map(|b| b * FRAC_1_PI));
            close(triple(Layer::Indirect), [0.25, 0.0625, 0.0].map(|b| b * FRAC_1_PI));
            let Some(Values::Numbers(depths)) = picture.layer(Layer::Depth) else { unreachable!() };
            assert!(depths.iter().all(|&depth| (depth - 0.8).abs() < 1e-12), "{depths:?}");
            let Some(Values::Indices(elements)) = picture.layer(Layer::Element) else { unreachable!() };
            // The wall z = 1 has the last four of the 24 elements.
            assert!(elements.iter().all(|&element| (20..24).contains(&element)), "{elements:?}");
            assert_eq!(picture.layer(Layer::Face), Some(&Values::Indices(vec![5; 81])));
        }
    }

    /// A square lamp, turned, in the dark: its part of each pixel is what the pixel has of its radiance, and what the preview shows.
    #[test]
    fn lamps_borders_are_as_bright_in_the_preview_as_they_are_covered() {
        let (sin, cos) = 0.37f64.sin_cos();
        let (along, across) = (DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0));
        let mut mesh = empty_mesh();
        add_parallelogram(&mut mesh, -2.0 * (along + across), 4.0 * along, 4.0 * across, 1, 0);
        let mut scene = lit(mesh);
        scene.materials[0].diffuse = [0.0; 3];
        scene.materials[0].radiance = [20.0; 3];
        let eye = DVec3::new(0.0, 0.0, 5.0);
        let camera = Camera::new(eye, DVec3::ZERO, DVec3::Y, Lens::Orthographic(9.0), [9, 9]).unwrap();
        let mut report = report();
        let picture = rendered(&scene, &camera, &fine(4), &mut report);
        let between = |p: &&[f64; 3]| p[0] > 0.0 && p[0] < 20.0 - 1e-6;
        assert_eq!(picture.lamps.len(), picture.pixels.iter().filter(between).count());
        let (count, borders) = (picture.lamps.len(), report.counters["lamp_border_pixels"]);
        // Twelve pixels are covered by a quarter to five sixths, eight by a hundredth, which samples may miss.
        assert!((12..=20).contains(&count) && count as u64 <= borders, "{count} of {borders}");
        let shown = |curve| Tone::new(&picture, Exposure::Stops(0.0), curve).shown(&picture).pixels;
        let (linear, white) = (shown(Curve::Linear), shown(Curve::Reinhard));
        for lamp in &picture.lamps {
            // The shares are sums of at most 64 parts of 1.
            let pixel = picture.pixels[lamp.pixel];
            assert!((pixel[0] - 20.0 * lamp.share).abs() < 1e-12, "{pixel:?} {lamp:?}");
            assert_eq!(pixel, lamp.radiance);
            // IEC 61966-2-1 for the covered part of white; a share below 0.0031 would be on its straight part.
            let want = 255.0 * (1.055 * lamp.share.powf(1.0 / 2.4) - 0.055);
            assert!(
                lamp.share > 0.0032 && (f64::from(linear[lamp.pixel][0]) - want).abs() < 0.501,
                "{lamp:?}"
            );
            assert_eq!(linear[lamp.pixel], white[lamp.pixel]);
        }
    }

    #[test]
    fn constant_shows_the_solution() {
        let mut scene = cube(2);
        scene.radiosity = (0..24).map(|k| [f64::from(k), 0.0, 1.0]).collect();
        let eye = DVec3::new(0.5, 0.5, 0.2);
        let camera = Camera::new(eye, eye + DVec3::Z, DVec3::Y, Lens::Vertical(30.0), [2, 2]).unwrap();
        let quality = Quality { scheme: None, ..fine(2) };
        let picture = rendered(&scene, &camera, &quality, &mut report());
        let mut seen: Vec<f64> = picture.pixels.iter().map(|p| p[0] / FRAC_1_PI).collect();
        seen.sort_by(f64::total_cmp);
        for (got, want) in seen.iter().zip([20.0, 21.0, 22.0, 23.0]) {
            assert!((got - want).abs() < 1e-12, "{seen:?}");
        }
    }
}
