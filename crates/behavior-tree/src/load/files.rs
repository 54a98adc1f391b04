//! The references between tree files: includes, and the main tree.

use std::collections::BTreeSet;

use super::mistake::Mistake;
use super::mistakes::Mistakes;
use super::parse::Contents;

/// Checks that every included file is among those loaded.
pub(crate) fn check_includes(contents: &[Contents<'_>], mistakes: &mut Mistakes) {
    for include in contents.iter().flat_map(|file| &file.includes) {
        let Some(path) = include.find("path") else {
            mistakes.add(include.at(), Mistake::MissingAttribute { tag: include.tag().to_owned(), attribute: "path" });
            continue;
        };
        let wanted = path.value.trim_start_matches("./");
        let is_loaded = mistakes.files().any(|name| name == wanted || name.ends_with(&format!("/{wanted}")));
        if !is_loaded {
            let nearest = mistakes.nearest(wanted, mistakes.files());
            mistakes.add(path.at, Mistake::UnknownInclude { path: path.value.to_owned(), nearest });
        }
    }
}

/// The main tree: the one that the first file with a main tree names, or else the only tree.
pub(crate) fn main_tree(contents: &[Contents<'_>], mistakes: &mut Mistakes) -> Option<String> {
    let trees = contents.iter().flat_map(|file| &file.trees);
    let known: BTreeSet<&str> = trees.filter_map(|tree| tree.get("ID")).collect();
    let mut named = contents.iter().filter_map(|file| file.main_tree).peekable();
    let first = named.peek().map(|main| main.value.to_owned());
    for main in named.filter(|main| !known.contains(main.value)) {
        let nearest = mistakes.nearest(main.value, known.iter().copied());
        mistakes.add(main.at, Mistake::UnknownTree { id: main.value.to_owned(), nearest });
    }
    let only = known.first().filter(|_| known.len() == 1).map(|id| (*id).to_owned());
    first.or(only)
}
