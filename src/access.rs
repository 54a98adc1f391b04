//! The folder that says who may do what over HTTP.

use std::io;
use std::path::{Path, PathBuf};

use gateway::Door;
use gateway::access::{BadTokens, Role, Tokens, entry};
use gateway::audit::Audit;

use crate::run_file;

const TOKENS: &str = "tokens.toml";
const AUDIT: &str = "audit.jsonl";

/// What `folder` says; without one nobody is let in.
pub fn door(folder: Option<&Path>) -> Result<Door, BadTokens> {
    let Some(folder) = folder else { return Ok(Door { tokens: Tokens::default(), audit: Audit::in_memory() }) };
    let tokens = Tokens::read(&folder.join(TOKENS))?;
    let path = folder.join(AUDIT);
    let audit = Audit::open(&path).map_err(|cause| BadTokens::Unreadable(path, cause))?;
    Ok(Door { tokens, audit })
}

/// A folder made for one run of `kittiwake up`, with one token that may do everything; removed with the value.
pub struct DemoAccess {
    /// Where it is.
    pub folder: PathBuf,
    /// The token.
    pub token: String,
}

impl DemoAccess {
    /// Makes the folder.
    ///
    /// # Errors
    /// If that is not possible, or the operating system has no randomness.
    pub fn create() -> io::Result<DemoAccess> {
        run_file::private_folder(&run_file::folder())?;
        let folder = run_file::folder().join(format!("{}.access", std::process::id()));
        run_file::private_folder(&folder)?;
        let demo = DemoAccess { folder, token: random_token()? };
        let text = entry("demo", &Role::ALL, &demo.token);
        run_file::write_private(&demo.folder.join(TOKENS), text.as_bytes())?;
        Ok(demo)
    }
}

impl Drop for DemoAccess {
    fn drop(&mut self) {
        // Gone already, or of no use to anybody: the gateway that took the token has ended.
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// 256 bits in hexadecimal.
fn random_token() -> io::Result<String> {
    use io::Read;
    let mut bytes = [0; 32];
    std::fs::File::open("/dev/urandom")?.read_exact(&mut bytes)?;
    Ok(bytes.iter().map(|it| format!("{it:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_token_made_for_a_run_may_do_everything_and_is_gone_with_it() {
        let demo = DemoAccess::create().unwrap();
        let door = door(Some(&demo.folder)).unwrap();
        let who = door.tokens.identify(&demo.token, 0).unwrap();
        assert_eq!(who.roles, Role::ALL);
        let folder = demo.folder.clone();
        drop(demo);
        assert!(!folder.exists());
    }
}
