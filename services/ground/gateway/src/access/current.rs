//! The tokens that are valid now: those of the file of the gateway's start, until it is changed to others.
//!
//! A token that was lost has to be revoked at once, and not after the flight. A file that cannot be used revokes nothing: a typing
//! error must not leave an aircraft without its operators.

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use domain::file::Source;

use crate::access::{Tokens, source};

/// How often to look. A change counts when it is seen a second time.
pub(crate) const LOOK_PERIOD: Duration = Duration::from_millis(500);

/// The valid tokens, shared by every request.
#[derive(Debug)]
pub(crate) struct CurrentTokens(Mutex<State>);

/// What a look finds: the text of the file, or why it cannot be read, in one line.
type Seen = Result<String, String>;

#[derive(Debug)]
struct State {
    tokens: Arc<Tokens>,
    /// What was seen last, and what of that was acted on last.
    newest: Seen,
    settled: Seen,
    /// Why the file of now is not used.
    problem: Option<String>,
}

impl CurrentTokens {
    /// Begins with `tokens`, and follows the file that they were read from.
    pub(crate) fn new(tokens: Tokens) -> CurrentTokens {
        tokens.keep_copy();
        let seen = Ok(tokens.read_from.as_ref().map(|it| it.text.clone()).unwrap_or_default());
        let (newest, settled) = (seen.clone(), seen);
        CurrentTokens(Mutex::new(State { tokens: Arc::new(tokens), newest, settled, problem: None }))
    }

    /// Those that are valid now.
    pub(crate) fn get(&self) -> Arc<Tokens> {
        self.lock().tokens.clone()
    }

    /// Why the file of now is not used.
    pub(crate) fn problem(&self) -> Option<String> {
        self.lock().problem.clone()
    }

    /// Reads the file again. What is seen once may be a part of what somebody is writing, so it counts when it is seen twice.
    pub(crate) fn look(&self) {
        let valid = self.get();
        let Some(path) = valid.read_from.as_ref().map(|it| it.path.clone()) else { return };
        let read = source(&path);
        let seen: Seen = read.as_ref().map(|it| it.text.clone()).map_err(first_line);
        {
            let mut state = self.lock();
            let is_settled = seen == state.newest;
            state.newest = seen.clone();
            if !is_settled || seen == state.settled {
                return;
            }
            state.settled = seen;
        }
        let found = match read {
            Ok(source) => usable(source),
            Err(refusal) => Err(first_line(&refusal)),
        };
        let mut state = self.lock();
        match found {
            Ok(tokens) => {
                tracing::info!(
                    "{}: was changed; its {} tokens are valid from now on",
                    path.display(),
                    tokens.all.len()
                );
                let tokens = Tokens { copy: valid.copy.clone(), ..tokens };
                tokens.keep_copy();
                (state.tokens, state.problem) = (Arc::new(tokens), None);
            }
            Err(why) => {
                let problem = format!("{why}; the tokens of before stay valid");
                tracing::warn!("{problem}");
                state.problem = Some(format!("gateway: {problem}"));
            }
        }
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// The tokens in it, if there are any: an empty file is one that somebody is about to write.
pub(crate) fn usable(source: Source) -> Result<Tokens, String> {
    let tokens = Tokens::parse(&source).map_err(|it| first_line(&it))?;
    if tokens.all.is_empty() {
        return Err(format!("{}: there is no token in it", source.path.display()));
    }
    Ok(Tokens { read_from: Some(source), ..tokens })
}

/// Of a mistake the line that says where and what; the lines after it show the text.
pub(crate) fn first_line(refusal: &impl ToString) -> String {
    refusal.to_string().lines().next().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::{Role, entry};
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;

    fn write(path: &Path, text: &str) {
        std::fs::write(path, text).unwrap();
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
    }

    fn of(token: &str) -> String {
        entry("anna", &[Role::Operator], token)
    }

    /// Changes a file that has the token `old`; `valid` is the one that is valid afterwards, and `said` the problem.
    #[track_caller]
    fn check(change: impl FnOnce(&Path), valid: &str, said: Option<&str>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        write(&path, &of("old"));
        let current = CurrentTokens::new(Tokens::read(&path).unwrap());
        let anna = current.get().identify("old", 0).unwrap().clone();
        change(&path);
        current.look();
        assert!(current.get().still_has(&anna, 0), "what is seen once may be half written");
        assert_eq!(current.problem(), None);
        for _ in 0..2 {
            current.look();
            let is_valid = |token| current.get().identify(token, 0).is_some();
            assert_eq!((is_valid("old"), is_valid("new")), (valid == "old", valid == "new"));
            assert_eq!(current.get().still_has(&anna, 0), valid == "old");
            let expected = said.map(|it| format!("gateway: {}{it}; the tokens of before stay valid", path.display()));
            assert_eq!(current.problem(), expected);
        }
        // Whatever was in its place: a usable file is used.
        let _ = std::fs::remove_dir(&path);
        write(&path, &of("newest"));
        current.look();
        current.look();
        assert!(current.get().identify("newest", 0).is_some());
        assert_eq!((current.get().still_has(&anna, 0), current.problem()), (false, None));
    }

    #[test]
    fn a_changed_file_is_used_and_one_that_cannot_be_takes_nothing_away() {
        check(|_| (), "old", None);
        check(|path| write(path, &of("new")), "new", None);
        check(|path| write(path, &format!("{}# the same tokens\n", of("old"))), "old", None);
        check(
            |path| {
                let beside = path.with_extension("1");
                write(&beside, &of("new"));
                std::fs::rename(beside, path).unwrap();
            },
            "new",
            None,
        );
        check(|path| write(path, ""), "old", Some(": there is no token in it"));
        check(
            |path| write(path, "[[token]]\nname = 3\n"),
            "old",
            Some(":2:8: invalid type: integer `3`, expected a string"),
        );
        check(|path| std::fs::remove_file(path).unwrap(), "old", Some(": No such file or directory (os error 2)"));
        check(
            |path| {
                std::fs::remove_file(path).unwrap();
                std::fs::DirBuilder::new().create(path).unwrap();
                std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o700)).unwrap();
            },
            "old",
            Some(": it is a folder, not a regular file"),
        );
        check(
            |path| std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o644)).unwrap(),
            "old",
            Some(": its mode is 0644; only its owner may have access (chmod 600)"),
        );
    }

    #[test]
    fn tokens_of_no_file_stay() {
        let source = Source { path: "tokens.toml".into(), text: of("old") };
        let current = CurrentTokens::new(Tokens::parse(&source).unwrap());
        current.look();
        current.look();
        assert!(current.get().identify("old", 0).is_some());
    }
}
