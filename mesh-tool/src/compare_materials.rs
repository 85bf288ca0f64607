//! `mesh-tool compare` of two material tables: which materials and which of their values differ.

use anyhow::bail;
use interchange::Result;
use interchange::materials::{Material, MaterialTable};
use interchange::tables::number;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// A value that two tables give differently.
#[derive(Debug, Clone, PartialEq)]
pub struct Changed {
    /// The material.
    pub material: String,
    /// The value as MTL calls it, with its channel.
    pub value: String,
    /// What each table says.
    pub found: [f64; 2],
}

impl Changed {
    fn difference(&self) -> f64 {
        (self.found[0] - self.found[1]).abs()
    }
}

/// How two tables differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Materials that both have.
    pub shared: usize,
    /// Materials that one alone has.
    pub alone: [Vec<String>; 2],
    /// Values that differ, by material.
    pub changed: Vec<Changed>,
}

impl Difference {
    /// Compares two tables; materials are matched by name.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn between(first: &Path, second: &Path) -> Result<Self> {
        Ok(Self::of(&MaterialTable::read(first)?.0, &MaterialTable::read(second)?.0))
    }

    fn of(first: &MaterialTable, second: &MaterialTable) -> Self {
        let missing = |of: &MaterialTable, from: &MaterialTable| -> Vec<String> {
            of.names.iter().filter(|name| from.get(name).is_none()).cloned().collect()
        };
        let alone = [missing(first, second), missing(second, first)];
        let both = first.names.iter().filter_map(|name| Some((name, first.get(name)?, second.get(name)?)));
        let changed = both.flat_map(|(name, a, b)| {
            let pairs = values(a).into_iter().zip(values(b)).filter(|((_, a), (_, b))| a != b);
            pairs.map(|((value, a), (_, b))| Changed { material: name.clone(), value, found: [a, b] })
        });
        Self { shared: first.names.len() - alone[0].len(), changed: changed.collect(), alone }
    }

    /// The value that differs most.
    pub fn worst(&self) -> Option<&Changed> {
        self.changed.iter().max_by(|a, b| a.difference().total_cmp(&b.difference()))
    }

    /// Refuses values that differ by more than `most`, and materials that one table alone has.
    ///
    /// # Errors
    /// Says which.
    pub fn check(&self, most: Option<f64>) -> anyhow::Result<()> {
        let Some(most) = most else { return Ok(()) };
        if let Some(name) = self.alone.iter().flatten().next() {
            bail!("material {name} is in one table alone");
        }
        match self.worst() {
            Some(worst) if worst.difference() > most => bail!(
                "{} of material {} differs by {:.3e}, above --max {most:e}",
                worst.value,
                worst.material,
                worst.difference()
            ),
            _ => Ok(()),
        }
    }

    /// The comparison on one page, or as JSON.
    pub fn describe(&self, as_json: bool) -> String {
        if as_json {
            let changed = |c: &Changed| json!({ "material": c.material, "value": c.value, "found": c.found });
            let changed: Vec<Value> = self.changed.iter().map(changed).collect();
            let data = json!({
                "kind": "material comparison", "shared": self.shared, "first_alone": self.alone[0],
                "second_alone": self.alone[1], "values_that_differ": changed,
            });
            return format!("{data:#}\n");
        }
        let mut text = String::new();
        // Writing to a string cannot fail.
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name:<12} {value}");
        };
        line("materials", format!("{} in both, {} of their values differ", self.shared, self.changed.len()));
        for (name, alone) in ["first", "second"].iter().zip(&self.alone).filter(|(_, a)| !a.is_empty()) {
            line(name, format!("alone has {}", alone.join(", ")));
        }
        for Changed { material, value, found: [a, b] } in &self.changed {
            line(material, format!("{value} {} and {}", number(*a), number(*b)));
        }
        text
    }
}

/// All values of a material with their names.
fn values(material: &Material) -> Vec<(String, f64)> {
    let colours = [
        ("Kd", material.diffuse),
        ("Ke", material.radiance),
        ("Ks", material.specular),
        ("Tf", material.transmission),
    ];
    let of_channel = |(name, colour): (&str, [f64; 3])| {
        ["red", "green", "blue"].into_iter().zip(colour).map(|(c, x)| (format!("{name} {c}"), x)).collect()
    };
    let single = [
        ("Ns", material.exponent),
        ("Ni", material.refraction),
        ("d", material.opacity),
        ("Pr", material.roughness),
        ("Pm", material.metalness),
        ("two-sided", material.two_sided),
    ];
    let colours = colours.into_iter().flat_map(|colour| -> Vec<(String, f64)> { of_channel(colour) });
    colours.chain(single.map(|(name, x)| (name.to_owned(), x))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(materials: &[(&str, f64)]) -> MaterialTable {
        let grey = |&(_, rho): &(&str, f64)| Material { diffuse: [rho, 0.5, 0.5], ..Material::default() };
        MaterialTable {
            names: materials.iter().map(|(name, _)| (*name).to_owned()).collect(),
            values: materials.iter().map(grey).collect(),
        }
    }

    #[test]
    fn materials_are_matched_by_name_and_every_value_is_compared() {
        let first = table(&[("wall", 0.5), ("floor", 0.25)]);
        let same = Difference::of(&first, &table(&[("floor", 0.25), ("wall", 0.5)]));
        assert_eq!((same.shared, same.changed.len()), (2, 0));
        assert!(same.check(Some(0.0)).is_ok());

        let other = Difference::of(&first, &table(&[("floor", 0.75), ("wall", 0.5)]));
        let worst = other.worst().map(|w| (w.material.as_str(), w.value.as_str(), w.found));
        assert_eq!(worst, Some(("floor", "Kd red", [0.25, 0.75])));
        assert!(other.check(None).is_ok() && other.check(Some(0.5)).is_ok());
        assert!(other.check(Some(0.4)).is_err_and(|e| e.to_string().contains("material floor")));
        assert!(other.describe(false).contains("Kd red 0.25 and 0.75"));

        let fewer = Difference::of(&first, &table(&[("wall", 0.5)]));
        assert_eq!(fewer.alone, [vec!["floor".to_owned()], vec![]]);
        assert!(fewer.check(Some(1.0)).is_err());
    }
}
