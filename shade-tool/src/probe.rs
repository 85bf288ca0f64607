//! Irradiance at points given by the user, on a surface or anywhere.

use crate::coarser::coarser_radiosity;
use crate::error::Result;
use crate::joined::Sources;
use crate::light::Gathering;
use crate::lit_scene::LitScene;
use crate::on_surface::Surfaces;
use crate::points::{COLUMNS, ProbePoint};
use geometry::gather::Scratch;
use geometry::source_tree::Opening;
use interchange::report::Report;
use interchange::tables::{TableFormat, number, write_csv, write_npy};
use interchange::tool::Common;
use rayon::prelude::*;
use std::path::Path;

/// Columns added to those of the points.
pub const ADDED: [&str; 3] = ["H_r", "H_g", "H_b"];

/// Column of the estimated error, where asked for.
pub const ERROR: &str = "H_error";

/// What was found at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probed {
    /// Irradiance, RGB, W m^-2.
    pub irradiance: [f64; 3],
    /// Its estimated error, worst channel, W m^-2: by the elements' size and by the solver's stop. Errors of the matrix are
    /// the solution's own report.
    pub error: f64,
}

/// Irradiance at every point, and counters in the report.
pub fn probe(
    scene: &LitScene,
    points: &[ProbePoint],
    opening: Opening,
    common: &Common,
    report: &mut Report,
) -> Vec<Probed> {
    let (surfaces, light) = report.phase("gatherer", || (Surfaces::new(scene), light(scene, opening)));
    let receivers: Vec<_> = report.phase("find faces", || {
        points.par_iter().map(|point| surfaces.receiver(point.point, point.normal)).collect()
    });
    report.count("points", points.len());
    report.count("points_on_faces", receivers.iter().filter(|(r, _)| r.face.is_some()).count());
    report.count("points_moved_inward", receivers.iter().filter(|(_, moved)| *moved).count());
    let bar = common.progress("probe", points.len());
    let solver_error = scene.achieved * mean_exitance(scene);
    let probed: Vec<Probed> = report.phase("gather", || {
        receivers
            .par_iter()
            .map_init(Scratch::default, |scratch, (receiver, _)| {
                let both = light.irradiance(receiver, scratch);
                bar.inc(1);
                let by_size = (0..3).fold(0.0, |most: f64, c| most.max((both[c] - both[c + 3]).abs()));
                Probed { irradiance: [both[0], both[1], both[2]], error: by_size + solver_error }
            })
            .collect()
    });
    bar.finish_and_clear();
    light.count("sources_", report);
    for (c, name) in ADDED.iter().enumerate().filter(|_| !points.is_empty()) {
        let mean = probed.iter().map(|p| p.irradiance[c]).sum::<f64>() / points.len() as f64;
        report.estimate(&format!("mean_{name}"), mean);
    }
    if !probed.is_empty() {
        report.estimate("largest_H_error", probed.iter().fold(0.0, |most, p| most.max(p.error)));
    }
    probed
}

/// The solution's radiosity, and that of a coarser one.
fn light(scene: &LitScene, opening: Opening) -> Gathering<6> {
    let coarse = coarser_radiosity(scene);
    let both =
        |(fine, coarse): (&[f64; 3], &[f64; 3])| [fine[0], fine[1], fine[2], coarse[0], coarse[1], coarse[2]];
    let strengths: Vec<[f64; 6]> = scene.radiosity.iter().zip(&coarse).map(both).collect();
    Gathering::new(scene, Sources::elements(scene, &strengths), opening)
}

/// Emitted power over area, brightest channel, W m^-2: what the solver's bound is a part of.
fn mean_exitance(scene: &LitScene) -> f64 {
    let (mut power, mut area) = ([0.0; 3], 0.0);
    for element in scene.mesh.element_ids() {
        let own = geometry::polygon::area(&scene.mesh.element_corners(element));
        let exitance = scene.material(element).exitance();
        (0..3).for_each(|c| power[c] += own * exitance[c]);
        area += own;
    }
    if area > 0.0 { power.into_iter().fold(0.0, f64::max) / area } else { 0.0 }
}

/// Writes the points as they were given, and behind each irradiance, and its error if `with_error`: csv or npy by the name's ending.
pub fn write(path: &Path, points: &[ProbePoint], probed: &[Probed], with_error: bool) -> Result<()> {
    let found =
        |p: &Probed| -> Vec<f64> { p.irradiance.into_iter().chain(with_error.then_some(p.error)).collect() };
    if TableFormat::of(path, &[TableFormat::Csv, TableFormat::Npy])? == TableFormat::Npy {
        let columns = COLUMNS.len() + ADDED.len() + usize::from(with_error);
        // The numbers as written in the table, not the unit normal.
        let given = |p: &ProbePoint| -> Vec<f64> {
            p.fields.iter().map(|field| field.parse().unwrap_or(f64::NAN)).collect()
        };
        let rows = points.iter().zip(probed).flat_map(|(p, q)| given(p).into_iter().chain(found(q)));
        return Ok(write_npy(path, columns, points.len(), rows).map(|_| ())?);
    }
    let added = ADDED.iter().copied().chain(with_error.then_some(ERROR));
    let header: Vec<String> = COLUMNS.iter().copied().chain(added).map(String::from).collect();
    let rows = points.iter().zip(probed).map(|(point, probed)| {
        point.fields.iter().cloned().chain(found(probed).into_iter().map(number)).collect()
    });
    Ok(write_csv(path, &header, rows).map(|_| ())?)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::test_scenes::cube;
    use glam::DVec3;

    fn point(x: f64, y: f64, z: f64, normal: DVec3) -> ProbePoint {
        let fields = [x, y, z, normal.x, normal.y, normal.z].map(|v| v.to_string()).to_vec();
        ProbePoint { point: DVec3::new(x, y, z), normal, fields }
    }

    #[test]
    fn furnace_lights_points_on_walls_corners_and_in_space_alike() {
        let mut scene = cube(2);
        scene.radiosity = vec![[1.0, 2.0, 0.0]; scene.mesh.element_count()];
        let up = DVec3::Y;
        let slanted = DVec3::new(1.0, -2.0, 0.5).normalize();
        let points = [
            point(0.3, 0.0, 0.6, up),
            point(0.3, 1e-7, 0.6, up),
            point(0.0, -1e-7, 0.0, up),
            point(1.0, 0.0, 0.5, up),
            point(0.5, 0.5, 0.5, slanted),
            point(0.9, 0.99, 0.1, slanted),
        ];
        let common = Common { threads: None, quiet: true, verbose: false };
        let mut report = Report::new("shade-tool", "test");
        for probed in probe(&scene, &points, Opening::EXACT, &common, &mut report) {
            assert!(probed.error < 1e-9, "{probed:?}");
            for (got, want) in probed.irradiance.iter().zip([1.0, 2.0, 0.0]) {
                assert!((got - want).abs() < 1e-9, "{got}, want {want}");
            }
        }
        assert_eq!(report.counters["points_on_faces"], 4);
        assert_eq!(report.counters["points_moved_inward"], 2);
    }

    #[test]
    fn table_echoes_the_points_and_an_empty_one_keeps_its_header() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.csv");
        let mut given = point(0.0, 0.0, 0.0, DVec3::Y);
        given.fields[0] = "0.50".into();
        let probed = [Probed { irradiance: [0.1, 1.0 / 3.0, 2.0], error: 0.25 }];
        write(&path, std::slice::from_ref(&given), &probed, false).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "x,y,z,nx,ny,nz,H_r,H_g,H_b\n0.50,0,0,0,1,0,0.1,0.3333333333333333,2\n");
        write(&path, &[given], &probed, true).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(
            text.starts_with("x,y,z,nx,ny,nz,H_r,H_g,H_b,H_error\n") && text.ends_with(",2,0.25\n"),
            "{text}"
        );
        write(&path, &[], &[], false).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "x,y,z,nx,ny,nz,H_r,H_g,H_b\n");
    }

    /// A floor under a wall whose radiosity varies: the estimate covers what finer elements change.
    #[test]
    fn estimated_error_covers_that_of_the_elements_size() {
        let irradiance = |n: usize| {
            let mut scene = cube(n);
            // A ramp over the ceiling, element 2 n^2 to come after floor and before the walls.
            scene.radiosity = vec![[0.0; 3]; 6 * n * n];
            for k in 0..n * n {
                let corners = &scene.sources[n * n + k];
                let middle = corners.iter().sum::<DVec3>() / 4.0;
                scene.radiosity[n * n + k] = [(3.0 * middle.x).sin() + 1.0; 3];
            }
            let common = Common { threads: None, quiet: true, verbose: false };
            let points = [point(0.2, 0.0, 0.3, DVec3::Y), point(0.9, 0.8, 0.4, DVec3::Y)];
            probe(&scene, &points, Opening::EXACT, &common, &mut Report::new("shade-tool", "test"))
        };
        for (coarse, fine) in irradiance(4).into_iter().zip(irradiance(32)) {
            let error = (coarse.irradiance[0] - fine.irradiance[0]).abs();
            assert!(
                error > 0.0 && error < coarse.error && coarse.error < 100.0 * error,
                "{error:.2e} {coarse:?}"
            );
        }
    }
}
