//! Flags, and the three subcommands from files to files.

use crate::camera::{Camera, Lens, Wishes};
use crate::compare::Difference;
use crate::error::Result;
use crate::exr_file::{self, Fit, Precision};
use crate::lit_scene::LitScene;
use crate::picture::Picture;
use crate::{TOOL, VERSION, info, points, preview, probe, render};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand};
use glam::DVec3;
use interchange::atomic_write::refuse_input;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::scene::Settings;
use interchange::tool::{Common, EXIT_CODES, Finish, examples, not_negative, pages, positive, print_data};
use std::path::{Path, PathBuf};

/// Largest picture side: 2^16 pixels, beyond any display or print.
const LARGEST_SIDE: u32 = 1 << 16;
/// Largest picture: 2^28 pixels, 6 GB while it is made.
const LARGEST_PICTURE: u64 = 1 << 28;

/// Lines to try, in `--help` and the manual page.
const EXAMPLES: [&str; 4] = [
    "shade-tool render box.sol --mesh box.mesh -o box.exr --png box.png --camera tests/scenes/cornell_blocks.toml",
    "shade-tool info box.exr",
    "shade-tool compare box.exr box.exr --max 0",
    "shade-tool probe box.sol --mesh box.mesh --points points.csv -o lit.csv",
];

/// Radiosity to pictures and points.
#[derive(Debug, Parser)]
#[command(name = TOOL, version, about, after_help = EXIT_CODES, after_long_help = examples(&EXAMPLES))]
pub struct Arguments {
    /// Flags of all tools.
    #[command(flatten)]
    pub common: Common,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a picture: OpenEXR with linear radiance, and a PNG preview
    Render(Box<RenderArguments>),
    /// Irradiance at the points of a table, by exact gathering
    Probe(ProbeArguments),
    /// Show by how much two pictures differ
    Compare(CompareArguments),
    /// Write manual pages and completions below a folder such as /usr/local
    #[command(hide = true)]
    Pages {
        /// Folder
        prefix: PathBuf,
    },
    /// Tell what a picture holds
    Info(InfoArguments),
}

/// The three files that are shaded.
#[derive(Debug, Args)]
pub struct SceneArguments {
    /// Solution by solve-tool
    #[arg(value_name = "S.SOL")]
    pub solution: PathBuf,
    /// Mesh the solution was computed on
    #[arg(long, value_name = "S.MESH")]
    pub mesh: PathBuf,
    /// Material table instead of the one beside the mesh
    #[arg(long, value_name = "X.MATERIALS")]
    pub materials: Option<PathBuf>,
}

/// Flags of `render`.
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// What to shade.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Picture to write
    #[arg(short, long, value_name = "S.EXR", value_parser = ends_in("exr"))]
    pub output: PathBuf,
    /// Tone-mapped preview to write besides
    #[arg(long, value_name = "S.PNG", value_parser = ends_in("png"))]
    pub png: Option<PathBuf>,
    /// Camera of a scene's toml; without one the picture frames the scene from outside
    #[arg(long, value_name = "C.TOML")]
    pub camera: Option<PathBuf>,
    /// Name of the camera, where the toml has several (default: its first)
    #[arg(long, value_name = "NAME", requires = "camera")]
    pub camera_name: Option<String>,
    /// Place of the eye
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub eye: Option<DVec3>,
    /// Point in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub look_at: Option<DVec3>,
    /// Direction that is up in the picture, not along the view (default: 0,1,0)
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub up: Option<DVec3>,
    /// Focal length, in the unit of the film
    #[arg(long, value_name = "F", value_parser = positive, requires = "film", conflicts_with = "fov_deg")]
    pub focal_length: Option<f64>,
    /// Width and height of the film; where they disagree with the picture's the width holds
    #[arg(long, value_name = "W,H", value_parser = film, requires = "focal_length")]
    pub film: Option<[f64; 2]>,
    /// Vertical field of view in degrees (default: 40)
    #[arg(long, value_name = "D", value_parser = angle)]
    pub fov_deg: Option<f64>,
    /// Width and height in pixels (default: the toml's, or 512x512)
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Store 32-bit floats instead of halves
    #[arg(long)]
    pub float: bool,
    /// Samples along each side of a pixel
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub samples: u32,
    /// Cut facets while the middle of an edge is off linear interpolation by more than this part of its value
    #[arg(long, value_name = "E", default_value_t = 0.02, value_parser = positive)]
    pub tolerance: f64,
    /// Brighten the preview by so many powers of two
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = stops, allow_hyphen_values = true, requires = "png")]
    pub exposure: f64,
}

/// Flags of `probe`.
#[derive(Debug, Args)]
pub struct ProbeArguments {
    /// What to shade.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Table of points with the header x,y,z,nx,ny,nz
    #[arg(long, value_name = "P.CSV")]
    pub points: PathBuf,
    /// Table to write: the points, then H_r,H_g,H_b
    #[arg(short, long, value_name = "OUT.CSV")]
    pub output: PathBuf,
}

/// Flags of `compare`.
#[derive(Debug, Args)]
pub struct CompareArguments {
    /// Picture (.exr or .png)
    pub first: PathBuf,
    /// Picture to compare it with, of the same kind and size
    pub second: PathBuf,
    /// Tell it as JSON
    #[arg(long)]
    pub json: bool,
    /// Fail (exit 1) where a channel's RMS difference is above this part of its mean
    #[arg(long, value_name = "E", value_parser = not_negative)]
    pub max: Option<f64>,
}

/// Flags of `info`.
#[derive(Debug, Args)]
pub struct InfoArguments {
    /// Picture (.exr)
    pub file: PathBuf,
    /// Tell it as JSON
    #[arg(long)]
    pub json: bool,
}

impl Arguments {
    /// Bad usage that single flags do not show.
    pub fn check(&self) -> std::result::Result<(), clap::Error> {
        let Command::Render(render) = &self.command else { return Ok(()) };
        if render.camera.is_none() && render.eye.is_some() != render.look_at.is_some() {
            let message = "--eye and --look-at must be given together, or with --camera";
            return Err(Arguments::command().error(ErrorKind::MissingRequiredArgument, message));
        }
        Ok(())
    }

    /// Does what was asked.
    pub fn run(&self) -> Result<Finish> {
        match &self.command {
            Command::Render(arguments) => run_render(arguments, &self.common)?,
            Command::Probe(arguments) => run_probe(arguments, &self.common)?,
            Command::Compare(arguments) => run_compare(arguments)?,
            Command::Pages { prefix } => pages::write(Arguments::command(), prefix)?,
            Command::Info(arguments) => run_info(arguments)?,
        }
        Ok(Finish::Done)
    }
}

fn run_render(arguments: &RenderArguments, common: &Common) -> Result<()> {
    let mut report = Report::new(TOOL, VERSION);
    let scene = read_scene(&arguments.scene, &mut report)?;
    let settings = arguments.camera.as_deref().map(Settings::read).transpose()?.unwrap_or_default();
    let camera = Camera::resolve(&arguments.wishes(), &settings.cameras, scene.bounds())?;
    let precision = if arguments.float { Precision::Float } else { Precision::Half };

    let provenance = Provenance::new(TOOL, VERSION)
        .flag(format!("--samples {}", arguments.samples))
        .flag(format!("--tolerance {}", arguments.tolerance))
        .flag(if arguments.float { "--float" } else { "--half" })
        .flag(format!("camera {}", camera.describe()));
    let provenance = scene.sign(provenance);
    report.flags.clone_from(&provenance.flags);

    let quality = render::Quality { samples: arguments.samples as usize, tolerance: arguments.tolerance };
    let picture = render::render(&scene, &camera, quality, common, &mut report);
    warn_of_range(&picture, precision, &mut report);
    report.phase("write", || {
        exr_file::write(&arguments.output, &picture, precision, &provenance)?;
        match &arguments.png {
            Some(png) => preview::write(png, &picture, arguments.exposure).map(|_| ()),
            None => Ok(()),
        }
    })?;
    report.write_beside(&arguments.output)?;
    Ok(())
}

fn warn_of_range(picture: &Picture, precision: Precision, report: &mut Report) {
    let remedy = if precision == Precision::Half { "give --float" } else { "scale the lamps" };
    match exr_file::fit(picture, precision) {
        Fit::Good => {}
        Fit::TooBright(count) => {
            report.warn(format!("{count} values are too large to store and become infinite; {remedy}"));
        }
        Fit::TooDark => {
            let highest = picture.highest();
            report.warn(format!(
                "the picture is too dark to keep all digits (at most {highest:.1e}); {remedy}"
            ));
        }
    }
}

fn run_probe(arguments: &ProbeArguments, common: &Common) -> Result<()> {
    refuse_input(
        &arguments.output,
        [arguments.points.as_path(), &arguments.scene.solution, &arguments.scene.mesh],
    )?;
    let mut report = Report::new(TOOL, VERSION);
    let points = points::read(&arguments.points)?;
    let scene = read_scene(&arguments.scene, &mut report)?;
    let irradiance = probe::probe(&scene, &points, common, &mut report);
    report.phase("write", || probe::write(&arguments.output, &points, &irradiance))?;
    report.write_beside(&arguments.output)?;
    Ok(())
}

fn run_compare(arguments: &CompareArguments) -> Result<()> {
    let difference = Difference::between(&arguments.first, &arguments.second)?;
    let text = if arguments.json { format!("{:#}\n", difference.json()) } else { difference.text() };
    print_data(&text).map_err(|e| interchange::Error::io(Path::new("stdout"), "write", e))?;
    let found = difference.relative();
    match arguments.max {
        Some(most) if found > most => {
            let message = format!(
                "differs from {} by {found:.3e} of the mean, above --max {most:e}",
                arguments.first.display()
            );
            Err(interchange::Error::whole(&arguments.second, message).into())
        }
        _ => Ok(()),
    }
}

fn run_info(arguments: &InfoArguments) -> Result<()> {
    let info = info::read(&arguments.file)?;
    let text = if arguments.json { format!("{:#}\n", info.json()) } else { info.text() };
    print_data(&text).map_err(|e| interchange::Error::io(Path::new("stdout"), "write", e))?;
    Ok(())
}

fn read_scene(arguments: &SceneArguments, report: &mut Report) -> Result<LitScene> {
    let start = std::time::Instant::now();
    let scene = LitScene::read(&arguments.solution, &arguments.mesh, arguments.materials.as_deref(), report);
    let seconds = start.elapsed().as_secs_f64();
    report.phases.push(interchange::report::Phase { name: "read".into(), seconds });
    scene
}

impl RenderArguments {
    /// What the flags say of the camera.
    pub fn wishes(&self) -> Wishes {
        let film = self.focal_length.zip(self.film);
        let film = film.map(|(focal_length, [width, _])| Lens::Film { focal_length, width });
        Wishes {
            name: self.camera_name.clone(),
            eye: self.eye,
            look_at: self.look_at,
            up: self.up,
            lens: film.or(self.fov_deg.map(Lens::Vertical)),
            size: self.size,
        }
    }
}

fn ends_in(ending: &'static str) -> impl Fn(&str) -> Result<PathBuf, String> + Clone {
    move |text| {
        let path = PathBuf::from(text);
        let found = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        if found.as_deref() == Some(ending) {
            Ok(path)
        } else {
            Err(format!("the name must end in .{ending}"))
        }
    }
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let values: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse().ok().filter(|x: &f64| x.is_finite())).collect();
    values
        .and_then(|values| values.try_into().ok())
        .ok_or_else(|| format!("expected {N} finite numbers with commas"))
}

fn vector(text: &str) -> Result<DVec3, String> {
    numbers(text).map(DVec3::from_array)
}

fn film(text: &str) -> Result<[f64; 2], String> {
    let film = numbers(text)?;
    if film.iter().all(|&x| x > 0.0) { Ok(film) } else { Err("expected two numbers above 0".into()) }
}

fn angle(text: &str) -> Result<f64, String> {
    let degrees = positive(text)?;
    if degrees < 180.0 { Ok(degrees) } else { Err("expected an angle below 180 degrees".into()) }
}

fn stops(text: &str) -> Result<f64, String> {
    let [x] = numbers(text)?;
    if x.abs() <= 100.0 { Ok(x) } else { Err("expected at most 100 stops".into()) }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let sides: [u32; 2] = sides.ok_or("expected WIDTHxHEIGHT, such as 640x480")?;
    let fits = sides.iter().all(|side| (1..=LARGEST_SIDE).contains(side));
    let pixels = u64::from(sides[0]) * u64::from(sides[1]);
    if fits && pixels <= LARGEST_PICTURE {
        Ok(sides)
    } else {
        Err(format!("expected sides of 1 to {LARGEST_SIDE} and at most {LARGEST_PICTURE} pixels"))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn sizes_vectors_and_angles_are_checked() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert!(["", "640", "0x1", "1x-1", "65537x1", "65536x65536"].iter().all(|text| size(text).is_err()));
        assert_eq!(vector("1,-2e3, 0.5"), Ok(DVec3::new(1.0, -2e3, 0.5)));
        assert!(["1,2", "1,2,3,4", "1,2,NaN", "1,2,inf", "a,b,c"].iter().all(|text| vector(text).is_err()));
        assert!(angle("180").is_err() && angle("0").is_err() && angle("40").is_ok());
    }

    #[test]
    fn definitions_of_flags_hold_together() {
        Arguments::command().debug_assert();
    }
}
