//! Elements to exchange matrix: S = diag(A) F with occlusion, exact where nothing stands between, adaptive elsewhere.
//!
//! # Limitations
//! A pair of leaf clusters is computed at a time and held in memory as f64; a mesh whose leaves hold thousands of elements
//! needs memory for that. The hemicube and the rays besides keep the rows until the end: 20 bytes per element that each
//! element sees.

#![forbid(unsafe_code)]

pub mod area_form;
pub mod block_sums;
mod by_points;
pub mod classical;
pub mod closure;
pub mod cluster_rule;
pub mod compare;
pub mod compute;
pub mod counts;
pub mod descent;
pub mod estimator;
pub mod exact;

pub mod export;
mod filling;
pub mod foreign;
pub mod hemicube;
pub mod import;
pub mod info;
pub mod journal;
pub mod look;
pub mod merge;
pub mod method;
pub mod options;
pub mod picture;
pub mod plan;
pub mod point_views;
pub mod poses;
pub mod rays;
pub mod reuse;
pub mod rows;
pub mod scene;
pub mod schedule;
pub mod shards;
mod sizes;
pub mod skips;
pub mod store;
pub mod tile;
pub mod traversal;
pub mod visible_share;
