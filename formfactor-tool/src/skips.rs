//! Work that is provably not needed. Each skip has a name for `--no-skip`, which turns it off: the matrix stays the same
//! (to the bit, or within its tolerance where a cheaper rule serves).

use clap::ValueEnum;

/// One kind of work left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Skip {
    /// Two elements of one plane: zero
    SamePlane,
    /// An element wholly behind the other's plane: zero
    Behind,
    /// A cluster wholly behind the other's plane: its whole block is zero
    BehindClusters,
    /// No occluder reaches in front of any other: nothing can block anywhere
    ConvexEnclosure,
    /// Nothing reaches into the pair's shaft: no visibility work
    EmptyShaft,
    /// One convex blocker covers the pair's shaft: zero
    Covered,
    /// Blockers outside a shaft are outside every narrower one
    InheritedBlockers,
    /// S is symmetric: each pair is computed once (within a block on the diagonal always)
    Reciprocity,
    /// Zeros are not stored: no blocks of zeros, only the others in blocks that hold mostly zeros
    ZeroBlocks,
    /// Equal relative poses of unoccluded near pairs: computed once
    EqualPoses,
    /// Well-separated pairs and clusters: cheaper rules than the contour, one interpolated kernel for all pairs of two clusters
    FarRules,
    /// At loose tolerances: partly occluded far pairs by what a few points of both elements see, not cut along shadow lines
    PointViews,
    /// Elements that an older matrix (--reuse) has had: their factors are taken from it
    Reuse,
}

/// Which skips are on.
#[derive(Debug, Clone, Default)]
pub struct Skips {
    off: Vec<Skip>,
}

impl Skips {
    /// All but those `off`.
    pub fn without(off: &[Skip]) -> Self {
        Self { off: off.to_vec() }
    }

    /// Whether this kind of work is left out.
    pub fn has(&self, skip: Skip) -> bool {
        !self.off.contains(&skip)
    }
}
