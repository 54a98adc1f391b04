//! What shells and `man` know of the command line, made of the command line itself.

use std::path::Path;

use clap_complete::Shell;

use crate::cli;
use crate::outcome::Outcome;
use crate::output;

/// Prints the completions of a shell.
pub fn completions(shell: Shell) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut cli::command(), "kittiwake", &mut script);
    output::line(String::from_utf8_lossy(&script).trim_end());
    Outcome::Success
}

/// Writes `kittiwake.1`, and a page for each command, such as `kittiwake-plan.1`.
pub fn write(folder: &Path) -> Outcome {
    match clap_mangen::generate_to(cli::command(), folder) {
        Ok(()) => Outcome::Success,
        Err(error) => {
            output::error_line(format_args!("error: the manual cannot be written to {}: {error}", folder.display()));
            Outcome::BadInput
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(write(folder.path()), Outcome::Success);
        for command in cli::command().get_subcommands() {
            let page = folder.path().join(format!("kittiwake-{}.1", command.get_name()));
            let text = std::fs::read_to_string(&page).unwrap_or_else(|error| panic!("{}: {error}", page.display()));
            assert!(text.contains(".SH SYNOPSIS"), "{text}");
        }
        assert_eq!(write(&folder.path().join("missing")), Outcome::BadInput);
    }
}
