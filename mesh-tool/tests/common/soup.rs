//! Soups: scenes of boxes and slivers that cross, stand on, contain, touch and nearly coincide with each other, from a
//! few numbers that shrink well or from any bytes; and what a mesh of such a scene must satisfy.

use super::{
    assert_faces_conforming, assert_faces_meet, box_text, check, elements, floor_text, given, scene_of,
};
use geometry::polygon;
use glam::{DQuat, DVec3};
use interchange::mesh::Mesh;
use interchange::report::Report;
use interchange::scene::Scene;
use mesh_tool::build;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How a thing stands to the floor or to the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    Anywhere,
    OnTheFloor,
    OnTop,
    Inside,
    Beside,
    /// A hair (1e-11) off the one before.
    Again,
    /// Turned about the vertical by a hair (1e-9 to 1e-3): nearly parallel planes.
    NearlyParallel,
    /// A triangle nearly in the plane of the floor.
    Sliver,
}

pub const RELATIONS: [Relation; 8] = [
    Relation::Anywhere,
    Relation::OnTheFloor,
    Relation::OnTop,
    Relation::Inside,
    Relation::Beside,
    Relation::Again,
    Relation::NearlyParallel,
    Relation::Sliver,
];

/// One thing in the soup.
#[derive(Debug, Clone)]
pub struct Thing {
    /// Lowest corner, each coordinate from -1 to 1.
    pub low: [f64; 3],
    /// Extents, 1e-6 to 1.2.
    pub size: [f64; 3],
    /// How it stands to others.
    pub relation: Relation,
    /// Whether a box has its bottom.
    pub bottom: bool,
    /// Whether it shines.
    pub lamp: bool,
    /// From -1 to 1: how far off what is nearly so.
    pub tilt: f64,
}

/// Things above, on and through a floor, turned and scaled.
#[derive(Debug, Clone)]
pub struct Soup {
    /// Things, each placed with regard to the one before.
    pub things: Vec<Thing>,
    /// Angle of the whole, radians.
    pub turn: f64,
    /// Scale, as a power of ten.
    pub power: i32,
}

impl Soup {
    /// Any bytes are a soup: sixteen for each thing, two for all.
    pub fn from_bytes(bytes: &[u8]) -> Soup {
        let (&[turn, power], bytes) = bytes.split_first_chunk::<2>().unwrap_or((&[0, 6], &[]));
        let things = bytes.chunks_exact(16).take(5).map(|chunk| {
            let whole = |k: usize| f64::from(i16::from_le_bytes([chunk[k], chunk[k + 1]])) / 32768.0;
            let extent = |k: usize| match chunk[k] {
                thin @ 0..32 => 1e-6 * 1e3f64.powf(f64::from(thin) / 32.0),
                thick => 0.1 + 1.1 * f64::from(thick - 32) / 223.0,
            };
            Thing {
                low: [whole(0), whole(2), whole(4)],
                size: [extent(6), extent(7), extent(8)],
                relation: RELATIONS[usize::from(chunk[9]) % RELATIONS.len()],
                bottom: chunk[10] % 2 == 1,
                lamp: chunk[11] % 8 == 0,
                tilt: whole(12),
            }
        });
        let turn = if turn % 4 == 0 { 0.0 } else { 6.0 * f64::from(turn) / 256.0 };
        Soup { things: things.collect(), turn, power: i32::from(power % 13) - 6 }
    }

    /// The scene.
    pub fn scene(&self) -> Scene {
        let mut text = floor_text(-2.0, 3.0);
        let mut before = ([0.0; 3], [0.5; 3]);
        let mut vertices = 4;
        for thing in &self.things {
            let (mut low, mut size) = (thing.low, thing.size);
            match thing.relation {
                Relation::OnTheFloor => low[1] = 0.0,
                Relation::OnTop => {
                    low = [before.0[0] + 0.1 * size[0], before.0[1] + before.1[1], before.0[2]];
                }
                Relation::Inside => {
                    low = [0, 1, 2].map(|k| before.0[k] + 0.25 * before.1[k]);
                    size = before.1.map(|x| 0.5 * x);
                }
                Relation::Beside => low = [before.0[0] + before.1[0], before.0[1], before.0[2]],
                Relation::Again => (low, size) = (before.0.map(|x| x + 1e-11 * thing.tilt), before.1),
                Relation::NearlyParallel => (low, size) = before,
                Relation::Anywhere | Relation::Sliver => {}
            }
            let high = [0, 1, 2].map(|k| low[k] + size[k]);
            text += if thing.lamp { "usemtl lamp\n" } else { "usemtl white\n" };
            if thing.relation == Relation::Sliver {
                let h = 1e-7 * thing.tilt;
                text += &format!(
                    "v {:?} 0 {:?}\nv {:?} {h:?} {:?}\nv {:?} 0 {:?}\nf -3 -2 -1\n",
                    low[0],
                    low[2],
                    high[0],
                    low[2] + 1e-4,
                    low[0] + 0.3,
                    high[2]
                );
                vertices += 3;
            } else {
                let mut own = box_text(low, high, thing.bottom, vertices + 1);
                if thing.relation == Relation::NearlyParallel {
                    let angle = thing.tilt.signum() * 1e-9 * 1e6f64.powf(thing.tilt.abs());
                    own = turned(&own, low, angle);
                }
                text += &own;
                vertices += 8;
            }
            before = (low, size);
        }
        let mut scene = scene_of(&text);
        let rotation = DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.2).normalize(), self.turn);
        for vertex in &mut scene.vertices {
            *vertex = (10f64.powi(self.power) * (rotation * DVec3::from_array(*vertex))).to_array();
        }
        scene
    }

    /// What is wrong with the meshes of this soup; nothing, if all is well.
    pub fn faults(&self) -> Vec<String> {
        let scene = self.scene();
        let mut faults = Vec::new();
        for (name, options) in [("given", given()), ("150 elements", elements(150))] {
            let meshed = options.elements.is_some();
            let attempt = catch_unwind(AssertUnwindSafe(|| {
                let mut report = Report::new("mesh-tool", "soup");
                let mesh = build(&scene, &options, &mut report).map_err(|error| error.to_string())?;
                Ok::<_, String>((mesh, report))
            }));
            let (mesh, report) = match attempt {
                Ok(Ok(made)) => made,
                Ok(Err(refused)) => {
                    faults.push(format!("{name}: refused: {refused}"));
                    continue;
                }
                Err(panic) => {
                    faults.push(format!("{name}: panic: {}", message(&*panic)));
                    continue;
                }
            };
            let mut test = |what: &str, holds: &dyn Fn()| {
                if let Err(panic) = catch_unwind(AssertUnwindSafe(holds)) {
                    faults.push(format!("{name}: {what}: {}", message(&*panic)));
                }
            };
            test("elements", &|| check(&mesh));
            test("area", &|| assert_area_conserved(&scene, &mesh, &report));
            if meshed {
                test("conforming", &|| {
                    assert_faces_conforming(&mesh);
                });
                test("T-vertices", &|| assert_faces_meet(&mesh));
            }
        }
        faults
    }
}

/// Area of the scene's faces, less what was dropped, is that of the elements and of what lies hidden or under others.
fn assert_area_conserved(scene: &Scene, mesh: &Mesh, report: &Report) {
    let counted = |name: &str| report.counters.get(name).copied().unwrap_or(0);
    assert_eq!(counted("dropped zero area"), 0);
    let given: f64 = scene
        .faces
        .iter()
        .map(|face| {
            let corner = |&v: &u32| DVec3::from_array(scene.vertices[v as usize]);
            polygon::area(&face.corners.iter().map(corner).collect::<Vec<_>>())
        })
        .sum();
    let shown: f64 = mesh.element_ids().map(|e| polygon::area(&mesh.element_corners(e))).sum();
    let [hidden, under, dropped] = ["hidden area", "overlapped area", "area of dropped duplicates"]
        .map(|name| report.estimates.get(name).copied().unwrap_or(0.0));
    let found = shown + hidden + under + dropped;
    assert!(
        (found / given - 1.0).abs() < 1e-9,
        "{shown} shown, {hidden} hidden, {under} under others, {dropped} repeated; of {given}: off by {:.1e}",
        found / given - 1.0
    );
}

/// The vertices of an OBJ text turned about a vertical axis.
fn turned(text: &str, about: [f64; 3], angle: f64) -> String {
    let (sine, cosine) = angle.sin_cos();
    let line = |line: &str| match line.strip_prefix("v ") {
        None => format!("{line}\n"),
        Some(rest) => {
            let v: Vec<f64> = rest.split(' ').map(|x| x.parse().unwrap()).collect();
            let (x, z) = (v[0] - about[0], v[2] - about[2]);
            let (x, z) = (cosine * x - sine * z, sine * x + cosine * z);
            format!("v {:?} {:?} {:?}\n", about[0] + x, v[1], about[2] + z)
        }
    };
    text.lines().map(line).collect()
}

fn message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|&s| s.to_owned())).unwrap_or_default()
}
