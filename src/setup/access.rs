//! The access folder: whose tokens are valid over HTTP, and the audit trail.

use std::io;
use std::path::Path;
use std::time::Duration;

use gateway::AccessControl;
use gateway::access::{InvalidTokens, Role, Tokens, entry};
use gateway::audit::{Audit, OpenError};

use crate::output;
use crate::run::first_start::nothing_flies;
use crate::run::run_file::{self, Remembered, RunFolder};
use crate::settings::Settings;

/// In that folder: the tokens that are valid.
pub const TOKENS: &str = "tokens.toml";
/// Length of a token: 256 bits.
pub const TOKEN_BYTES: usize = 32;

/// How long the start of a gateway waits for the disk of the audit trail: many times what a slow one takes, and far less than a
/// supervisor waits.
const OPEN_LIMIT: Duration = Duration::from_secs(5);

/// Why the access folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The tokens are refused.
    #[error(transparent)]
    Tokens(#[from] InvalidTokens),
    /// The audit trail is not opened.
    #[error(transparent)]
    Audit(#[from] OpenError),
}

/// The tokens and the audit trail in the access folder, of which the newest `audit_files` files are kept; without a folder no token is
/// valid. A gateway that may be needed in flight starts without a trail that can be written, and one that is started again without tokens,
/// until their file is mended: an aircraft is not left without its operators.
///
/// # Errors
/// If there are no tokens, another gateway writes the trail, or nothing flies and the trail cannot be written.
pub fn access_control(settings: &Settings, audit_files: usize) -> Result<AccessControl, Failure> {
    let Some(folder) = &settings.access else {
        return Ok(AccessControl { tokens: Tokens::default(), audit: Audit::in_memory() });
    };
    let path = folder.join(TOKENS);
    let tokens = match Tokens::read(&path) {
        Err(refusal) if settings.has_run => {
            output::error_line(format_args!("{refusal}\ngateway: until it can be used no token is valid"));
            Tokens::awaited(path, &refusal)
        }
        read => read?,
    };
    let open = if nothing_flies(settings) { open } else { open_or_failing };
    Ok(AccessControl { tokens, audit: open(folder, audit_files)? })
}

fn open(folder: &Path, audit_files: usize) -> Result<Audit, OpenError> {
    Audit::open_within(folder, audit_files, OPEN_LIMIT)
}

/// The audit trail in a folder that may be gone; without one that can be written, orders go on without a record, and
/// the gateway says so.
fn open_or_failing(folder: &Path, audit_files: usize) -> Result<Audit, OpenError> {
    if std::fs::symlink_metadata(folder).is_err_and(|it| it.kind() == io::ErrorKind::NotFound) {
        // Where that fails, opening says why.
        let _ = run_file::private_folder(folder);
    }
    match open(folder, audit_files) {
        Err(OpenError::Unusable(path, cause)) => {
            let audit = Audit::failing(&path, &cause);
            audit.problems().iter().for_each(output::error_line);
            Ok(audit)
        }
        opened => opened,
    }
}

/// A folder made for one run of `kittiwake up`, with one token that has every role; removed with the value.
pub struct DemoAccess {
    /// Where it is.
    pub folder: RunFolder,
    /// The token.
    pub token: String,
    written: Remembered,
}

impl DemoAccess {
    /// Makes the folder.
    ///
    /// # Errors
    /// If that is not possible, or the operating system has no randomness.
    pub fn create() -> io::Result<DemoAccess> {
        let folder = RunFolder::create("access")?;
        let token = random_hex(TOKEN_BYTES)?;
        let text = entry("demo", &Role::ALL, &token);
        run_file::write_private(&folder.0.join(TOKENS), text.as_bytes())?;
        let written = Remembered::of(&folder.0)?;
        Ok(DemoAccess { folder, token, written })
    }

    /// Writes it again where it was removed; whether it was.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn restore(&self) -> io::Result<bool> {
        self.written.restore(&self.folder)
    }
}

/// This many random bytes in hexadecimal.
pub fn random_hex(count: usize) -> io::Result<String> {
    use io::Read;
    let mut bytes = vec![0; count];
    std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.iter().map(|it| format!("{it:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_folder(folder: &Path) -> Settings {
        Settings { access: Some(folder.to_owned()), ..Settings::of_file(Path::new("kittiwake.toml")) }
    }

    #[test]
    fn a_gateway_that_has_run_before_starts_whatever_became_of_its_folder() {
        #[track_caller]
        fn check(spoil: impl FnOnce(&Path), problems: usize) {
            let place = tempfile::tempdir().unwrap();
            let folder = &place.path().join("access");
            run_file::private_folder(folder).unwrap();
            run_file::write_private(&folder.join(TOKENS), entry("anna", &Role::ALL, "secret").as_bytes()).unwrap();
            let first = Settings { simulated: true, ..of_folder(folder) };
            let again = Settings { has_run: true, ..first.clone() };
            let before = access_control(&first, 1).unwrap();
            assert!(before.tokens.identify("secret", 0).is_some());
            drop(before);
            spoil(folder);
            assert!(access_control(&first, 1).is_err(), "a first start is refused");
            let after = access_control(&again, 1).unwrap();
            assert_eq!(after.tokens.identify("secret", 0), None, "until the file can be used");
            assert_eq!(after.audit.problems().len(), problems);
        }
        check(|it| std::fs::write(it.join(TOKENS), "[[token").unwrap(), 0);
        check(|it| std::fs::remove_dir_all(it).unwrap(), 0);
        let replaced = |it: &Path| {
            std::fs::remove_dir_all(it).unwrap();
            std::fs::write(it, "").unwrap();
        };
        check(replaced, 1);
    }

    #[test]
    fn a_trail_that_cannot_be_written_keeps_no_gateway_away_that_may_be_needed_in_flight() {
        #[track_caller]
        fn check<T>(spoil: impl FnOnce(&Path) -> T, starts: bool, problems_in_flight: Result<usize, ()>) {
            let place = tempfile::tempdir().unwrap();
            let folder = &place.path().join("access");
            run_file::private_folder(folder).unwrap();
            run_file::write_private(&folder.join(TOKENS), entry("anna", &Role::ALL, "secret").as_bytes()).unwrap();
            let _spoilt = spoil(folder);
            let first = Settings { simulated: true, ..of_folder(folder) };
            assert_eq!(access_control(&first, 1).is_ok(), starts);
            // By systemd or in a container, also for the first time.
            let found = access_control(&of_folder(folder), 1).map(|it| it.audit.problems().len());
            assert_eq!(found.map_err(drop), problems_in_flight);
        }
        // Root may write everywhere, but no file where a folder is.
        check(|it| std::fs::create_dir(it.join("last-audit-number")).unwrap(), false, Ok(1));
        check(|it| std::fs::create_dir(it.join("refusals.jsonl")).unwrap(), false, Ok(1));
        check(|_| {}, true, Ok(0));
        // Two gateways would break the chain.
        check(|it| Audit::open(it, 1).unwrap(), false, Err(()));
    }

    #[test]
    fn the_token_made_for_a_run_may_do_everything_and_is_gone_with_it() {
        let demo = DemoAccess::create().unwrap();
        let access = access_control(&of_folder(&demo.folder.0), 1).unwrap();
        let who = access.tokens.identify(&demo.token, 0).unwrap();
        assert_eq!(who.roles, Role::ALL);
        let folder = demo.folder.0.clone();
        drop(demo);
        assert!(!folder.exists());
    }
}
