//! Elements to exchange matrix: S = diag(A) F with occlusion, exact where nothing stands between, adaptive elsewhere.
//!
//! # Limitations
//! The matrix is computed in memory and written at the end: dense blocks of about 8 bytes per pair that sees each other.

#![forbid(unsafe_code)]

pub mod compute;
pub mod counts;
pub mod estimator;
pub mod exact;
pub mod export;
pub mod info;
pub mod scene;
pub mod skips;
pub mod store;
pub mod tile;
pub mod traversal;
