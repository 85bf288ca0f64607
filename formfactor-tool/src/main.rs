//! Command line of the form-factor stage.

use clap::{Parser, Subcommand, ValueEnum};
use formfactor_tool::skips::Skip;
use formfactor_tool::{compute, export, info};
use interchange::grouping::By;
use interchange::tool::{Common, EXIT_CODES, Finish, exit_code, print_data};
use std::path::PathBuf;
use std::process::ExitCode;

/// Exchange matrix S = diag(A) F of a mesh, occlusion included
#[derive(Debug, Parser)]
#[command(name = "formfactor-tool", version, after_help = EXIT_CODES)]
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
        /// Method: auto takes the cheapest exact or adaptive rule per pair
        #[arg(long, value_enum, default_value = "auto")]
        method: Method,
        /// Do this work even where it is provably not needed
        #[arg(long, value_enum, value_name = "NAME", value_delimiter = ',')]
        no_skip: Vec<Skip>,
    },
    /// Write the factors F(i -> j) as a table
    Export {
        /// Matrix file
        matrix: PathBuf,
        /// Mesh it was computed for
        #[arg(long, value_name = "FILE")]
        mesh: PathBuf,
        /// Sum over elements, faces of the scene, or groups
        #[arg(long, value_enum)]
        by: By,
        /// Table to write: .csv, .npy or .mtx
        #[arg(short, long, value_name = "FILE")]
        output: PathBuf,
    },
    /// Describe a matrix file on one page
    Info {
        /// Matrix file
        file: PathBuf,
        /// The same as JSON
        #[arg(long)]
        json: bool,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Method {
    Auto,
}

fn run(cli: Cli) -> anyhow::Result<Finish> {
    match cli.command {
        Command::Compute { mesh, output, tolerance, method: Method::Auto, no_skip } => {
            return compute::run(&compute::Request { mesh, output, tolerance, no_skip }, &cli.common);
        }
        Command::Export { matrix, mesh, by, output } => export::run(&matrix, &mesh, by, &output)?,
        Command::Info { file, json } => print_data(&info::describe(&file, json)?)?,
    }
    Ok(Finish::Done)
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    cli.common.start();
    exit_code("formfactor-tool", run(cli))
}
