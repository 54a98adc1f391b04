//! `kittiwake access`: makes a token for an operator where no launcher does it.
//!
//! The folder that the gateway reads gets the hash; the token itself stays in a file of the operator's,
//! which no other process needs. Repeated at each start, it prints the same link.

use std::io::ErrorKind;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use gateway::access::{InvalidTokens, Role, Tokens, entry};

use crate::cli::AccessArgs;
use crate::outcome::Outcome;
use crate::output;
use crate::run::run_file;
use crate::setup::access::{TOKEN_BYTES, TOKENS, random_hex};

/// The operator's name in the audit records.
const NAME: &str = "operator";
/// A shorter token could be guessed.
const SHORTEST_TOKEN: usize = 32;
/// Of the files that it makes.
const PRIVATE: u32 = 0o600;

/// Why there is no link.
#[derive(Debug, thiserror::Error)]
enum Refusal {
    #[error("{path}: cannot be {done}: {cause}")]
    File { path: PathBuf, done: &'static str, cause: std::io::Error },
    #[error("{path}: its mode is {mode:04o}; others than its owner could read the token in it (chmod 600)")]
    Exposed { path: PathBuf, mode: u32 },
    #[error(
        "{secret}: a token has at least {least} characters, found {found}; remove it and {tokens}, and the operator gets a new one",
        least = SHORTEST_TOKEN
    )]
    Short { secret: PathBuf, tokens: PathBuf, found: usize },
    #[error(transparent)]
    Tokens(#[from] InvalidTokens),
    #[error("{tokens}: does not know the token in {secret}; remove both, and the operator gets a new one")]
    UnknownToken { tokens: PathBuf, secret: PathBuf },
    #[error("the operating system has no randomness: {0}")]
    Randomness(std::io::Error),
}

/// Prints the operator's link, and makes the token if there is none yet.
pub fn access(args: &AccessArgs) -> Outcome {
    match operator_token(&args.folder, &args.secret) {
        Ok(token) => {
            output::line(format_args!("operate: {}/#token={token}", args.url.trim_end_matches('/')));
            Outcome::Success
        }
        Err(refusal) => {
            output::error_line(format_args!("access: {refusal}"));
            Outcome::BadInput
        }
    }
}

/// The operator's token. A folder that is missing is made, for this user alone.
fn operator_token(folder: &Path, secret: &Path) -> Result<String, Refusal> {
    if !folder.exists() {
        let made = run_file::private_folder(folder);
        made.map_err(|cause| Refusal::File { path: folder.to_owned(), done: "made", cause })?;
    }
    let tokens = folder.join(TOKENS);
    let token = match read(secret)? {
        // What a power loss may leave of a file, as long as nobody was let in by it.
        None => new_token(secret)?,
        Some(token) if token.is_empty() && !tokens.exists() => new_token(secret)?,
        Some(token) => accepted(token, secret, &tokens)?,
    };
    if !tokens.exists() {
        write(&tokens, &entry(NAME, &Role::ALL, &token))?;
    }
    // The gateway checks whether it has expired.
    match Tokens::read(&tokens)?.identify(&token, 0) {
        Some(_) => Ok(token),
        None => Err(Refusal::UnknownToken { tokens, secret: secret.to_owned() }),
    }
}

/// What is in the operator's file, if there is one.
fn read(secret: &Path) -> Result<Option<String>, Refusal> {
    match regular_file::read_text(secret) {
        Ok(text) => Ok(Some(text.trim().to_owned())),
        Err(cause) if cause.kind() == ErrorKind::NotFound => Ok(None),
        Err(cause) => Err(Refusal::File { path: secret.to_owned(), done: "read", cause }),
    }
}

fn new_token(secret: &Path) -> Result<String, Refusal> {
    let token = random_hex(TOKEN_BYTES).map_err(Refusal::Randomness)?;
    write(secret, &token)?;
    Ok(token)
}

/// The token of the operator's file, if it is one and nobody else has read it.
fn accepted(token: String, secret: &Path, tokens: &Path) -> Result<String, Refusal> {
    let found = token.chars().count();
    if found < SHORTEST_TOKEN {
        return Err(Refusal::Short { secret: secret.to_owned(), tokens: tokens.to_owned(), found });
    }
    let path = secret.to_owned();
    let mode = std::fs::metadata(secret).map(|it| it.permissions().mode() & 0o7777);
    match mode {
        Ok(mode) if mode & 0o077 == 0 => Ok(token),
        Ok(mode) => Err(Refusal::Exposed { path, mode }),
        Err(cause) => Err(Refusal::File { path, done: "read", cause }),
    }
}

/// Atomic and durable: a power loss leaves no partial file.
fn write(path: &Path, text: &str) -> Result<(), Refusal> {
    regular_file::replace(path, PRIVATE, text.as_bytes()).map_err(|cause| Refusal::File {
        path: path.to_owned(),
        done: "written",
        cause,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_operator_is_let_in_by_the_same_token_each_time() {
        let folder = tempfile::tempdir().unwrap();
        let secret = folder.path().join("operator.token");
        let token = operator_token(folder.path(), &secret).unwrap();
        assert_eq!(operator_token(folder.path(), &secret).unwrap(), token);
        let tokens = Tokens::read(&folder.path().join(TOKENS)).unwrap();
        assert_eq!(tokens.identify(&token, 0).unwrap().roles, Role::ALL);
        assert!(!std::fs::read_to_string(folder.path().join(TOKENS)).unwrap().contains(&token), "only its hash");
    }

    #[test]
    fn a_folder_that_is_missing_is_made_for_its_owner_alone() {
        use std::os::unix::fs::MetadataExt as _;
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("ground").join("access");
        operator_token(&folder, &place.path().join("operator.token")).unwrap();
        assert_eq!(std::fs::metadata(&folder).unwrap().mode() & 0o777, 0o700);
    }

    #[test]
    fn what_does_not_belong_together_is_refused_and_so_is_a_file_in_the_place_of_the_folder() {
        let (one, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let secret = |it: &tempfile::TempDir| it.path().join("operator.token");
        operator_token(one.path(), &secret(&one)).unwrap();
        let said = operator_token(one.path(), &secret(&other)).unwrap_err().to_string();
        assert!(said.contains("does not know the token in"), "{said}");
        let taken = &secret(&one);
        let said = operator_token(&taken.join("nowhere"), &secret(&other)).unwrap_err().to_string();
        assert!(said.contains("nowhere: cannot be made: Not a directory"), "{said}");
        assert!(operator_token(taken, &secret(&other)).unwrap_err().to_string().contains("Not a directory"));
    }

    /// What becomes of a secret file with this text and mode, which the folder's tokens know or not.
    #[track_caller]
    fn check(text: &str, mode: u32, known: bool, expected: Result<(), &str>) {
        let folder = tempfile::tempdir().unwrap();
        let (secret, tokens) = (folder.path().join("operator.token"), folder.path().join(TOKENS));
        std::fs::write(&secret, text).unwrap();
        std::fs::set_permissions(&secret, std::fs::Permissions::from_mode(mode)).unwrap();
        if known {
            write(&tokens, &entry(NAME, &Role::ALL, text.trim())).unwrap();
        }
        match (operator_token(folder.path(), &secret), expected) {
            (Ok(token), Ok(())) => {
                assert!(SHORTEST_TOKEN <= token.len() && token.starts_with(text.trim()), "{token}");
                assert_eq!(std::fs::metadata(&secret).unwrap().permissions().mode() & 0o777, 0o600);
                assert!(Tokens::read(&tokens).unwrap().identify(&token, 0).is_some());
            }
            (Err(refusal), Err(said)) => {
                assert!(refusal.to_string().contains(said), "{refusal}");
                assert_eq!(tokens.exists(), known, "nobody is let in by it");
                assert_eq!(std::fs::read_to_string(&secret).unwrap(), text, "it is left as it is");
            }
            (found, expected) => panic!("found {found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn only_a_token_that_nobody_guesses_or_has_read_lets_in() {
        let good = "0123456789abcdef0123456789abcdef";
        check(good, 0o600, false, Ok(()));
        check(&format!("{good}\n"), 0o600, true, Ok(()));
        // An empty remnant of a power loss, which has let in nobody.
        check("", 0o600, false, Ok(()));
        check("\n", 0o644, false, Ok(()));
        check("", 0o600, true, Err("a token has at least 32 characters, found 0; remove it and"));
        check(&good[1..], 0o600, false, Err("operator.token: a token has at least 32 characters, found 31"));
        check("secret", 0o600, true, Err("found 6"));
        check(good, 0o640, false, Err("operator.token: its mode is 0640"));
        check(good, 0o604, true, Err("its mode is 0604; others than its owner could read the token"));
    }
}
