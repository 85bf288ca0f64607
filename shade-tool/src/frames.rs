//! The pictures of one run: one, one per camera of the toml, or the frames of a turn around the scene.

use crate::camera::{Camera, Wishes};
use crate::error::{Error, Result};
use glam::DVec3;
use interchange::scene::CameraSettings;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// A picture to make.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Camera.
    pub camera: Camera,
    /// What its files have in their names before the ending.
    pub suffix: Option<String>,
}

impl Frame {
    /// Where a file of this frame goes: `s.NAME.exr` for `s.exr`.
    pub fn path(&self, output: &Path) -> PathBuf {
        let Some(suffix) = &self.suffix else { return output.into() };
        let ending = output.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
        output.with_extension(format!("{suffix}.{ending}"))
    }
}

/// The frames that toml and command line ask for. A turntable turns the camera, against the clock seen from above, about the
/// middle of the scene's box and the picture's up.
pub fn frames(
    wishes: &Wishes,
    described: &[CameraSettings],
    bounds: (DVec3, DVec3),
    all_cameras: bool,
    turntable: Option<u32>,
) -> Result<Vec<Frame>> {
    if all_cameras {
        if described.is_empty() {
            return Err(Error::camera("the toml has none", "leave out --all-cameras"));
        }
        let of = |(k, settings): (usize, &CameraSettings)| {
            let camera = Camera::resolve(wishes, std::slice::from_ref(settings), bounds)?;
            let suffix = settings.name.clone().unwrap_or_else(|| k.to_string());
            if suffix.contains(['/', '\\', '\0']) {
                let found = format!("the name {suffix} cannot be part of a file's name");
                return Err(Error::camera(found, "choose another name in the toml"));
            }
            Ok(Frame { camera, suffix: Some(suffix) })
        };
        return described.iter().enumerate().map(of).collect();
    }
    let camera = Camera::resolve(wishes, described, bounds)?;
    let Some(count) = turntable else { return Ok(vec![Frame { camera, suffix: None }]) };
    let middle = 0.5 * (bounds.0 + bounds.1);
    let axis = wishes.up.or(described.first().map(|d| d.up.into())).unwrap_or(DVec3::Y);
    let turned = |k: u32| camera.turned(middle, axis, TAU * f64::from(k) / f64::from(count));
    Ok((0..count).map(|k| Frame { camera: turned(k), suffix: Some(format!("{k:03}")) }).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_turntable_goes_once_around_and_names_its_frames() {
        let bounds = (DVec3::ZERO, DVec3::new(2.0, 1.0, 4.0));
        let wishes = Wishes::default();
        let frames = frames(&wishes, &[], bounds, false, Some(4)).unwrap();
        assert_eq!(frames.len(), 4);
        assert_eq!(frames[3].path(Path::new("a/s.exr")), Path::new("a/s.003.exr"));
        let middle = DVec3::new(1.0, 0.5, 2.0);
        for frame in &frames {
            let to_middle = (middle - frame.camera.eye).normalize();
            assert!(to_middle.abs_diff_eq(frame.camera.forward, 1e-12));
            assert!(frame.camera.framing);
        }
        let [first, third] = [0, 2].map(|k: usize| frames[k].camera.eye - middle);
        assert!((first + third).abs_diff_eq(DVec3::new(0.0, 2.0 * first.y, 0.0), 1e-9));
    }
}
