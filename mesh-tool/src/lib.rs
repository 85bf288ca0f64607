//! Scene to elements: `mesh-tool build` and `mesh-tool materials`.
//!
//! The way of a scene: [`clean`] welds and drops ([`duplicates`]), [`orient`] turns over what contradicts its neighbours;
//! [`sheets`] finds what lies in one plane and looks the same way, [`contact`] where other faces stand on it or poke
//! through it. Then either [`given`] leaves the faces as they are, or
//! - [`regions`] merges coplanar neighbours, [`solids`] and [`hidden`] find what nothing can shine on,
//! - [`discontinuity`] draws the lines of the light ([`features`], [`wedge`], [`eee`]), those that matter ([`strength`]),
//! - [`meshed`] triangulates each plane as a whole ([`planar`], [`triangulation`], [`seeds`], [`refine`]),
//! - [`sized`] finds the size: where light changes ([`light`], [`lit`]), where its interpolation asks for it ([`adaptive`]),
//!   or where a solution is worst ([`solved`]); [`conform`] makes planes meet, [`grading`] evens sizes.
//!
//! [`assemble`] leaves out what has no area ([`flat`]), numbers elements ([`cluster`]) and nodes ([`nodes`]); [`quality`]
//! measures them; [`info`], [`look`] and [`picture`] ([`unfold`]) show the result, [`mod@compare`] sets two beside each other, [`export`] hands
//! one to other programs.
//!
//! # Limitations
//! With a number of elements as budget, shape and grading yield to it: faces much narrower than the elements get narrow ones, and sizes are
//! graded only where that takes no more than a tenth above the number (`--no-skip grading`: always). Two
//! curvature lines may cross at a degree or less; angles between them are what they are. A body that touches itself or
//! has a hole is not closed, and what lies in it counts as lit.

#![forbid(unsafe_code)]

pub mod adaptive;
pub mod arranged;
pub mod assemble;
pub mod box_tree;
pub mod build;
pub mod chosen;
pub mod clean;
pub mod cluster;
pub mod compare;
pub mod compare_materials;
pub mod conform;
pub mod contact;
pub mod convex;
pub mod depfile;
pub mod discontinuity;
pub mod duplicates;
pub mod eee;
pub mod export;
pub mod features;
pub mod flat;
pub mod frame;
pub mod given;
pub mod grading;
pub mod hidden;
pub mod info;
pub mod light;
pub mod lit;
pub mod look;
pub mod merge_lines;
pub mod meshed;
pub mod near;
pub mod nodes;
pub mod orient;
pub mod outline;
pub mod patch;
pub mod picture;
pub mod places;
pub mod planar;
pub mod quality;
pub mod refine;
pub mod regions;
pub mod search;
pub mod seeds;
pub mod sheets;
pub mod sized;
pub mod solids;
pub mod solved;
pub mod steps;
pub mod strength;
pub mod triangulation;
pub mod unfold;
pub mod wedge;

pub use build::{Options, build, provenance};

/// Name of the tool.
pub const NAME: &str = "mesh-tool";
/// Version of the tool.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
