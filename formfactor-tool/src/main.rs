//! Command line of the form-factor stage.

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, Parser, Subcommand};
use formfactor_tool::closure::Closure;
use formfactor_tool::foreign::Format;
use formfactor_tool::look::{self, Look};
use formfactor_tool::options::Storage;
use formfactor_tool::skips::Skip;
use formfactor_tool::{compare, compute, export, import, info, merge, method, picture, reuse};
use interchange::grouping::By;
use interchange::tool::{Common, EXIT_CODES, Finish, examples, exit_code, not_negative, pages, print_data};
use std::path::PathBuf;
use std::process::ExitCode;

/// Lines to try, in `--help` and the manual page.
const EXAMPLES: [&str; 9] = [
    "formfactor-tool compute box.mesh -o box.ff --tolerance 1e-3",
    "formfactor-tool compute finer.mesh -o finer.ff --tolerance 1e-3 --reuse box.ff --reuse-mesh box.mesh",
    "formfactor-tool info box.ff",
    "formfactor-tool info box.ff --verify",
    "formfactor-tool info box.ff --group floor light --mesh box.mesh",
    "formfactor-tool export box.ff --mesh box.mesh --by group -o factors.csv",
    "formfactor-tool import factors.npz --mesh box.mesh -o again.ff --tolerance 1e-3",
    "formfactor-tool compare box.ff again.ff --max 0",
    "formfactor-tool picture box.ff -o matrix.png",
];

/// Exchange matrix S = diag(A) F of a mesh, occlusion included
#[derive(Debug, Parser)]
#[command(name = "formfactor-tool", version, after_help = EXIT_CODES, after_long_help = examples(&EXAMPLES))]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    common: Common,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compute the matrix of a mesh
    Compute {
        /// Mesh made by mesh-tool build
        mesh: PathBuf,
        /// Matrix file to write
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Bound on the estimated sum over j of |error of F_ij| in any row
        #[arg(long, default_value = "1e-4", value_parser = compute::parse_tolerance)]
        tolerance: f64,
        #[command(flatten)]
        method: method::Flags,
        #[command(flatten)]
        reuse: reuse::source::OldMatrix,
        /// Do this work even where it is provably not needed
        #[arg(long, value_enum, value_name = "NAME", value_delimiter = ',')]
        no_skip: Vec<Skip>,
        #[command(flatten)]
        storage: Storage,
    },
    /// Put the files of a matrix that was computed in shards together
    Merge {
        /// All shards, in any order
        #[arg(required = true)]
        shards: Vec<PathBuf>,
        /// Matrix file to write
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Closure in place of the one that the shards were asked for
        #[arg(long, value_enum)]
        closure: Option<Closure>,
    },
    /// Write the factors F(i -> j) as a table
    Export {
        /// Matrix file, or all files of one computed in shards
        #[arg(required = true)]
        matrix: Vec<PathBuf>,
        /// Mesh it was computed for
        #[arg(long, value_name = "FILE")]
        mesh: PathBuf,
        /// Sum over elements, faces of the scene, or groups
        #[arg(long, value_enum)]
        by: By,
        /// Table to write; its ending says the format: .csv, .npy, .npz, .mtx, .rmx or .vf
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Format, whatever the ending
        #[arg(long, value_enum)]
        format: Option<Format>,
    },
    /// Make a matrix file of factors F(i -> j) that another program computed, and say what is wrong with them
    Import {
        /// Table to read: numpy (.npy), scipy (.npz), MatrixMarket, Radiance, View3D or CSV, told by what is in it
        table: PathBuf,
        /// Mesh the factors belong to
        #[arg(long, value_name = "FILE")]
        mesh: PathBuf,
        /// Matrix file to write
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        #[command(flatten)]
        wishes: import::Wishes,
    },
    /// Draw the matrix in cluster order with its blocks; or, with --row, paint what an element sees onto the scene
    Picture {
        /// Matrix file, or all files of one computed in shards
        #[arg(required = true)]
        matrix: Vec<PathBuf>,
        /// Picture to write (.png); with --row also .ply, .vtu, .glb, .obj or .rad
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
        /// Paint how well every element sees element I, from 1
        #[arg(long, value_name = "I", requires = "mesh")]
        row: Option<u32>,
        /// Mesh of the matrix
        #[arg(long, value_name = "FILE", requires = "row")]
        mesh: Option<PathBuf>,
        /// With --row: direction from the scene to the eye of a .png [default: 1,1,2]
        #[arg(long, value_name = "X,Y,Z", value_parser = picture::row::parse_direction, requires = "row", allow_hyphen_values = true)]
        from: Option<[f64; 3]>,
    },
    /// Show by how much two matrices of one mesh differ
    Compare {
        /// Matrix file
        first: PathBuf,
        /// Matrix file to compare it with
        second: PathBuf,
        /// The mesh of both, to name face and group of the worst places
        #[arg(long, value_name = "FILE")]
        mesh: Option<PathBuf>,
        /// The same as JSON
        #[arg(long)]
        json: bool,
        /// Fail (exit 1) where the sum over j of |dF_ij| is above this in some row
        #[arg(long, value_name = "E", value_parser = not_negative)]
        max: Option<f64>,
    },
    /// Write manual pages and completions below a folder such as /usr/local
    #[command(hide = true)]
    Pages {
        /// Folder
        prefix: PathBuf,
    },
    /// Describe a matrix file on one page
    Info {
        /// Matrix file, one shard, or all files of one computed in shards
        #[arg(required = true)]
        file: Vec<PathBuf>,
        /// The same as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        look: LookFlags,
        /// Read all of the file and check it; without, the entries are only mapped
        #[arg(long)]
        verify: bool,
        /// Mesh of the matrix, to name faces and groups
        #[arg(long, value_name = "FILE")]
        mesh: Option<PathBuf>,
    },
}

/// Which numbers are looked at.
#[derive(Debug, Args)]
#[group(multiple = false)]
struct LookFlags {
    /// The factors of element I, from 1
    #[arg(long, value_name = "I")]
    row: Option<u32>,
    /// The factors between elements I and J
    #[arg(long, value_names = ["I", "J"], num_args = 2)]
    pair: Option<Vec<u32>>,
    /// The factors between two groups
    #[arg(long, value_names = ["A", "B"], num_args = 2, requires = "mesh")]
    group: Option<Vec<String>>,
}

impl LookFlags {
    fn look(self) -> Option<Look> {
        let row = self.row.map(Look::Row);
        let pair = self.pair.and_then(|pair| Some(Look::Pair(*pair.first()?, *pair.get(1)?)));
        let group = self.group.and_then(|names| <[String; 2]>::try_from(names).ok());
        row.or(pair).or(group.map(|[a, b]| Look::Groups(a, b)))
    }
}

fn run(cli: Cli) -> anyhow::Result<Finish> {
    match cli.command {
        Command::Compute { mesh, output, tolerance, method, reuse, no_skip, storage } => {
            let method = method.choice().map_err(anyhow::Error::msg)?;
            let request = compute::Request { mesh, output, tolerance, method, reuse, no_skip, storage };
            return compute::run(&request, &cli.common);
        }
        Command::Merge { shards, output, closure } => {
            return merge::run(&merge::Request { shards, output, closure }, &cli.common);
        }
        Command::Export { matrix, mesh, by, output, format } => {
            export::run(&matrix, &mesh, by, format, &output)?;
        }
        Command::Import { table, mesh, output, wishes } => {
            return import::run(&import::Request { table, mesh, output, wishes });
        }
        Command::Picture { matrix, output, row, mesh, from } => match row.zip(mesh.as_deref()) {
            None => picture::matrix::draw(&matrix, &output)?,
            Some((element, mesh)) => {
                let from = from.unwrap_or(picture::row::FROM);
                picture::row::draw(&matrix, &picture::row::Request { mesh, element, from }, &output)?;
            }
        },
        Command::Compare { first, second, mesh, json, max } => {
            let difference = compare::Difference::between(&first, &second, mesh.as_deref())?;
            print_data(&difference.describe(json)?)?;
            difference.check(max)?;
        }
        Command::Pages { prefix } => pages::write(Cli::command(), &prefix)?,
        Command::Info { file, json, look, verify, mesh } => print_data(&match look.look() {
            Some(look) => look::describe(&file, mesh.as_deref(), &look, json, verify)?,
            None => info::describe(&file, json, verify)?,
        })?,
    }
    Ok(Finish::Done)
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    if let Command::Compute { method, .. } = &cli.command
        && let Err(message) = method.choice()
    {
        Cli::command().error(ErrorKind::ArgumentConflict, message).exit();
    }
    cli.common.start();
    exit_code("formfactor-tool", run(cli))
}
