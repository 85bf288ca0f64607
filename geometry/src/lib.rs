//! What a point or a polygon sees: planes, polygons, clipping, form factors, visible parts, ray casting.
//!
//! Knows no file and no radiosity. All lengths are relative: nothing here compares with an absolute epsilon, so a
//! scene scaled by any factor gives the same answers.

pub mod area_rule;
pub mod body;
mod border_sum;
mod cell;
mod cell_rule;
pub mod cluster_kernel;
pub mod contour;
pub mod edge_pair;
mod element_tree;
pub mod far;
pub mod gather;
pub mod hemicube;
mod interval;
pub mod lanes;
pub mod line_term;
pub mod merge;
pub mod occluded;
pub mod occluder;
pub mod pair;
pub mod patch;
pub mod plane;
pub mod point_factor;
pub mod point_shadow;
pub mod point_view;
pub mod polygon;
pub mod quadrature;
pub mod ray_cast;
pub mod shadow;
pub mod shadow_planes;
pub mod sides;
pub mod source_tree;
pub mod square_rule;
pub mod strata;
pub mod unoccluded;
pub mod visible_part;
pub mod visible_pieces;
pub mod visible_together;
