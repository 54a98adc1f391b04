//! The tokens that are valid now: those of the file of the gateway's start, until it is changed to others.
//!
//! A token that was lost has to be revoked at once, and not after the flight. A file that cannot be used revokes nothing: a typing
//! error must not leave an aircraft without its operators.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use domain::file::Source;
use regular_file::{Followed, Unusable};

use crate::access::{Tokens, source};

/// How often to look. A change counts when it is seen a second time.
pub(crate) const LOOK_PERIOD: Duration = Duration::from_millis(500);

/// The valid tokens, shared by every request.
#[derive(Debug)]
pub(crate) struct CurrentTokens {
    /// Absent where they are of no file.
    path: Option<PathBuf>,
    followed: Mutex<Followed<Content, Arc<Tokens>, String>>,
}

/// The text of the file, or why it cannot be read, in one line.
pub(super) type Content = Result<String, String>;

impl CurrentTokens {
    /// Begins with `tokens`, and follows the file that they were read from.
    pub(crate) fn new(tokens: Tokens) -> CurrentTokens {
        let (path, content) = tokens.read_from.clone().unzip();
        let tokens = Arc::new(tokens);
        let followed = match content.unwrap_or_else(|| Ok(String::new())) {
            Err(why) => Followed::refused(Err(why.clone()), tokens, why),
            content => Followed::new(content, tokens),
        };
        CurrentTokens { path, followed: Mutex::new(followed) }
    }

    /// Those that are valid now.
    pub(crate) fn get(&self) -> Arc<Tokens> {
        self.lock().value().clone()
    }

    /// Why the file as it is now is not used.
    pub(crate) fn problem(&self) -> Option<String> {
        let followed = self.lock();
        followed.problem().map(|why| format!("gateway: {}", not_used(why, followed.value())))
    }

    /// Reads the file again. What is seen once may be a part of what somebody is writing, so it counts when it is seen twice.
    pub(crate) fn look(&self) {
        let Some(path) = &self.path else { return };
        // A disk that hangs delays no request.
        let content = source(path).map(|it| it.text).map_err(|it| first_line(&it));
        let mut followed = self.lock();
        let valid = followed.value().clone();
        match followed.look_twice(content, |content, _| parse(path, content.clone()).map_err(Unusable::Content)) {
            None => {}
            Some(Ok(tokens)) => {
                let (path, count) = (path.display(), tokens.all.len());
                tracing::info!("{path}: was changed; its {count} tokens are valid from now on");
            }
            Some(Err(why)) => tracing::warn!("{}", not_used(why, &valid)),
        }
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Followed<Content, Arc<Tokens>, String>> {
        self.followed.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

fn not_used(why: &str, valid: &Tokens) -> String {
    let what =
        if valid.all.is_empty() { "until it can be used no token is valid" } else { "the previous tokens stay valid" };
    format!("{why}; {what}")
}

/// The tokens in it, if there are any: an empty file is one that somebody is about to write.
fn parse(path: &Path, content: Content) -> Result<Arc<Tokens>, String> {
    let source = Source { path: path.to_owned(), text: content? };
    let tokens = Tokens::parse(&source).map_err(|it| first_line(&it))?;
    if tokens.all.is_empty() {
        return Err(format!("{}: there is no token in it", path.display()));
    }
    Ok(Arc::new(tokens))
}

/// Of a mistake the line that says where and what; the lines after it show the text.
pub(super) fn first_line(refusal: &impl ToString) -> String {
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
            let expected = said.map(|it| format!("gateway: {}{it}; the previous tokens stay valid", path.display()));
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
    fn a_gateway_that_was_started_again_while_the_file_is_spoiled_waits_for_tokens() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        let refusal = Tokens::read(&path).unwrap_err();
        let current = CurrentTokens::new(Tokens::awaited(path.clone(), &refusal));
        assert!(current.problem().is_some_and(|it| it.contains("No such file")));
        let look_twice = || {
            current.look();
            current.look();
            (current.get().identify("new", 0).is_some(), current.problem())
        };
        write(&path, "[[");
        let (is_valid, problem) = look_twice();
        assert!(!is_valid && problem.is_some_and(|it| it.ends_with("; until it can be used no token is valid")));
        write(&path, &of("new"));
        assert_eq!(look_twice(), (true, None));
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
