//! `view`: a rendered picture looked at in other ways, from its EXR file. Nothing is rendered again.

use crate::canvas::Canvas;
use crate::colour_scale::{Scale, captioned, coloured, label, round_step, with_bar};
use crate::element_error;
use crate::error::{Error, Result};
use crate::exr_reader::StoredPicture;
use crate::flag_values::{ends_in, numbers};
use crate::isolux::isolux;
use crate::layers::{Layer, Values};
use crate::mesh_overlay::mesh_overlay;
use crate::quantity::{Map, Quantity};
use crate::tone::{Tone, ToneArguments};
use crate::{TOOL, VERSION};
use clap::{Args, Subcommand};
use interchange::mesh::Mesh;
use interchange::report::Report;
use interchange::tool::positive;
use std::path::PathBuf;

/// Lumens per watt where neither flag nor picture says: equal-energy white.
const EFFICACY: f64 = 179.0;
/// Contours to a scale's length, at least, where no step is given.
const CONTOURS: usize = 8;
/// Without a step contours go on to so many times the scale's end: beyond it are lamps.
const BEYOND_SCALE: f64 = 4.0;
/// More contours than this are no picture.
const MOST_CONTOURS: f64 = 1000.0;

/// Ways of looking at a picture.
#[derive(Debug, Subcommand)]
#[command(
    after_help = "Example: render once with all layers that views need, then look at the file again and again:
  shade-tool render s.sol --mesh s.mesh -o s.exr --layers element,face,irradiance,error
  shade-tool view tone s.exr -o tone.png --exposure auto+1 --curve filmic
  shade-tool view false-colour s.exr -o lux.png --quantity illuminance --range 0,500
  shade-tool view isolux s.exr -o isolux.png --step 50
  shade-tool view mesh s.exr --mesh s.mesh -o mesh.png
  shade-tool view error s.exr -o error.png"
)]
pub enum View {
    /// Tone-mapped, as the preview of render but for the borders of lamps: a file has mean radiance only, which is stepped there
    Tone(ToneView),
    /// A quantity in colours, with a labelled scale
    FalseColour(FalseColourView),
    /// Labelled contours of a quantity over the picture (layer face, and irradiance for illuminance)
    Isolux(IsoluxView),
    /// Elements, and discontinuity lines coloured by order, over the picture
    Mesh(MeshView),
    /// How well each element is known (layers element and error)
    Error(ErrorView),
}

/// The picture and where its view goes.
#[derive(Debug, Args)]
pub struct Files {
    /// Picture by render
    #[arg(value_name = "S.EXR")]
    pub picture: PathBuf,
    /// View to write
    #[arg(short, long, value_name = "V.PNG", value_parser = ends_in("png"))]
    pub output: PathBuf,
}

/// Flags of `view tone`.
#[derive(Debug, Args)]
pub struct ToneView {
    /// Picture and view.
    #[command(flatten)]
    pub files: Files,
    /// Show a layer of colours instead of radiance
    #[arg(long, value_name = "NAME", value_parser = layer_of_colours)]
    pub layer: Option<Layer>,
    /// Exposure and curve.
    #[command(flatten)]
    pub tone: ToneArguments,
}

/// Which numbers have which colours.
#[derive(Debug, Args)]
pub struct ScaleArguments {
    /// Ends of the scale, in the quantity's unit (default: 0 and a round number above 98 % of the pixels)
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<[f64; 2]>,
    /// Equal factors, not equal differences, are equal steps of colour
    #[arg(long)]
    pub log: bool,
}

/// Flags of `view false-colour`.
#[derive(Debug, Args)]
pub struct FalseColourView {
    /// Picture and view.
    #[command(flatten)]
    pub files: Files,
    /// What is shown; illuminance and irradiance need the layer irradiance
    #[arg(long, value_name = "WHAT", default_value = "luminance")]
    pub quantity: Quantity,
    /// Lumens per watt, for cd/m² and lx (default: what the picture was rendered with, else 179, equal-energy white)
    #[arg(long, value_name = "LM/W", value_parser = positive)]
    pub efficacy: Option<f64>,
    /// Scale.
    #[command(flatten)]
    pub scale: ScaleArguments,
}

/// Flags of `view isolux`.
#[derive(Debug, Args)]
pub struct IsoluxView {
    /// Picture and view.
    #[command(flatten)]
    pub files: Files,
    /// What is equal along a contour; illuminance and irradiance need the layer irradiance
    #[arg(long, value_name = "WHAT", default_value = "illuminance")]
    pub quantity: Quantity,
    /// Lumens per watt, for cd/m² and lx (default: what the picture was rendered with, else 179, equal-energy white)
    #[arg(long, value_name = "LM/W", value_parser = positive)]
    pub efficacy: Option<f64>,
    /// Distance of the contours, in the quantity's unit (default: a round one that gives about ten); where they would touch
    /// only every fifth is drawn
    #[arg(long, value_name = "S", value_parser = positive, conflicts_with = "levels")]
    pub step: Option<f64>,
    /// Values of the contours, instead of even steps
    #[arg(long, value_name = "V,V,...", value_delimiter = ',', value_parser = positive)]
    pub levels: Vec<f64>,
    /// Exposure and curve of the picture below.
    #[command(flatten)]
    pub tone: ToneArguments,
}

/// Flags of `view mesh`.
#[derive(Debug, Args)]
pub struct MeshView {
    /// Picture and view.
    #[command(flatten)]
    pub files: Files,
    /// Mesh that the picture was rendered from
    #[arg(long, value_name = "S.MESH")]
    pub mesh: PathBuf,
    /// Exposure and curve of the picture below.
    #[command(flatten)]
    pub tone: ToneArguments,
}

/// Flags of `view error`.
#[derive(Debug, Args)]
pub struct ErrorView {
    /// Picture and view.
    #[command(flatten)]
    pub files: Files,
    /// Show the bounds that solve-tool solve --bounds proved, instead of the picture's own layer error
    #[arg(long, value_name = "S.SOL")]
    pub solution: Option<PathBuf>,
    /// Scale, in percent.
    #[command(flatten)]
    pub scale: ScaleArguments,
}

impl View {
    /// Bad usage that single flags do not show.
    pub fn usage(&self) -> std::result::Result<(), &'static str> {
        let scale = match self {
            View::FalseColour(view) => &view.scale,
            View::Error(view) => &view.scale,
            _ => return Ok(()),
        };
        match scale.range {
            Some([low, _]) if scale.log && low <= 0.0 => Err("--range of a --log scale must begin above 0"),
            _ => Ok(()),
        }
    }

    /// Makes the view and its report.
    pub fn run(&self) -> Result<()> {
        let mut report = Report::new(TOOL, VERSION);
        let files = self.files();
        let stored = StoredPicture::read(&files.picture)?;
        let canvas = match self {
            View::Tone(view) => {
                let mut stored = stored.clone();
                if let Some(layer) = view.layer
                    && let Values::Triples(colours) = stored.layer(layer)?.clone()
                {
                    stored.picture.pixels = colours;
                }
                shown(&stored, &view.tone, &mut report)
            }
            View::FalseColour(view) => {
                let map = view.quantity.map(&stored, efficacy(view.efficacy, &stored))?;
                false_colour(&map, &view.scale, &mut report)
            }
            View::Isolux(view) => view.canvas(&stored, &mut report)?,
            View::Mesh(view) => view.canvas(&stored, &mut report)?,
            View::Error(view) => {
                let map = match &view.solution {
                    Some(solution) => element_error::bounds(&stored, solution)?,
                    None => element_error::interpolation(&stored)?,
                };
                false_colour(&map, &view.scale, &mut report)
            }
        };
        report.count("pixels", stored.picture.pixels.len());
        canvas.write(&files.output)?;
        Ok(report.write_beside(&files.output)?)
    }

    fn files(&self) -> &Files {
        match self {
            View::Tone(view) => &view.files,
            View::FalseColour(view) => &view.files,
            View::Isolux(view) => &view.files,
            View::Mesh(view) => &view.files,
            View::Error(view) => &view.files,
        }
    }
}

impl IsoluxView {
    fn canvas(&self, stored: &StoredPicture, report: &mut Report) -> Result<Canvas> {
        let map = self.quantity.map(stored, efficacy(self.efficacy, stored))?;
        let Values::Indices(faces) = stored.layer(Layer::Face)? else {
            return Err(Error::view(&stored.path, "layer face holds no indices", "render it again"));
        };
        let even = self.levels.is_empty();
        let mut levels = self.levels.clone();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        let caption = if even {
            let mut highest = map.values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
            let step = self.step.unwrap_or_else(|| {
                let end = Scale::fitting(&map.values, false).high;
                highest = highest.min(BEYOND_SCALE * end);
                round_step(end, CONTOURS)
            });
            if highest / step > MOST_CONTOURS {
                let found =
                    format!("{} contours of {} up to {highest}", (highest / step).round(), label(step));
                return Err(Error::view(&stored.path, found, "give a larger --step"));
            }
            levels.extend((1..=(highest / step) as u32).map(|k| f64::from(k) * step));
            report.estimate("contour_step", step);
            format!("{}, contours every {}", map.caption, label(step))
        } else {
            map.caption.clone()
        };
        Ok(captioned(&isolux(&shown(stored, &self.tone, report), &map, faces, &levels, even), &caption))
    }
}

impl MeshView {
    fn canvas(&self, stored: &StoredPicture, report: &mut Report) -> Result<Canvas> {
        let (mesh, _, digest) = Mesh::read(&self.mesh)?;
        stored.check_input("mesh", &self.mesh, digest)?;
        let size = [stored.picture.width, stored.picture.height].map(|n| n as u32);
        let camera = stored.camera.as_ref().filter(|camera| camera.size == size);
        let Some(camera) = camera else {
            let found = "does not say from where it was seen";
            return Err(Error::view(&stored.path, found, "render it again with shade-tool render"));
        };
        for (order, name) in ["lines_d0", "lines_d1", "lines_d2"].iter().enumerate() {
            report.count(name, mesh.lines.iter().filter(|line| line.order as usize == order).count());
        }
        Ok(mesh_overlay(&shown(stored, &self.tone, report), &mesh, camera))
    }
}

/// The tone-mapped picture; the report tells the exposure, so that another picture can be given the same.
fn shown(stored: &StoredPicture, tone: &ToneArguments, report: &mut Report) -> Canvas {
    let tone = tone.fitted(&stored.picture);
    tell_exposure(&tone, report);
    tone.shown(&stored.picture)
}

/// Notes the exposure in stops.
pub fn tell_exposure(tone: &Tone, report: &mut Report) {
    if tone.factor > 0.0 {
        report.estimate("exposure_stops", tone.factor.log2());
    }
}

fn efficacy(asked: Option<f64>, stored: &StoredPicture) -> f64 {
    asked.or(stored.efficacy).unwrap_or(EFFICACY)
}

fn false_colour(map: &Map, asked: &ScaleArguments, report: &mut Report) -> Canvas {
    let fitting = Scale::fitting(&map.values, asked.log);
    let scale = match asked.range {
        Some([low, high]) => Scale { low, high, ..fitting },
        None => fitting,
    };
    report.estimate("scale_low", scale.low);
    report.estimate("scale_high", scale.high);
    let beyond = map.values.iter().any(|&v| v > scale.high);
    let picture = coloured(&map.values, map.width, &scale);
    captioned(&with_bar(&picture, &scale, beyond), &map.caption)
}

fn layer_of_colours(text: &str) -> Result<Layer, String> {
    let colours = [Layer::Albedo, Layer::Irradiance, Layer::Direct, Layer::Indirect];
    let names = || colours.map(Layer::name).join(", ");
    colours
        .into_iter()
        .find(|layer| layer.name() == text)
        .ok_or_else(|| format!("expected one of {}", names()))
}

fn range(text: &str) -> Result<[f64; 2], String> {
    let [low, high] = numbers(text)?;
    if low < high { Ok([low, high]) } else { Err("expected a lower and a higher number".into()) }
}
