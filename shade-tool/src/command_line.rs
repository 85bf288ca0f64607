//! Flags, and the three subcommands from files to files.

use crate::camera::{Lens, Wishes};
use crate::compare::Difference;
use crate::error::Result;
use crate::exr_file::{self, Fit, Label, Precision};
use crate::facets::Drawn;
use crate::flag_values::{Interpolation, angle, ends_in, film, size, table, vector};
use crate::frames::{Frame, frames};
use crate::judge::Scheme;
use crate::layers::Layer;
use crate::lit_scene::LitScene;
use crate::local_picture::LocalRenderer;
use crate::page::{self, PageArguments};
use crate::picture::Picture;
use crate::pixel_samples::Sampling;
use crate::render::{Quality, Renderer};
use crate::shading::ShadingArguments;
use crate::sheet::SheetArguments;
use crate::skips::Skip;
use crate::tone::ToneArguments;
use crate::view::{View, tell_exposure};
use crate::{TOOL, VERSION, bounces, grid, info, points, probe, skips};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand};
use glam::DVec3;
use interchange::atomic_write::{is_stdout, refuse_input};
use interchange::counted::counted;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::scene::Settings;
use interchange::tool::{Common, EXIT_CODES, Finish, examples, not_negative, pages, positive, print_data};
use std::path::{Path, PathBuf};

/// Lines to try, in `--help` and the manual page.
const EXAMPLES: [&str; 5] = [
    "shade-tool render box.sol --mesh box.mesh -o box.exr --png box.png --camera tests/scenes/cornell_blocks.toml",
    "shade-tool page box.sol --mesh box.mesh --matrix box.ff --picture box.exr --bounds bounded.sol --figure picture=box.png -o box.html",
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
    /// Look at a picture in another way, without rendering it again: PNG from EXR
    #[command(subcommand)]
    View(Box<View>),
    /// Put a whole run on a page: one HTML file with a 3-D view, pictures, errors, times and provenance
    Page(Box<PageArguments>),
    /// Put pictures side by side with one exposure: a contact sheet
    Sheet(SheetArguments),
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
    /// Do work that is proved or estimated to be needless
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub no_skip: Vec<Skip>,
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
    /// Tone-mapped preview to write besides; where a lamp covers a part of a pixel, lamp and surroundings are toned before their mean
    #[arg(long, value_name = "S.PNG", value_parser = ends_in("png"))]
    pub png: Option<PathBuf>,
    /// Camera of a scene's toml; without one the picture frames the scene from outside
    #[arg(long, value_name = "C.TOML")]
    pub camera: Option<PathBuf>,
    /// Name of the camera, where the toml has several (default: its first)
    #[arg(long, value_name = "NAME", requires = "camera")]
    pub camera_name: Option<String>,
    /// Render with every camera of the toml, into S.NAME.exr each
    #[arg(long, requires = "camera", conflicts_with_all = ["camera_name", "eye", "look_at", "turntable"])]
    pub all_cameras: bool,
    /// Render so many frames while the scene turns once about its middle, into S.000.exr and so on
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub turntable: Option<u32>,
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
    /// Parallel projection, with the height of the picture in the scene's unit
    #[arg(long, value_name = "HEIGHT", value_parser = positive, conflicts_with_all = ["fov_deg", "focal_length", "panorama"])]
    pub orthographic: Option<f64>,
    /// All directions, longitude by latitude; give a --size twice as wide as high
    #[arg(long, conflicts_with_all = ["fov_deg", "focal_length"])]
    pub panorama: bool,
    /// Width and height in pixels (default: the toml's, or 512x512)
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Store 32-bit floats instead of halves
    #[arg(long)]
    pub float: bool,
    /// Samples along each side of a pixel
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    pub samples: u32,
    /// Samples along each side of a pixel that the border of a surface crosses, rounded to a multiple of --samples; three
    /// times as many at a lamp's, 64 at most, but for N up to --samples (default: as --tolerance asks for)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub border_samples: Option<u32>,
    /// Local models.
    #[command(flatten)]
    pub shading: ShadingArguments,
    /// How light is interpolated over elements
    #[arg(long, value_name = "HOW", default_value = "auto")]
    pub interpolation: Interpolation,
    /// Layers to store besides radiance
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub layers: Vec<Layer>,
    /// Solutions after 0, 1, 2 ... bounces (solve-tool solve --bounces): layers bounces.0 to bounces.K, K solutions of them
    #[arg(long, value_name = "B0.SOL,...", value_delimiter = ',')]
    pub bounces: Vec<PathBuf>,
    /// Lumens per watt, for the white luminance that the EXR states (179: equal-energy white)
    #[arg(long, value_name = "LM/W", default_value_t = 179.0, value_parser = positive)]
    pub efficacy: f64,
    /// Gather more while interpolation is off by more than this part of the value
    #[arg(long, value_name = "E", default_value_t = 0.02, value_parser = positive)]
    pub tolerance: f64,
    /// Exposure and curve of the preview.
    #[command(flatten)]
    pub tone: ToneArguments,
}

/// Flags of `probe`.
#[derive(Debug, Args)]
pub struct ProbeArguments {
    /// What to shade.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Table of points with the header x,y,z,nx,ny,nz
    #[arg(long, value_name = "P.CSV", required_unless_present = "grid", conflicts_with = "grid")]
    pub points: Option<PathBuf>,
    /// Points spread over a group, or over the input face with this number, instead of a table
    #[arg(long, value_name = "FACE|GROUP", requires = "spacing")]
    pub grid: Option<String>,
    /// Largest distance of the grid's points, in the scene's unit
    #[arg(long, value_name = "D", value_parser = positive, requires = "grid", conflicts_with = "points")]
    pub spacing: Option<f64>,
    /// Height of the grid above its faces, in the scene's unit
    #[arg(long, value_name = "H", default_value_t = 0.0, value_parser = not_negative, requires = "grid", conflicts_with = "points")]
    pub height: f64,
    /// Lumens per watt, for the illuminance of the grid's summary (179: equal-energy white)
    #[arg(long, value_name = "LM/W", default_value_t = 179.0, value_parser = positive, requires = "grid", conflicts_with = "points")]
    pub efficacy: f64,
    /// Add the column H_error, the estimated error at each point (a grid has it always)
    #[arg(long)]
    pub errors: bool,
    /// Table to write: the points, then H_r,H_g,H_b; `-` for standard output
    #[arg(short, long, value_name = "OUT.CSV|NPY", value_parser = table(["csv", "npy"]))]
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
        let bad = |kind, message: String| Err(Arguments::command().error(kind, message));
        let render = match &self.command {
            Command::Render(render) => render,
            Command::View(view) => {
                return view.usage().or_else(|message| bad(ErrorKind::ValueValidation, message.into()));
            }
            Command::Sheet(sheet) => {
                return sheet.usage().or_else(|message| bad(ErrorKind::WrongNumberOfValues, message));
            }
            Command::Probe(_)
            | Command::Page(_)
            | Command::Compare(_)
            | Command::Pages { .. }
            | Command::Info(_) => return Ok(()),
        };
        if render.tone.given() && render.png.is_none() {
            let message = "--exposure and --curve are for the preview: give --png";
            return bad(ErrorKind::MissingRequiredArgument, message.into());
        }
        if render.camera.is_none() && render.eye.is_some() != render.look_at.is_some() {
            let message = "--eye and --look-at must be given together, or with --camera";
            return Err(Arguments::command().error(ErrorKind::MissingRequiredArgument, message));
        }
        if let Err(message) = render.shading.usage(&render.layers) {
            return bad(ErrorKind::ArgumentConflict, message);
        }
        let apart = render.layers.iter().find(|layer| layer.needs_gathering());
        if let (Some(layer), Interpolation::Constant) = (apart, render.interpolation) {
            let message =
                format!("--interpolation constant knows no {} layer: nothing is gathered", layer.name());
            return Err(Arguments::command().error(ErrorKind::ArgumentConflict, message));
        }
        if !render.bounces.is_empty() && render.shading.local().is_some() {
            let message = "a local model has no layers of --bounces: all its light is direct";
            return bad(ErrorKind::ArgumentConflict, message.into());
        }
        if !render.bounces.is_empty() && render.interpolation == Interpolation::Constant {
            let message = "--interpolation constant knows no layers of --bounces: nothing is gathered";
            return Err(Arguments::command().error(ErrorKind::ArgumentConflict, message));
        }
        Ok(())
    }

    /// Does what was asked.
    pub fn run(&self) -> Result<Finish> {
        match &self.command {
            Command::Render(arguments) => run_render(arguments, &self.common)?,
            Command::Probe(arguments) => run_probe(arguments, &self.common)?,
            Command::View(view) => view.run()?,
            Command::Page(arguments) => page::run(arguments)?,
            Command::Sheet(arguments) => arguments.run()?,
            Command::Compare(arguments) => run_compare(arguments)?,
            Command::Pages { prefix } => pages::write(Arguments::command(), prefix)?,
            Command::Info(arguments) => run_info(arguments)?,
        }
        Ok(Finish::Done)
    }
}

/// What makes the pictures of a run.
enum Shader<'a> {
    Solution(Box<Renderer<'a>>),
    Local(Box<LocalRenderer<'a>>),
}

fn run_render(arguments: &RenderArguments, common: &Common) -> Result<()> {
    let mut report = Report::new(TOOL, VERSION);
    let local = arguments.shading.local();
    // Local models know elements only.
    let scheme = arguments.interpolation.scheme(arguments.tolerance).filter(|_| local.is_none());
    let drawn = match scheme {
        None => Drawn::Elements,
        Some(Scheme::Linear) => Drawn::Facets,
        Some(_) => Drawn::Triangles,
    };
    let scene = read_scene(&arguments.scene, drawn, &mut report)?;
    let frames = cameras(arguments, &scene, &mut report)?;
    let precision = if arguments.float { Precision::Float } else { Precision::Half };
    let scheme_name = scheme.map_or("Constant".into(), |scheme| format!("{scheme:?}")).to_lowercase();
    let sampling = arguments.sampling();
    let provenance = Provenance::new(TOOL, VERSION)
        .flag(format!("--samples {}", sampling.each))
        .flag(format!("--border-samples {}", sampling.each * sampling.in_cell));
    let provenance = match &local {
        Some(model) => model.sign(provenance),
        None => provenance
            .flag(format!("--tolerance {}", arguments.tolerance))
            .flag(format!("--interpolation {scheme_name}")),
    };
    let provenance = provenance.flag(if arguments.float { "--float" } else { "--half" });
    let provenance = skips::sign(&arguments.scene.no_skip, provenance);
    let provenance = scene.sign(provenance);
    let by_bounces = bounces::scenes(&arguments.bounces, &arguments.scene, drawn, &mut report)?;
    // The first of them is the second one in the dark.
    let provenance = by_bounces.iter().skip(1).fold(provenance, |p, scene| {
        scene
            .inputs
            .iter()
            .filter(|(role, _)| *role == "solution")
            .fold(p, |p, &(_, d)| p.input("bounces", d))
    });
    report.flags.clone_from(&provenance.flags);

    let quality =
        Quality { sampling, scheme, tolerance: arguments.tolerance, layers: arguments.layers.clone() };
    let opening =
        skips::opening(&arguments.scene.no_skip, Some(arguments.tolerance), scene.mean_irradiance());
    let mut renderer = match local {
        Some(model) => Shader::Local(Box::new(LocalRenderer::new(&scene, model, &mut report))),
        None => Shader::Solution(Box::new(Renderer::new(&scene, opening, &mut report))),
    };
    // What these count is not the picture's.
    let mut aside = Report::new(TOOL, VERSION);
    let mut bounce_renderers: Vec<Renderer<'_>> =
        by_bounces.iter().map(|scene| Renderer::new(scene, opening, &mut aside)).collect();
    for frame in &frames {
        let mut picture = match &mut renderer {
            Shader::Solution(renderer) => renderer.render(&frame.camera, &quality, common, &mut report),
            Shader::Local(renderer) => {
                renderer.render(&frame.camera, quality.sampling, &quality.layers, common, &mut report)
            }
        };
        picture.bounces = report.phase("bounces", || {
            let plain = Quality { layers: Vec::new(), ..quality.clone() };
            let render = |renderer: &mut Renderer<'_>| {
                renderer.render(&frame.camera, &plain, common, &mut aside).pixels
            };
            bounce_renderers.iter_mut().map(render).collect()
        });
        warn_of_range(&picture, precision, &mut report);
        let provenance = provenance.clone().flag(format!("camera {}", frame.camera.describe()));
        report.flags.push(format!("camera {}", frame.camera.describe()));
        let label = Label {
            provenance: &provenance,
            camera: Some(&frame.camera),
            efficacy: arguments.efficacy,
            remarks: match &local {
                Some(model) => format!("; {} shading, direct light only", model.name()),
                None => format!(
                    "; {scheme_name} interpolation to {} of radiosity on a solution to {:.1e} of the emitted power",
                    arguments.tolerance, scene.achieved
                ),
            },
        };
        let path = frame.path(&arguments.output);
        report.phase("write", || exr_file::write(&path, &picture, precision, &label))?;
        if let Some(png) = &arguments.png {
            let tone = arguments.tone.fitted(&picture);
            tell_exposure(&tone, &mut report);
            report.phase("preview", || tone.shown(&picture).write(&frame.path(png)))?;
        }
    }
    if let Shader::Solution(renderer) = &renderer {
        renderer.count(&mut report);
    }
    report.write_beside(&arguments.output)?;
    Ok(())
}

/// The cameras to render with, and where their pictures go.
fn cameras(arguments: &RenderArguments, scene: &LitScene, report: &mut Report) -> Result<Vec<Frame>> {
    let settings = arguments.camera.as_deref().map(Settings::read).transpose()?.unwrap_or_default();
    if let (Some(path), true, None) = (&arguments.camera, settings.cameras.is_empty(), arguments.eye) {
        let remedy = "add a [camera], or give --eye and --look-at";
        let path = path.display();
        report.warn(format!("{path}: has no camera; the picture frames the scene from outside; {remedy}"));
    }
    frames(&arguments.wishes(), &settings.cameras, scene.bounds(), arguments.all_cameras, arguments.turntable)
}

fn warn_of_range(picture: &Picture, precision: Precision, report: &mut Report) {
    let remedy = if precision == Precision::Half { "give --float" } else { "scale the lamps" };
    match exr_file::fit(picture, precision) {
        Fit::Good => {}
        Fit::TooBright(count) => {
            let those = counted(
                count,
                "value is too large to store and becomes",
                "values are too large to store and become",
            );
            report.warn(format!("{those} infinite; {remedy}"));
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
    let ProbeArguments { scene: files, points, output, .. } = arguments;
    let inputs = [files.solution.as_path(), &files.mesh].into_iter().chain(points.as_deref());
    refuse_input(output, inputs)?;
    let mut report = Report::new(TOOL, VERSION);
    let table = points.as_deref().map(points::read).transpose()?;
    let scene = read_scene(files, Drawn::Elements, &mut report)?;
    let of_grid = |(what, spacing): (&String, f64)| grid::points(&scene, what, spacing, arguments.height);
    let grid = arguments.grid.as_ref().zip(arguments.spacing).map(of_grid).transpose()?;
    let with_error = arguments.errors || grid.is_some();
    let points = table.or_else(|| grid.clone()).unwrap_or_default();
    let opening = skips::opening(&files.no_skip, None, 0.0);
    let probed = probe::probe(&scene, &points, opening, common, &mut report);
    report.phase("write", || probe::write(output, &points, &probed, with_error))?;
    if grid.is_some() {
        let (irradiance, errors): (Vec<_>, Vec<_>) = probed.iter().map(|p| (p.irradiance, p.error)).unzip();
        let summary = grid::Summary::of(&irradiance, &errors);
        for (name, value) in [
            ("grid_mean", summary.mean),
            ("grid_minimum", summary.minimum),
            ("grid_uniformity", summary.uniformity),
        ] {
            report.estimate(name, value);
        }
        // Where the table goes to standard output, the summary is talk.
        if !is_stdout(output) {
            print_data(&summary.text(arguments.efficacy))
                .map_err(|e| interchange::Error::io(Path::new("stdout"), "write", e))?;
        } else if !common.quiet {
            eprint!("{}", summary.text(arguments.efficacy));
        }
    }
    report.write_beside(output)?;
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

fn read_scene(arguments: &SceneArguments, drawn: Drawn, report: &mut Report) -> Result<LitScene> {
    let start = std::time::Instant::now();
    let SceneArguments { solution, mesh, materials, .. } = arguments;
    let scene = LitScene::read(solution, mesh, materials.as_deref(), drawn, report);
    let seconds = start.elapsed().as_secs_f64();
    report.phases.push(interchange::report::Phase { name: "read".into(), seconds });
    scene
}

impl RenderArguments {
    /// What the flags say of samples.
    pub fn sampling(&self) -> Sampling {
        Sampling::new(self.samples as usize, self.border_samples.map(|side| side as usize), self.tolerance)
    }

    /// What the flags say of the camera.
    pub fn wishes(&self) -> Wishes {
        let film = self.focal_length.zip(self.film);
        let film = film.map(|(focal_length, [width, _])| Lens::Film { focal_length, width });
        Wishes {
            name: self.camera_name.clone(),
            eye: self.eye,
            look_at: self.look_at,
            up: self.up,
            lens: film
                .or(self.fov_deg.map(Lens::Vertical))
                .or(self.orthographic.map(Lens::Orthographic))
                .or(self.panorama.then_some(Lens::Panorama)),
            size: self.size,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definitions_of_flags_hold_together() {
        Arguments::command().debug_assert();
    }
}
