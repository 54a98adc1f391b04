//! The access folder: whose tokens are valid over HTTP, and the audit trail.

use std::io;
use std::path::Path;

use gateway::AccessControl;
use gateway::access::{InvalidTokens, Role, Tokens, entry};
use gateway::audit::Audit;

use crate::run::run_file::{self, Remembered, RunFolder};

/// In that folder: the tokens that are valid.
pub const TOKENS: &str = "tokens.toml";
/// Length of a token: 256 bits.
pub const TOKEN_BYTES: usize = 32;

/// The tokens and the audit trail in `folder`, of which the newest `audit_files` files are kept; without a folder no token is
/// valid.
pub fn access_control(folder: Option<&Path>, audit_files: usize) -> Result<AccessControl, InvalidTokens> {
    let Some(folder) = folder else {
        return Ok(AccessControl { tokens: Tokens::default(), audit: Audit::in_memory() });
    };
    let tokens = Tokens::read(&folder.join(TOKENS))?;
    let audit = Audit::open(folder, audit_files).map_err(|(path, cause)| InvalidTokens::Unreadable(path, cause))?;
    Ok(AccessControl { tokens, audit })
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

    #[test]
    fn the_token_made_for_a_run_may_do_everything_and_is_gone_with_it() {
        let demo = DemoAccess::create().unwrap();
        let access = access_control(Some(&demo.folder.0), 1).unwrap();
        let who = access.tokens.identify(&demo.token, 0).unwrap();
        assert_eq!(who.roles, Role::ALL);
        let folder = demo.folder.0.clone();
        drop(demo);
        assert!(!folder.exists());
    }
}
