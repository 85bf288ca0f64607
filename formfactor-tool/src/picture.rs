//! `formfactor-tool picture`: the matrix as a picture, and one row of it painted onto the scene.

pub mod canvas;
pub mod matrix;
pub mod row;
pub mod scale;
