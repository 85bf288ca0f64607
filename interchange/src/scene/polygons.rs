//! Geometry through tobj, from the normalised text of the scan, cross-checked with the scan.
//!
//! tobj numbers the vertices of its one mesh by first use and leaves out those no face names; the scan knows their
//! numbers in the file, so the scene gets back the file's order.

use super::obj_scan::Scan;
use crate::error::{Error, Result};
use std::path::Path;

/// Vertices in file order, those no face names left out, and the faces' corners.
#[derive(Debug, PartialEq)]
pub(super) struct Polygons {
    /// Positions.
    pub vertices: Vec<[f64; 3]>,
    /// Corners of each face, front counter-clockwise, in file order.
    pub faces: Vec<Vec<u32>>,
}

/// No vertex yet.
const UNSET: u32 = u32::MAX;

/// Reads the geometry of `scan`, the scan of `path`.
pub(super) fn read(path: &Path, scan: &Scan) -> Result<Polygons> {
    let mesh = parse(path, &scan.normalised)?;
    let disagree = |what: &str, found: usize, expected: usize| {
        let message =
            format!("the OBJ parser read {found} {what}, the scan {expected}; please report this file");
        Error::whole(path, message)
    };
    let used = mesh.positions.len() / 3;
    // A mesh of triangles alone comes without arities.
    let arities =
        if mesh.face_arities.is_empty() { vec![3; mesh.indices.len() / 3] } else { mesh.face_arities };
    if arities.len() != scan.faces.len() {
        return Err(disagree("faces", arities.len(), scan.faces.len()));
    }
    if mesh.indices.len() != scan.corners.len() {
        return Err(disagree("corners", mesh.indices.len(), scan.corners.len()));
    }
    if let Some(at) = (0..arities.len()).find(|&f| arities[f] != scan.faces[f].corner_count) {
        return Err(disagree(
            "corners of one face",
            arities[at] as usize,
            scan.faces[at].corner_count as usize,
        ));
    }

    // Pair each vertex of tobj with its number in the file: both ways, so that neither merges nor splits one.
    let mut file_number = vec![UNSET; used];
    let mut parsed_number = vec![UNSET; scan.vertex_count];
    for (&parsed, &number) in mesh.indices.iter().zip(&scan.corners) {
        let (parsed_at, number_at) = (parsed as usize, number as usize);
        let pair = file_number.get_mut(parsed_at).zip(parsed_number.get_mut(number_at));
        let Some((to_file, to_parsed)) = pair else { return Err(disagree("vertices", parsed_at + 1, used)) };
        let fresh = *to_file == UNSET && *to_parsed == UNSET;
        if !fresh && (*to_file != number || *to_parsed != parsed) {
            return Err(disagree("as the number of a vertex", *to_file as usize + 1, number_at + 1));
        }
        (*to_file, *to_parsed) = (number, parsed);
    }

    // Number the used vertices in file order.
    let mut vertices = Vec::with_capacity(used);
    let mut rank = vec![UNSET; used];
    for &parsed in parsed_number.iter().filter(|&&parsed| parsed != UNSET) {
        let at = parsed as usize;
        rank[at] = vertices.len() as u32;
        vertices.push([mesh.positions[3 * at], mesh.positions[3 * at + 1], mesh.positions[3 * at + 2]]);
    }
    let mut corners = mesh.indices.iter().map(|&parsed| rank[parsed as usize]);
    let faces = arities.iter().map(|&arity| corners.by_ref().take(arity as usize).collect()).collect();
    Ok(Polygons { vertices, faces })
}

/// The single mesh that tobj makes of the normalised text.
fn parse(path: &Path, normalised: &str) -> Result<tobj::Mesh> {
    let options = tobj::LoadOptions { triangulate: false, single_index: true, ..Default::default() };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut normalised.as_bytes(), &options, no_materials)
        .map_err(|e| Error::whole(path, format!("the OBJ parser refuses the geometry: {e}")))?;
    let count = models.len();
    match <[tobj::Model; 1]>::try_from(models) {
        Ok([model]) => Ok(model.mesh),
        Err(_) => {
            let message = format!("the OBJ parser read {count} meshes, expected 1; please report this file");
            Err(Error::whole(path, message))
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::obj_scan::scan;
    use super::*;

    fn polygons(text: &str) -> Polygons {
        let path = Path::new("s.obj");
        read(path, &scan(path, text).unwrap()).unwrap()
    }

    #[test]
    fn vertices_keep_the_order_of_the_file_and_unused_ones_are_left_out() {
        let text = "v 0 0 0\nv 9 9 9\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 5 4 3 1\nf 3 1 4";
        let got = polygons(text);
        assert_eq!(got.vertices, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(got.faces, [vec![3, 2, 1, 0], vec![1, 0, 2]]);
    }

    #[test]
    fn triangles_alone_and_polygons_of_many_corners_keep_their_corners() {
        let vertices: String = (0..7).map(|i| format!("v {i} {} 0\n", i * i)).collect();
        let triangles = polygons(&format!("{vertices}f 1 2 3\nf 3 2 4"));
        assert_eq!(triangles.faces, [vec![0, 1, 2], vec![2, 1, 3]]);
        let mixed = polygons(&format!("{vertices}f 1 2 3 4 5 6 7\nf 1 2 3\nf 7 7 7 7 7"));
        assert_eq!(mixed.faces, [vec![0, 1, 2, 3, 4, 5, 6], vec![0, 1, 2], vec![6; 5]]);
    }

    #[test]
    fn a_parser_that_merges_vertices_would_be_noticed() {
        let path = Path::new("s.obj");
        let mut scanned = scan(path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4").unwrap();
        scanned.corners[3] = 1;
        let message = read(path, &scanned).unwrap_err().to_string();
        assert!(message.contains("please report this file"), "{message}");
    }
}
