//! How well each element is known: what interpolating over it costs, as the picture estimated it, or what a solution with
//! bounds proves of it.

use crate::error::{Error, Result};
use crate::exr_reader::StoredPicture;
use crate::layers::{Layer, NOTHING, Values};
use crate::picture::luminance;
use crate::quantity::Map;
use interchange::solution::Solution;
use std::collections::BTreeMap;
use std::path::Path;

/// Each element's largest estimated error of radiance among its pixels, in percent of the picture's mean radiance.
pub fn interpolation(stored: &StoredPicture) -> Result<Map> {
    let elements = elements(stored)?;
    let Values::Numbers(errors) = stored.layer(Layer::Error)? else {
        return Err(Error::view(&stored.path, "layer error holds no numbers", "render it again"));
    };
    let mut worst: BTreeMap<u32, f64> = BTreeMap::new();
    for (&element, &error) in elements.iter().zip(errors) {
        let most = worst.entry(element).or_default();
        *most = most.max(error);
    }
    let mean = luminance(stored.picture.mean());
    let percent = |error: f64| if mean > 0.0 { 100.0 * error / mean } else { 0.0 };
    let caption = "estimated error of interpolation by element, % of mean radiance".into();
    Ok(map(stored, elements, caption, |element| percent(worst.get(&element).copied().unwrap_or(0.0))))
}

/// Half the distance between the bounds of each element's radiosity in a solution of `solve-tool solve --bounds`, in percent
/// of the mean radiosity of the picture.
pub fn bounds(stored: &StoredPicture, solution_path: &Path) -> Result<Map> {
    let elements = elements(stored)?;
    let (solution, _, origins, _) = Solution::read(solution_path)?;
    stored.check_input("mesh", solution_path, origins.mesh)?;
    let Some([lower, upper]) = solution.details.bounds else {
        return Err(Error::view(
            solution_path,
            "has no bounds",
            "solve again with solve-tool solve --bounds",
        ));
    };
    if let Some(unknown) = elements.iter().find(|&&e| e != NOTHING && e as usize >= lower.len()) {
        let found = format!("element {unknown} is not in {}", solution_path.display());
        return Err(Error::view(&stored.path, found, "give a solution on the mesh of the picture"));
    }
    let mean = std::f64::consts::PI * luminance(stored.picture.mean());
    let half = |element: u32| {
        let element = element as usize;
        let half: [f64; 3] = std::array::from_fn(|c| 0.5 * (upper[element][c] - lower[element][c]));
        if mean > 0.0 { 100.0 * luminance(half) / mean } else { 0.0 }
    };
    let caption = "proved bound on each element, ± % of mean radiosity".into();
    Ok(map(stored, elements, caption, half))
}

fn elements(stored: &StoredPicture) -> Result<&[u32]> {
    match stored.layer(Layer::Element)? {
        Values::Indices(elements) => Ok(elements),
        _ => Err(Error::view(&stored.path, "layer element holds no indices", "render it again")),
    }
}

fn map(stored: &StoredPicture, elements: &[u32], caption: String, value: impl Fn(u32) -> f64) -> Map {
    let of = |&element: &u32| if element == NOTHING { f64::NAN } else { value(element) };
    Map { width: stored.picture.width, values: elements.iter().map(of).collect(), caption }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::picture::Picture;
    use crate::test_scenes::stored;
    use interchange::digest::Digest;
    use interchange::provenance::Provenance;
    use interchange::solution::{Details, Origins};

    fn picture() -> StoredPicture {
        stored(&Picture {
            width: 4,
            height: 1,
            pixels: vec![[2.0; 3]; 4],
            layers: vec![
                (Layer::Element, Values::Indices(vec![1, 1, NOTHING, 0])),
                (Layer::Error, Values::Numbers(vec![0.01, 0.04, 9.0, 0.0])),
            ],
            ..Picture::default()
        })
    }

    #[test]
    fn an_elements_error_is_its_worst_pixel() {
        let map = interpolation(&picture()).unwrap();
        assert!(map.values[..2].iter().all(|v| (v - 2.0).abs() < 1e-5), "{:?}", map.values);
        assert!(map.values[2].is_nan() && map.values[3] == 0.0);
    }

    #[test]
    fn bounds_come_from_the_solution_and_are_missed_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.sol");
        let digest = Digest::of(b"x");
        let origins = Origins { mesh: digest, matrix: digest, materials: digest };
        let radiosity = vec![[1.0; 3]; 2];
        let mut solution = Solution { irradiance: radiosity.clone(), radiosity, ..Solution::default() };
        solution.write(&path, Provenance::new("solve-tool", "test"), origins).unwrap();
        let error = bounds(&picture(), &path).unwrap_err().to_string();
        assert!(error.contains("--bounds"), "{error}");
        let width = std::f64::consts::PI * 0.02;
        let upper = vec![[1.0 + 2.0 * width; 3], [f64::INFINITY; 3]];
        solution.details = Details { bounds: Some([vec![[1.0; 3]; 2], upper]), ..Details::default() };
        solution.write(&path, Provenance::new("solve-tool", "test"), origins).unwrap();
        let map = bounds(&picture(), &path).unwrap();
        assert!((map.values[3] - 1.0).abs() < 1e-9 && map.values[0] == f64::INFINITY, "{:?}", map.values);
    }
}
