//! Elements to exchange matrix: S = diag(A) F with occlusion, exact where nothing stands between, adaptive elsewhere.
//!
//! # Limitations
//! A pair of leaf clusters is computed at a time and held in memory as f64; a mesh whose leaves hold thousands of elements
//! needs memory for that.

#![forbid(unsafe_code)]

pub mod block_sums;
pub mod closure;
pub mod compute;
pub mod counts;
pub mod descent;
pub mod estimator;
pub mod exact;
pub mod export;
pub mod info;
pub mod journal;
pub mod merge;
pub mod options;
pub mod plan;
pub mod poses;
pub mod scene;
pub mod schedule;
pub mod shards;
pub mod skips;
pub mod store;
pub mod tile;
pub mod traversal;
