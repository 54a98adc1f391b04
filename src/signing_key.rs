//! Links with MAVLink signatures, whose key is in a file that only its owner can read.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use domain::file::{Mistake, Mistakes};
use mavlink_bridge::config::Config;
use mavlink_bridge::link::Link;
use mavlink_bridge::signing::{Key, SignedLink, Signing};

/// The key in a file.
///
/// # Errors
/// If the file cannot be read, may be read by others, or holds something else.
pub fn read(path: &Path) -> Result<Key, Mistakes> {
    let mistake = |message: String, help: &str| {
        Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: help.into() }])
    };
    let unreadable = |cause: std::io::Error| mistake(format!("the signing key cannot be read: {cause}"), "");
    let mode = std::fs::metadata(path).map_err(unreadable)?.permissions().mode() & 0o7777;
    if mode & 0o077 != 0 {
        let message = format!("the signing key may be read by others (mode {mode:04o}): they could fly the vehicle");
        return Err(mistake(message, "make it readable for its owner only: `chmod 600`"));
    }
    let text = regular_file::read_text(path).map_err(unreadable)?;
    text.parse().map_err(|why| mistake(format!("holds no signing key: {why}"), ""))
}

/// `link` with signatures, if the configuration has a key for them. Each link of a component has an `id` of its own.
///
/// # Errors
/// If the key cannot be used.
pub fn signed(config: &Config, link: Box<dyn Link>, id: u8) -> Result<Box<dyn Link>, Mistakes> {
    Ok(match &config.signing_key {
        Some(path) => Box::new(SignedLink::new(link, Signing::new(read(path)?, id), utc_ms)),
        None => link,
    })
}

#[expect(clippy::disallowed_methods, reason = "signatures count by UTC")]
fn utc_ms() -> i64 {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since_epoch.as_millis()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_that_cannot_be_used_is_told_with_its_file() {
        #[track_caller]
        fn check(text: &str, mode: u32, expected: &str) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("signing.key");
            std::fs::write(&path, text).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            let said = read(&path).map_or_else(|it| it.to_string(), |_| "read".to_owned());
            assert!(said.contains(expected), "{said}");
        }
        let digits = "0f".repeat(32);
        check(&digits, 0o600, "read");
        check(&format!("{digits}\n"), 0o400, "read");
        check(&digits, 0o644, "may be read by others (mode 0644)");
        check("secret", 0o600, "signing.key: holds no signing key: found 6 characters, expected 64 hexadecimal digits");
        let absent = read(Path::new("/nowhere/signing.key")).unwrap_err().to_string();
        assert!(absent.contains("/nowhere/signing.key: the signing key cannot be read: No such file"), "{absent}");
    }
}
