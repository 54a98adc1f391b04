//! `kittiwake access`: makes a token for an operator where no launcher does it.
//!
//! The folder that the gateway reads gets the hash; the token itself stays in a file of the operator's,
//! which no other process needs. Repeated at each start, it prints the same link.

use std::path::{Path, PathBuf};

use gateway::access::{InvalidTokens, Role, Tokens, entry};

use crate::cli::AccessArgs;
use crate::outcome::Outcome;
use crate::output;
use crate::run::run_file;
use crate::setup::access::{TOKEN_BYTES, TOKENS, random_hex};

/// The operator's name in the audit records.
const NAME: &str = "operator";

/// Why there is no link.
#[derive(Debug, thiserror::Error)]
enum Refusal {
    #[error("{path}: cannot be {done}: {cause}")]
    File { path: PathBuf, done: &'static str, cause: std::io::Error },
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
    let token = match std::fs::read_to_string(secret) {
        Ok(token) => token.trim().to_owned(),
        Err(cause) if cause.kind() == std::io::ErrorKind::NotFound => {
            let token = random_hex(TOKEN_BYTES).map_err(Refusal::Randomness)?;
            write(secret, &token)?;
            token
        }
        Err(cause) => return Err(Refusal::File { path: secret.to_owned(), done: "read", cause }),
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

fn write(path: &Path, text: &str) -> Result<(), Refusal> {
    run_file::write_private(path, text.as_bytes()).map_err(|cause| Refusal::File {
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
}
