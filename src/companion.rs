//! `kittiwake kpi` and `kittiwake chaos`: each starts a program of its own, which is not part of what flies.

use std::fmt;
use std::io::ErrorKind;
use std::os::unix::process::CommandExt;
use std::process::Command;

use crate::cli::CompanionArgs;
use crate::outcome::Outcome;
use crate::output;

/// A program that lies beside this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Companion {
    /// Measures.
    Kpi,
    /// Troubles.
    Chaos,
}

impl Companion {
    /// Its executable, and its package.
    fn program(self) -> &'static str {
        match self {
            Companion::Kpi => "kittiwake-kpi",
            Companion::Chaos => "kittiwake-chaos",
        }
    }
}

impl fmt::Display for Companion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Companion::Kpi => "kpi",
            Companion::Chaos => "chaos",
        })
    }
}

/// Becomes that program with the given arguments. Returns only if that is not possible.
pub(crate) fn become_companion(companion: Companion, args: &CompanionArgs) -> Outcome {
    let own = match std::env::current_exe() {
        Ok(own) => own,
        Err(cause) => {
            output::error_line(format_args!("{companion}: the path of this program is unknown: {cause}"));
            return Outcome::Unavailable;
        }
    };
    let name = companion.program();
    let program = own.with_file_name(name);
    let cause = Command::new(&program).args(&args.args).exec();
    let profile = if cfg!(debug_assertions) { "" } else { " --release" };
    match cause.kind() {
        ErrorKind::NotFound => output::error_line(format_args!(
            "{companion}: {} is missing: build it with `cargo build{profile} -p {name}`, or copy it there",
            program.display()
        )),
        _ => output::error_line(format_args!("{companion}: {} cannot be started: {cause}", program.display())),
    }
    Outcome::Unavailable
}
