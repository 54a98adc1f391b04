//! Where a gateway copies the tokens that are valid, for the one that is started in its place: a file in memory without a name, which
//! nobody removes and which needs no disk. It ends with the launcher, and holds hashes only.

use std::fs::{File, Permissions};
use std::io;
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::PathBuf;

use rustix::fs::{MemfdFlags, memfd_create};

/// The file; gone with the value.
pub struct TokenCopy(File);

impl TokenCopy {
    /// Makes it, empty.
    ///
    /// # Errors
    /// If the operating system has no memory or descriptor for it.
    pub fn create() -> io::Result<TokenCopy> {
        let file = File::from(memfd_create("valid-tokens", MemfdFlags::CLOEXEC)?);
        // What others may read is refused.
        file.set_permissions(Permissions::from_mode(0o600))?;
        Ok(TokenCopy(file))
    }

    /// Where processes of this user open it, for as long as the value lives.
    pub fn path(&self) -> PathBuf {
        format!("/proc/{}/fd/{}", std::process::id(), self.0.as_raw_fd()).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway::access::{Role, entry};

    use crate::run::run_file;
    use crate::settings::Settings;
    use crate::setup::access::{TOKENS, access_control};

    #[test]
    fn a_gateway_finds_the_tokens_there_that_the_one_before_had() {
        let (place, copy) = (tempfile::tempdir().unwrap(), TokenCopy::create().unwrap());
        let tokens = place.path().join(TOKENS);
        run_file::write_private(&tokens, entry("anna", &Role::ALL, "secret").as_bytes()).unwrap();
        let first = Settings {
            access: Some(place.path().to_owned()),
            tokens_copy: Some(copy.path()),
            ..Settings::of_file(&place.path().join("kittiwake.toml"))
        };
        let before = access_control(&first, 1).unwrap();
        before.tokens.keep_copy();
        drop(before);
        std::fs::write(&tokens, "[[").unwrap();
        let again = Settings { has_run: true, ..first };
        assert!(access_control(&again, 1).unwrap().tokens.identify("secret", 0).is_some());
        drop(copy);
        assert!(access_control(&again, 1).is_err());
    }
}
