//! Command line of solve-tool.

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use interchange::error::meant_ending;
use interchange::foreign::Format;
use interchange::grouping::By;
use interchange::tables::TableFormat;
use interchange::tool::{
    Common, EXIT_CODES, Finish, examples, exit_code, not_negative, pages, positive, print_data,
};
use solve_tool::compare::{Difference, Request};
use solve_tool::export::{ExportRequest, Quantity, Units};
use solve_tool::interval::Spread;
use solve_tool::look::Look;
use solve_tool::run::SolveRequest;
use solve_tool::skips::{Skip, Skips};
use solve_tool::snapshot::Plan;
use solve_tool::solve::Solver;
use std::path::PathBuf;
use std::process::ExitCode;

/// Lines to try, in `--help` and the manual page.
const EXAMPLES: [&str; 5] = [
    "solve-tool solve box.ff --mesh box.mesh -o box.sol --tolerance 1e-3",
    "solve-tool info box.sol",
    "solve-tool export box.sol --mesh box.mesh --by group -o groups.csv",
    "solve-tool export box.sol --mesh box.mesh -o box.vtu",
    "solve-tool compare box.sol bounce.sol --mesh box.mesh",
];

/// Radiosity from an exchange matrix and materials.
#[derive(Debug, Parser)]
#[command(name = "solve-tool", version, arg_required_else_help = true, after_help = EXIT_CODES, after_long_help = examples(&EXAMPLES))]
struct Cli {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Solve for the radiosity of every element
    Solve {
        /// Exchange matrix (.ff), or all files of one computed in shards
        #[arg(required = true)]
        matrix: Vec<PathBuf>,
        /// The mesh it was computed for
        #[arg(long, value_name = "MESH")]
        mesh: PathBuf,
        /// Material table or MTL file in place of the .materials beside the mesh
        #[arg(long, value_name = "FILE")]
        materials: Option<PathBuf>,
        /// Heat: temperature and emissivity, or net flux, of every group, as a table with the header
        /// group,emissivity,temperature,flux (K, W m^-2), in place of materials
        #[arg(long, value_name = "CSV", conflicts_with = "materials")]
        thermal: Option<PathBuf>,
        /// Solution to write (.sol)
        #[arg(long, short, value_name = "SOL")]
        output: PathBuf,
        /// Method
        #[arg(long, value_enum, default_value_t = Solver::Auto)]
        solver: Solver,
        /// Stop after K reflections of every ray (0: emission alone) instead of solving
        #[arg(long, value_name = "K", conflicts_with_all = ["solver", "tolerance", "start", "snapshots", "max_steps"])]
        bounces: Option<u32>,
        /// Write a solution after every N steps (southwell: shots), or after those in a list, beside the output
        #[arg(long, value_name = "N[,N...]", value_parser = Plan::parse)]
        snapshots: Option<Plan>,
        /// Older solution on the same mesh to start from
        #[arg(long, value_name = "SOL")]
        start: Option<PathBuf>,
        /// With southwell: elements pass on at once what the balance of power foresees
        #[arg(long)]
        overshoot: bool,
        /// Give up after N steps, each as long as a product with the matrix
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
        max_steps: Option<u64>,
        /// Bound every radiosity from below and above, and tell the errors of matrix, solver and elements apart; the
        /// value says how the errors of a row of the matrix are spread
        #[arg(long, value_name = "SPREAD", value_enum, num_args = 0..=1, require_equals = true,
            default_missing_value = "rows", conflicts_with = "bounces")]
        bounds: Option<Spread>,
        /// Do work that is known to change nothing; several with commas between
        #[arg(long, value_name = "NAME", value_enum, value_delimiter = ',')]
        no_skip: Vec<Skip>,
        /// Error to be proved, relative to the emitted power: sum of A |error of B| over sum of A E; auto and cg stop at 0.03 of it
        #[arg(long, value_name = "E", default_value = "1e-6", value_parser = positive)]
        tolerance: f64,
    },
    /// Write a table (radiosity and irradiance, energy, bounds, errors or heat), or the elements with all of it
    ///
    /// Elements go to viewers and other programs as .ply, .vtu (VTK), .glb (glTF), .obj or .rad (Radiance).
    Export {
        /// Solution (.sol)
        solution: PathBuf,
        /// The mesh it was computed on
        #[arg(long, value_name = "MESH")]
        mesh: PathBuf,
        /// What a row of the table stands for
        #[arg(long, value_enum)]
        by: Option<By>,
        /// What it tells
        #[arg(long, value_enum, default_value_t = Quantity::Radiosity)]
        quantity: Quantity,
        /// Units of radiosity and energy
        #[arg(long, value_enum, default_value_t = Units::Radiometric)]
        units: Units,
        /// Luminous efficacy of the light for photometric units, lm/W (179: equal-energy white light)
        #[arg(long, value_name = "LM_PER_W", default_value = "179", value_parser = positive)]
        efficacy: f64,
        /// With elements: radiance that shows as white, W m^-2 sr^-1 [default: what 98 % of the area stays below]
        #[arg(long, value_name = "L", value_parser = positive)]
        white: Option<f64>,
        /// Format of elements, where the ending of the output does not say it
        #[arg(long, value_enum)]
        format: Option<Format>,
        /// Table (.csv or .npy) or elements (.ply, .vtu, .glb, .obj or .rad) to write; - for standard output
        #[arg(long, short, value_name = "FILE")]
        output: PathBuf,
    },
    /// Show by how much two solutions differ
    Compare {
        /// Solution (.sol)
        first: PathBuf,
        /// Solution to compare it with
        second: PathBuf,
        /// Mesh of the first, and of the second unless that has its own
        #[arg(long, value_name = "MESH")]
        mesh: PathBuf,
        /// Mesh of the second, where it is another one
        #[arg(long, value_name = "MESH")]
        second_mesh: Option<PathBuf>,
        /// What is compared: means over it [default: element on one mesh, group on two]
        #[arg(long, value_enum)]
        by: Option<By>,
        /// The same as JSON
        #[arg(long)]
        json: bool,
        /// Fail (exit 1) where the radiosities differ by more than this part of all light
        #[arg(long, value_name = "E", value_parser = not_negative)]
        max: Option<f64>,
    },
    /// Write manual pages and completions below a folder such as /usr/local
    #[command(hide = true)]
    Pages {
        /// Folder
        prefix: PathBuf,
    },
    /// Describe a solution
    Info {
        /// Solution (.sol)
        file: PathBuf,
        /// For machines
        #[arg(long)]
        json: bool,
        /// Only what it says of element I, from 1
        #[arg(long, value_name = "I")]
        element: Option<u32>,
        /// Only what it says of a group: means, and sums of powers
        #[arg(long, value_name = "NAME", requires = "mesh", conflicts_with = "element")]
        group: Option<String>,
        /// The mesh it was computed on, for areas and names
        #[arg(long, value_name = "MESH")]
        mesh: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    cli.common.start();
    exit_code("solve-tool", run(cli.command))
}

/// Ends the program as for any other bad usage.
fn refuse(kind: ErrorKind, message: &str) -> ! {
    Cli::command().error(kind, message).exit()
}

fn run(command: Command) -> anyhow::Result<Finish> {
    match command {
        Command::Solve {
            matrix,
            mesh,
            materials,
            thermal,
            output,
            solver,
            bounces,
            snapshots,
            start,
            overshoot,
            max_steps,
            bounds,
            no_skip,
            tolerance,
        } => {
            if overshoot && solver != Solver::Southwell {
                refuse(ErrorKind::ArgumentConflict, "--overshoot goes with --solver southwell");
            }
            let request = SolveRequest {
                matrix,
                mesh,
                materials,
                thermal,
                output,
                solver,
                tolerance,
                bounces,
                snapshots,
                start,
                overshooting: overshoot,
                most_steps: max_steps.map(|steps| steps as usize),
                skips: Skips { done: no_skip },
                bounds,
            };
            return Ok(solve_tool::run::run(&request)?);
        }
        Command::Export { solution, mesh, by, quantity, units, efficacy, white, format, output } => {
            if format.is_some() || Format::of(&output).is_some() {
                if by.is_some() || quantity != Quantity::Radiosity || units != Units::Radiometric {
                    refuse(
                        ErrorKind::ArgumentConflict,
                        "--by, --quantity and --units go with tables (.csv, .npy)",
                    );
                }
                solve_tool::surface::write(&solution, &mesh, white, &output, format)?;
                return Ok(Finish::Done);
            }
            if white.is_some() {
                refuse(
                    ErrorKind::ArgumentConflict,
                    "--white goes with elements (.ply, .vtu, .glb, .obj, .rad)",
                );
            }
            TableFormat::of(&output, &[TableFormat::Csv, TableFormat::Npy]).map_err(|_| {
                let meant = meant_ending(&output, ["csv", "npy", "ply", "vtu", "glb", "obj", "rad"]);
                let message = format!(
                    "the name must end in .csv or .npy (tables), or in .ply, .vtu, .glb, .obj or .rad (elements){meant}"
                );
                interchange::Error::whole(&output, message)
            })?;
            let Some(by) = by else {
                refuse(ErrorKind::MissingRequiredArgument, "a table needs --by element, face or group");
            };
            let request = ExportRequest { solution, mesh, by, quantity, units, efficacy, output };
            solve_tool::export::run(&request)?;
        }
        Command::Compare { first, second, mesh, second_mesh, by, json, max } => {
            let meshes = [mesh.clone(), second_mesh.unwrap_or(mesh)];
            let difference = Difference::between(Request { solutions: [first, second], meshes, by })?;
            print_data(&difference.describe(json))?;
            difference.check(max)?;
        }
        Command::Pages { prefix } => pages::write(Cli::command(), &prefix)?,
        Command::Info { file, json, element, group, mesh } => {
            print_data(&match element.map(Look::Element).or(group.map(Look::Group)) {
                Some(look) => solve_tool::look::describe(&file, mesh.as_deref(), &look, json)?,
                None => solve_tool::info::describe(&file, json)?,
            })?;
        }
    }
    Ok(Finish::Done)
}
