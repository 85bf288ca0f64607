//! Which leaf pairs a shard computes: short runs of neighbours dealt out in turn, cut by expected work, so that shards
//! are balanced even where the expectation is off in one corner of the scene.

use crate::estimator::Estimator;
use crate::options::Shard;
use crate::traversal::LeafPair;

/// Runs per shard: an error of the expected work averages out over this many places.
const RUNS: f64 = 32.0;

/// The pairs of one shard, in order. The shards of one N share no pair and miss none.
pub fn pairs_of(pairs: Vec<LeafPair>, estimator: &impl Estimator, shard: Shard) -> Vec<LeafPair> {
    let works: Vec<f64> = pairs.iter().map(|pair| estimator.work(pair)).collect();
    let total: f64 = works.iter().sum();
    let runs = RUNS * f64::from(shard.parts);
    let mut before = 0.0;
    let mut kept = Vec::new();
    for (pair, work) in pairs.into_iter().zip(works) {
        // The run in which the middle of its work lies.
        let run = ((before + 0.5 * work) / total * runs) as u64;
        before += work;
        if run % u64::from(shard.parts) == u64::from(shard.part) {
            kept.push(pair);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tile::Tile;

    struct Uneven;

    impl Estimator for Uneven {
        fn tile(&self, _: &LeafPair) -> Tile {
            unreachable!("nothing is computed here")
        }

        fn work(&self, pair: &LeafPair) -> f64 {
            // Three orders of magnitude between the cheapest and the dearest, the dear ones together.
            if pair.rows.start > 900 { 1000.0 } else { 1.0 + (pair.rows.start % 7) as f64 }
        }
    }

    #[test]
    fn every_pair_is_in_one_shard_and_work_is_even() {
        let pairs: Vec<LeafPair> = (0..2000)
            .map(|k| LeafPair { rows: k..k + 1, columns: k + 1..k + 2, blockers: Vec::new() })
            .collect();
        for parts in [1, 3, 5] {
            let shards: Vec<Vec<LeafPair>> =
                (0..parts).map(|part| pairs_of(pairs.clone(), &Uneven, Shard { part, parts })).collect();
            let mut all: Vec<LeafPair> = shards.iter().flatten().cloned().collect();
            all.sort_by_key(|pair| pair.rows.start);
            assert_eq!(all, pairs);
            let works: Vec<f64> =
                shards.iter().map(|shard| shard.iter().map(|pair| Uneven.work(pair)).sum()).collect();
            let mean = works.iter().sum::<f64>() / works.len() as f64;
            assert!(works.iter().all(|work| (work / mean - 1.0).abs() < 0.05), "{works:?}");
        }
    }
}
