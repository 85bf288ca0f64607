//! Elements to exchange matrix: S = diag(A) F with occlusion, exact where nothing stands between, adaptive elsewhere.
//!
//! # Limitations
//! The matrix is computed in memory and written at the end: dense blocks of about 8 bytes per pair that sees each other.
//! The hemicube and the rays besides keep the rows until the end: 20 bytes per element that each element sees.

#![forbid(unsafe_code)]

pub mod area_form;
pub mod classical;
pub mod compare;
pub mod compute;
pub mod counts;
pub mod estimator;
pub mod exact;
pub mod export;
pub mod hemicube;
pub mod info;
pub mod method;
pub mod rays;
pub mod rows;
pub mod scene;
pub mod skips;
pub mod store;
pub mod tile;
pub mod traversal;
pub mod visible_share;
