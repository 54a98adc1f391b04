//! `kittiwake kpi`: starts the program that measures, `kittiwake-kpi`, which is not part of what flies.

use std::io::ErrorKind;
use std::os::unix::process::CommandExt;
use std::process::Command;

use crate::cli::KpiArgs;
use crate::outcome::Outcome;
use crate::output;

/// The program that measures; it lies beside this one.
const PROGRAM: &str = "kittiwake-kpi";

/// Becomes `kittiwake-kpi` with the given arguments. Returns only if that is not possible.
pub(crate) fn kpi(args: &KpiArgs) -> Outcome {
    let own = match std::env::current_exe() {
        Ok(own) => own,
        Err(cause) => {
            output::error_line(format_args!("kpi: the path of this program is unknown: {cause}"));
            return Outcome::Unavailable;
        }
    };
    let program = own.with_file_name(PROGRAM);
    let cause = Command::new(&program).args(&args.args).exec();
    let profile = if cfg!(debug_assertions) { "" } else { " --release" };
    match cause.kind() {
        ErrorKind::NotFound => output::error_line(format_args!(
            "kpi: {} is missing: build it with `cargo build{profile} -p {PROGRAM}`, or copy it there",
            program.display()
        )),
        _ => output::error_line(format_args!("kpi: {} cannot be started: {cause}", program.display())),
    }
    Outcome::Unavailable
}
