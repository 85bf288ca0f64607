//! Cameras: from the scene's toml, from the command line, or framing the scene from outside.
//!
//! Right-handed: seen along the view, right is view x up. A pinhole's picture plane lies at distance 1 before the eye; an
//! orthographic picture has its true size on a plane through the eye, and shows what lies before that plane; a panorama
//! shows all directions, longitudes along the rows and latitudes along the columns, the view in the middle. Pixels are
//! square, so of film and vertical extent only one dimension counts (the film's width, the others' height).

use crate::error::{Error, Result};
use glam::DVec3;
use interchange::error::nearest_name;
use interchange::scene::{CameraSettings, ProjectionSettings};
use interchange::tables::number;
use std::f64::consts::{PI, TAU};

/// Vertical field of view, degrees, where nothing says another.
pub const DEFAULT_FOV_DEG: f64 = 40.0;
/// Pixels, where nothing says another number.
pub const DEFAULT_SIZE: [u32; 2] = [512, 512];
/// Where a framing camera stands, seen from the middle of the scene: from the right, above and in front.
const FRAMING_DIRECTION: DVec3 = DVec3::new(1.0, 0.8, 1.6);
/// A framed scene fills at most this part of the picture's half width and half height.
const FRAMING_FILL: f64 = 0.95;
/// An `up` within this angle, radians, of the view leaves the picture's rotation to rounding.
const PARALLEL: f64 = 1e-9;

/// Field of view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Focal length and width of the film, in one unit.
    Film {
        /// Focal length.
        focal_length: f64,
        /// Width.
        width: f64,
    },
    /// Full vertical angle in degrees.
    Vertical(f64),
    /// Orthographic, with the height of the picture in the scene's unit.
    Orthographic(f64),
    /// All directions.
    Panorama,
}

/// How a place of the picture becomes a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// Through a pinhole.
    Perspective,
    /// Parallel.
    Orthographic,
    /// Equirectangular.
    Panorama,
}

/// What the command line says of the camera; each part wins over the toml's.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Wishes {
    /// Name of the toml's camera, its first one where absent.
    pub name: Option<String>,
    /// Place of the eye.
    pub eye: Option<DVec3>,
    /// Point in the middle of the picture.
    pub look_at: Option<DVec3>,
    /// Direction that is up in the picture.
    pub up: Option<DVec3>,
    /// Field of view.
    pub lens: Option<Lens>,
    /// Width and height in pixels.
    pub size: Option<[u32; 2]>,
}

/// A camera ready to give rays.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Place of the eye.
    pub eye: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Unit vector along the rows.
    pub right: DVec3,
    /// Unit vector against the columns.
    pub up: DVec3,
    /// How places become rays.
    pub projection: Projection,
    /// Half the width and half the height of the picture: at distance 1, in the scene's unit, or in radians.
    pub half: [f64; 2],
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Whether it was placed by [`Camera::framing`]: then faces whose back looks at the eye are not drawn.
    pub framing: bool,
}

impl Camera {
    /// The camera that toml and command line ask for; without an eye in either, one that frames the box of `bounds`.
    pub fn resolve(wishes: &Wishes, described: &[CameraSettings], bounds: (DVec3, DVec3)) -> Result<Camera> {
        let described = chosen(wishes.name.as_deref(), described)?;
        let size = wishes.size.or(described.map(|d| d.resolution)).unwrap_or(DEFAULT_SIZE);
        let lens = match (wishes.lens, described) {
            (Some(lens), _) => lens,
            (None, Some(described)) => described_lens(described)?,
            (None, None) => Lens::Vertical(DEFAULT_FOV_DEG),
        };
        let up = wishes.up.or(described.map(|d| d.up.into())).unwrap_or(DVec3::Y);
        let eye = wishes.eye.or(described.map(|d| d.eye.into()));
        let look_at = wishes.look_at.or(described.map(|d| d.look_at.into()));
        match (eye, look_at) {
            (Some(eye), Some(look_at)) => Camera::new(eye, look_at, up, lens, size),
            (None, None) => Camera::framing(bounds, up, lens, size),
            _ => Err(Error::camera("only one of eye and look_at is known", "give both --eye and --look-at")),
        }
    }

    /// A camera at `eye` with `look_at` in the middle of the picture.
    pub fn new(eye: DVec3, look_at: DVec3, up: DVec3, lens: Lens, size: [u32; 2]) -> Result<Camera> {
        if ![eye, look_at, up].into_iter().all(DVec3::is_finite) {
            return Err(Error::camera("a coordinate is not finite", "give finite eye, look_at and up"));
        }
        let forward = (look_at - eye).try_normalize();
        let forward =
            forward.ok_or_else(|| Error::camera("eye and look_at are one point", "move one of them"))?;
        let side = forward.cross(up.normalize_or_zero());
        if side.length() <= PARALLEL {
            let found = format!("up {up} is zero or points along the view");
            return Err(Error::camera(found, "give an --up across the view"));
        }
        let right = side.normalize();
        let half = half_extent(lens, size)?;
        let projection = match lens {
            Lens::Film { .. } | Lens::Vertical(_) => Projection::Perspective,
            Lens::Orthographic(_) => Projection::Orthographic,
            Lens::Panorama => Projection::Panorama,
        };
        Ok(Camera { eye, forward, right, up: right.cross(forward), projection, half, size, framing: false })
    }

    /// A camera outside the box, from where all of it is seen, as near as that allows.
    pub fn framing(bounds: (DVec3, DVec3), up: DVec3, lens: Lens, size: [u32; 2]) -> Result<Camera> {
        let (low, high) = bounds;
        let middle = 0.5 * (low + high);
        // A flat scene seen along its plane is as good as any: only a point has no size to frame.
        let reach = (high - low).length();
        if !(reach > 0.0 && reach.is_finite()) {
            return Err(Error::camera("the scene has no extent", "give --eye and --look-at"));
        }
        let mut camera = Camera::new(middle + reach * FRAMING_DIRECTION, middle, up, lens, size)?;
        let [half_width, half_height] = camera.half.map(|half| FRAMING_FILL * half);
        let corners = (0..8).map(|k| {
            let pick = |bit: usize, axis: usize| if k >> bit & 1 == 0 { low[axis] } else { high[axis] };
            DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2)) - middle
        });
        if camera.projection != Projection::Perspective {
            return Err(Error::camera(
                "only a pinhole camera can frame the scene by itself",
                "give --eye and --look-at, or --camera",
            ));
        }
        // A corner at depth z nearer than the middle and x aside is seen from distance z + |x| / half width on.
        let distance = corners.fold(0.0, |distance: f64, corner| {
            let nearer = -corner.dot(camera.forward);
            let aside = corner.dot(camera.right).abs() / half_width;
            let above = corner.dot(camera.up).abs() / half_height;
            distance.max(nearer + aside.max(above))
        });
        camera.eye = middle - distance * camera.forward;
        camera.framing = true;
        Ok(camera)
    }

    /// Origin and direction of the ray through the place `x`, `y` in pixels from the upper left corner of the picture.
    /// Distance along the direction is depth: along the view, in a panorama from the eye.
    pub fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let across = (2.0 * x / f64::from(self.size[0]) - 1.0) * self.half[0];
        let upward = (1.0 - 2.0 * y / f64::from(self.size[1])) * self.half[1];
        match self.projection {
            Projection::Perspective => (self.eye, self.forward + across * self.right + upward * self.up),
            Projection::Orthographic => (self.eye + across * self.right + upward * self.up, self.forward),
            Projection::Panorama => {
                let level = across.cos() * self.forward + across.sin() * self.right;
                (self.eye, upward.cos() * level + upward.sin() * self.up)
            }
        }
    }

    /// Whether the picture's left and right border are one.
    pub fn wraps(&self) -> bool {
        self.projection == Projection::Panorama
    }

    /// The camera turned by an angle (radians) about the axis through `middle` along `axis`, as a scene on a turntable is seen.
    pub fn turned(&self, middle: DVec3, axis: DVec3, angle: f64) -> Camera {
        let turn = glam::DQuat::from_axis_angle(axis.normalize_or(DVec3::Y), angle);
        Camera {
            eye: middle + turn * (self.eye - middle),
            forward: turn * self.forward,
            right: turn * self.right,
            up: turn * self.up,
            ..self.clone()
        }
    }

    /// Rotation and translation into the camera's space (x right, y up, looking along -z), for row vectors: p' = p M.
    pub fn world_to_camera(&self) -> [[f64; 4]; 4] {
        let axes = [self.right, self.up, -self.forward];
        let row = |k: usize| [axes[0][k], axes[1][k], axes[2][k], 0.0];
        let last = axes.map(|axis| -axis.dot(self.eye));
        [row(0), row(1), row(2), [last[0], last[1], last[2], 1.0]]
    }

    /// World to picture, for row vectors: after division by w, x from -1 at the left to 1 and y from -1 at the bottom to 1; z
    /// falls from 1 at the eye's plane's infinity, 1 - 1 / depth (perspective), or is the depth. None for a panorama.
    pub fn world_to_ndc(&self) -> Option<[[f64; 4]; 4]> {
        let project = |[x, y, z, w]: [f64; 4]| match self.projection {
            Projection::Perspective => [x / self.half[0], y / self.half[1], -z - w, -z],
            _ => [x / self.half[0], y / self.half[1], -z, w],
        };
        (self.projection != Projection::Panorama).then(|| self.world_to_camera().map(project))
    }

    /// Where a point of space appears, in pixels, and its depth; `None` at and behind the eye.
    pub fn place_of(&self, point: DVec3) -> Option<([f64; 2], f64)> {
        let v = point - self.eye;
        let [x, y, depth] = [self.right, self.up, self.forward].map(|axis| axis.dot(v));
        let (across, upward, depth) = match self.projection {
            Projection::Perspective if depth > 0.0 => (x / depth, y / depth, depth),
            Projection::Orthographic if depth > 0.0 => (x, y, depth),
            Projection::Panorama => (x.atan2(depth), y.atan2(x.hypot(depth)), v.length()),
            _ => return None,
        };
        let [width, height] = self.size.map(f64::from);
        let place =
            [0.5 * (1.0 + across / self.half[0]) * width, 0.5 * (1.0 - upward / self.half[1]) * height];
        Some((place, depth))
    }

    /// The camera in one line of numbers that give their bits back.
    pub fn describe(&self) -> String {
        let vector = |v: DVec3| v.to_array().map(number).join(",");
        format!(
            "{}eye={} forward={} up={} half_width={} half_height={} size={}x{}{}",
            match self.projection {
                Projection::Perspective => "",
                Projection::Orthographic => "orthographic ",
                Projection::Panorama => "panorama ",
            },
            vector(self.eye),
            vector(self.forward),
            vector(self.up),
            number(self.half[0]),
            number(self.half[1]),
            self.size[0],
            self.size[1],
            if self.framing { " framing" } else { "" }
        )
    }
}

/// The camera of that name, or the first.
fn chosen<'a>(name: Option<&str>, described: &'a [CameraSettings]) -> Result<Option<&'a CameraSettings>> {
    let Some(name) = name else { return Ok(described.first()) };
    let names = || described.iter().filter_map(|d| d.name.as_deref());
    let found = described.iter().find(|d| d.name.as_deref() == Some(name));
    found.map(Some).ok_or_else(|| {
        let remedy = match nearest_name(name, names()) {
            Some(near) => format!("did you mean {near}?"),
            None if names().next().is_none() => "the file names no cameras: leave out --camera-name".into(),
            None => format!("there are {}", names().collect::<Vec<_>>().join(", ")),
        };
        Error::camera(format!("none has the name {name}"), remedy)
    })
}

fn described_lens(described: &CameraSettings) -> Result<Lens> {
    match described.projection {
        ProjectionSettings::Orthographic => {
            return described.view_height.map(Lens::Orthographic).ok_or_else(|| {
                Error::camera("an orthographic camera has no view_height", "give it in the scene's unit")
            });
        }
        ProjectionSettings::Equirectangular => return Ok(Lens::Panorama),
        ProjectionSettings::Perspective => {}
    }
    match (described.focal_length, described.film, described.fov_deg) {
        (Some(focal_length), Some([width, _]), None) => Ok(Lens::Film { focal_length, width }),
        (None, None, Some(fov_deg)) => Ok(Lens::Vertical(fov_deg)),
        (None, None, None) => Ok(Lens::Vertical(DEFAULT_FOV_DEG)),
        _ => Err(Error::camera(
            "neither focal_length with film nor fov_deg alone",
            "give focal_length and film = [width, height], or fov_deg",
        )),
    }
}

fn half_extent(lens: Lens, [width, height]: [u32; 2]) -> Result<[f64; 2]> {
    if width == 0 || height == 0 {
        return Err(Error::camera(format!("{width}x{height} pixels"), "give at least one of each"));
    }
    let aspect = f64::from(width) / f64::from(height);
    let (half_width, half_height) = match lens {
        Lens::Film { focal_length, width } => {
            let half_width = 0.5 * width / focal_length;
            (half_width, half_width / aspect)
        }
        Lens::Vertical(degrees) if degrees < 180.0 => {
            let half_height = (0.5 * degrees.to_radians()).tan();
            (half_height * aspect, half_height)
        }
        Lens::Vertical(_) => (f64::NAN, f64::NAN),
        Lens::Orthographic(view_height) => (0.5 * view_height * aspect, 0.5 * view_height),
        Lens::Panorama => (0.5 * TAU, 0.5 * PI),
    };
    if !(half_width > 0.0 && half_height > 0.0 && half_width.is_finite() && half_height.is_finite()) {
        return Err(Error::camera(
            format!("{lens:?} has no field of view"),
            "give a positive focal length and film, or an angle above 0 and below 180 degrees",
        ));
    }
    Ok([half_width, half_height])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn cornell() -> Camera {
        let (eye, look_at) = (DVec3::new(278.0, 273.0, -800.0), DVec3::new(278.0, 273.0, 0.0));
        Camera::new(eye, look_at, DVec3::Y, Lens::Film { focal_length: 0.035, width: 0.025 }, [256, 256])
            .unwrap()
    }

    /// Place in pixels where a point of space appears.
    fn seen_at(camera: &Camera, point: DVec3) -> (f64, f64) {
        let v = point - camera.eye;
        let depth = v.dot(camera.forward);
        let (x, y) =
            (v.dot(camera.right) / depth / camera.half[0], v.dot(camera.up) / depth / camera.half[1]);
        (0.5 * (1.0 + x) * f64::from(camera.size[0]), 0.5 * (1.0 - y) * f64::from(camera.size[1]))
    }

    #[test]
    fn middle_and_corners_of_the_cornell_picture() {
        let camera = cornell();
        assert_eq!(camera.ray(128.0, 128.0).1, DVec3::Z);
        // Half the film over the focal length, x to the left.
        let half = 0.0125 / 0.035;
        assert!(camera.ray(0.0, 0.0).1.abs_diff_eq(DVec3::new(half, half, 1.0), 1e-15));
        assert!(camera.ray(256.0, 256.0).1.abs_diff_eq(DVec3::new(-half, -half, 1.0), 1e-15));
    }

    /// Looking along +z with y up, right-handed, the red wall at x = 552 is on the left and the ceiling is above.
    #[test]
    fn red_wall_appears_on_the_left_and_the_ceiling_above() {
        let camera = cornell();
        let (x, y) = seen_at(&camera, DVec3::new(552.0, 273.0, 300.0));
        assert!(x < 64.0 && (y - 128.0).abs() < 1e-9, "{x} {y}");
        let (_, y) = seen_at(&camera, DVec3::new(278.0, 548.0, 300.0));
        assert!(y < 64.0, "{y}");
        let (_, there) = camera.ray(x, 128.0);
        assert!(there.cross(DVec3::new(552.0 - 278.0, 0.0, 1100.0)).length() < 1e-9);
    }

    #[test]
    fn width_holds_for_film_and_height_for_the_angle() {
        let film = Lens::Film { focal_length: 2.0, width: 1.0 };
        let camera = Camera::new(DVec3::ZERO, DVec3::X, DVec3::Z, film, [200, 100]).unwrap();
        assert_eq!(camera.half, [0.25, 0.125]);
        let camera = Camera::new(DVec3::ZERO, DVec3::X, DVec3::Z, Lens::Vertical(90.0), [200, 100]).unwrap();
        assert!((camera.half[0] - 2.0).abs() < 1e-15 && (camera.half[1] - 1.0).abs() < 1e-15);
        // Up need not be perpendicular to the view.
        let tilted = DVec3::new(0.7, 0.0, 0.1);
        let other = Camera::new(DVec3::ZERO, DVec3::X, tilted, Lens::Vertical(90.0), [200, 100]).unwrap();
        assert!(camera.up.abs_diff_eq(other.up, 1e-15) && camera.right.abs_diff_eq(other.right, 1e-15));
    }

    #[test]
    fn framing_contains_the_box_tightly() {
        for (size, high) in
            [([512, 512], DVec3::ONE), ([640, 200], DVec3::new(3.0, 0.1, 1.0)), ([100, 300], DVec3::X)]
        {
            for scale in [1e-6, 1.0, 1e6] {
                let bounds = (scale * -DVec3::ONE, scale * high);
                let camera = Camera::framing(bounds, DVec3::Y, Lens::Vertical(40.0), size).unwrap();
                let mut widest: f64 = 0.0;
                for k in 0..8 {
                    let pick = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { high[bit] };
                    let (x, y) = seen_at(&camera, scale * DVec3::new(pick(0), pick(1), pick(2)));
                    let (x, y) = (2.0 * x / f64::from(size[0]) - 1.0, 2.0 * y / f64::from(size[1]) - 1.0);
                    widest = widest.max(x.abs()).max(y.abs());
                }
                assert!((widest - FRAMING_FILL).abs() < 1e-9, "{widest}");
                assert!(camera.framing);
            }
        }
    }

    #[test]
    fn command_line_wins_over_the_toml_and_names_choose() {
        let described = |name: &str, x: f64| CameraSettings {
            name: Some(name.into()),
            eye: [x, 0.0, 0.0],
            look_at: [x, 0.0, 1.0],
            up: [0.0, 1.0, 0.0],
            resolution: [10, 20],
            focal_length: None,
            film: None,
            fov_deg: Some(90.0),
            projection: ProjectionSettings::Perspective,
            view_height: None,
        };
        let both = [described("front", 1.0), described("side", 2.0)];
        let bounds = (DVec3::ZERO, DVec3::ONE);
        let resolve = |wishes: Wishes| Camera::resolve(&wishes, &both, bounds);
        assert_eq!(resolve(Wishes::default()).unwrap().eye.x, 1.0);
        let side = Wishes { name: Some("side".into()), size: Some([40, 10]), ..Wishes::default() };
        let side = resolve(side).unwrap();
        assert_eq!((side.eye.x, side.size, side.framing), (2.0, [40, 10], false));
        let moved = resolve(Wishes { eye: Some(DVec3::new(5.0, 0.0, 1.0)), ..Wishes::default() }).unwrap();
        assert_eq!(moved.forward, -DVec3::X);
        let named = |name: &str| resolve(Wishes { name: Some(name.into()), ..Wishes::default() });
        assert!(named("above").unwrap_err().to_string().contains("front, side"));
        assert!(named("sied").unwrap_err().to_string().contains("did you mean side?"));
        assert!(Camera::resolve(&Wishes::default(), &[], bounds).unwrap().framing);
    }

    #[test]
    fn cameras_that_see_nothing_are_refused() {
        let (eye, at, lens) = (DVec3::ZERO, DVec3::X, Lens::Vertical(40.0));
        let refused = |camera: Result<Camera>, word: &str| camera.unwrap_err().to_string().contains(word);
        assert!(refused(Camera::new(eye, eye, DVec3::Y, lens, [1, 1]), "one point"));
        assert!(refused(Camera::new(eye, at, DVec3::X, lens, [1, 1]), "--up"));
        assert!(refused(Camera::new(eye, at, DVec3::Y, Lens::Vertical(180.0), [1, 1]), "field of view"));
        assert!(refused(Camera::new(DVec3::NAN, at, DVec3::Y, lens, [1, 1]), "finite"));
        assert!(refused(Camera::new(eye, at, DVec3::Y, lens, [0, 1]), "pixels"));
    }

    /// What a ray meets appears where the ray came from, in every projection, and the matrices agree.
    #[test]
    fn places_and_rays_are_inverse() {
        let (eye, at, up) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 1.0, 0.5), DVec3::new(0.1, 1.0, 0.0));
        for lens in [Lens::Vertical(70.0), Lens::Orthographic(3.0), Lens::Panorama] {
            let camera = Camera::new(eye, at, up, lens, [200, 100]).unwrap();
            for (x, y, depth) in [(100.0, 50.0, 1.0), (3.0, 97.0, 0.5), (180.0, 12.5, 40.0)] {
                let (origin, direction) = camera.ray(x, y);
                let point = origin + depth * direction;
                let (place, found) = camera.place_of(point).unwrap();
                assert!((place[0] - x).abs() < 1e-9 && (place[1] - y).abs() < 1e-9, "{lens:?} {place:?}");
                assert!((found - depth).abs() < 1e-9 * depth, "{found} {depth}");
                let Some(matrix) = camera.world_to_ndc() else { continue };
                let row = [point.x, point.y, point.z, 1.0];
                let out: [f64; 4] = std::array::from_fn(|c| (0..4).map(|k| row[k] * matrix[k][c]).sum());
                assert!((out[0] / out[3] - (x / 100.0 - 1.0)).abs() < 1e-9);
                assert!((out[1] / out[3] - (1.0 - y / 50.0)).abs() < 1e-9);
            }
        }
        let panorama = Camera::new(eye, at, up, Lens::Panorama, [200, 100]).unwrap();
        assert!(panorama.ray(0.0, 50.0).1.abs_diff_eq(-panorama.forward, 1e-12));
        assert!(panorama.ray(150.0, 50.0).1.abs_diff_eq(panorama.right, 1e-12));
        assert!(panorama.ray(37.0, 0.0).1.abs_diff_eq(panorama.up, 1e-12));
    }

    #[test]
    fn a_full_turn_comes_back_and_half_of_it_looks_from_the_other_side() {
        let camera = cornell();
        let middle = DVec3::new(278.0, 0.0, 280.0);
        let half = camera.turned(middle, DVec3::Y, PI);
        assert!(half.eye.abs_diff_eq(DVec3::new(278.0, 273.0, 1360.0), 1e-9), "{}", half.eye);
        assert!(half.forward.abs_diff_eq(-camera.forward, 1e-12));
        assert!(camera.turned(middle, DVec3::Y, TAU).eye.abs_diff_eq(camera.eye, 1e-9));
    }
}
