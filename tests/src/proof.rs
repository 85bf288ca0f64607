//! Proof by measurement: the real tools on the reference scenes, their CPU time against the error they really make.
//!
//! A *case* is a scene with a method, a kind of mesh and an asked error ([`plan`]); it is run ([`runner`], [`measure`]), its result
//! is held against a reference ([`reference`](mod@reference), [`errors`]), and the row is kept in a CSV ([`record`]) from which
//! the table ([`table`]) and the curves ([`plot`]) are drawn. [`skips`] does the same for what the tools leave out.

pub mod boxes;
pub mod errors;
pub mod measure;
pub mod plan;
pub mod plot;
pub mod record;
pub mod reference;
pub mod runner;
pub mod skips;
pub mod table;
