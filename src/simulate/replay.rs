//! `kittiwake replay`: gives the mission manager and the planner of a recording the same again, and compares what they decide.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use simulation::recording::file::Writer;
use simulation::recording::replay::{self, Replayed};
use simulation::recording::{Entry, Header};

use super::args::ReplayArgs;
use crate::outcome::Outcome;
use crate::output;

/// Replays a file, and prints the first decision that is another one.
pub fn replay(args: &ReplayArgs) -> Outcome {
    match replay::replay(&args.file) {
        Err(refusal) => {
            output::error_line(refusal);
            Outcome::BadInput
        }
        Ok(Replayed { same, difference: None }) => {
            output::line(format_args!("{}: {same} decisions, calls and answers, all the same", args.file.display()));
            Outcome::Success
        }
        Ok(Replayed { same, difference: Some(difference) }) => {
            output::line(format_args!(
                "{}: {same} decisions, calls and answers the same, then\n{difference}",
                args.file.display()
            ));
            Outcome::Breached
        }
    }
}

/// Writes a recording.
pub(super) fn write(path: &Path, header: &Header, entries: &[Entry]) -> io::Result<()> {
    let mut writer = Writer::begin(BufWriter::new(regular_file::create(path)?), header)?;
    entries.iter().try_for_each(|it| writer.write(it))?;
    writer.end()?.flush()
}
