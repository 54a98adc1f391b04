//! The mistakes found so far.

use std::collections::HashSet;
use std::sync::Arc;

use super::mistake::{LoadError, LoadErrors, Mistake};
use super::nearest::nearest;
use crate::xml::source::Place;

/// More mistakes than this are only counted.
const MAX_MISTAKES: usize = 100;

/// Collects mistakes while files are loaded.
pub(crate) struct Mistakes {
    /// The name and text of every file.
    files: Arc<[(String, String)]>,
    found: Vec<(Position, Mistake)>,
    seen: HashSet<(Position, Mistake)>,
    left_out: usize,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Position {
    Offset(Place),
    Line { file: u32, line: u32, column: u32 },
}

impl Mistakes {
    pub(crate) fn new(files: Arc<[(String, String)]>) -> Self {
        Mistakes { files, found: Vec::new(), seen: HashSet::new(), left_out: 0 }
    }

    /// Adds a mistake. A subtree is checked wherever it is used, and each of its mistakes counts once.
    pub(crate) fn add(&mut self, at: Place, mistake: Mistake) {
        self.insert(Position::Offset(at), mistake);
    }

    /// [`Mistakes::add`], for a parser that counts lines and columns, both from 1.
    pub(super) fn add_at_line(&mut self, file: u32, line: u32, column: u32, mistake: Mistake) {
        self.insert(Position::Line { file, line, column }, mistake);
    }

    /// The known name most similar to `name`. `None` once mistakes are only counted: a file with a thousand wrong names
    /// must not cause a thousand searches.
    pub(super) fn nearest<'k>(&self, name: &str, known: impl IntoIterator<Item = &'k str>) -> Option<String> {
        if self.is_full() { None } else { nearest(name, known) }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    pub(super) fn count(&self) -> usize {
        self.found.len() + self.left_out
    }

    /// The names of the files.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> + Clone {
        self.files.iter().map(|(name, _)| name.as_str())
    }

    /// `file:line:column` of a place.
    pub(super) fn describe(&self, at: Place) -> String {
        if self.is_full() {
            return String::new();
        }
        let (file, line, column) = self.locate(Position::Offset(at));
        format!("{file}:{line}:{column}")
    }

    pub(crate) fn into_errors(mut self) -> LoadErrors {
        let found = std::mem::take(&mut self.found);
        let mut errors: Vec<(u32, LoadError)> = found
            .into_iter()
            .map(|(position, mistake)| {
                let number = match position {
                    Position::Offset(place) => place.file,
                    Position::Line { file, .. } => file,
                };
                let (file, line, column) = self.locate(position);
                (number, LoadError { file, line, column, mistake })
            })
            .collect();
        errors.sort_by_key(|(file, error)| (*file, error.line, error.column));
        LoadErrors { errors: errors.into_iter().map(|(_, error)| error).collect(), left_out: self.left_out }
    }

    fn is_full(&self) -> bool {
        MAX_MISTAKES <= self.found.len()
    }

    fn insert(&mut self, position: Position, mistake: Mistake) {
        if self.is_full() {
            self.left_out += 1;
        } else if self.seen.insert((position, mistake.clone())) {
            self.found.push((position, mistake));
        }
    }

    fn locate(&self, position: Position) -> (String, u32, u32) {
        match position {
            Position::Line { file, line, column } => (self.name(file), line, column),
            Position::Offset(place) => {
                let text = self.files.get(place.file as usize).map_or("", |(_, text)| text.as_str());
                let before = text.get(..place.offset as usize).unwrap_or("");
                let line = before.matches('\n').count() + 1;
                let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
                (self.name(place.file), line as u32, column as u32)
            }
        }
    }

    /// Mistakes of the registry are in no file.
    fn name(&self, file: u32) -> String {
        self.files.get(file as usize).map_or_else(|| "registry".to_owned(), |(name, _)| name.clone())
    }
}
