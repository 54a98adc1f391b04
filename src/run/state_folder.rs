//! What outlives a run: the states of processes, and the folder in which a user's programs store their data.

use std::path::{Path, PathBuf};

use store::{InUse, Loaded, Store, Trouble};

use crate::service::Service;

/// The owner of what the ground stores about all vehicles.
pub const FLEET: &str = "the fleet";

/// Opens the state of the process `name` of `owner`, a vehicle or the fleet, in `folder`, for states of this `format`. If the process `has_run` before, a state that is
/// not there was lost; otherwise there has been none.
///
/// # Errors
/// If another process has it open.
pub fn open(folder: &Path, name: &str, owner: &str, format: u32, has_run: bool) -> Result<(Store, Loaded), InUse> {
    let (store, loaded) = Store::open(folder, name, owner, format)?;
    let gone = || Loaded::Unusable(Trouble::Gone { folder: folder.to_owned(), name: name.to_owned() });
    Ok((store, if loaded == Loaded::Nothing && has_run { gone() } else { loaded }))
}

/// Whether no process of another run has its state for `vehicle` in `folder` open now.
///
/// # Errors
/// The first one that is open.
pub fn check_free(folder: &Path, vehicle: &str) -> Result<(), InUse> {
    let states = [(Service::Mcm, vehicle), (Service::ControlTower, FLEET)];
    states.into_iter().try_for_each(|(service, owner)| Store::check_free(folder, service.name(), owner))
}

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
    fn a_state_that_is_gone_is_no_first_start() {
        #[track_caller]
        fn check(is_saved: bool, has_run: bool, expected: &str) {
            let folder = tempfile::tempdir().unwrap();
            if is_saved {
                open(folder.path(), "mcm", "uav1", 1, false).unwrap().0.save(b"{}").unwrap();
            }
            let told = match open(folder.path(), "mcm", "uav1", 1, has_run).unwrap().1 {
                Loaded::Nothing => "nothing".to_owned(),
                Loaded::Unusable(trouble) => trouble.to_string().replace(folder.path().to_str().unwrap(), "FOLDER"),
                Loaded::Newest(_) | Loaded::Behind(..) => "a state".to_owned(),
            };
            assert_eq!(told, expected);
        }
        check(false, false, "nothing");
        check(false, true, "FOLDER has no state of `mcm`, which has run before");
        check(true, false, "a state");
        check(true, true, "a state");
    }

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
