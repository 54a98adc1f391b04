//! What the mission manager and the planner were given, and what they decided: recorded, kept in a file, and given to the same nodes
//! again.
//!
//! A recording holds the files that were flown, so that it needs nothing else; every event with its time; and every decision, call and
//! answer as it was. A node reads no clock and no file, so the same events give the same decisions, unless the program has changed:
//! that is what a replay finds.

mod bytes;
mod content;
pub mod file;
mod recorded;
pub mod replay;

use std::path::Path;

use domain::declared_skill::DeclaredSkills;
use domain::file::{Mistakes, Source};

pub use content::{Entry, Header, Input};
pub use recorded::{Recorded, Sink, Tape};

/// The names of the tree files.
pub fn trees() -> impl Iterator<Item = &'static str> {
    ["mission.xml", "step.xml", "actions.xml"].into_iter()
}

/// The files of the declared skills in this folder, by their names in a recording.
///
/// # Errors
/// If one cannot be read.
pub fn skills(folder: &Path) -> Result<Vec<(String, String)>, Mistakes> {
    let named = |it: Source| (format!("skills/{}", it.path.file_name().unwrap_or_default().to_string_lossy()), it.text);
    Ok(DeclaredSkills::sources(folder)?.into_iter().map(named).collect())
}

/// The nodes that are recorded.
pub const RECORDED: [&str; 2] = ["mcm", "planner"];
