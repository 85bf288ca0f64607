//! The picture: visible surface per sample, radiosity at the nodes that are seen, linear interpolation between them
//! (Gouraud 1971), plain mean over the samples of a pixel. Samples have fixed places, so a picture has no
//! noise and is the same for any number of threads.

use crate::camera::Camera;
use crate::interpolation::corner_weights;
use crate::lit_scene::LitScene;
use crate::nodes::NodeRadiosity;
use crate::picture::Picture;
use crate::refined::RefinedFacets;
use crate::visible::{Seen, VisibleSurface};
use interchange::ids::ElementId;
use interchange::report::{Phase, Report};
use interchange::tool::Common;
use rayon::prelude::*;
use std::f64::consts::FRAC_1_PI;
use std::ops::Range;
use std::time::Instant;

/// The picture is made in bands of rows with about this many samples: 32 MB of what they see are kept at a time.
const SAMPLES_PER_BAND: usize = 1 << 20;

/// How a picture is sampled and how linear its facets must be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Samples along each side of a pixel.
    pub samples: usize,
    /// Facets are cut while the middle of an edge is off the mean of its ends by more than this part of its value.
    pub tolerance: f64,
}

/// Renders the scene, and reports phases and counters.
pub fn render(
    scene: &LitScene,
    camera: &Camera,
    quality: Quality,
    common: &Common,
    report: &mut Report,
) -> Picture {
    let surface = report.phase("hierarchy", || VisibleSurface::new(scene));
    let mut nodes = report.phase("gatherer", || NodeRadiosity::new(scene));
    let [width, height] = camera.size.map(|n| n as usize);
    let samples = quality.samples;
    let per_pixel = samples * samples;
    let rows_per_band = (SAMPLES_PER_BAND / (width * per_pixel)).max(1);
    let bands: Vec<Range<usize>> =
        (0..height).step_by(rows_per_band).map(|top| top..(top + rows_per_band).min(height)).collect();
    let look = |band: &Range<usize>| -> Vec<Seen> {
        let rows = band.clone().into_par_iter();
        rows.flat_map_iter(|row| samples_of_row(&surface, camera, row, samples)).collect()
    };

    // Find what every sample sees, and so how many samples every facet has; a single band is kept for later.
    let mut kept = None;
    let mut seen_samples = vec![0u32; scene.mesh.element_count()];
    report.phase("visible surface", || {
        for band in &bands {
            let seen = look(band);
            count_samples(&seen, &mut seen_samples);
            kept = (bands.len() == 1).then_some(seen);
        }
    });

    // Gather at the nodes of the facets that are seen, and in between where radiosity is not linear.
    let elements: Vec<ElementId> =
        (0..seen_samples.len()).filter(|&k| seen_samples[k] > 0).map(ElementId::new).collect();
    let bar = common.progress("render", height);
    report.phase("gather at nodes", || {
        nodes.gather(&elements, |points| bar.inc_length(points as u64), || bar.inc(1));
    });
    let facets: Vec<(ElementId, f64)> =
        elements.iter().map(|&e| (e, f64::from(seen_samples[e.index()]) / per_pixel as f64)).collect();
    let refined = report.phase("gather in between", || {
        RefinedFacets::new(&nodes, &surface, &facets, quality.tolerance, || bar.tick())
    });

    // Interpolate, and average over each pixel.
    let mut picture = Picture { width, height, pixels: Vec::with_capacity(width * height) };
    report.count("background_samples", 0);
    report.count("back_face_samples", 0);
    let start = Instant::now();
    for band in &bands {
        let seen = kept.take().unwrap_or_else(|| look(band));
        count_unlit(&seen, report);
        let band_pixels: Vec<[f64; 3]> = seen
            .par_chunks(per_pixel)
            .map_init(Vec::new, |weights, seen| pixel(&surface, &nodes, &refined, seen, weights))
            .collect();
        picture.pixels.extend(band_pixels);
        bar.inc(band.len() as u64);
    }
    report.phases.push(Phase { name: "interpolation".into(), seconds: start.elapsed().as_secs_f64() });
    bar.finish_and_clear();
    report.count("samples", width * height * per_pixel);
    report.count("nodes_gathered", nodes.counts.whole);
    report.count("nodes_split", nodes.counts.split);
    report.count("node_edges_gathered", nodes.counts.edges);
    report.count("nodes_black_skipped", nodes.counts.black);
    report.count("nodes_unseen_skipped", nodes.counts.unseen);
    report.count("points_gathered_in_between", refined.gathered);
    report.count("facets_cut", refined.cut);
    for (channel, mean) in ["r", "g", "b"].iter().zip(picture.mean()) {
        report.estimate(&format!("mean_radiance_{channel}"), mean);
    }
    picture
}

/// Adds the samples of each facet.
fn count_samples(seen: &[Seen], samples: &mut [u32]) {
    for sample in seen {
        if let Seen::Surface(element, _) = sample {
            samples[element.index()] = samples[element.index()].saturating_add(1);
        }
    }
}

/// Samples of a row, pixel by pixel.
fn samples_of_row<'a>(
    surface: &'a VisibleSurface,
    camera: &'a Camera,
    row: usize,
    samples: usize,
) -> impl Iterator<Item = Seen> + 'a {
    (0..camera.size[0] as usize * samples * samples).map(move |i| {
        let (column, k) = (i / (samples * samples), i % (samples * samples));
        let [x, y] = place_in_pixel(k, samples);
        surface.seen(camera, column as f64 + x, row as f64 + y)
    })
}

/// Place within its pixel of sample `k`: one in each cell of a regular grid, and all in different columns and rows of a grid
/// so many times finer (as Kensler 2013, "Correlated Multi-Jittered Sampling", before jitter). So an edge along rows or
/// columns, as most edges of rooms are, is covered in n^2 steps instead of n. His arrangement has n samples on the
/// pixel's diagonal, where edges of rooms seen straight run; counting one axis backwards leaves it free.
fn place_in_pixel(k: usize, samples: usize) -> [f64; 2] {
    let n = samples as f64;
    let (column, row) = ((k % samples) as f64, (k / samples) as f64);
    [(column + (row + 0.5) / n) / n, (row + (n - column - 0.5) / n) / n]
}

fn count_unlit(seen: &[Seen], report: &mut Report) {
    report.count("background_samples", seen.iter().filter(|s| **s == Seen::Background).count());
    report.count("back_face_samples", seen.iter().filter(|s| **s == Seen::Back).count());
}

/// Mean radiance B / pi over the samples of a pixel.
fn pixel(
    surface: &VisibleSurface,
    nodes: &NodeRadiosity,
    refined: &RefinedFacets,
    seen: &[Seen],
    weights: &mut Vec<f64>,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for sample in seen {
        let Seen::Surface(element, place) = *sample else { continue };
        let radiosity = refined.at(element, place, weights).unwrap_or_else(|| {
            corner_weights(surface.corners(element), place, weights);
            nodes.interpolate(element, weights)
        });
        for (sum, b) in sum.iter_mut().zip(radiosity) {
            *sum += b;
        }
    }
    sum.map(|radiosity| radiosity * FRAC_1_PI / seen.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::camera::{Camera, Lens};
    use crate::test_scenes::{add_parallelogram, cube, empty_mesh, lit};
    use glam::DVec3;
    use interchange::mesh::FACE_TWO_SIDED;

    fn quiet() -> Common {
        Common { threads: None, quiet: true, verbose: false }
    }

    fn fine(samples: usize) -> Quality {
        Quality { samples, tolerance: 0.01 }
    }

    fn report() -> Report {
        Report::new("shade-tool", "test")
    }

    #[test]
    fn samples_fall_into_all_cells_rows_and_columns_once() {
        for n in [1, 2, 3, 4, 8] {
            let places: Vec<[f64; 2]> = (0..n * n).map(|k| place_in_pixel(k, n)).collect();
            let all = |key: &dyn Fn(&[f64; 2]) -> usize| {
                let mut keys: Vec<usize> = places.iter().map(key).collect();
                keys.sort_unstable();
                keys == (0..n * n).collect::<Vec<_>>()
            };
            let (side, fine) = (n as f64, (n * n) as f64);
            assert!(all(&|p| (p[0] * side) as usize + n * (p[1] * side) as usize));
            assert!(all(&|p| (p[0] * fine) as usize) && all(&|p| (p[1] * fine) as usize));
            let on_diagonals = places.iter().filter(|p| p[0] == p[1] || p[0] + p[1] == 1.0).count();
            assert_eq!(on_diagonals, n % 2, "{places:?}");
            let mean = places.iter().fold(0.0, |sum, p| sum + p[0]) / fine;
            assert!((mean - 0.5).abs() < 1e-12, "{mean}");
        }
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
            let picture = render(&scene, &camera, fine(3), &quiet(), &mut report);
            assert_eq!(picture.pixels.len(), 16 * 12);
            for value in picture.pixels.iter().flatten() {
                assert!((value - FRAC_1_PI).abs() < 1e-9, "{value}");
            }
            assert_eq!(report.counters["samples"], 16 * 12 * 9);
            assert_eq!(report.counters["background_samples"] + report.counters["back_face_samples"], 0);
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
        let picture = render(&scene, &camera, fine(2), &quiet(), &mut framed);
        assert_eq!(framed.counters["back_face_samples"], 0);
        assert!(framed.counters["background_samples"] > 100);
        assert!((picture.pixels[16 * 32 + 16][0] - FRAC_1_PI).abs() < 1e-9);
        assert_eq!(picture.pixels[0], [0.0; 3]);

        let placed = Camera { framing: false, ..camera };
        let mut seen = report();
        let picture = render(&scene, &placed, fine(2), &quiet(), &mut seen);
        assert_eq!(seen.counters["background_samples"], framed.counters["background_samples"]);
        assert_eq!(seen.counters["background_samples"] + seen.counters["back_face_samples"], 4 * 32 * 32);
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
            let picture = render(&scene, &camera, fine(1), &quiet(), &mut report());
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
        let picture = render(&scene, &camera, fine(1), &quiet(), &mut report());
        // The mean value coordinates of a square are symmetric: its middle is the mean of its four corners.
        let far = (1f64.atan() - 0.5f64.sqrt() * 0.5f64.sqrt().atan()) / std::f64::consts::TAU;
        let want = 0.5 * (0.375 + far) * FRAC_1_PI;
        let middle = picture.pixels[4 * 9 + 4][0];
        // The limits are taken at 1e-4 of an edge's length.
        assert!((middle - want).abs() < 3e-4, "{middle}, want {want}");
    }
}
