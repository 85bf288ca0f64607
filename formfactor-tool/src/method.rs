//! The choice of `--method` with its own flags.

use crate::classical::{Classical, Form};
use crate::estimator::Estimator;
use crate::exact::Exact;
use crate::hemicube::HemicubeRows;
use crate::rays::RayRows;
use crate::reuse::Reuse;
use crate::rows::RowWise;
use crate::scene::Scene;
use crate::skips::Skips;
use crate::traversal::LeafPair;
use clap::ValueEnum;

/// Cells along an edge of the hemicube's top unless asked otherwise: the upper end of what was usual in 1985.
const DEFAULT_RESOLUTION: u32 = 100;
/// Item buffers of more cells than this (some 50 million) gain nothing that rounding would not take.
const LARGEST_RESOLUTION: i64 = 4096;
/// Rays per element unless asked otherwise: as many as a hemicube of that resolution has cells on its top.
const DEFAULT_RAYS: u32 = 10_000;

/// How the entries are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Per pair the cheapest rule that keeps the tolerance; exact visible parts where something blocks
    Auto,
    /// Closed double contour integral, times the visible share by 64 rays (Goral et al. 84)
    Contour,
    /// Gauss points on both elements, times the visible share by 64 rays (Goral et al. 84)
    Area,
    /// Item buffers on a half cube around each centre (Cohen & Greenberg 85)
    Hemicube,
    /// Stratified cosine-distributed rays from each element
    Rays,
}

/// A method and the flags that are its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    method: Method,
    /// Cells for the hemicube, rays for rays; nothing for the others.
    amount: Option<u32>,
}

/// `--method` and the flags that belong to some methods only.
#[derive(Debug, Clone, clap::Args)]
pub struct Flags {
    /// How the entries are computed
    #[arg(long, value_enum, default_value = "auto")]
    method: Method,
    /// With --method hemicube: cells along an edge of the cube's top (default: 100)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=LARGEST_RESOLUTION))]
    resolution: Option<u32>,
    /// With --method rays: rays per element (default: 10000)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    rays: Option<u32>,
}

impl Flags {
    /// The method they choose.
    ///
    /// # Errors
    /// A flag that is not the method's: the sentence for the user.
    pub fn choice(&self) -> Result<Choice, String> {
        Choice::new(self.method, self.resolution, self.rays)
    }
}

impl Choice {
    /// The method that adapts to the tolerance.
    pub const AUTO: Choice = Choice { method: Method::Auto, amount: None };

    /// A method with `--resolution` and `--rays` as given.
    ///
    /// # Errors
    /// A flag that is not the method's: the sentence for the user.
    pub fn new(method: Method, resolution: Option<u32>, rays: Option<u32>) -> Result<Self, String> {
        if resolution.is_some() && method != Method::Hemicube {
            return Err("--resolution is for --method hemicube only".into());
        }
        if rays.is_some() && method != Method::Rays {
            return Err("--rays is for --method rays only".into());
        }
        let amount = match method {
            Method::Hemicube => Some(resolution.unwrap_or(DEFAULT_RESOLUTION)),
            Method::Rays => Some(rays.unwrap_or(DEFAULT_RAYS)),
            Method::Auto | Method::Contour | Method::Area => None,
        };
        Ok(Self { method, amount })
    }

    /// The flags that say so: none for the default.
    pub fn flags(&self) -> Vec<String> {
        let name = match self.method {
            Method::Auto => return Vec::new(),
            Method::Contour => "contour",
            Method::Area => "area",
            Method::Hemicube => "hemicube",
            Method::Rays => "rays",
        };
        let flag = if self.method == Method::Rays { "--rays" } else { "--resolution" };
        let own = self.amount.map(|amount| format!("{flag} {amount}"));
        std::iter::once(format!("--method {name}")).chain(own).collect()
    }

    /// The estimator on a scene, for rows within `tolerance` where the method can be asked for that. Entries are reused by
    /// `auto` alone.
    pub fn estimator<'a>(
        &self,
        scene: &'a Scene,
        skips: &'a Skips,
        reuse: &'a Reuse<'a>,
        pairs: &[LeafPair],
        tolerance: f64,
    ) -> Box<dyn Estimator + 'a> {
        let amount = self.amount.unwrap_or(1) as usize;
        match self.method {
            Method::Auto => Box::new(Exact::new(scene, skips, reuse, pairs, tolerance)),
            Method::Contour => Box::new(Classical::new(scene, Form::Contour, tolerance)),
            Method::Area => Box::new(Classical::new(scene, Form::Area, tolerance)),
            Method::Hemicube => Box::new(RowWise::new(scene, HemicubeRows::new(scene, amount))),
            Method::Rays => Box::new(RowWise::new(scene, RayRows::new(scene, amount))),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn flags_belong_to_their_method() {
        assert_eq!(Choice::new(Method::Auto, None, None).unwrap(), Choice::AUTO);
        assert!(Choice::AUTO.flags().is_empty());
        let hemicube = Choice::new(Method::Hemicube, Some(64), None).unwrap();
        assert_eq!(hemicube.flags(), ["--method hemicube", "--resolution 64"]);
        let rays = Choice::new(Method::Rays, None, None).unwrap();
        assert_eq!(rays.flags(), ["--method rays", "--rays 10000"]);
        assert_eq!(Choice::new(Method::Area, None, None).unwrap().flags(), ["--method area"]);
        for method in [Method::Auto, Method::Contour, Method::Area, Method::Rays] {
            assert!(Choice::new(method, Some(64), None).is_err());
        }
        for method in [Method::Auto, Method::Contour, Method::Area, Method::Hemicube] {
            assert!(Choice::new(method, None, Some(64)).is_err());
        }
    }
}
