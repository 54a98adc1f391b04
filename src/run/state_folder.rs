//! The folder in which a user's programs store what outlives a run.

use std::path::{Path, PathBuf};

/// The folder of recorded missions; `None` if the environment does not name one.
pub fn recordings() -> Option<PathBuf> {
    let variable = |name| std::env::var_os(name).map(PathBuf::from);
    choose(variable("XDG_STATE_HOME"), variable("HOME"))
}

/// By the XDG base directory specification: a path that is not absolute is ignored.
fn choose(state: Option<PathBuf>, home: Option<PathBuf>) -> Option<PathBuf> {
    let absolute = |it: &PathBuf| it.is_absolute();
    let state = state.filter(absolute).or_else(|| Some(home.filter(absolute)?.join(".local/state")))?;
    Some(state.join(Path::new("kittiwake/recordings")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_where_there_is_one() {
        #[track_caller]
        fn check(state: Option<&str>, home: Option<&str>, expected: Option<&str>) {
            assert_eq!(choose(state.map(PathBuf::from), home.map(PathBuf::from)), expected.map(PathBuf::from));
        }
        check(Some("/s"), Some("/h"), Some("/s/kittiwake/recordings"));
        check(Some("s"), Some("/h"), Some("/h/.local/state/kittiwake/recordings"));
        check(None, Some("/h"), Some("/h/.local/state/kittiwake/recordings"));
        check(None, Some(""), None);
        check(None, None, None);
    }
}
