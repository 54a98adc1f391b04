//! Who may do what: bearer tokens with roles, from a file that only its owner may read.
//!
//! The file holds SHA-256 hashes, so that a reader of the file learns no token. A token is random and
//! long, so a plain hash is enough: there is no dictionary to try. Without a token nothing is allowed.
//!
//! The file is replaced while the gateway runs: `CurrentTokens` follows it.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use domain::file::{Mistakes, Source};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

pub(crate) use current::{CurrentTokens, LOOK_PERIOD};

mod current;

/// What a token lets its bearer do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Reads everything.
    Observer,
    /// Orders, and changes missions.
    Operator,
    /// Decides about permissions.
    Tower,
    /// Pauses, returns, lands and aborts without command.
    Safety,
}

impl Role {
    /// Every role.
    pub const ALL: [Role; 4] = [Role::Observer, Role::Operator, Role::Tower, Role::Safety];

    /// Its name in files and documents.
    pub fn name(self) -> &'static str {
        match self {
            Role::Observer => "observer",
            Role::Operator => "operator",
            Role::Tower => "tower",
            Role::Safety => "safety",
        }
    }
}

/// The person or program that a token belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// The name in audit records.
    pub name: Arc<str>,
    /// The roles, in the order of [`Role::ALL`].
    pub roles: Vec<Role>,
    /// The hash of its token, so that what goes on after a request ends with the token.
    sha256: [u8; 32],
}

impl Identity {
    /// Whether it has one of `roles`.
    pub(crate) fn has_one_of(&self, roles: &[Role]) -> bool {
        roles.iter().any(|role| self.roles.contains(role))
    }

    /// Whether it may do more than read.
    pub(crate) fn may_order(&self) -> bool {
        self.roles.iter().any(|role| *role != Role::Observer)
    }

    /// The hash of its token: another one with the same name has another.
    pub(crate) fn token_hash(&self) -> [u8; 32] {
        self.sha256
    }

    /// The names of its roles.
    pub(crate) fn role_names(&self) -> Vec<String> {
        self.roles.iter().map(|role| role.name().to_owned()).collect()
    }
}

/// The valid tokens, with their identities.
#[derive(Debug, Clone, Default)]
pub struct Tokens {
    all: Vec<Token>,
    /// The file that they were read from, and what was found in it; absent where there is none.
    read_from: Option<(PathBuf, current::Content)>,
}

#[derive(Debug, Clone)]
struct Token {
    identity: Identity,
    /// Milliseconds since the Unix epoch, UTC.
    expires_utc_ms: Option<i64>,
}

/// Why a file of the access folder is refused.
#[derive(Debug)]
pub enum InvalidTokens {
    /// The file cannot be read.
    Unreadable(PathBuf, std::io::Error),
    /// Others than the owner may read or write the file; its mode.
    Exposed(PathBuf, u32),
    /// The text of the file has mistakes.
    Mistakes(Mistakes),
}

impl fmt::Display for InvalidTokens {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            InvalidTokens::Unreadable(path, cause) => write!(f, "{}: {cause}", path.display()),
            InvalidTokens::Exposed(path, mode) => {
                write!(f, "{}: its mode is {mode:04o}; only its owner may have access (chmod 600)", path.display())
            }
            InvalidTokens::Mistakes(mistakes) => mistakes.fmt(f),
        }
    }
}

impl std::error::Error for InvalidTokens {}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    token: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: toml::Spanned<String>,
    roles: Vec<Role>,
    sha256: toml::Spanned<String>,
    expires_utc: Option<toml::Spanned<String>>,
}

impl Tokens {
    /// Reads a file of `[[token]]` entries with `name`, `roles`, `sha256` (hexadecimal) and, for a token that
    /// expires, `expires_utc`.
    ///
    /// # Errors
    /// If the file cannot be read, others than its owner may read it, or its text has mistakes.
    pub fn read(path: &Path) -> Result<Tokens, InvalidTokens> {
        let source = source(path)?;
        let tokens = Tokens::parse(&source).map_err(InvalidTokens::Mistakes)?;
        Ok(Tokens { read_from: Some((source.path, Ok(source.text))), ..tokens })
    }

    /// No token is valid until this file can be used, which was refused: for a gateway that is started again in flight.
    pub fn awaited(path: PathBuf, why: &InvalidTokens) -> Tokens {
        Tokens { all: Vec::new(), read_from: Some((path, Err(current::first_line(why)))) }
    }

    /// Reads the entries from the text of such a file.
    ///
    /// # Errors
    /// Every mistake, with its place.
    pub fn parse(source: &Source) -> Result<Tokens, Mistakes> {
        let file: File = source.parse()?;
        let mut mistakes = Vec::new();
        let mut tokens: Vec<Token> = Vec::new();
        for entry in file.token {
            let name = entry.name.as_ref().trim();
            let is_new = tokens.iter().all(|known| &*known.identity.name != name);
            if name.is_empty() || !is_new {
                mistakes.push(source.mistake(
                    Some(entry.name.span()),
                    "each token needs a name that no other token has",
                    "",
                ));
            }
            let sha256 = from_hex(entry.sha256.as_ref());
            if sha256.is_none() {
                let message = "a SHA-256 hash has 64 hexadecimal digits";
                mistakes.push(source.mistake(Some(entry.sha256.span()), message, ""));
            }
            let expires_utc_ms = entry.expires_utc.as_ref().map(|text| (text.span(), utc_ms(text.as_ref())));
            if let Some((span, None)) = &expires_utc_ms {
                let help = "write it like 2026-05-01T08:00:00Z";
                mistakes.push(source.mistake(Some(span.clone()), "expected a UTC date and time", help));
            }
            let mut roles = entry.roles;
            roles.sort();
            roles.dedup();
            tokens.push(Token {
                identity: Identity { name: name.into(), roles, sha256: sha256.unwrap_or_default() },
                expires_utc_ms: expires_utc_ms.and_then(|(_, utc_ms)| utc_ms),
            });
        }
        Mistakes(mistakes).or(Tokens { all: tokens, read_from: None })
    }

    /// The identity that `token` belongs to; `None` for a token that is unknown or has expired. Every hash is compared,
    /// each in constant time, so that the time taken reveals nothing.
    pub fn identify(&self, token: &str, utc_ms: i64) -> Option<&Identity> {
        let hash = Sha256::digest(token.as_bytes());
        let mut found = None;
        for known in &self.all {
            let matches = bool::from(known.identity.sha256.as_slice().ct_eq(hash.as_slice()));
            if matches && known.is_in_date(utc_ms) {
                found = Some(&known.identity);
            }
        }
        found
    }

    /// Whether somebody of this name may have command of a vehicle.
    pub(crate) fn let_command(&self, name: &str, utc_ms: i64) -> bool {
        let lets = |it: &Token| &*it.identity.name == name && it.identity.has_one_of(&[Role::Operator]);
        self.all.iter().any(|known| lets(known) && known.is_in_date(utc_ms))
    }

    /// Whether the token is still valid by which somebody was identified, with the name and the roles of then.
    pub(crate) fn still_has(&self, who: &Identity, utc_ms: i64) -> bool {
        self.all.iter().any(|known| known.identity == *who && known.is_in_date(utc_ms))
    }

    /// Whether the token with this hash is valid, under whatever name and with whatever roles.
    pub(crate) fn has_token(&self, sha256: &[u8; 32], utc_ms: i64) -> bool {
        self.all.iter().any(|known| known.identity.sha256 == *sha256 && known.is_in_date(utc_ms))
    }
}

impl Token {
    fn is_in_date(&self, utc_ms: i64) -> bool {
        self.expires_utc_ms.is_none_or(|expires| utc_ms < expires)
    }
}

/// The text of a file that only its owner may read.
fn source(path: &Path) -> Result<Source, InvalidTokens> {
    use std::os::unix::fs::PermissionsExt;
    let unreadable = |cause| InvalidTokens::Unreadable(path.to_owned(), cause);
    let mode = std::fs::metadata(path).map_err(unreadable)?.permissions().mode() & 0o7777;
    if mode & 0o077 != 0 {
        return Err(InvalidTokens::Exposed(path.to_owned(), mode));
    }
    Ok(Source { path: path.to_owned(), text: regular_file::read_text(path).map_err(unreadable)? })
}

/// Now, in milliseconds since the Unix epoch, as tokens expire.
#[expect(clippy::disallowed_methods, reason = "tokens expire by UTC")]
pub(crate) fn utc_ms_now() -> i64 {
    let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since_epoch.as_millis()).unwrap_or(i64::MAX)
}

/// The entry of a token file that gives `token` to `name`.
pub fn entry(name: &str, roles: &[Role], token: &str) -> String {
    let roles: Vec<String> = roles.iter().map(|role| format!("\"{}\"", role.name())).collect();
    let hash = to_hex(&Sha256::digest(token.as_bytes()));
    format!("[[token]]\nname = \"{name}\"\nroles = [{}]\nsha256 = \"{hash}\"\n", roles.join(", "))
}

/// Bytes in hexadecimal.
pub(crate) fn to_hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A hash from 64 hexadecimal digits.
pub(crate) fn from_hex(text: &str) -> Option<[u8; 32]> {
    if text.len() != 64 || !text.is_ascii() {
        return None;
    }
    let mut bytes = [0; 32];
    for (index, byte) in bytes.iter_mut().enumerate() {
        *byte = u8::from_str_radix(text.get(2 * index..2 * index + 2)?, 16).ok()?;
    }
    Some(bytes)
}

fn utc_ms(text: &str) -> Option<i64> {
    let since_epoch = humantime::parse_rfc3339_weak(text).ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
    i64::try_from(since_epoch.as_millis()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::testing::check_mistake;

    fn parse(text: &str) -> Result<Tokens, Mistakes> {
        Tokens::parse(&Source { path: "tokens.toml".into(), text: text.into() })
    }

    #[test]
    fn a_token_identifies_its_owner_until_it_expires() {
        let text = entry("anna", &[Role::Operator, Role::Observer], "secret");
        let tokens = parse(&format!("{text}expires_utc = \"2026-01-01T00:00:00Z\"\n")).unwrap();
        let end = 1_767_225_600_000;
        let anna = tokens.identify("secret", end - 1).unwrap();
        assert_eq!((&*anna.name, anna.roles.as_slice()), ("anna", &[Role::Observer, Role::Operator][..]));
        assert!(tokens.identify("secret", end).is_none());
        assert!(tokens.identify("Secret", 0).is_none());
        assert!(tokens.identify("", 0).is_none());
        assert!(Tokens::default().identify("", 0).is_none());
        let hash = anna.token_hash();
        assert!(tokens.has_token(&hash, end - 1) && !tokens.has_token(&hash, end));
        assert!(!tokens.has_token(&[0; 32], 0));
    }

    #[test]
    fn every_mistake_is_reported_with_its_place() {
        let good = entry("anna", &[Role::Observer], "secret");
        #[track_caller]
        fn check(good: &str, find: &str, replace: &str, expected: &str) {
            check_mistake(good, find, replace, parse, expected);
        }
        check(&good, "observer", "chief", "tokens.toml:3:10: unknown variant `chief`");
        check(&good, "sha256 = \"", "sha256 = \"x", "tokens.toml:4:10: a SHA-256 hash has 64");
        let twice = format!("{good}{good}");
        check(&good, &good, &twice, "tokens.toml:6:8: each token needs a name that no other token has");
        let expired = format!("{good}expires_utc = \"soon\"");
        check(&good, &good, &expired, "tokens.toml:5:15: expected a UTC date");
    }

    #[test]
    fn a_file_that_others_may_read_is_refused() {
        use std::os::unix::fs::PermissionsExt;
        let path = std::env::temp_dir().join(format!("kittiwake-tokens-{}", std::process::id()));
        std::fs::write(&path, entry("anna", &[Role::Observer], "secret")).unwrap();
        let read_with = |mode| {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            Tokens::read(&path).map(|_| ()).map_err(|error| error.to_string())
        };
        let (closed, open) = (read_with(0o600), read_with(0o640));
        std::fs::remove_file(&path).unwrap();
        assert_eq!(closed, Ok(()));
        assert!(open.unwrap_err().contains("its mode is 0640"));
    }
}
