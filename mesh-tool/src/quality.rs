//! Shape of the elements of a mesh, and what the report says about it.

use geometry::polygon;
use glam::DVec3;
use interchange::ids::VertexId;
use interchange::mesh::Mesh;
use interchange::report::Report;
use std::collections::{HashMap, HashSet};

/// Counts and measures the finished mesh.
pub fn measure(mesh: &Mesh, report: &mut Report) {
    report.count("elements", mesh.element_count());
    report.count("vertices", mesh.vertices.len());
    report.count("nodes", mesh.node_vertices.len());
    report.count("lines", mesh.lines.len());
    let quality = Quality::of(mesh);
    report.estimate("area of faces", quality.face_area);
    report.estimate("area of elements", quality.element_area);
    report.estimate("longest edge", quality.longest_edge);
    report.estimate("smallest angle deg", quality.smallest_angle_deg);
    report.estimate("median smallest angle deg", quality.median_smallest_angle_deg);
    report.count("elements below 25 deg", quality.narrow);
    report.count("elements below 25 deg where lines or borders meet so", quality.narrow_at_given_angles);
    report.count("elements below 25 deg in strips between lines or borders", quality.narrow_in_strips);
    report.count("elements below 25 deg that no line or border forces", quality.narrow_freely());
    report.count("neighbours of more than twice the size", quality.uneven);
    report.count("neighbours of more than twice the size in strips", quality.uneven_in_strips);
}

/// Shape of the elements of a mesh.
#[derive(Debug, Clone, Copy)]
pub struct Quality {
    /// Area of the faces, both sides of two-sided ones.
    pub face_area: f64,
    /// Area of the elements.
    pub element_area: f64,
    /// Longest edge of an element.
    pub longest_edge: f64,
    /// Smallest angle of any element, degrees.
    pub smallest_angle_deg: f64,
    /// Median over the elements of their smallest angles, degrees.
    pub median_smallest_angle_deg: f64,
    /// Elements with an angle below 25 degrees.
    pub narrow: usize,
    /// Of these, elements whose smallest angle is one between two lines or borders.
    pub narrow_at_given_angles: usize,
    /// Of the others, elements with all corners on lines or borders: these pass each other more closely than the edges
    /// along them are long. More elements would make them wider.
    pub narrow_in_strips: usize,
    /// Pairs of elements across an edge, the longest edge of one more than twice that of the other.
    pub uneven: usize,
    /// Of these, pairs whose larger element has all corners on lines or borders.
    pub uneven_in_strips: usize,
}

impl Quality {
    /// Elements with an angle below 25 degrees that neither a given angle nor a strip excuses.
    pub fn narrow_freely(&self) -> usize {
        self.narrow - self.narrow_at_given_angles - self.narrow_in_strips
    }

    /// Measures a mesh.
    pub fn of(mesh: &Mesh) -> Quality {
        let faces = (0..mesh.face_count()).map(interchange::ids::FaceId::new);
        let face_area = faces
            .map(|face| {
                let sides = 1.0 + f64::from(u8::from(mesh.is_two_sided(face)));
                sides * polygon::area(&mesh.face_corners(face))
            })
            .sum();
        let lines: HashSet<(u32, u32)> = mesh.lines.iter().map(|l| sorted(l.from.0, l.to.0)).collect();
        let mut sides: HashMap<(u32, u32, u32), Vec<usize>> = HashMap::new();
        let longest =
            |corners: &[DVec3]| polygon::edges(corners).map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
        // Both sides of a two-sided face have elements of their own.
        let side_of = |element: usize| 2 * mesh.element_faces[element].0 + mesh.element_sides[element];
        for element in mesh.element_ids().map(|element| element.index()) {
            for (a, b) in edges_of(mesh.elements.row(element)) {
                sides.entry((side_of(element), a, b)).or_default().push(element);
            }
        }
        let (mut element_area, mut longest_edge, mut angles) = (0.0, 0.0f64, Vec::new());
        let given =
            |side: u32, (a, b): (u32, u32)| lines.contains(&(a, b)) || sides[&(side, a, b)].len() == 1;
        let on_given: HashSet<(u32, u32)> = sides
            .keys()
            .filter(|&&(face, a, b)| given(face, (a, b)))
            .flat_map(|&(side, a, b)| [(side, a), (side, b)])
            .collect();
        let all_on_given = |element: usize| {
            mesh.elements.row(element).iter().all(|v| on_given.contains(&(side_of(element), v.0)))
        };
        let lengths: Vec<f64> = mesh.element_ids().map(|e| longest(&mesh.element_corners(e))).collect();
        let (mut uneven, mut uneven_in_strips) = (0, 0);
        for pair in sides.values().filter(|pair| pair.len() == 2) {
            let (small, large) =
                if lengths[pair[0]] < lengths[pair[1]] { (pair[0], pair[1]) } else { (pair[1], pair[0]) };
            if lengths[large] > UNEVEN * lengths[small] {
                uneven += 1;
                uneven_in_strips += usize::from(all_on_given(large));
            }
        }
        let (mut narrow, mut narrow_at_given_angles, mut narrow_in_strips) = (0, 0, 0);
        for element in mesh.element_ids() {
            let corners = mesh.element_corners(element);
            element_area += polygon::area(&corners);
            longest_edge = longest_edge.max(longest(&corners));
            let (angle, at) = smallest_angle(&corners);
            angles.push(angle.to_degrees());
            if angle.to_degrees() < NARROW_DEG {
                narrow += 1;
                let ring = mesh.elements.row(element.index());
                let side = side_of(element.index());
                let edges: Vec<(u32, u32)> = edges_of(ring).collect();
                let before = (at + edges.len() - 1) % edges.len();
                if given(side, edges[at]) && given(side, edges[before]) {
                    narrow_at_given_angles += 1;
                } else {
                    narrow_in_strips += usize::from(all_on_given(element.index()));
                }
            }
        }
        angles.sort_by(f64::total_cmp);
        Quality {
            face_area,
            element_area,
            longest_edge,
            smallest_angle_deg: angles.first().copied().unwrap_or(0.0),
            median_smallest_angle_deg: angles.get(angles.len() / 2).copied().unwrap_or(0.0),
            narrow,
            narrow_at_given_angles,
            narrow_in_strips,
            uneven,
            uneven_in_strips,
        }
    }
}

/// Elements with a smaller angle are narrow, degrees.
const NARROW_DEG: f64 = 24.999_999;

/// Neighbours differ in size when they do so by more than a factor 2 and rounding, which halved edges have.
const UNEVEN: f64 = 2.0 * (1.0 + 1e-9);

fn sorted(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

fn edges_of(ring: &[VertexId]) -> impl Iterator<Item = (u32, u32)> + '_ {
    (0..ring.len()).map(|k| sorted(ring[k].0, ring[(k + 1) % ring.len()].0))
}

/// The smallest angle of a polygon, radians, and the corner it is at.
pub fn smallest_angle(corners: &[DVec3]) -> (f64, usize) {
    let n = corners.len();
    let angle = |k: usize| {
        let (a, b) = (corners[(k + 1) % n] - corners[k], corners[(k + n - 1) % n] - corners[k]);
        a.cross(b).length().atan2(a.dot(b))
    };
    let mut best = (f64::INFINITY, 0);
    for k in 0..n {
        let angle = angle(k);
        if angle < best.0 {
            best = (angle, k);
        }
    }
    best
}
