//! The mistakes found so far.

use std::collections::HashSet;

use super::mistake::{LoadError, LoadErrors, Mistake};
use super::nearest::nearest;
use crate::xml::element::Place;

/// More mistakes than this are only counted.
const MAX_MISTAKES: usize = 100;

/// Collects mistakes while files are loaded.
pub(crate) struct Mistakes {
    /// Name and text of every file.
    files: Vec<(String, String)>,
    found: Vec<(Where, Mistake)>,
    seen: HashSet<(Where, Mistake)>,
    left_out: usize,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Where {
    Place(Place),
    Line { file: u32, line: u32, column: u32 },
}

impl Mistakes {
    pub(crate) fn new(files: Vec<(String, String)>) -> Self {
        Mistakes { files, found: Vec::new(), seen: HashSet::new(), left_out: 0 }
    }

    /// A subtree is checked in every place where it is used; each mistake counts once.
    pub(crate) fn add(&mut self, at: Place, mistake: Mistake) {
        self.insert(Where::Place(at), mistake);
    }

    pub(crate) fn add_at_line(&mut self, file: u32, line: u32, column: u32, mistake: Mistake) {
        self.insert(Where::Line { file, line, column }, mistake);
    }

    /// The known name most like `name`. None once nobody is told any more: a file with a thousand wrong names must not take
    /// a thousand searches.
    pub(crate) fn nearest<'k>(&self, name: &str, known: impl IntoIterator<Item = &'k str>) -> Option<String> {
        if self.is_full() { None } else { nearest(name, known) }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    pub(crate) fn count(&self) -> usize {
        self.found.len() + self.left_out
    }

    pub(crate) fn files(&self) -> &[(String, String)] {
        &self.files
    }

    /// `file:line:column` of a place.
    pub(crate) fn describe(&self, at: Place) -> String {
        if self.is_full() {
            return String::new();
        }
        let (file, line, column) = self.locate(Where::Place(at));
        format!("{file}:{line}:{column}")
    }

    pub(crate) fn into_errors(mut self) -> LoadErrors {
        let found = std::mem::take(&mut self.found);
        let mut errors: Vec<(u32, LoadError)> = found
            .into_iter()
            .map(|(at, mistake)| {
                let number = match at {
                    Where::Place(place) => place.file,
                    Where::Line { file, .. } => file,
                };
                let (file, line, column) = self.locate(at);
                (number, LoadError { file, line, column, mistake })
            })
            .collect();
        errors.sort_by_key(|(file, error)| (*file, error.line, error.column));
        LoadErrors { errors: errors.into_iter().map(|(_, error)| error).collect(), left_out: self.left_out }
    }

    fn is_full(&self) -> bool {
        MAX_MISTAKES <= self.found.len()
    }

    fn insert(&mut self, at: Where, mistake: Mistake) {
        if !self.is_full() {
            if self.seen.insert((at, mistake.clone())) {
                self.found.push((at, mistake));
            }
        } else {
            self.left_out += 1;
        }
    }

    fn locate(&self, at: Where) -> (String, u32, u32) {
        match at {
            Where::Line { file, line, column } => (self.name(file), line, column),
            Where::Place(place) => {
                let text = self.files.get(place.file as usize).map_or("", |(_, text)| text.as_str());
                let before = text.get(..place.offset as usize).unwrap_or("");
                let line = before.matches('\n').count() + 1;
                let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
                (self.name(place.file), line as u32, column as u32)
            }
        }
    }

    fn name(&self, file: u32) -> String {
        self.files.get(file as usize).map_or_else(|| "registry".to_owned(), |(name, _)| name.clone())
    }
}
