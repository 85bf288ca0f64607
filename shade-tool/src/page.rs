//! `page`: one HTML file that shows a run of the pipeline: the 3-D view of the solution, pictures, balance of power,
//! convergence, errors, times, skips and provenance.
//!
//! The file needs nothing else, and its content policy forbids it to load anything: pictures and arrays are in it as
//! base64, the 3-D view is WebGL of our own (`assets/viewer.js`). A library such as three.js would be fifty times as
//! large for one shader and an orbit. The same files give the same bytes; times are those of the reports.

mod balance;
mod input;
mod markup;
mod plot;
mod scene_data;
mod stages;

use crate::error::Result;
use crate::flag_values::ends_in;
use clap::Args;
use input::Input;
use interchange::atomic_write::{self, refuse_input};
use interchange::tool::positive;
use markup::{count, escape, figure, number, seconds};
use scene_data::{Drawn, MOST_ELEMENTS};
use std::fmt::Write;
use std::path::PathBuf;

const STYLE: &str = include_str!("../assets/page.css");
const VIEWER: &str = include_str!("../assets/viewer.js");
/// Captions of the figures that pipeline.mk makes.
const CAPTIONS: [(&str, &str); 6] = [
    ("picture", "The picture, tone-mapped."),
    (
        "false-colour",
        "The picture in false colours; the quantity and its unit stand above, the scale beside it.",
    ),
    ("isolux", "Lines of equal illuminance, lx."),
    (
        "mesh",
        "The elements of the mesh, and the lines across which light jumps (by order), over the picture.",
    ),
    ("error", "How well the elements of the picture are known; the unit stands above."),
    (
        "matrix",
        "The matrix of form factors in the order of the clusters: colour is the factor F on a logarithmic scale, frames \
         are blocks by the way they are stored.",
    ),
];

/// Flags of `page`.
#[derive(Debug, Args)]
pub struct PageArguments {
    /// Solution by solve-tool; the reports beside it and beside the other files are shown, too
    #[arg(value_name = "S.SOL")]
    pub solution: PathBuf,
    /// Mesh the solution was computed on
    #[arg(long, value_name = "S.MESH")]
    pub mesh: PathBuf,
    /// Material table instead of the one beside the mesh
    #[arg(long, value_name = "X.MATERIALS")]
    pub materials: Option<PathBuf>,
    /// Page to write
    #[arg(short, long, value_name = "S.HTML", value_parser = ends_in("html"))]
    pub output: PathBuf,
    /// Matrix the solution was computed from, for its provenance and report
    #[arg(long, value_name = "S.FF")]
    pub matrix: Option<PathBuf>,
    /// Picture rendered from the solution, for its report
    #[arg(long, value_name = "S.EXR")]
    pub picture: Option<PathBuf>,
    /// Solution of the same matrix by solve-tool solve --bounds, for the error of each element (default: S.SOL's bounds, if any)
    #[arg(long, value_name = "B.SOL")]
    pub bounds: Option<PathBuf>,
    /// Picture to show: one of picture, false-colour, isolux, mesh, error, matrix, or a caption of your own; repeat for more
    #[arg(long = "figure", value_name = "NAME=X.PNG", value_parser = named_figure)]
    pub figures: Vec<NamedFigure>,
    /// Scene's toml: where the 3-D view begins, and the unit of length
    #[arg(long, value_name = "C.TOML")]
    pub camera: Option<PathBuf>,
    /// Title (default: the name of the page's file)
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Lumens per watt, for lx (179: equal-energy white)
    #[arg(long, value_name = "LM/W", default_value_t = 179.0, value_parser = positive)]
    pub efficacy: f64,
    /// Show whole faces in the 3-D view where there are more elements than this
    #[arg(long, value_name = "N", default_value_t = MOST_ELEMENTS)]
    pub most_elements: usize,
}

/// A picture and what it shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedFigure {
    /// A name that has a caption, or the caption.
    pub name: String,
    /// PNG file.
    pub path: PathBuf,
}

fn named_figure(text: &str) -> Result<NamedFigure, String> {
    let (name, path) = text.rsplit_once('=').ok_or("expected NAME=FILE.png, such as mesh=mesh.png")?;
    Ok(NamedFigure { name: name.into(), path: ends_in("png")(path)? })
}

/// Writes the page.
pub fn run(arguments: &PageArguments) -> Result<()> {
    let optional = [&arguments.matrix, &arguments.picture, &arguments.bounds, &arguments.camera];
    let inputs = [arguments.solution.as_path(), &arguments.mesh];
    refuse_input(&arguments.output, inputs.into_iter().chain(optional.into_iter().flatten().map(|p| &**p)))?;
    let input = Input::read(arguments)?;
    let stem = arguments.output.file_stem().map(|s| s.to_string_lossy().into_owned());
    let title = arguments.title.clone().or(stem).unwrap_or_default();
    let html = html(&input, &title, arguments.most_elements);
    atomic_write::write_bytes(&arguments.output, html.as_bytes())?;
    Ok(())
}

fn html(input: &Input, title: &str, most_elements: usize) -> String {
    let drawn = Drawn::new(input, most_elements);
    let title = escape(title);
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'; \
         script-src 'unsafe-inline'\">\n\
         <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1><p>{}</p></header>\n<main>\n",
        summary(input)
    );
    let mut section = |id: &str, heading: &str, content: &str| {
        if !content.is_empty() {
            let _ = write!(page, "<section id=\"{id}\"><h2>{heading}</h2>\n{content}</section>\n");
        }
    };
    section("key-figures", "Key figures", &key_figures(input));
    section("warnings", "Warnings", &stages::warnings(input).unwrap_or_default());
    section("view", "The solution in 3-D", &view(&drawn));
    let (matrix, pictures): (Vec<_>, Vec<_>) = input.figures.iter().partition(|(name, _)| name == "matrix");
    section("pictures", "Pictures", &figures(&pictures));
    section("balance", "Where the power goes", &balance::tables(input));
    section("convergence", "Convergence of the solver", &convergence(input));
    section("errors", "Errors and estimates", &stages::estimates(input));
    section("matrix", "The matrix", &figures(&matrix));
    section("times", "Times", &stages::times(input));
    section("skips", "What was left out", &stages::skips(input));
    section("provenance", "Provenance", &stages::provenance(input));
    page.push_str("</main>\n");
    page.push_str(&drawn.scripts(input));
    let _ = write!(page, "<script>\n{VIEWER}</script>\n</body>\n</html>\n");
    page
}

fn summary(input: &Input) -> String {
    let elements = count(input.mesh.element_count() as u64);
    let faces = count(u64::from(input.mesh.input_face_count));
    let (groups, unit) = (count(input.mesh.groups.len() as u64), escape(&input.unit));
    let (low, high) = input.bounds();
    let [x, y, z] = (high - low).to_array().map(number);
    format!("Radiosity of {elements} elements on {faces} faces in {groups} groups; {x} × {y} × {z} {unit}.")
}

fn key_figures(input: &Input) -> String {
    let summary = &input.solution.summary;
    let mut figures = vec![
        ("elements", count(input.mesh.element_count() as u64)),
        ("error bound of the solver, part of the emitted power", number(summary.achieved)),
        ("bound asked of the solver", number(summary.tolerance)),
    ];
    if let Some(matrix) = &input.matrix {
        figures.push(("error asked of a row of the matrix", number(matrix.tolerance)));
    }
    let time = stages::total_time(input);
    if time > 0.0 {
        figures.push(("wall time of the stages", seconds(time)));
    }
    let items: String =
        figures.iter().map(|(what, value)| format!("<div><dt>{what}</dt><dd>{value}</dd></div>")).collect();
    format!("<dl class=\"figures\">{items}</dl>\n")
}

fn figures(figures: &[&(String, String)]) -> String {
    let shown = |(name, data): &&(String, String)| {
        let known = CAPTIONS.iter().find(|(known, _)| known == name).map(|(_, caption)| *caption);
        let caption = escape(known.unwrap_or(name));
        figure(&format!("<img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">"), &caption)
    };
    let all: String = figures.iter().map(shown).collect();
    if all.is_empty() { all } else { format!("<div class=\"pictures\">{all}</div>\n") }
}

fn convergence(input: &Input) -> String {
    let summary = &input.solution.summary;
    let caption = format!(
        "Bound on the error of all radiosities, relative to the emitted power, after each product with the matrix \
         (solver: {}). Stopped at {}, asked was {}.",
        escape(&summary.solver),
        number(summary.achieved),
        number(summary.tolerance)
    );
    match plot::convergence(&input.solution.history, summary.tolerance) {
        Some(svg) => figure(&svg, &caption),
        None => "<p>The solver took no steps: there is no light, or the file keeps no history.</p>\n".into(),
    }
}

/// The frame of the 3-D view; `viewer.js` fills it.
fn view(drawn: &Drawn) -> String {
    let errors = match drawn.has_errors() {
        true => "<option value=\"errors\">bound on the error, false colours</option>",
        false => "",
    };
    let (kind, note) = match drawn.is_by_element() {
        true => ("an element", String::new()),
        false => ("a face", " The mesh has too many elements for a page: faces show their means.".into()),
    };
    let note = match drawn.has_errors() || !drawn.is_by_element() {
        true => note,
        false => note + " Errors of elements are known after <code>solve-tool solve --bounds</code>.",
    };
    format!(
        "<div id=\"viewer\"><div class=\"controls\">\
         <label>paint <select id=\"paint\"><option value=\"radiosity\">radiosity, tone-mapped</option>\
         <option value=\"irradiance\">irradiance, false colours</option>{errors}</select></label>\
         <label id=\"exposure-label\">exposure <input id=\"exposure\" type=\"range\" min=\"-5\" max=\"5\" step=\"0.25\" value=\"0\">\
         <output id=\"stops\"></output></label>\
         <label><input id=\"smooth\" type=\"checkbox\" checked> smooth</label>\
         <label><input id=\"edges\" type=\"checkbox\"> mesh edges</label>\
         <button id=\"reset\" type=\"button\">reset view</button></div>\n\
         <div class=\"stage\"><canvas id=\"canvas\" tabindex=\"0\" aria-label=\"The scene; arrow keys turn it\"></canvas>\
         <div id=\"legend\" hidden></div></div>\n\
         <div id=\"picked\" aria-live=\"polite\"><p>Click {kind} to read its values.</p></div></div>\n\
         <p class=\"note\">Drag turns, wheel or two fingers zoom, right button or Shift and drag moves; arrow keys turn, + and − zoom. \
         Surfaces are seen from their front only.{note}</p>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_named_by_what_stands_before_the_last_equals_sign() {
        let figure = |name: &str, path: &str| Ok(NamedFigure { name: name.into(), path: path.into() });
        assert_eq!(named_figure("mesh=a.png"), figure("mesh", "a.png"));
        assert_eq!(named_figure("E = mc² at noon=b.PNG"), figure("E = mc² at noon", "b.PNG"));
        assert!(named_figure("a.png").is_err() && named_figure("mesh=a.jpg").is_err());
    }
}
