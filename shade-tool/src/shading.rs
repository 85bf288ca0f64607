//! `--shading`: the radiosity solution, or one of the local models that came before it, which know only the light that comes
//! straight from emitters.

use crate::gloss::Gloss;
use crate::layers::Layer;
use crate::lit_scene::LitScene;
use crate::phong::PhongForm;
use interchange::materials::Material;
use interchange::provenance::Provenance;
use interchange::report::Report;

/// How surfaces are shaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Shading {
    /// The radiosity solution, interpolated (see --interpolation)
    Gouraud,
    /// Direct light on matt surfaces, one value for each element, at its middle
    Flat,
    /// Direct light at every sample, with Phong's highlight by Ks and Ns
    Phong,
    /// Direct light at every sample, with Cook & Torrance's highlight by Ks, Ni and Pr (without Pr: Ns)
    CookTorrance,
}

/// Flags that choose the model.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct ShadingArguments {
    /// How surfaces are shaded; all but gouraud know direct light only, without any ambient term, and use neither
    /// --interpolation nor --tolerance
    #[arg(long, value_name = "MODEL", default_value = "gouraud")]
    pub shading: Shading,
    /// Which of Phong's constants --shading phong uses (default: normalised)
    #[arg(long, value_name = "FORM")]
    pub phong: Option<PhongForm>,
    /// Local models: nothing blocks direct light, as in the first of them
    #[arg(long)]
    pub no_shadows: bool,
}

/// A model of direct light.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LocalModel {
    /// Highlights: `None` for matt surfaces with one value for each element.
    pub highlights: Option<Highlights>,
    /// Whether faces block light.
    pub shadows: bool,
}

/// Which highlights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Highlights {
    /// Phong's.
    Phong(PhongForm),
    /// Cook & Torrance's.
    CookTorrance,
}

impl ShadingArguments {
    /// The local model, `None` for the radiosity solution.
    pub fn local(&self) -> Option<LocalModel> {
        let highlights = match self.shading {
            Shading::Gouraud => return None,
            Shading::Flat => None,
            Shading::Phong => Some(Highlights::Phong(self.phong.unwrap_or(PhongForm::Normalised))),
            Shading::CookTorrance => Some(Highlights::CookTorrance),
        };
        Some(LocalModel { highlights, shadows: !self.no_shadows })
    }

    /// Bad usage that single flags do not show.
    pub fn usage(&self, layers: &[Layer]) -> Result<(), String> {
        if self.phong.is_some() && self.shading != Shading::Phong {
            return Err("--phong is for --shading phong".into());
        }
        if self.shading == Shading::Gouraud {
            let message = "--no-shadows is for --shading flat, phong or cook-torrance";
            return if self.no_shadows { Err(message.into()) } else { Ok(()) };
        }
        match layers.iter().find(|layer| layer.needs_gathering()) {
            Some(layer) => {
                Err(format!("a local model has no {} layer: all its light is direct", layer.name()))
            }
            None => Ok(()),
        }
    }
}

impl LocalModel {
    /// Name for files.
    pub fn name(&self) -> String {
        let name = match self.highlights {
            None => "flat",
            Some(Highlights::Phong(PhongForm::Normalised)) => "phong",
            Some(Highlights::Phong(PhongForm::Original)) => "phong 1975",
            Some(Highlights::CookTorrance) => "cook-torrance",
        };
        let shadows = if self.shadows { "" } else { " without shadows" };
        format!("{name}{shadows}")
    }

    /// Adds the model to a provenance.
    pub fn sign(&self, provenance: Provenance) -> Provenance {
        provenance.flag(format!("--shading {}", self.name()))
    }

    /// The highlight of a material.
    pub fn gloss(&self, material: &Material) -> Option<Gloss> {
        match self.highlights? {
            Highlights::Phong(form) => Gloss::phong(material, form),
            Highlights::CookTorrance => Gloss::cook_torrance(material),
        }
    }

    /// Factor on what [`crate::direct_light`] gives as highlight: Phong's lobe lacks the material's Ks.
    pub fn highlight_factor(&self, material: &Material) -> [f64; 3] {
        match self.highlights {
            Some(Highlights::Phong(_)) => material.specular,
            _ => [1.0; 3],
        }
    }

    /// Tells of materials that reflect more than they get, and where no highlight can be seen at all.
    pub fn warn(&self, scene: &LitScene, report: &mut Report) {
        if self.highlights.is_none() {
            return;
        }
        let used = |k: usize| scene.mesh.face_materials.iter().any(|material| material.index() == k);
        let of_mesh =
            || scene.materials.iter().zip(&scene.mesh.materials).enumerate().filter(|(k, _)| used(*k));
        let excess = |material: &Material| (0..3).any(|c| material.diffuse[c] + material.specular[c] > 1.0);
        for (_, (_, name)) in of_mesh().filter(|(_, (material, _))| excess(material)) {
            report.warn(format!("material {name}: Kd + Ks is above 1: it reflects more light than it gets"));
        }
        if of_mesh().all(|(_, (material, _))| self.gloss(material).is_none()) {
            report.warn("no material has Ks: there is no highlight to be seen");
        }
    }
}
