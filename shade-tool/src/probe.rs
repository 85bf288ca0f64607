//! Irradiance at points given by the user, on a surface or anywhere.

use crate::error::Result;
use crate::lit_scene::LitScene;
use crate::on_surface::Surfaces;
use crate::points::{COLUMNS, ProbePoint};
use crate::receiver::Light;
use geometry::gather::Scratch;
use interchange::report::Report;
use interchange::tables::{number, write_csv};
use interchange::tool::Common;
use rayon::prelude::*;
use std::path::Path;

/// Columns added to those of the points.
pub const ADDED: [&str; 3] = ["H_r", "H_g", "H_b"];

/// Irradiance at every point, RGB, W m^-2, and counters in the report.
pub fn probe(scene: &LitScene, points: &[ProbePoint], common: &Common, report: &mut Report) -> Vec<[f64; 3]> {
    let (surfaces, light) = report.phase("gatherer", || (Surfaces::new(scene), Light::new(scene)));
    let receivers: Vec<_> = report.phase("find faces", || {
        points.par_iter().map(|point| surfaces.receiver(point.point, point.normal)).collect()
    });
    report.count("points", points.len());
    report.count("points_on_faces", receivers.iter().filter(|(r, _)| r.face.is_some()).count());
    report.count("points_moved_inward", receivers.iter().filter(|(_, moved)| *moved).count());
    let bar = common.progress("probe", points.len());
    let irradiance: Vec<[f64; 3]> = report.phase("gather", || {
        receivers
            .par_iter()
            .map_init(Scratch::default, |scratch, (receiver, _)| {
                let irradiance = light.irradiance(receiver, scratch);
                bar.inc(1);
                irradiance
            })
            .collect()
    });
    bar.finish_and_clear();
    for (c, name) in ADDED.iter().enumerate().filter(|_| !points.is_empty()) {
        let mean = irradiance.iter().map(|h| h[c]).sum::<f64>() / points.len() as f64;
        report.estimate(&format!("mean_{name}"), mean);
    }
    irradiance
}

/// Writes the points as they were given, and irradiance behind each.
pub fn write(path: &Path, points: &[ProbePoint], irradiance: &[[f64; 3]]) -> Result<()> {
    let header: Vec<String> = COLUMNS.iter().chain(&ADDED).map(|&name| name.into()).collect();
    let rows = points.iter().zip(irradiance).map(|(point, irradiance)| {
        point.fields.iter().cloned().chain(irradiance.iter().map(|&x| number(x))).collect()
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
        for h in probe(&scene, &points, &common, &mut report) {
            for (got, want) in h.iter().zip([1.0, 2.0, 0.0]) {
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
        write(&path, &[given], &[[0.1, 1.0 / 3.0, 2.0]]).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "x,y,z,nx,ny,nz,H_r,H_g,H_b\n0.50,0,0,0,1,0,0.1,0.3333333333333333,2\n");
        write(&path, &[], &[]).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "x,y,z,nx,ny,nz,H_r,H_g,H_b\n");
    }
}
