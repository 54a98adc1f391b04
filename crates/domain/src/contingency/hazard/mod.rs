//! What can go wrong with a flight, whatever a table says about it, and the answer that it calls for.
//!
//! A table is complete if each of these is answered in each phase by a row whose response fits, within the time that the hazard leaves, or is
//! waived in writing by the table ([`Waiver`]). `simulation/src/proof/hazards.rs` judges that. The list knows no row by its name, but for
//! the flags that the mission manager raises itself.

use std::collections::BTreeSet;

use super::narrowing::Narrows;
use super::snapshot::Field;
use super::{Phase, Severity};

mod list;
pub mod reach;

pub use list::HAZARDS;

/// Something that can go wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hazard {
    /// As a waiver names it.
    pub name: &'static str,
    /// How it shows.
    pub sign: Sign,
    /// The answer must have begun this many mission seconds after the sign is seen.
    pub within_s: f64,
    /// In which phases it calls for which answer; in the others for none.
    pub calls_for: &'static [(&'static [Phase], Answer)],
    /// Where the level, the time and the answer come from.
    pub source: &'static str,
}

/// What shows a hazard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sign {
    /// These fields have these values, a choice by its place in the list of names; all others are as they are while all is well.
    Fields(&'static [(Field, f64)]),
    /// The mission manager raises this flag itself.
    Flag(&'static str),
}

/// What a hazard calls for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Answer {
    /// A flag is up, so that people know and the record has it.
    Told,
    /// This is narrowed, or a row responds.
    Narrowed(Narrows),
    /// A row responds, whose first action has one of these severities.
    Response(&'static [Severity]),
}

/// A hazard that a table leaves without the answer that it calls for, on purpose.
#[derive(Debug, Clone, PartialEq)]
pub struct Waiver {
    /// The hazard.
    pub hazard: &'static Hazard,
    /// The phases in which it is waived.
    pub phases: BTreeSet<Phase>,
    /// Why.
    pub reason: String,
}

impl Hazard {
    /// The one of this name.
    pub fn named(name: &str) -> Option<&'static Hazard> {
        HAZARDS.iter().find(|it| it.name == name)
    }

    /// What it calls for in this phase.
    pub fn calls_for(&self, phase: Phase) -> Option<Answer> {
        self.calls_for.iter().find(|(phases, _)| phases.contains(&phase)).map(|(_, answer)| *answer)
    }
}

/// As users read it: `battery.charge_percent 6.00 %`.
impl std::fmt::Display for Sign {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Sign::Fields(fields) => {
                let words = |(field, value): &(Field, f64)| format!("{} {}", field.name(), field.in_words(*value));
                f.write_str(&fields.iter().map(words).collect::<Vec<_>>().join(", "))
            }
            Sign::Flag(flag) => write!(f, "`{flag}` is raised by the mission manager"),
        }
    }
}

/// As users read it, after "it calls for".
impl std::fmt::Display for Answer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Answer::Told => f.write_str("a flag"),
            Answer::Narrowed(what) => write!(f, "a flag that narrows ({}), or a response", what.name()),
            Answer::Response(severities) => {
                let names: Vec<&str> = severities.iter().map(|it| it.name()).collect();
                write!(f, "a response ({})", names.join(", "))
            }
        }
    }
}
