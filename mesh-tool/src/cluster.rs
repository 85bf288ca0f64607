//! Cluster order: a binary tree over the elements, first by the direction they look, then by plane, then by place;
//! elements are numbered in its order, so that a cluster is a range of rows and columns of the matrix.

use geometry::plane::Plane;
use geometry::polygon;
use glam::DVec3;
use interchange::mesh::Cluster;

/// Leaves hold at most this many elements.
pub const LEAF: usize = 32;
/// Clusters whose normals differ by more than this in some component are split by direction (0.5 is 30 degrees).
const DIRECTION: f64 = 0.5;
/// Distance between parallel planes counts this many times as much as distance along them: parts of different
/// surfaces see each other and the rest of the scene differently, parts of one surface do not see each other.
const ACROSS: f64 = 4.0;
/// Places are compared in this many steps of the scene's diagonal, so that equal ones stay equal in another unit.
const STEPS: f64 = 4_294_967_296.0; // 2^32

/// What decides where an element goes.
#[derive(Debug, Clone, Copy)]
struct Item {
    element: usize,
    centre: DVec3,
    normal: DVec3,
}

/// The order of the elements (old index at each new place) and the tree over it.
pub fn order(elements: &[Vec<DVec3>], centre: DVec3, diagonal: f64) -> (Vec<usize>, Vec<Cluster>) {
    let rounded = |v: DVec3| (v * STEPS).round() / STEPS;
    let mut items: Vec<Item> = elements
        .iter()
        .enumerate()
        .map(|(element, corners)| {
            let normal = Plane::of_polygon(corners).map_or(DVec3::ZERO, |plane| plane.normal);
            let place = (polygon::centroid(corners) - centre) / diagonal;
            Item { element, centre: rounded(place), normal: rounded(normal) }
        })
        .collect();
    let mut clusters = Vec::new();
    split(&mut items, 0, &mut clusters);
    (items.into_iter().map(|item| item.element).collect(), clusters)
}

/// Appends the tree over `items`, whose first element has number `start`; children follow their parent.
fn split(items: &mut [Item], start: usize, clusters: &mut Vec<Cluster>) {
    let own = clusters.len();
    let end = (start + items.len()) as u32;
    clusters.push(Cluster { start: start as u32, end, first_child: 0, second_child: 0 });
    if items.len() <= LEAF {
        sort_leaf(items);
        return;
    }
    let middle = partition(items);
    let (first, second) = items.split_at_mut(middle);
    clusters[own].first_child = clusters.len() as u32;
    split(first, start, clusters);
    clusters[own].second_child = clusters.len() as u32;
    split(second, start + middle, clusters);
}

/// Orders the elements of a leaf so that halves of it, and halves of those, are close together too.
fn sort_leaf(items: &mut [Item]) {
    if items.len() > 2 {
        partition(items);
        let (first, second) = items.split_at_mut(items.len() / 2);
        sort_leaf(first);
        sort_leaf(second);
    }
}

/// Sorts the items into two parts, both not empty, and returns the length of the first.
fn partition(items: &mut [Item]) -> usize {
    // By direction, in the middle of the widest component.
    let (low, high) = bounds(items, |item| item.normal);
    let axis = widest(high - low);
    if (high - low)[axis] > DIRECTION {
        let middle = 0.5 * (low[axis] + high[axis]);
        sort(items, |item| item.normal[axis]);
        return items.partition_point(|item| item.normal[axis] < middle).clamp(1, items.len() - 1);
    }
    // By place, in the widest direction of a frame along the mean plane.
    let normal = items.iter().map(|item| item.normal).sum::<DVec3>().try_normalize().unwrap_or(DVec3::Z);
    let (x, y) = normal.any_orthonormal_pair();
    let place =
        |item: &Item| DVec3::new(item.centre.dot(x), item.centre.dot(y), ACROSS * item.centre.dot(normal));
    let (low, high) = bounds(items, place);
    let axis = widest(high - low);
    sort(items, |item| place(item)[axis]);
    if axis < 2 {
        return items.len() / 2;
    }
    // Between planes, at the widest gap that leaves both sides many elements.
    let worth =
        |k: usize| (place(&items[k])[axis] - place(&items[k - 1])[axis]) * k.min(items.len() - k) as f64;
    (1..items.len()).fold(items.len() / 2, |best, k| if worth(k) > worth(best) { k } else { best })
}

/// Sorts by a key rounded to the steps; equal ones keep the order of the elements.
fn sort(items: &mut [Item], key: impl Fn(&Item) -> f64) {
    items.sort_by_key(|item| ((key(item) * STEPS / 16.0).round() as i64, item.element));
}

fn bounds(items: &[Item], value: impl Fn(&Item) -> DVec3) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    items.iter().map(value).fold(start, |(low, high), v| (low.min(v), high.max(v)))
}

/// The widest axis; of (nearly) equal ones the first, so that rounding does not choose.
fn widest(extent: DVec3) -> usize {
    (1..3).fold(0, |best, k| if extent[k] > 1.000001 * extent[best] { k } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_are_small_and_tile_the_order() {
        let square = |x: f64, y: f64, z: f64, up: bool| -> Vec<DVec3> {
            let mut ring = [(0.0, 0.0), (0.9, 0.0), (0.9, 0.9), (0.0, 0.9)]
                .map(|(u, v)| DVec3::new(x + u, y + v, z))
                .to_vec();
            if !up {
                ring.reverse();
            }
            ring
        };
        let mut elements = Vec::new();
        for k in 0..20 {
            for l in 0..20 {
                elements.push(square(f64::from(k), f64::from(l), 0.0, true));
                elements.push(square(f64::from(k), f64::from(l), 20.0, false));
            }
        }
        let (order, clusters) = order(&elements, DVec3::ZERO, 30.0);
        let mut seen = order.clone();
        seen.sort_unstable();
        assert_eq!(seen, (0..800).collect::<Vec<_>>());
        // The first split separates floor from ceiling: even from odd.
        let second = clusters[clusters[0].second_child as usize];
        assert_eq!((second.start, second.end), (400, 800));
        assert!(order[..400].iter().all(|e| e % 2 == order[0] % 2));
        let mut covered = 0;
        for cluster in &clusters {
            if cluster.is_leaf() {
                assert_eq!(cluster.start, covered);
                assert!((cluster.end - cluster.start) as usize <= LEAF);
                covered = cluster.end;
            }
        }
        assert_eq!(covered, 800);
    }
}
