//! The key with which the control tower signs permissions, and its public half, with which vehicles verify them, as files.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use signed_permissions::key::{InvalidKey, NoRandomNumbers, PublicKey, SecretKey};

use crate::run::run_file::{private_folder, write_private};

/// The key, which only its owner may read, in the tower's folder.
pub const SECRET: &str = "control-tower.key";
/// Its public half, for vehicles.
pub const PUBLIC: &str = "control-tower.pub";

/// Why there is no key.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// It cannot be read.
    #[error("the key of the control tower {} cannot be read: {cause}", path.display())]
    Read {
        /// Where.
        path: PathBuf,
        /// What the operating system said.
        cause: io::Error,
    },
    /// It holds something else.
    #[error("{} holds {cause}", path.display())]
    Invalid {
        /// Where.
        path: PathBuf,
        /// What was expected.
        cause: InvalidKey,
    },
    /// Others could sign permissions with it.
    #[error("{} may be read by others (mode {mode:o}): make it readable for its owner only, `chmod 600`", path.display())]
    NotPrivate {
        /// Where.
        path: PathBuf,
        /// Its present mode.
        mode: u32,
    },
    /// It cannot be made.
    #[error("the key of the control tower {} cannot be written: {cause}", path.display())]
    Write {
        /// Where.
        path: PathBuf,
        /// What the operating system said.
        cause: io::Error,
    },
    /// It cannot be made up.
    #[error(transparent)]
    NoRandomNumbers(#[from] NoRandomNumbers),
}

/// The public key in a file.
///
/// # Errors
/// If there is none.
pub fn read_public(path: &Path) -> Result<PublicKey, Failure> {
    read(path)
}

/// The secret key in a file that only its owner can read.
///
/// # Errors
/// If there is none, or others may read it.
pub fn read_secret(path: &Path) -> Result<SecretKey, Failure> {
    use std::os::unix::fs::PermissionsExt;
    let metadata = std::fs::metadata(path).map_err(|cause| Failure::Read { path: path.to_owned(), cause })?;
    let mode = metadata.permissions().mode() & 0o7777;
    if mode & 0o077 != 0 {
        return Err(Failure::NotPrivate { path: path.to_owned(), mode });
    }
    read(path)
}

/// The key of a tower: the one in the file `named`, or the one in the folder of its state; `None`: it has neither.
///
/// # Errors
/// If it cannot be used or made.
pub fn of_tower(named: Option<&Path>, state: Option<&Path>) -> Result<Option<SecretKey>, Failure> {
    named.map(read_secret).or_else(|| state.map(in_folder)).transpose()
}

/// The key in the tower's state folder, made at the first start together with its public half. A key that is there and cannot
/// be used is never replaced: vehicles go by it.
///
/// # Errors
/// If it cannot be used or made.
pub fn in_folder(folder: &Path) -> Result<SecretKey, Failure> {
    let path = folder.join(SECRET);
    let key = match read_secret(&path) {
        Err(Failure::Read { cause, .. }) if cause.kind() == ErrorKind::NotFound => make(folder)?,
        other => other?,
    };
    let public = folder.join(PUBLIC);
    if !public.exists() {
        write_whole(&public, &key.public().to_string())?;
    }
    Ok(key)
}

/// The key in `secret`, made if there is none, with its public half in `public`, to be copied to vehicles.
///
/// # Errors
/// If it cannot be used or made.
pub fn in_folders(secret: &Path, public: &Path) -> Result<(), Failure> {
    let key = in_folder(secret)?;
    private_folder(public).map_err(|cause| Failure::Write { path: public.to_owned(), cause })?;
    write_whole(&public.join(PUBLIC), &key.public().to_string())
}

/// Makes a key and its public half.
fn make(folder: &Path) -> Result<SecretKey, Failure> {
    let key = SecretKey::generate()?;
    private_folder(folder).map_err(|cause| Failure::Write { path: folder.to_owned(), cause })?;
    write_whole(&folder.join(SECRET), &key.to_text())?;
    write_whole(&folder.join(PUBLIC), &key.public().to_string())?;
    Ok(key)
}

/// A reader finds all of it or nothing.
fn write_whole(path: &Path, line: &str) -> Result<(), Failure> {
    let unfinished = path.with_added_extension("part");
    let written = write_private(&unfinished, format!("{line}\n").as_bytes());
    let written = written.and_then(|()| std::fs::rename(&unfinished, path));
    written.map_err(|cause| Failure::Write { path: path.to_owned(), cause })
}

fn read<K: FromStr<Err = InvalidKey>>(path: &Path) -> Result<K, Failure> {
    let text = credentials::file::read_text(path).map_err(|cause| Failure::Read { path: path.to_owned(), cause })?;
    text.parse().map_err(|cause| Failure::Invalid { path: path.to_owned(), cause })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    fn mode(path: &Path) -> u32 {
        std::fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn a_key_is_made_once_for_its_owner_only() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("state");
        let made = in_folder(&folder).unwrap().public();
        assert_eq!(mode(&folder.join(SECRET)), 0o600);
        assert_eq!(in_folder(&folder).unwrap().public(), made);
        std::fs::remove_file(folder.join(PUBLIC)).unwrap();
        in_folder(&folder).unwrap();
        assert_eq!(read_public(&folder.join(PUBLIC)).unwrap(), made);
    }

    #[test]
    fn a_key_that_cannot_be_used_is_reported_and_not_replaced() {
        #[track_caller]
        fn check(text: &str, mode: u32, expected: &str) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(SECRET);
            write_private(&path, text.as_bytes()).unwrap();
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(mode)).unwrap();
            let said = in_folder(folder.path()).unwrap_err().to_string();
            assert!(said.contains(expected), "{said}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
        }
        check(
            "garbled",
            0o600,
            "holds no key of the control tower: expected one line, `kittiwake-tower-secret ed25519`",
        );
        check("", 0o600, "holds no key of the control tower");
        check("garbled", 0o644, "may be read by others (mode 644)");
    }

    #[test]
    fn a_vehicle_is_not_given_the_secret_key() {
        let folder = tempfile::tempdir().unwrap();
        in_folder(folder.path()).unwrap();
        let said = read_public(&folder.path().join(SECRET)).unwrap_err().to_string();
        assert!(said.contains("a vehicle gets the public one"), "{said}");
    }
}
