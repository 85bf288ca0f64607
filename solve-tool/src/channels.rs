//! Reflectance and exitance of every element, per colour channel: where materials meet the mesh.

use crate::error::{Result, SolveError};
use interchange::materials::Material;
use interchange::mesh::Mesh;

/// Names of the channels, for messages.
pub const CHANNEL_NAMES: [&str; 3] = ["red", "green", "blue"];

/// One colour channel of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Channel {
    /// Diffuse reflectance rho of each element, 0 to 1.
    pub reflectance: Vec<f64>,
    /// Emitted radiosity E = pi Ke of each element, W m^-2, finite. Below 0 only where a prescribed flux takes heat away.
    pub exitance: Vec<f64>,
}

impl Channel {
    /// Emitted power, sum of A E, W.
    pub fn emitted(&self, areas: &[f64]) -> f64 {
        self.exitance.iter().zip(areas).map(|(e, a)| e * a).sum()
    }

    /// Whether any element emits.
    pub fn emits(&self) -> bool {
        self.exitance.iter().any(|&e| e != 0.0)
    }
}

/// The three channels of a mesh whose materials, in the order of its names, are `materials`.
///
/// # Errors
/// An exitance that is no finite number: Ke times pi beyond the range of f64.
pub fn of_mesh(mesh: &Mesh, materials: &[Material]) -> Result<[Channel; 3]> {
    let mut channels: [Channel; 3] = Default::default();
    for element in mesh.element_ids() {
        let id = mesh.element_material(element);
        let material = &materials[id.index()];
        let exitance = material.exitance();
        for (c, channel) in channels.iter_mut().enumerate() {
            if !exitance[c].is_finite() {
                let name = mesh.materials[id.index()].clone();
                return Err(SolveError::ExitanceTooLarge { material: name, radiance: material.radiance });
            }
            channel.reflectance.push(material.diffuse[c]);
            channel.exitance.push(exitance[c]);
        }
    }
    Ok(channels)
}

/// Exitances that differ by a factor agree with it to this: one rounding each of the factor and of the product.
const PROPORTIONAL: f64 = 2.0 * f64::EPSILON;

/// Channels without their repetitions: a grey scene is solved once, its light of any colour.
#[derive(Debug)]
pub struct Distinct {
    /// Each different channel once.
    pub channels: Vec<Channel>,
    /// Which of them each of the three channels is.
    pub index: [usize; 3],
    /// What its radiosities have to be multiplied with.
    pub scale: [f64; 3],
}

impl Distinct {
    /// The different ones among `channels`: equal reflectances, and exitances that are the same but for one factor. The
    /// solution is linear in the exitance.
    pub fn of(channels: &[Channel; 3]) -> Self {
        let mut distinct: Vec<Channel> = Vec::new();
        let mut scale = [1.0; 3];
        let index = std::array::from_fn(|c| {
            let factors = distinct.iter().map(|known| factor(known, &channels[c]));
            match factors.enumerate().find_map(|(d, factor)| factor.map(|factor| (d, factor))) {
                Some((d, factor)) => {
                    scale[c] = factor;
                    d
                }
                None => {
                    distinct.push(channels[c].clone());
                    distinct.len() - 1
                }
            }
        });
        Self { channels: distinct, index, scale }
    }

    /// All three, equal or not.
    pub fn all(channels: &[Channel; 3]) -> Self {
        Self { channels: channels.to_vec(), index: [0, 1, 2], scale: [1.0; 3] }
    }

    /// Name of the first colour that distinct channel `d` stands for.
    pub fn name(&self, d: usize) -> &'static str {
        let first = self.index.iter().position(|&index| index == d);
        CHANNEL_NAMES[first.unwrap_or(0)]
    }
}

/// What `known` has to be multiplied with to be `other`, if there is such a number.
fn factor(known: &Channel, other: &Channel) -> Option<f64> {
    if known.reflectance != other.reflectance || known.emits() != other.emits() {
        return None;
    }
    if known.exitance == other.exitance {
        return Some(1.0);
    }
    let brightest = (0..known.exitance.len())
        .max_by(|&a, &b| known.exitance[a].abs().total_cmp(&known.exitance[b].abs()))?;
    let factor = other.exitance[brightest] / known.exitance[brightest];
    let same = |(a, b): (&f64, &f64)| (a * factor - b).abs() <= PROPORTIONAL * b.abs();
    (factor.is_finite() && known.exitance.iter().zip(&other.exitance).all(same)).then_some(factor)
}
