//! A copy of the tokens that were valid last, for a gateway that is started again in flight while their file cannot be used.
//!
//! It is written again whenever the tokens change: a token that was taken away does not come back with it. It is opened once, so that this
//! needs no descriptor.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::Path;
use std::sync::Arc;

use crate::access::current::{first_line, usable};
use crate::access::{InvalidTokens, Tokens, source};

impl Tokens {
    /// As [`Tokens::read`]; has whatever is valid copied to `copy`, and takes the tokens from there if the gateway `has_run` before and the
    /// file cannot be used now. The file is followed all the same, so that what is wrong with it is told.
    ///
    /// # Errors
    /// As [`Tokens::read`], where there is no copy that can be used either.
    pub fn read_or_copied(path: &Path, copy: &Path, has_run: bool) -> Result<Tokens, InvalidTokens> {
        let tokens = match (source(path), has_run) {
            (Ok(source), true) => {
                usable(source).or_else(|why| copied(path, copy, &why).map_or_else(|| Tokens::read(path), Ok))
            }
            (Err(refusal), true) => copied(path, copy, &first_line(&refusal)).ok_or(refusal),
            _ => Tokens::read(path),
        };
        let opened = regular_file::in_place(copy).map(Arc::new).inspect_err(not_copied);
        tokens.map(|it| Tokens { copy: opened.ok(), ..it })
    }

    /// Copies the text that they were read from, if there is a place for that.
    pub fn keep_copy(&self) {
        let (Some(source), Some(copy)) = (&self.read_from, &self.copy) else { return };
        let _ = write(copy, &source.text).inspect_err(not_copied);
    }
}

fn not_copied(cause: &io::Error) {
    tracing::warn!("the valid tokens cannot be copied: {cause}");
}

/// The tokens of the copy, as if `path` had them, which cannot be used.
fn copied(path: &Path, copy: &Path, why: &str) -> Option<Tokens> {
    let mut tokens = usable(source(copy).ok()?).ok()?;
    tokens.read_from.as_mut()?.path = path.to_owned();
    tracing::warn!("{why}; the tokens of before stay valid");
    Some(tokens)
}

/// What was in it goes first: no copy, or a part of one, is better than one with tokens that were taken away.
fn write(copy: &File, text: &str) -> io::Result<()> {
    copy.set_len(0)?;
    copy.write_all_at(text.as_bytes(), 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::{CurrentTokens, Role, entry};

    fn put(path: &Path, text: &str) {
        let _ = std::fs::remove_dir_all(path);
        write(&regular_file::in_place(path).unwrap(), text).unwrap();
    }

    fn of(token: &str) -> String {
        entry("anna", &[Role::Operator], token)
    }

    /// Whose file has the token `old`, then `new`, and then what `spoil` makes of it; `expected` is the token that is valid, and the problem
    /// that is told, after a start.
    #[track_caller]
    fn check(spoil: impl FnOnce(&Path), has_run: bool, expected: Result<(&str, Option<&str>), &str>) {
        let (folder, run) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let (path, copy) = (folder.path().join("tokens.toml"), run.path().join("tokens.toml"));
        put(&path, &of("old"));
        let before = CurrentTokens::new(Tokens::read_or_copied(&path, &copy, false).unwrap());
        put(&path, &of("new"));
        before.look();
        before.look();
        spoil(&path);
        let found = match Tokens::read_or_copied(&path, &copy, has_run) {
            Ok(found) => CurrentTokens::new(found),
            Err(refusal) => {
                let said = refusal.to_string();
                assert!(expected.is_err_and(|it| said.contains(it)), "{said}");
                return;
            }
        };
        found.look();
        found.look();
        let valid: Vec<_> =
            ["old", "new", "newest"].into_iter().filter(|it| found.get().identify(it, 0).is_some()).collect();
        let (token, problem) = expected.unwrap();
        assert_eq!(valid, [token]);
        let problem = problem.map(|it| format!("gateway: {}{it}; the tokens of before stay valid", path.display()));
        assert_eq!(found.problem(), problem);
        // A usable file counts again, also one with the same tokens.
        put(&path, &of("new"));
        found.look();
        found.look();
        assert_eq!((found.get().identify("new", 0).is_some(), found.problem()), (true, None));
    }

    #[test]
    fn a_gateway_that_is_started_again_has_the_last_tokens_whatever_became_of_their_file() {
        let gone = ": No such file or directory (os error 2)";
        let remove = |it: &Path| std::fs::remove_file(it).unwrap();
        check(|_| (), true, Ok(("new", None)));
        check(|it| put(it, &of("newest")), true, Ok(("newest", None)));
        check(|it| put(it, "[[token"), true, Ok(("new", Some(":1:8: unclosed array table, expected `]]`"))));
        check(|it| put(it, ""), true, Ok(("new", Some(": there is no token in it"))));
        check(remove, true, Ok(("new", Some(gone))));
        check(
            |it| {
                remove(it);
                std::fs::create_dir(it).unwrap();
                use std::os::unix::fs::PermissionsExt as _;
                std::fs::set_permissions(it, std::fs::Permissions::from_mode(0o700)).unwrap();
            },
            true,
            Ok(("new", Some(": it is a folder, not a regular file"))),
        );
        check(|it| put(it, "[[token"), false, Err("tokens.toml:1:8: unclosed array table"));
        check(remove, false, Err("No such file"));
    }

    #[test]
    fn only_its_owner_can_read_the_copy() {
        use std::os::unix::fs::MetadataExt as _;
        let folder = tempfile::tempdir().unwrap();
        let (path, copy) = (folder.path().join("tokens.toml"), folder.path().join("copy.toml"));
        put(&path, &of("old"));
        CurrentTokens::new(Tokens::read_or_copied(&path, &copy, false).unwrap());
        assert_eq!(std::fs::metadata(&copy).unwrap().mode() & 0o777, 0o600);
        assert_eq!(std::fs::read_to_string(&copy).unwrap(), of("old"));
    }

    #[test]
    fn a_copy_that_cannot_be_made_keeps_no_gateway_away() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        put(&path, &of("old"));
        let current = CurrentTokens::new(Tokens::read_or_copied(&path, folder.path(), true).unwrap());
        put(&path, &of("new"));
        current.look();
        current.look();
        assert!(current.get().identify("new", 0).is_some());
    }
}
