//! The independently computed view factors of `viewfactors/cases.json`: surfaces, their blockers, factors by name.

use crate::surfaces::{Surface, corners, list, number, string};
use serde_json::Value;
use std::f64::consts::PI;

/// What was independently computed.
#[derive(Debug, Clone)]
pub struct Case {
    /// Name.
    pub name: String,
    /// Kind of case.
    pub category: String,
    /// Surfaces and blockers, each a group of its own.
    pub surfaces: Vec<Surface>,
    /// F(first -> second).
    pub expected: Vec<(String, String, f64)>,
    /// Digits of the factors that can be trusted: decimals where `is_absolute`, else significant ones.
    digits: f64,
    is_absolute: bool,
}

impl Case {
    /// How far off a factor of the reference may be.
    pub fn uncertainty(&self, factor: f64) -> f64 {
        // No factor is better than its nearest f64.
        let digits = 10.0f64.powf(-self.digits) * if self.is_absolute { 1.0 } else { factor };
        digits.max(f64::EPSILON * factor)
    }
}

/// Surfaces of a JSON list of named polygons.
pub fn surfaces_of(list_of_named: &Value) -> Vec<Surface> {
    let named = list(list_of_named).iter();
    named.map(|s| Surface::new(string(&s["name"]), corners(&s["vertices"]))).collect()
}

/// Regular polygon inscribed in a circle about the z axis.
fn inscribed(name: &str, radius: f64, sides: usize, height: f64, looks_up: bool) -> Surface {
    let corner = |k: usize| {
        let (sin, cos) = (2.0 * PI * k as f64 / sides as f64).sin_cos();
        [radius * cos, radius * sin, height]
    };
    let ring = (0..sides).map(|k| corner(if looks_up { k } else { sides - 1 - k }));
    Surface::new(name, ring.collect::<Vec<_>>())
}

/// One case of the file, or for coaxial discs one for each number of sides of the polygons that stand for them.
pub fn cases(case: &Value) -> Vec<Case> {
    let (name, category) = (string(&case["id"]).to_owned(), string(&case["category"]).to_owned());
    let digits = case["digits"].as_f64().unwrap_or(12.0);
    let is_absolute = case["abs_digits"].as_bool().unwrap_or(false);
    if category == "coaxial-discs" {
        let discs = |polygon: &Value| {
            let sides = polygon["n"].as_u64().expect("a number of sides") as usize;
            Case {
                name: format!("{name} with {sides} sides"),
                category: category.clone(),
                surfaces: vec![
                    inscribed("disc1", number(&case["r1"]), sides, 0.0, true),
                    inscribed("disc2", number(&case["r2"]), sides, number(&case["h"]), false),
                ],
                expected: vec![("disc1".into(), "disc2".into(), number(&polygon["F"]))],
                digits,
                is_absolute,
            }
        };
        return list(&case["inscribed_ngons"]).iter().map(discs).collect();
    }
    let mut surfaces = surfaces_of(&case["surfaces"]);
    surfaces.extend(surfaces_of(&case["obstructions"]));
    let pair = |e: &Value| (string(&e["frm"]).to_owned(), string(&e["to"]).to_owned(), number(&e["F"]));
    let expected = list(&case["expected"]).iter().map(pair).collect();
    vec![Case { name, category, surfaces, expected, digits, is_absolute }]
}
