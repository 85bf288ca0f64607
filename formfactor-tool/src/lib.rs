//! Elements to exchange matrix: S = diag(A) F with occlusion, exact where nothing stands between, adaptive elsewhere.
//!
//! # Limitations
//! The matrix is computed in memory and written at the end: dense blocks of about 8 bytes per pair that sees each other.

#![forbid(unsafe_code)]

pub mod compute;
pub mod export;
pub mod info;
pub mod tile;
