//! Command line of mesh-tool.

use clap::{Args, Parser, Subcommand};
use interchange::atomic_write;
use interchange::provenance::Provenance;
use interchange::report::Report;
use interchange::scene::Scene;
use interchange::tool::{self, Common, Finish};
use mesh_tool::discontinuity::Order;
use mesh_tool::steps::{Off, Skip, Step};
use mesh_tool::{NAME, Options, VERSION, depfile, info};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Turns a scene into elements
#[derive(Debug, Parser)]
#[command(name = "mesh-tool", version, about, after_help = tool::EXIT_CODES)]
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
    /// Say what is in a mesh or a material table
    Info {
        /// Mesh (.mesh) or material table (.materials)
        file: PathBuf,
        /// As JSON, for scripts
        #[arg(long)]
        json: bool,
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
    /// Mesh with about this many triangles, smaller where light changes; with --max-edge too, the finer of the two wins
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    elements: Option<u32>,
    /// Mesh along the lines where direct light jumps in value (d0: contacts), slope (d1) or curvature (d2) [default: d2,
    /// with --linear d1]
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
    fn options(&self) -> Options {
        Options {
            max_edge: self.max_edge,
            elements: self.elements,
            discontinuity: self.discontinuity,
            eee: self.eee,
            linear: self.linear,
            no_clean: Off::new(self.no_clean.clone()),
            no_skip: Off::new(self.no_skip.clone()),
        }
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
    tool::exit_code(NAME, run(&line).map(|()| Finish::Done))
}

fn run(line: &CommandLine) -> anyhow::Result<()> {
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
            let options = size.options();
            let mut report = Report::new(NAME, VERSION);
            report.flags = options.flags();
            report.flags.extend(args.two_sided.iter().map(|name| format!("--two-sided {name}")));
            let scene = report.phase("read", || args.read())?;
            for warning in &scene.warnings {
                report.warn(warning.clone());
            }
            refuse_overwriting(&scene, output)?;
            let mesh = mesh_tool::build(&scene, &options, &mut report)?;
            let provenance = mesh_tool::provenance(&scene, &options);
            report.phase("write", || -> interchange::Result<()> {
                write_materials(&scene, &output.with_extension("materials"))?;
                mesh.write(output, provenance)?;
                Ok(())
            })?;
            report.write_beside(output)?;
        }
        Command::Info { file, json } => tool::print_data(&info::describe(file, *json)?)?,
    }
    Ok(())
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
    atomic_write::refuse_input(output, depfile::dependencies(scene).iter().map(PathBuf::as_path))
}
