//! `shade-tool`: see `shade-tool --help`.

use clap::Parser;
use shade_tool::command_line::Arguments;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if let Err(usage) = arguments.check() {
        usage.exit();
    }
    arguments.common.start();
    interchange::tool::exit_code(shade_tool::TOOL, arguments.run())
}
