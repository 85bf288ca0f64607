//! Radiosity to pictures and points: the last stage of the pipeline.
//!
//! [`render`] finds the surface that each sample of a pixel sees ([`visible`]), gathers irradiance at the nodes of the
//! facets that are seen ([`facets`], [`nodes`], [`node_places`]), cuts facets where interpolation is not good enough ([`refined`]),
//! interpolates ([`interpolation`]) and writes radiance and layers ([`layers`]) as OpenEXR ([`exr_file`]) and a tone-mapped
//! preview ([`preview`]), for one camera or several ([`camera`], [`frames`]). [`probe`] gathers irradiance at the points of a
//! table or of a grid ([`grid`]). [`info`] tells what a picture holds. [`joined`] makes few sources of the
//! solution's elements, [`bounces`] layers of light by its number of reflections. [`skips`] names what is left out.
//!
//! # Limitations
//! Surfaces are seen as Lambertian: specular and transparent parts of a material do not show.

#![forbid(unsafe_code)]

pub mod bounces;
pub mod camera;
pub mod coarser;
pub mod command_line;
pub mod convex;
pub mod error;
pub mod exr_file;
pub mod face_elements;
pub mod facets;
pub mod frames;
pub mod grid;
pub mod info;
pub mod interpolation;
pub mod joined;
pub mod layers;
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
pub mod skips;
pub mod visible;

#[cfg(test)]
mod test_scenes;

pub use error::{Error, Result};

/// Name of the tool in reports, provenance and messages.
pub const TOOL: &str = "shade-tool";
/// Version of the tool in reports and provenance.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
