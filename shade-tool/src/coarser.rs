//! The solution with half as many elements along each side: what a gathered value changes by is an estimate of what the
//! elements' size costs it (Richardson's, with first order assumed, which is the pessimistic one).

use crate::lit_scene::LitScene;
use geometry::polygon;
use glam::DVec3;

/// Elements taken together at most: four in a plane are half as many along each side.
const TOGETHER: usize = 4;

/// For every source the mean radiosity of it and its neighbours on the same side of its face.
pub fn coarser_radiosity(scene: &LitScene) -> Vec<[f64; 3]> {
    let mut coarse = scene.radiosity.clone();
    let mut of_face: Vec<(u32, u32, usize)> = Vec::new();
    for (drawn, &source) in scene.source_of.iter().enumerate() {
        of_face.push((scene.mesh.element_faces[drawn].0, scene.mesh.element_sides[drawn], source as usize));
    }
    of_face.sort_unstable();
    of_face.dedup();
    let places: Vec<(DVec3, f64)> =
        scene.sources.iter().map(|corners| (polygon::centroid(corners), polygon::area(corners))).collect();
    for side in of_face.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let mut members: Vec<usize> = side.iter().map(|&(.., source)| source).collect();
        average(&mut members, &places, &scene.radiosity, &mut coarse);
    }
    coarse
}

/// Halves a set along its longest extent until few are left, and gives those their mean.
fn average(members: &mut [usize], places: &[(DVec3, f64)], radiosity: &[[f64; 3]], coarse: &mut [[f64; 3]]) {
    if members.len() > TOGETHER {
        let empty = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
        let (low, high) =
            members.iter().fold(empty, |(low, high), &k| (low.min(places[k].0), high.max(places[k].0)));
        let extent = high - low;
        let axis = (0..3).fold(0, |best, c| if extent[c] > extent[best] { c } else { best });
        members.sort_by(|&a, &b| places[a].0[axis].total_cmp(&places[b].0[axis]).then(a.cmp(&b)));
        let (first, second) = members.split_at_mut(members.len() / 2);
        average(first, places, radiosity, coarse);
        average(second, places, radiosity, coarse);
        return;
    }
    let area: f64 = members.iter().map(|&k| places[k].1).sum();
    if area > 0.0 {
        let mean = std::array::from_fn(|c| {
            members.iter().map(|&k| places[k].1 * radiosity[k][c]).sum::<f64>() / area
        });
        members.iter().for_each(|&k| coarse[k] = mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scenes::cube;

    #[test]
    fn four_elements_of_a_wall_become_one_and_power_stays() {
        let mut scene = cube(2);
        scene.radiosity = (0..24).map(|k| [f64::from(k), f64::from(k % 4), 1.0]).collect();
        let coarse = coarser_radiosity(&scene);
        assert_eq!((coarse[0], coarse[3], coarse[4]), ([1.5, 1.5, 1.0], [1.5, 1.5, 1.0], [5.5, 1.5, 1.0]));
        let mut finer = cube(8);
        finer.radiosity = (0..384).map(|k| [f64::from(k * k % 7), 0.0, 1.0]).collect();
        let sum = |values: &[[f64; 3]]| values.iter().map(|b| b[0]).sum::<f64>();
        assert!((sum(&coarser_radiosity(&finer)) / sum(&finer.radiosity) - 1.0).abs() < 1e-12);
    }
}
