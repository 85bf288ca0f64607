//! What a camera's numbers must satisfy for a picture to exist.

use super::settings::{CameraSettings, ProjectionSettings};

/// Most pixels along a side.
const LARGEST_SIDE: u32 = 65536;

/// Smallest sine of the angle between up and view. The picture's horizontal is their cross product, whose direction
/// loses digits as 1 / sine: 1e-9 leaves 7 of the 16 digits of a double, enough to tell pixels apart.
const SMALLEST_SINE: f64 = 1e-9;

/// What is wrong with the camera: the key to look at, and the message.
type Fault = (&'static str, String);

/// Checks a camera.
pub(super) fn check(camera: &CameraSettings) -> Result<(), Fault> {
    let vectors = [("eye", &camera.eye), ("look_at", &camera.look_at), ("up", &camera.up)];
    if let Some((key, value)) = vectors.into_iter().find(|(_, value)| !value.iter().all(|x| x.is_finite())) {
        return Err((key, format!("{key} is {value:?}; coordinates must be finite numbers")));
    }
    check_directions(camera)?;
    if let Some(side) = camera.resolution.iter().find(|side| !(1..=LARGEST_SIDE).contains(side)) {
        return Err((
            "resolution",
            format!("resolution has {side}, expected 1 to {LARGEST_SIDE} pixels a side"),
        ));
    }
    check_lens(camera)
}

/// The view must have a direction and up must not lie along it.
fn check_directions(camera: &CameraSettings) -> Result<(), Fault> {
    let Some(view) = unit([0, 1, 2].map(|k| camera.look_at[k] / 2.0 - camera.eye[k] / 2.0)) else {
        return Err(("look_at", "look_at and eye are the same point; the camera looks nowhere".into()));
    };
    let Some(up) = unit(camera.up) else {
        return Err(("up", "up is zero; it must be a direction".into()));
    };
    let across = [0, 1, 2].map(|k| view[(k + 1) % 3] * up[(k + 2) % 3] - view[(k + 2) % 3] * up[(k + 1) % 3]);
    if across.iter().map(|x| x * x).sum::<f64>().sqrt() < SMALLEST_SINE {
        return Err(("up", "up is parallel to the view; choose another direction".into()));
    }
    Ok(())
}

/// `vector` at length 1, whatever its scale; none if it is zero.
fn unit(vector: [f64; 3]) -> Option<[f64; 3]> {
    let largest = vector.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    if largest == 0.0 {
        return None;
    }
    let scaled = vector.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    Some(scaled.map(|x| x / length))
}

/// A pinhole has either focal length and film, or the field of view; an orthographic camera a height; a panorama nothing.
fn check_lens(camera: &CameraSettings) -> Result<(), Fault> {
    const EXPECTED: &str = "expected either focal_length with film, or fov_deg";
    let positive = |x: f64| x.is_finite() && x > 0.0;
    if camera.projection != ProjectionSettings::Perspective {
        let lens = [
            ("focal_length", camera.focal_length.is_some()),
            ("film", camera.film.is_some()),
            ("fov_deg", camera.fov_deg.is_some()),
        ];
        if let Some((key, _)) = lens.into_iter().find(|(_, given)| *given) {
            return Err((key, format!("{key} belongs to a perspective camera; remove it or the projection")));
        }
    }
    match (camera.projection, camera.view_height) {
        (ProjectionSettings::Orthographic, Some(height)) if positive(height) => return Ok(()),
        (ProjectionSettings::Orthographic, found) => {
            let found = found.map_or("missing".to_owned(), |height| height.to_string());
            let message = format!("view_height is {found}; an orthographic camera needs one greater than 0");
            return Err(("view_height", message));
        }
        (_, Some(_)) => {
            return Err(("view_height", "view_height belongs to an orthographic camera".into()));
        }
        (ProjectionSettings::Equirectangular, None) => return Ok(()),
        (ProjectionSettings::Perspective, None) => {}
    }
    match (camera.focal_length, camera.film, camera.fov_deg) {
        (Some(focal_length), Some(film), None) => {
            if !positive(focal_length) {
                let message = format!("focal_length is {focal_length}; it must be finite and greater than 0");
                return Err(("focal_length", message));
            }
            if !film.into_iter().all(positive) {
                let message = format!("film is {film:?}; width and height must be finite and greater than 0");
                return Err(("film", message));
            }
            Ok(())
        }
        (None, None, Some(angle)) => {
            if !(angle > 0.0 && angle < 180.0) {
                return Err(("fov_deg", format!("fov_deg is {angle}; it must lie between 0 and 180")));
            }
            Ok(())
        }
        (None, None, None) => Err(("camera", format!("the camera has no lens; {EXPECTED}"))),
        (Some(_), None, None) => Err(("focal_length", format!("film is missing; {EXPECTED}"))),
        (None, Some(_), None) => Err(("film", format!("focal_length is missing; {EXPECTED}"))),
        (_, _, Some(_)) => Err(("fov_deg", format!("fov_deg besides focal_length or film; {EXPECTED}"))),
    }
}
