//! Exchange matrix and materials to radiosity: B = E + rho H, H = F B, per element and colour channel.
//!
//! [`mod@solve`] takes the scene apart and has each part solved by a [`mod@method`] until a proved [`bound`] on the error
//! meets the tolerance; [`mod@bounces`] sums bounces instead. [`error_budget`] says what errors of the matrix add to that,
//! [`bounds`] encloses every radiosity and says who causes the error, and [`energy`] where the power went. [`thermal`]
//! makes heat of it. [`run`], [`export`] (tables), [`surface`] (geometry), [`mod@compare`] and [`info`] are the program's subcommands.
//!
//! Two parallel plates that see nothing but each other, rho = 1/2, one of them glowing:
//!
//! ```
//! use interchange::matrix::{Block, BlockKind, Values};
//! use solve_tool::{channels::Channel, product::Product, solve::{Solver, solve}, system::System};
//!
//! // S = [[0, 1], [1, 0]], the upper triangle row after row.
//! let blocks = [Block::new(BlockKind::Triangle, 0..2, 0..2, 0)];
//! let product = Product::from_parts(2, &blocks, Values::F64(&[0.0, 1.0, 0.0]));
//! let system = System::from_parts(product, &[1.0, 1.0], &[0.0, 0.0], 0.0);
//! let grey = Channel { reflectance: vec![0.5, 0.5], exitance: vec![1.0, 0.0] };
//! let solved = solve(&system, &[grey.clone(), grey.clone(), grey], Solver::Auto, 1e-12)?;
//! // B1 = 1 / (1 - 1/4), B2 = B1 / 2.
//! assert!((solved.channels[0].radiosity[0] - 4.0 / 3.0).abs() < 1e-12);
//! assert!(solved.channels[0].bound <= 1e-12);
//! # Ok::<(), solve_tool::error::SolveError>(())
//! ```
//!
//! # Limitations
//! The matrix must be whole (one part). Diffuse reflection only; channels do not mix.

pub mod account;
pub mod bounces;
pub mod bound;
pub mod bounds;
pub mod channels;
pub mod compare;
pub mod components;
pub mod discretisation;
pub mod energy;
mod equation;
pub mod error;
pub mod error_budget;
pub mod export;
pub mod info;
pub mod interval;
mod kernel;
pub mod look;
pub mod lossless;
pub mod method;
mod part;
pub mod product;
pub mod run;
pub mod skips;
pub mod snapshot;
pub mod solve;
pub mod start;
pub mod surface;
pub mod system;
pub mod thermal;
mod weighted;
pub mod work;
