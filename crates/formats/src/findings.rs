//! What a reader has to say about a file: what has no counterpart and what was repaired, and what is wrong.

use std::path::{Path, PathBuf};

use domain::file::{Mistake, Mistakes};

use crate::leave_out::LeaveOut;
use crate::mission_file::one_line;

/// The most notes about one file, and the most [loud](Findings::loud) ones: a file that needs more has another format.
const MOST: usize = 10_000;
/// The most mistakes of one file that are reported together.
const MOST_MISTAKES: usize = 100;
/// The longest place or text, in characters; both may repeat what stands in the file.
const LONGEST: usize = 300;

/// Something that was read differently from how it stands there, or not at all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Note {
    /// The file.
    pub path: PathBuf,
    /// The place in it: a JSON pointer (RFC 6901), or a line.
    pub place: String,
    /// What is there, and its result.
    pub text: String,
    /// How much it matters.
    pub weight: Weight,
}

/// How much a note matters; what matters most comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Weight {
    /// Left out as a person has asked.
    LeftOut,
    /// Read as something that bars more.
    NotUnderstood,
    /// Kept in the mission, and not flown yet.
    ForLater,
    /// Read differently from how it stands there, or left out.
    Changed,
    /// Nothing that a flight knows of.
    Furniture,
}

/// Why nothing is written, and what was found besides.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refused {
    /// At least one.
    pub mistakes: Mistakes,
    /// What to tell all the same.
    pub notes: Vec<Note>,
}

impl From<Mistakes> for Refused {
    fn from(mistakes: Mistakes) -> Refused {
        Refused { mistakes, notes: Vec::new() }
    }
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.mistakes.fmt(f)
    }
}

impl std::error::Error for Refused {}

/// What cannot be read, so that nothing is written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wrong {
    pub(crate) place: String,
    pub(crate) message: String,
    pub(crate) help: &'static str,
}

impl Wrong {
    pub(crate) fn at(place: impl Into<String>, message: impl Into<String>, help: &'static str) -> Wrong {
        Wrong { place: place.into(), message: message.into(), help }
    }
}

/// Collects them for one file.
#[derive(Debug)]
pub(crate) struct Findings {
    path: PathBuf,
    notes: Vec<Note>,
    /// How many of them are loud.
    loud: usize,
    mistakes: Vec<Mistake>,
    leave_out: LeaveOut,
}

impl Findings {
    pub(crate) fn about(path: &Path) -> Findings {
        let leave_out = LeaveOut::default();
        Findings { path: path.to_owned(), notes: Vec::new(), loud: 0, mistakes: Vec::new(), leave_out }
    }

    /// The same, without what a person has decided to leave out.
    pub(crate) fn leaving_out(self, leave_out: LeaveOut) -> Findings {
        Findings { leave_out, ..self }
    }

    /// Which items are left out, and which were found.
    pub(crate) fn leave_out(&self) -> &LeaveOut {
        &self.leave_out
    }

    /// Whether what is at this place, or has this name, is left out; then that is noted, and it must not be read.
    pub(crate) fn leaves_out(&mut self, place: &str, name: &str) -> bool {
        let is_left_out = self.leave_out.covers(&self.path, place, name);
        if is_left_out {
            self.say(Weight::LeftOut, place, "left out as asked");
        }
        is_left_out
    }

    pub(crate) fn note(&mut self, place: &str, text: impl Into<String>) {
        self.say(Weight::Changed, place, text);
    }

    pub(crate) fn say(&mut self, weight: Weight, place: &str, text: impl Into<String>) {
        match self.notes.len() - self.loud {
            MOST => {
                let text = format!("there are more than {MOST} notes: the others are not listed");
                self.push_note(Weight::Changed, "", text);
            }
            count if count < MOST => self.push_note(weight, place, text.into()),
            _ => {}
        }
    }

    /// What was not understood: all the other notes leave room for it.
    pub(crate) fn loud(&mut self, place: &str, text: &str) {
        if self.loud <= MOST {
            let is_last = self.loud == MOST;
            let text =
                if is_last { format!("more than {MOST} things: the others are not listed") } else { text.to_owned() };
            self.loud += 1;
            let place = if is_last { "" } else { place };
            self.push_note(Weight::NotUnderstood, place, format!("NOT UNDERSTOOD: {text}"));
        }
    }

    fn push_note(&mut self, weight: Weight, place: &str, text: String) {
        let place = one_line(place, LONGEST);
        self.notes.push(Note { path: self.path.clone(), place, text: one_line(&text, LONGEST), weight });
    }

    /// Whether something was left out as asked so far.
    pub(crate) fn has_left_out(&self) -> bool {
        self.notes.iter().any(|it| it.weight == Weight::LeftOut)
    }

    /// Whether something was wrong so far.
    pub(crate) fn has_mistakes(&self) -> bool {
        !self.mistakes.is_empty()
    }

    /// A mistake, or a note if it is left out. The line itself is not shown: in files that programs write it may have megabytes.
    pub(crate) fn wrong(&mut self, wrong: Wrong) {
        if self.leave_out.covers(&self.path, &wrong.place, "") {
            self.say(Weight::LeftOut, &wrong.place, format!("left out as asked: {}", wrong.message));
            return;
        }
        let help = match wrong.help {
            // Once is enough.
            "" if !wrong.place.is_empty() && self.mistakes.is_empty() => {
                format!("correct it, or leave it out: --leave-out \"{}\"", one_line(&wrong.place, LONGEST))
            }
            help => help.into(),
        };
        let message =
            if wrong.place.is_empty() { wrong.message } else { format!("{}: {}", wrong.place, wrong.message) };
        if self.mistakes.len() < MOST_MISTAKES {
            let (path, message) = (self.path.clone(), one_line(&message, LONGEST));
            self.mistakes.push(Mistake { path, place: None, message, help });
        }
    }

    /// The value, or `None` after its mistake is recorded.
    pub(crate) fn unless_wrong<T>(&mut self, result: Result<T, Wrong>) -> Option<T> {
        result.map_err(|wrong| self.wrong(wrong)).ok()
    }

    /// The notes of a writer, for which nothing is wrong.
    pub(crate) fn into_notes(self) -> Vec<Note> {
        self.notes
    }

    /// `value` and the notes, if nothing is wrong.
    pub(crate) fn with<T>(self, value: T) -> Result<(T, Vec<Note>), Refused> {
        if self.mistakes.is_empty() {
            return Ok((value, self.notes));
        }
        Err(Refused { mistakes: Mistakes(self.mistakes), notes: self.notes })
    }
}
