//! Damage on purpose: files cut short, bytes flipped, at places that a fixed seed chooses.

/// A small generator (SplitMix64, Steele et al. 2014): the same places on every machine and in every run.
#[derive(Debug, Clone)]
pub struct Dice(u64);

impl Dice {
    /// Starts from a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.bits() % limit.max(1) as u64) as usize
    }
}

/// Lengths to cut a file of `length` bytes to: none, the envelope's borders, and seeded places up to one byte short.
pub fn cuts(length: usize, seed: u64) -> Vec<usize> {
    let mut dice = Dice::new(seed);
    let mut cuts = vec![0, 1, 7, 8, 31, 32, 33, length / 2, length - 1];
    cuts.extend((0..8).map(|_| dice.below(length)));
    cuts.retain(|&cut| cut < length);
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}

/// The bytes with one bit flipped, at `count` seeded places. Byte 10 and 11, the minor version, may hold anything and
/// are left out.
pub fn flips(good: &[u8], count: usize, seed: u64) -> impl Iterator<Item = (usize, Vec<u8>)> {
    let mut dice = Dice::new(seed);
    (0..count).map(move |_| {
        let place = loop {
            let place = dice.below(good.len());
            if !(10..12).contains(&place) {
                break place;
            }
        };
        let mut bad = good.to_vec();
        bad[place] ^= 1 << dice.below(8);
        (place, bad)
    })
}

/// Whether the full number of faults is asked for (FAULTS=full, `make -f pipeline.mk faults`) and not the quick subset.
pub fn full() -> bool {
    std::env::var_os("FAULTS").is_some_and(|value| value == "full")
}
