//! Scene to elements: `mesh-tool build` and `mesh-tool materials`.
//!
//! The way of a scene: [`clean`] welds and drops, [`sheets`] finds what lies in one plane and looks the same way,
//! [`contact`] where other faces stand on it or poke through it; then either [`given`] leaves the faces as they are, or
//! [`meshed`] triangulates each plane as a whole ([`planar`], [`triangulation`], [`seeds`], [`refine`]), with smaller triangles where
//! light changes ([`light`], [`lit`]; [`sized`] keeps the count); [`assemble`]
//! numbers elements ([`cluster`]) and nodes ([`nodes`]).
//!
//! # Limitations
//! Faces keep the orientation they are given in. Parts of faces that nothing can see (under a block, inside a body)
//! are meshed like the rest. Walls that meet at an edge are split alike along it, except where refinement near a
//! narrow angle splits one of them further.

#![forbid(unsafe_code)]

pub mod adaptive;
pub mod assemble;
pub mod box_tree;
pub mod build;
pub mod clean;
pub mod cluster;
pub mod conform;
pub mod contact;
pub mod convex;
pub mod depfile;
pub mod discontinuity;
pub mod duplicates;
pub mod eee;
pub mod features;
pub mod frame;
pub mod given;
pub mod hidden;
pub mod info;
pub mod light;
pub mod lit;
pub mod merge_lines;
pub mod meshed;
pub mod nodes;
pub mod orient;
pub mod outline;
pub mod patch;
pub mod picture;
pub mod places;
pub mod planar;
pub mod refine;
pub mod regions;
pub mod seeds;
pub mod sheets;
pub mod sized;
pub mod solids;
pub mod solved;
pub mod steps;
pub mod strength;
pub mod triangulation;
pub mod wedge;

pub use build::{Options, build, provenance};

/// Name of the tool.
pub const NAME: &str = "mesh-tool";
/// Version of the tool.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
