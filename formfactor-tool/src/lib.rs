//! Elements to exchange matrix.

pub mod export;
pub mod info;
