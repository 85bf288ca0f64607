//! Radiosity to pictures and points: the last stage of the pipeline.
//!
//! [`render`] finds the surface that each sample of a pixel sees ([`visible`]), gathers irradiance at the nodes of the
//! facets that are seen ([`facets`], [`nodes`], [`node_places`]), for lamps and surfaces apart ([`light`]), cuts facets where
//! interpolation is not good enough ([`refined`], [`refined_parts`], [`piece`], [`judge`]),
//! interpolates ([`interpolation`]) and writes radiance and layers ([`layers`]) as OpenEXR ([`exr_file`]) and a tone-mapped
//! preview ([`tone`]), for one camera or several ([`camera`], [`frames`]). [`view`] reads a picture back ([`exr_reader`])
//! and shows it tone-mapped, in false colours ([`quantity`], [`colour_scale`]), with isolux contours ([`contours`],
//! [`isolux`]), with the mesh ([`mesh_overlay`]) or the error of its elements ([`element_error`]); [`sheet`] puts pictures side by
//! side; both draw on a [`canvas`] with letters of [`interchange::font`]. [`probe`] gathers irradiance at the points of a
//! table or of a grid ([`grid`]). [`page`] puts a whole run into one HTML file. [`info`] tells what a picture holds. [`joined`] makes few sources of
//! the solution's elements, [`bounces`] layers of light by its number of reflections. [`skips`] names what is left out.
//!
//! Besides the solution there are the models of direct light that came before it ([`shading`], [`local_picture`]): emitters as
//! exactly visible polygons ([`direct_light`]), highlights of [`phong`] and [`cook_torrance`] with [`fresnel`]'s law,
//! integrated over those polygons ([`gloss`]).
//!
//! # Limitations
//! In pictures of a solution surfaces are Lambertian: specular and transparent parts of a material do not show. Highlights
//! are of direct light only, and mirrors show nothing but emitters.

#![forbid(unsafe_code)]

pub mod bounces;
pub mod camera;
pub mod canvas;
pub mod coarser;
pub mod colour_scale;
pub mod command_line;
pub mod compare;
pub mod contours;
pub mod convex;
pub mod cook_torrance;
pub mod covered;
pub mod direct_light;
pub mod element_error;
pub mod error;
pub mod exr_file;
pub mod exr_reader;
pub mod extent;
pub mod face_elements;
pub mod facets;
pub mod flag_values;
pub mod frames;
pub mod fresnel;
pub mod gloss;
pub mod grid;
pub mod info;
pub mod interpolation;
pub mod isolux;
pub mod joined;
pub mod judge;
pub mod layers;
pub mod light;
pub mod lit_scene;
pub mod local_picture;
pub mod mesh_overlay;
pub mod node_places;
pub mod nodes;
pub mod on_surface;
pub mod page;
pub mod phong;
pub mod picture;
pub mod piece;
pub mod pixel_samples;
pub mod points;
pub mod probe;
pub mod quantity;
pub mod receiver;
pub mod refined;
pub mod refined_parts;
pub mod render;
pub mod shading;
pub mod sheet;
pub mod skips;
pub mod tone;
pub mod view;
pub mod visible;

#[cfg(test)]
mod test_scenes;

pub use error::{Error, Result};

/// Name of the tool in reports, provenance and messages.
pub const TOOL: &str = "shade-tool";
/// Version of the tool in reports and provenance.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
