//! Elements of different planes meet edge to edge: where a vertex of one plane lies inside an edge of another plane (a
//! wall's foot, a common edge that one side split further), that edge is split there, too.

use crate::meshed::{Drawing, Triangles};
use crate::places::Places;
use glam::DVec3;
use rayon::prelude::*;

/// Rounds of splitting and widening the angles this makes. The last round only splits: then nothing is left to meet.
const ROUNDS: usize = 12;

/// Makes all layers meet. Points that are one of `places` (those of the scene's corners), or of each other, become one. A
/// layer whose edges would tangle (faces closer together than can be told apart) stays as it is; returns their number.
pub fn meet(drawings: &[Drawing], meshes: &mut [Triangles], places: &Places) -> usize {
    let tolerance = places.tolerance();
    let mut places = places.clone();
    let mut tangled = vec![false; meshes.len()];
    for round in 1..=ROUNDS {
        weld(drawings, meshes, &mut places);
        let found = splits_of(meshes, tolerance);
        if found.iter().zip(&tangled).all(|(found, &tangled)| tangled || found.is_empty()) {
            break;
        }
        let layers = meshes.par_iter_mut().zip(drawings).zip(&found).zip(&mut tangled);
        layers.for_each(|(((mesh, drawing), found), tangled)| {
            if !found.is_empty() && !*tangled {
                *tangled = drawing.split_edges(mesh, found, round < ROUNDS, tolerance).is_err();
            }
        });
    }
    tangled.into_iter().filter(|&tangled| tangled).count()
}

/// Moves points on edges to the place they are one with, in the order of the layers. What cannot be moved stays.
fn weld(drawings: &[Drawing], meshes: &mut [Triangles], places: &mut Places) {
    let at = meshes.iter().map(|mesh| {
        let points = mesh.fixed_points();
        points.map(|(point, position)| (point, places.insert(position))).collect()
    });
    let at: Vec<Vec<(usize, u32)>> = at.collect();
    let tolerance = places.tolerance();
    let layers = meshes.par_iter_mut().zip(drawings).zip(at);
    layers.for_each(|((mesh, drawing), at)| {
        let moves = at.into_iter().map(|(point, place)| (point, places.position(place)));
        // Where moving them tangles, the next rounds split what they can.
        let _ = drawing.move_points(mesh, moves, tolerance);
    });
}

/// Where an edge is to be split: its number, and points with their place along it, in order.
pub type EdgeSplit = (usize, Vec<(f64, DVec3)>);

/// Per layer the edges of its graph that vertices of others lie on.
fn splits_of(meshes: &[Triangles], tolerance: f64) -> Vec<Vec<EdgeSplit>> {
    let mut vertices: Vec<DVec3> = meshes.iter().flat_map(Triangles::edge_points).collect();
    vertices.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    vertices.dedup();
    let of_edge = |[from, to]: [DVec3; 2]| -> Vec<(f64, DVec3)> {
        let (low, high) = (from.min(to) - tolerance, from.max(to) + tolerance);
        let length = from.distance(to);
        let first = vertices.partition_point(|v| v.x < low.x);
        let mut within: Vec<(f64, DVec3)> = vertices[first..]
            .iter()
            .take_while(|v| v.x <= high.x)
            .filter(|v| v.cmpge(low).all() && v.cmple(high).all())
            .filter(|v| v.distance(from) > tolerance && v.distance(to) > tolerance)
            .filter_map(|&v| {
                let along = (v - from).dot(to - from) / (length * length);
                let within = along > 0.0 && along < 1.0;
                (within && v.distance(from.lerp(to, along)) <= tolerance).then_some((along, v))
            })
            .collect();
        within.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Vertices that are one place to the weld tolerance split an edge once.
        within.dedup_by(|later, first| (later.0 - first.0) * length <= tolerance);
        within
    };
    meshes
        .par_iter()
        .map(|mesh| {
            let splits = mesh.edges().map(|(edge, ends)| (edge, of_edge(ends)));
            splits.filter(|(_, points)| !points.is_empty()).collect()
        })
        .collect()
}
