//! What crosses a file between the four radiosity tools, and nothing else.
//!
//! The tools meet only here: a mesh, a matrix, a solution and a material table, all in one checksummed
//! [`container`]; the scene as its author wrote it ([`scene`]); the report every stage leaves beside its output;
//! the few command-line habits the tools share ([`tool`]); the letters of their pictures ([`font`]); and geometry for other programs ([`foreign`]). `FORMAT.md`
//! beside this crate specifies every byte of our own files.
//!
//! # Limitations
//! Files are little-endian and are read on little-endian machines only. A mapped file must not be truncated by
//! another program while it is in use; the tools themselves only ever replace files by rename.

pub mod atomic_write;
pub mod container;
pub mod counted;
pub mod digest;
pub mod error;
pub mod font;
pub mod foreign;
pub mod grouping;
pub mod ids;
mod interrupt;
mod mapping;
pub mod materials;
pub mod materials_input;
pub mod matrix;
pub mod mesh;
pub mod provenance;
pub mod ragged;
pub mod report;
pub mod scene;
pub mod solution;
pub mod tables;
pub mod tool;

pub use error::{Error, Result};

#[cfg(target_endian = "big")]
compile_error!(
    "files are little-endian and mapped as they lie; this crate supports little-endian machines only"
);
