//! Which elements of a mesh another mesh of the scene has, too: the same corners to the last bit, in the same order (so the same
//! plane and the same front), on the same side of the same face.

use interchange::ids::ElementId;
use interchange::mesh::Mesh;
use std::collections::HashMap;

/// Whether the same faces block light in both meshes, two-sided or not.
pub fn same_blockers(new: &Mesh, old: &Mesh) -> bool {
    let pieces = |mesh: &Mesh| mesh.occluders.len();
    let corners = |mesh: &Mesh, k: usize| -> Vec<[u64; 3]> {
        mesh.occluders.row(k).iter().map(|v| mesh.vertices[v.index()].map(f64::to_bits)).collect()
    };
    let two_sided = |mesh: &Mesh, k: usize| mesh.is_two_sided(mesh.occluder_faces[k]);
    pieces(new) == pieces(old)
        && (0..pieces(new))
            .all(|k| corners(new, k) == corners(old, k) && two_sided(new, k) == two_sided(old, k))
}

/// Per element of the new mesh its number in the old one, where it has it.
pub fn same_elements(new: &Mesh, old: &Mesh) -> Vec<Option<u32>> {
    let mut places = HashMap::with_capacity(old.element_count());
    for (k, identity) in old.element_identities().into_iter().enumerate() {
        places.insert(identity, k as u32);
    }
    // The identity is a hash: what it finds is compared itself.
    let found = |(k, identity): (usize, u64)| {
        let place = *places.get(&identity)?;
        let is_same = outline(new, k) == outline(old, place as usize)
            && new.element_faces[k] == old.element_faces[place as usize]
            && new.element_sides[k] == old.element_sides[place as usize];
        is_same.then_some(place)
    };
    new.element_identities().into_iter().enumerate().map(found).collect()
}

/// Corners of an element, bit for bit, from the least one on.
fn outline(mesh: &Mesh, element: usize) -> Vec<[u64; 3]> {
    let mut bits: Vec<[u64; 3]> = mesh
        .element_corners(ElementId::new(element))
        .iter()
        .map(|corner| corner.to_array().map(f64::to_bits))
        .collect();
    let least = (0..bits.len()).min_by_key(|&k| bits[k]).unwrap_or(0);
    bits.rotate_left(least);
    bits
}
