//! The worst that row errors of the matrix do to all radiosities together, weighted by importance.
//!
//! With p_i = rho_i z_i the change of sum A B is at most the sum over pairs of |dS_ij| (p_i B_j + p_j B_i), where all
//! that is known of dS >= 0 is that each row holds at most A_i e_i: a linear programme. Any y with
//! y_i + y_j >= p_i B_j + p_j B_i proves the bound sum of A_i e_i y_i (weak duality). Tried are, besides filling each row
//! by itself, the y that set apart the k brightest elements, or the k with the largest p, for every k: what is left has
//! smaller maxima.

/// An element's p, |B| and budget A e, W.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weighted {
    pub importance: f64,
    pub size: f64,
    pub budget: f64,
}

/// The least bound that the tried y prove, W.
pub(crate) fn pair_bound(elements: &[Weighted]) -> f64 {
    let swapped: Vec<Weighted> =
        elements.iter().map(|e| Weighted { importance: e.size, size: e.importance, ..*e }).collect();
    split_bound(elements).min(split_bound(&swapped))
}

/// The k largest sizes are set apart: y = B p_max + p B' for them, (p B' + B p') / 2 for the others, with B' and p' the
/// largest of the others.
fn split_bound(elements: &[Weighted]) -> f64 {
    let mut order: Vec<&Weighted> = elements.iter().collect();
    order.sort_by(|a, b| b.size.total_cmp(&a.size));
    let n = order.len();
    let largest = elements.iter().map(|e| e.importance).fold(0.0, f64::max);
    // Largest importance from k on.
    let mut rest_largest = vec![0.0; n + 1];
    for k in (0..n).rev() {
        rest_largest[k] = order[k].importance.max(rest_largest[k + 1]);
    }
    let mut rest_importance: f64 = order.iter().map(|e| e.budget * e.importance).sum();
    let mut rest_size: f64 = order.iter().map(|e| e.budget * e.size).sum();
    let (mut apart_importance, mut apart_size) = (0.0, 0.0);
    let mut best = f64::INFINITY;
    for (k, &rest_largest) in rest_largest.iter().enumerate() {
        let brightest_left = order.get(k).map_or(0.0, |e| e.size);
        let apart = largest * apart_size + brightest_left * apart_importance;
        let rest = 0.5 * (brightest_left * rest_importance.max(0.0) + rest_largest * rest_size.max(0.0));
        best = best.min(apart + rest);
        if let Some(next) = order.get(k) {
            apart_importance += next.budget * next.importance;
            apart_size += next.budget * next.size;
            rest_importance -= next.budget * next.importance;
            rest_size -= next.budget * next.size;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The programme itself by its definition, on few elements: errors put pair by pair where they hurt most is one
    /// choice, and no bound may be below it.
    fn greedy(elements: &[Weighted]) -> f64 {
        let n = elements.len();
        let gain = |i: usize, j: usize| {
            elements[i].importance * elements[j].size + elements[j].importance * elements[i].size
        };
        let mut pairs: Vec<(usize, usize)> = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).collect();
        pairs.sort_by(|&(a, b), &(c, d)| gain(c, d).total_cmp(&gain(a, b)));
        let mut left: Vec<f64> = elements.iter().map(|e| e.budget).collect();
        let mut total = 0.0;
        for (i, j) in pairs {
            let put = left[i].min(left[j]);
            total += put * gain(i, j);
            left[i] -= put;
            left[j] -= put;
        }
        total
    }

    #[test]
    fn no_choice_of_errors_exceeds_the_bound() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..500 {
            let n = 2 + (10.0 * next()) as usize;
            let element = |_| Weighted { importance: next(), size: next().powi(8), budget: next() };
            let elements: Vec<Weighted> = (0..n).map(element).collect();
            let (worst, bound) = (greedy(&elements), pair_bound(&elements));
            assert!(worst <= bound * (1.0 + 1e-12), "{worst} > {bound}: {elements:?}");
        }
    }

    #[test]
    fn two_alike_elements_reach_the_bound() {
        let one = Weighted { importance: 2.0, size: 3.0, budget: 0.5 };
        // |dS| = 0.5 between them, 2 * 3 + 3 * 2 each.
        assert!((pair_bound(&[one, one]) - 6.0).abs() < 1e-15);
    }
}
