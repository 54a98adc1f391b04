//! Several people with a token each, in a folder that is removed with the value.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use gateway::access::{Role, entry};

use super::System;

/// The people whom the gateway lets in.
pub struct People {
    folder: tempfile::TempDir,
    tokens: String,
}

impl People {
    /// Each with a role; the token is the name.
    pub fn new(people: &[(&str, Role)]) -> People {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let tokens = people.iter().map(|(name, role)| entry(name, &[*role], name)).collect();
        let people = People { folder, tokens };
        people.write_tokens();
        people
    }

    /// Writes the file of the tokens again.
    pub fn write_tokens(&self) {
        let path = self.folder.path().join("tokens.toml");
        std::fs::write(&path, &self.tokens).expect("the file can be written");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("it is ours");
    }

    /// For `--token-file` of one of them.
    pub fn token_file(&self, name: &str) -> String {
        let path = self.folder.path().join(name);
        std::fs::write(&path, name).expect("the file can be written");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).expect("it is ours");
        path.to_str().expect("a temporary folder has a plain name").to_owned()
    }

    /// For `--access`.
    pub fn folder(&self) -> &str {
        Path::to_str(self.folder.path()).expect("a temporary folder has a plain name")
    }
}

impl System {
    /// The link to the operator's page for one of the [`People`].
    pub fn link_for(&self, name: &str) -> String {
        let line = self.wait_for("status: http://");
        let start = line.find("http://").unwrap_or(0);
        let end = line.find("/api/").unwrap_or(line.len());
        format!("{}/#token={name}", &line[start..end])
    }
}
