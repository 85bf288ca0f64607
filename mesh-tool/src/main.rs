//! Command line of mesh-tool.

use clap::{Args, CommandFactory, Parser, Subcommand};
use interchange::atomic_write;
use interchange::foreign::Format;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::scene::Scene;
use interchange::tool::{self, Common, Finish};
use mesh_tool::adaptive::INTERPOLATION_ERROR;
use mesh_tool::discontinuity::Order;
use mesh_tool::look::{self, Look};
use mesh_tool::solved::Solved;
use mesh_tool::steps::{Off, Skip, Step};
use mesh_tool::{NAME, Options, VERSION, compare, compare_materials, depfile, export, info, picture};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Lines to try, in `--help` and the manual page.
const EXAMPLES: [&str; 5] = [
    "mesh-tool build tests/scenes/cornell_blocks.obj -o box.mesh --elements 300",
    "mesh-tool info box.mesh",
    "mesh-tool picture box.mesh -o box.svg",
    "mesh-tool export box.mesh -o box.glb",
    "mesh-tool import box.vs3 -o from_view3d.obj",
];

/// Turns a scene into elements
#[derive(Debug, Parser)]
#[command(name = "mesh-tool", version, about, after_help = tool::EXIT_CODES, after_long_help = tool::examples(&EXAMPLES))]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write the scene's material table, and beside it NAME.surfaces (what geometry depends on)
    Materials {
        #[command(flatten)]
        scene: SceneArgs,
        /// Material table to write
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Also write a make rule saying what the table depends on
        #[arg(long, value_name = "FILE")]
        depfile: Option<PathBuf>,
    },
    /// Write the scene's mesh, and beside it NAME.materials, NAME.surfaces and a report
    ///
    /// Without --max-edge and --elements the faces are elements as given: only what overlaps, crosses or is concave
    /// is cut.
    Build {
        #[command(flatten)]
        scene: SceneArgs,
        /// Mesh to write
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        #[command(flatten)]
        size: SizeArgs,
    },
    /// Draw the elements with all planes unfolded about the edges they share; lines red where light jumps in value, orange in
    /// slope, blue in curvature
    Picture {
        /// Mesh (.mesh)
        file: PathBuf,
        /// Picture to write (.svg or .png)
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Only the plane with this number
        #[arg(long, value_name = "N")]
        plane: Option<usize>,
    },
    /// Write the elements for other programs: .ply, .vtu, .glb, .obj, .rad (Radiance) or .vs3 (View3D)
    Export {
        /// Mesh (.mesh); colours are those of the .materials beside it
        file: PathBuf,
        /// Format, where the ending of the output does not say it
        #[arg(long, value_enum)]
        format: Option<Format>,
        /// File to write, - for standard output; its ending says the format
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Turn a scene of View3D or Radiance into an OBJ with its MTL
    Import {
        /// Scene (.vs3 or .rad)
        file: PathBuf,
        /// OBJ to write; the MTL goes beside it
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Show by how much two meshes or two material tables differ
    Compare {
        /// Mesh (.mesh) or material table (.materials)
        first: PathBuf,
        /// What to compare it with
        second: PathBuf,
        /// As JSON, for scripts
        #[arg(long)]
        json: bool,
        /// Fail (exit 1) where more than this part of the area is in elements that only one has, or where a value of a material
        /// differs by more
        #[arg(long, value_name = "E", value_parser = tool::not_negative)]
        max: Option<f64>,
    },
    /// Write manual pages and completions below a folder such as /usr/local
    #[command(hide = true)]
    Pages {
        /// Folder
        prefix: PathBuf,
    },
    /// Say what is in a mesh or a material table
    Info {
        /// Mesh (.mesh) or material table (.materials)
        file: PathBuf,
        /// As JSON, for scripts
        #[arg(long)]
        json: bool,
        /// Only element I, from 1, with its corners
        #[arg(long, value_name = "I")]
        element: Option<u32>,
        /// Only this group
        #[arg(long, value_name = "NAME", conflicts_with = "element")]
        group: Option<String>,
    },
}

#[derive(Debug, Args)]
struct SceneArgs {
    /// Scene (.obj)
    scene: PathBuf,
    /// Let both sides of this material emit, reflect and receive (besides those the scene's toml lists)
    #[arg(long, value_name = "NAME")]
    two_sided: Vec<String>,
}

/// What the elements should be.
#[derive(Debug, Args)]
struct SizeArgs {
    /// Mesh with triangles whose edges are no longer than this, in the scene's unit of length
    #[arg(long, value_name = "L", value_parser = tool::positive)]
    max_edge: Option<f64>,
    /// Mesh with about this many triangles, smaller where light changes; at least a quarter more than the faces need by themselves. With --max-edge too, the finer of the two wins
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    elements: Option<u32>,
    /// With --elements: triangles of equal size, whatever the light
    #[arg(long, requires = "elements", conflicts_with = "tolerance")]
    even: bool,
    /// Mesh as fine as this wants: interpolating direct light between the nodes of an element misses it by no more than
    /// E of the mean light; with --elements, that many elements at most
    #[arg(long, value_name = "E", value_parser = tool::positive)]
    tolerance: Option<f64>,
    /// Refine the mesh that the other flags make where this solution on it, beside its mesh, is worst. Elements that are not divided stay exactly as they are
    #[arg(long, value_name = "S.sol")]
    refine_with: Option<PathBuf>,
    /// With --refine-with: part of the mean irradiance that the solution may miss [default: 0.02]
    #[arg(long, value_name = "E", value_parser = tool::positive, requires = "refine_with")]
    refine_tolerance: Option<f64>,
    /// With --refine-with: also draw the lines of the K faces that send most light without emitting
    #[arg(long, value_name = "K", default_value_t = 0, requires = "refine_with")]
    sources: u32,
    /// Mesh along the lines where direct light jumps in value (d0: contacts), slope (d1) or curvature (d2)
    /// [default: d1]
    #[arg(long, value_name = "ORDER", value_enum)]
    discontinuity: Option<Order>,
    /// Also draw the curves of three edges (slow where there are many edges)
    #[arg(long)]
    eee: bool,
    /// Three nodes an element, for linear interpolation, in place of six
    #[arg(long)]
    linear: bool,
    /// Leave out a step of cleaning
    #[arg(long, value_name = "STEP", value_enum, value_delimiter = ',')]
    no_clean: Vec<Step>,
    /// Do also what provably does not matter
    #[arg(long, value_name = "NAME", value_enum, value_delimiter = ',')]
    no_skip: Vec<Skip>,
}

impl SizeArgs {
    fn options(&self) -> interchange::Result<Options> {
        let refine_with = self.refine_with.as_deref().map(Solved::read).transpose()?;
        Ok(Options {
            refine_with,
            refine_tolerance: self.refine_tolerance,
            sources: self.sources,
            max_edge: self.max_edge,
            elements: self.elements,
            even: self.even,
            tolerance: self.tolerance,
            discontinuity: self.discontinuity,
            eee: self.eee,
            linear: self.linear,
            no_clean: Off::new(self.no_clean.clone()),
            no_skip: Off::new(self.no_skip.clone()),
        })
    }
}

impl SceneArgs {
    fn read(&self) -> interchange::Result<Scene> {
        Scene::read(&self.scene, &self.two_sided)
    }
}

fn main() -> ExitCode {
    let line = CommandLine::parse();
    line.common.start();
    tool::exit_code(NAME, run(&line))
}

fn run(line: &CommandLine) -> anyhow::Result<Finish> {
    match &line.command {
        Command::Materials { scene, output, depfile } => {
            let scene = scene.read()?;
            for warning in &scene.warnings {
                tracing::warn!("{warning}");
            }
            write_materials(&scene, output)?;
            if let Some(path) = depfile {
                let rule = depfile::rule(output, &depfile::dependencies(&scene));
                atomic_write::write_bytes(path, rule.as_bytes())?;
            }
        }
        Command::Build { scene: args, output, size } => {
            let options = size.options()?;
            let mut report = Report::new(NAME, VERSION);
            report.flags = options.flags();
            report.flags.extend(args.two_sided.iter().map(|name| format!("--two-sided {name}")));
            let scene = report.phase("read", || args.read())?;
            for warning in &scene.warnings {
                report.warn(warning.clone());
            }
            refuse_overwriting(&scene, output)?;
            if let Some(solution) = &size.refine_with {
                let inputs = [solution.clone(), solution.with_extension("mesh")];
                atomic_write::refuse_input(output, inputs.iter().map(PathBuf::as_path))?;
            }
            let mesh = mesh_tool::build(&scene, &options, &mut report)?;
            let provenance = mesh_tool::provenance(&scene, &options);
            report.phase("write", || -> interchange::Result<()> {
                write_materials(&scene, &output.with_extension("materials"))?;
                mesh.write(output, provenance)?;
                Ok(())
            })?;
            report.write_beside(output)?;
            let error = report.estimates.get(INTERPOLATION_ERROR).copied().unwrap_or(0.0);
            if let Some(asked) = options.tolerance.filter(|&asked| error > asked) {
                return Ok(Finish::ToleranceMissed(format!(
                    "interpolating direct light misses it by up to {error:.2e} of the mean where {asked:.2e} was asked \
                     for (beside an emitter that touches a face no mesh would do); raise --tolerance or --elements"
                )));
            }
        }
        Command::Pages { prefix } => tool::pages::write(CommandLine::command(), prefix)?,
        Command::Picture { file, output, plane } => picture::draw(file, output, *plane)?,
        Command::Export { file, format, output } => export::write(file, output, *format)?,
        Command::Import { file, output } => {
            for finding in export::convert(file, output)? {
                tracing::warn!("{finding}");
            }
        }
        Command::Compare { first, second, json, max } => {
            if info::is_material_table(first) {
                let difference = compare_materials::Difference::between(first, second)?;
                tool::print_data(&difference.describe(*json))?;
                difference.check(*max)?;
                return Ok(Finish::Done);
            }
            let difference = compare::Difference::between(first, second)?;
            tool::print_data(&difference.describe(*json))?;
            difference.check(*max)?;
        }
        Command::Info { file, json, element, group } => {
            let look = element.map(Look::Element).or(group.clone().map(Look::Group));
            tool::print_data(&match look {
                Some(look) => look::describe(file, &look, *json)?,
                None => info::describe(file, *json)?,
            })?;
        }
    }
    Ok(Finish::Done)
}

/// Writes the table and, beside it, what geometry depends on. `build` and `materials` write the same bytes.
fn write_materials(scene: &Scene, path: &Path) -> interchange::Result<()> {
    refuse_overwriting(scene, path)?;
    let provenance = Provenance::new(NAME, VERSION).input("scene", scene.digest);
    scene.materials.write_surfaces(&path.with_extension("surfaces"))?;
    scene.materials.write(path, provenance)?;
    Ok(())
}

fn refuse_overwriting(scene: &Scene, output: &Path) -> interchange::Result<()> {
    atomic_write::refuse_stdout(output)?;
    atomic_write::refuse_input(output, depfile::dependencies(scene).iter().map(PathBuf::as_path))
}
