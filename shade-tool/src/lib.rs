//! Radiosity to pictures and points: the last stage of the pipeline.
//!
//! [`render`] finds the surface that each sample of a pixel sees ([`visible`]), gathers irradiance at the nodes of the
//! facets that are seen ([`facets`], [`nodes`], [`node_places`]), cuts facets over which radiosity is not linear ([`refined`]), interpolates linearly
//! ([`interpolation`]) and writes
//! radiance as OpenEXR ([`exr_file`]) and a tone-mapped preview ([`preview`]). [`probe`] gathers irradiance at the
//! points of a table. [`info`] tells what a picture holds.
//!
//! # Limitations
//! Surfaces are seen as Lambertian: specular and transparent parts of a material do not show.

#![forbid(unsafe_code)]

pub mod camera;
pub mod command_line;
pub mod compare;
pub mod convex;
pub mod error;
pub mod exr_file;
pub mod face_elements;
pub mod facets;
pub mod info;
pub mod interpolation;
pub mod lit_scene;
pub mod node_places;
pub mod nodes;
pub mod on_surface;
pub mod picture;
pub mod points;
pub mod preview;
pub mod probe;
pub mod receiver;
pub mod refined;
pub mod render;
pub mod visible;

#[cfg(test)]
mod test_scenes;

pub use error::{Error, Result};

/// Name of the tool in reports, provenance and messages.
pub const TOOL: &str = "shade-tool";
/// Version of the tool in reports and provenance.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
