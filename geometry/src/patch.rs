//! A convex polygon prepared for many form factors: plane, area, bounding ball and the points of the cheap rules.

use crate::plane::Plane;
use crate::polygon;
use crate::quadrature::{Strength, polygon_rule};
use glam::DVec3;

/// Points and weights of a rule, coordinates apart so that the kernel vectorises.
#[derive(Debug, Clone, Default)]
pub struct RulePoints {
    /// First coordinates.
    pub x: Vec<f64>,
    /// Second coordinates.
    pub y: Vec<f64>,
    /// Third coordinates.
    pub z: Vec<f64>,
    /// Weights; they add up to the area.
    pub weight: Vec<f64>,
}

impl RulePoints {
    /// The rule of this strength on a convex polygon.
    pub fn new(corners: &[DVec3], strength: Strength) -> Self {
        let (mut points, mut weight) = (Vec::new(), Vec::new());
        polygon_rule(corners, strength, &mut points, &mut weight);
        let coordinate = |k: usize| points.iter().map(|p| p[k]).collect();
        Self { x: coordinate(0), y: coordinate(1), z: coordinate(2), weight }
    }
}

/// A convex polygon with what its form factors need.
#[derive(Debug, Clone)]
pub struct Patch {
    /// Corners, counter-clockwise seen from the front.
    pub corners: Vec<DVec3>,
    /// Plane; the normal points to the front.
    pub plane: Plane,
    /// Area.
    pub area: f64,
    /// Centre of gravity.
    pub centroid: DVec3,
    /// Largest distance of a corner from the centroid.
    pub radius: f64,
    /// One point.
    pub centre: RulePoints,
    /// The rule of [`Strength::Low`].
    pub low: RulePoints,
    /// The rule of [`Strength::Middle`].
    pub middle: RulePoints,
}

impl Patch {
    /// Prepares a convex polygon; `None` where its area is zero to rounding.
    pub fn new(corners: Vec<DVec3>) -> Option<Patch> {
        let plane = Plane::of_polygon(&corners)?;
        let centroid = polygon::centroid(&corners);
        let radius = corners.iter().map(|&c| (c - centroid).length()).fold(0.0, f64::max);
        Some(Patch {
            plane,
            area: polygon::area(&corners),
            centroid,
            radius,
            centre: RulePoints::new(&corners, Strength::Centroid),
            low: RulePoints::new(&corners, Strength::Low),
            middle: RulePoints::new(&corners, Strength::Middle),
            corners,
        })
    }

    /// Least and largest height of this patch's corners over `plane`.
    pub fn heights_over(&self, plane: &Plane) -> (f64, f64) {
        self.corners
            .iter()
            .map(|&c| plane.distance(c))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)))
    }
}
