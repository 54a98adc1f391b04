//! What a person has decided to leave out of an import (`--leave-out ITEM`).

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use domain::file::Mistake;

/// Items by their places, as mistakes print them, or zones and sites by their names; and which of them a file has.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LeaveOut {
    items: Vec<String>,
    found: BTreeSet<String>,
}

impl LeaveOut {
    /// To leave these out. One that several files have is written with the path of its file and a colon before it.
    pub fn new(items: &[String]) -> LeaveOut {
        LeaveOut { items: items.to_vec(), found: BTreeSet::new() }
    }

    /// Whether what is at `place` in the file at `path`, or has this name, is to be left out.
    pub(crate) fn covers(&mut self, path: &Path, place: &str, name: &str) -> bool {
        let prefix = format!("{}:", path.display());
        let covers = |item: &String| {
            let item = item.strip_prefix(&prefix).unwrap_or(item).trim_start();
            // An item covers its parts: `/items/1` is not a part of `/items/10`, nor is line 10 of line 1.
            let is_part = place.strip_prefix(item).is_some_and(|it| it.is_empty() || it.starts_with(['/', ' ']));
            !item.is_empty() && (is_part || item == name)
        };
        let Some(item) = self.items.iter().find(|it| covers(it)) else { return false };
        self.found.insert(item.clone());
        true
    }
}

/// What was asked for and is in none of the files, or in several of them.
pub(crate) fn unmatched<'a>(files: impl Iterator<Item = (&'a Path, LeaveOut)>) -> Vec<Mistake> {
    let mut found: BTreeMap<String, Vec<&Path>> = BTreeMap::new();
    let mut first = None;
    for (path, leave_out) in files {
        first.get_or_insert(path);
        for item in leave_out.items {
            let paths = found.entry(item.clone()).or_default();
            paths.extend(leave_out.found.contains(&item).then_some(path));
        }
    }
    let mistake = |(item, paths): (String, Vec<&Path>)| match paths.as_slice() {
        [_] => None,
        [] => Some(Mistake {
            path: first?.to_owned(),
            place: None,
            message: format!("--leave-out {item}: there is no such item"),
            help: "give a place as a mistake or a note prints it, such as /mission/items/3 or \"line 7\", or a name"
                .into(),
        }),
        [one, .., other] => Some(Mistake {
            path: (*other).to_owned(),
            place: None,
            message: format!("--leave-out {item}: it is in {} as well", one.display()),
            help: format!("say which one: --leave-out \"{}:{item}\"", other.display()),
        }),
    };
    found.into_iter().filter_map(mistake).collect()
}
