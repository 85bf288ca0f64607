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
    /// Emitted radiosity E = pi Ke of each element, W m^-2, finite and at least 0.
    pub exitance: Vec<f64>,
}

impl Channel {
    /// Emitted power, sum of A E, W.
    pub fn emitted(&self, areas: &[f64]) -> f64 {
        self.exitance.iter().zip(areas).map(|(e, a)| e * a).sum()
    }

    /// Whether any element emits.
    pub fn emits(&self) -> bool {
        self.exitance.iter().any(|&e| e > 0.0)
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

/// Channels without their repetitions: a grey scene is solved once.
#[derive(Debug)]
pub struct Distinct {
    /// Each different channel once.
    pub channels: Vec<Channel>,
    /// Which of them each of the three channels is.
    pub index: [usize; 3],
}

impl Distinct {
    /// The different ones among `channels`.
    pub fn of(channels: &[Channel; 3]) -> Self {
        let mut distinct: Vec<Channel> = Vec::new();
        let index = std::array::from_fn(|c| {
            distinct.iter().position(|known| *known == channels[c]).unwrap_or_else(|| {
                distinct.push(channels[c].clone());
                distinct.len() - 1
            })
        });
        Self { channels: distinct, index }
    }

    /// Name of the first colour that distinct channel `d` stands for.
    pub fn name(&self, d: usize) -> &'static str {
        let first = self.index.iter().position(|&index| index == d);
        CHANNEL_NAMES[first.unwrap_or(0)]
    }
}
