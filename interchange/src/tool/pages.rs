//! Manual pages and completions, made from the same definition as `--help`.

use crate::atomic_write;
use crate::error::{Error, Result};
use clap_complete::aot::{Shell, generate};
use std::path::Path;

/// Where each shell looks for completions below a prefix; `{}` is the program.
const COMPLETIONS: [(Shell, &str); 3] = [
    (Shell::Bash, "share/bash-completion/completions/{}"),
    (Shell::Zsh, "share/zsh/site-functions/_{}"),
    (Shell::Fish, "share/fish/vendor_completions.d/{}.fish"),
];
/// Where manual pages of programs lie.
const MANUAL: &str = "share/man/man1";

/// Writes a page for the program and one for each of its subcommands and theirs, and completions for bash, zsh and fish, below
/// `prefix`.
///
/// # Errors
/// A folder cannot be made or a file cannot be written.
pub fn write(command: clap::Command, prefix: &Path) -> Result<()> {
    let name = command.get_name().to_owned();
    for (shell, place) in COMPLETIONS {
        let mut text = Vec::new();
        generate(shell, &mut command.clone(), &name, &mut text);
        if shell == Shell::Bash {
            text = with_one_spelling(&String::from_utf8_lossy(&text), &name).into_bytes();
        }
        write_below(prefix, &place.replace("{}", &name), &text)?;
    }
    let mut command = command.disable_help_subcommand(true);
    command.build();
    write_pages(&command, prefix)
}

/// Completions for bash in which every state has one spelling. clap_complete (4.6, its issue 6421) spells a hyphen in a program's name
/// one way where it finds out which subcommand is meant, and the other way where it looks up the flags of that, so that
/// programs with a hyphen complete nothing behind a subcommand.
fn with_one_spelling(text: &str, program: &str) -> String {
    text.replace(&program.replace('-', "__subcmd__"), &program.replace('-', "__"))
}

/// Pages of a command and of those below it.
fn write_pages(command: &clap::Command, prefix: &Path) -> Result<()> {
    let page = clap_mangen::Man::new(command.clone());
    let mut text = Vec::new();
    let file = format!("{MANUAL}/{}", page.get_filename());
    page.render(&mut text).map_err(|e| Error::io(&prefix.join(&file), "write", e))?;
    write_below(prefix, &file, &text)?;
    let mut below = command.get_subcommands().filter(|subcommand| !subcommand.is_hide_set());
    below.try_for_each(|subcommand| write_pages(subcommand, prefix))
}

fn write_below(prefix: &Path, file: &str, text: &[u8]) -> Result<()> {
    let path = prefix.join(file);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, "create", e))?;
    }
    atomic_write::write_bytes(&path, text).map(|_| ())
}
