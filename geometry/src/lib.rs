//! What a point or a polygon sees: planes, polygons, clipping, form factors, visible parts, ray casting.
//!
//! Knows no file and no radiosity. All lengths are relative: nothing here compares with an absolute epsilon, so a
//! scene scaled by any factor gives the same answers.

#![forbid(unsafe_code)]

pub mod gather;
pub mod plane;
pub mod polygon;
pub mod ray_cast;
