//! Faces given twice: the same corners the same way round.

use crate::clean::Face;
use crate::places::Places;
use geometry::polygon;
use interchange::counted::counted;
use interchange::report::Report;
use interchange::scene::Scene;
use std::collections::HashMap;

/// Drops faces with the corners and orientation of an earlier one; an emitter wins over what does not emit. Returns
/// what is left and how many were dropped.
pub fn without_duplicates(
    faces: Vec<Face>,
    places: &Places,
    scene: &Scene,
    report: &mut Report,
) -> (Vec<Face>, usize) {
    let mut first: HashMap<Vec<u32>, usize> = HashMap::new();
    let mut kept = vec![true; faces.len()];
    for (index, face) in faces.iter().enumerate() {
        let Some(&earlier) = first.get(&smallest_rotation(&face.corners)) else {
            first.insert(smallest_rotation(&face.corners), index);
            continue;
        };
        let (winner, loser) =
            if face.emits && !faces[earlier].emits { (index, earlier) } else { (earlier, index) };
        kept[loser] = false;
        first.insert(smallest_rotation(&face.corners), winner);
        if faces[loser].emits {
            report.warn(format!(
                "{}:{}: this emitter (group {}) repeats the one on line {} and was dropped",
                scene.path.display(),
                faces[loser].line,
                scene.groups[faces[loser].group.index()],
                faces[winner].line
            ));
        }
    }
    let dropped = kept.iter().filter(|kept| !**kept).count();
    let area = |face: &Face| polygon::area(&places.corners(&face.corners));
    let lost: f64 = faces.iter().zip(&kept).filter(|(_, kept)| !**kept).map(|(face, _)| area(face)).sum();
    report.estimate("area of dropped duplicates", lost.abs());
    if dropped > 0 {
        report.warn(format!(
            "{}: {}",
            scene.path.display(),
            counted(
                dropped,
                "face with the corners and orientation of another was dropped",
                "faces with the corners and orientation of another were dropped"
            )
        ));
    }
    (faces.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(face, _)| face).collect(), dropped)
}

/// The rotation of a ring that compares smallest: equal for equal rings of one orientation.
fn smallest_rotation(ring: &[u32]) -> Vec<u32> {
    let rotation = |start: usize| ring[start..].iter().chain(&ring[..start]).copied().collect::<Vec<u32>>();
    let least = ring.iter().min();
    let starts = (0..ring.len()).filter(|&start| Some(&ring[start]) == least);
    starts.map(rotation).min().unwrap_or_default()
}
