//! Exchange matrix and materials to radiosity: B = E + rho H, H = F B, per element and colour channel.
//!
//! [`mod@solve`] finds the radiosity by conjugate gradients or by factorisation and stops when a proved
//! [`bound`] on the error meets the tolerance; [`error_budget`] says what errors of the matrix add to that, and
//! [`energy`] where the power went. [`run`], [`export`] and [`info`] are the program's subcommands.
//!
//! # Limitations
//! The matrix must be whole (one part) and symmetric. Diffuse reflection only; channels do not mix.

pub mod bound;
mod cg;
pub mod channels;
pub mod components;
mod direct;
pub mod energy;
mod equation;
pub mod error;
pub mod error_budget;
pub mod export;
pub mod info;
mod kernel;
pub mod lossless;
pub mod product;
pub mod run;
pub mod solve;
pub mod system;
