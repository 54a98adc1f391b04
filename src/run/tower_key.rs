//! The key with which the control tower signs permissions, and its public half, with which vehicles verify them, as files.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use signed_permissions::key::{InvalidKey, NoRandomNumbers, PublicKey, SecretKey};

use crate::run::run_file::private_folder;

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

/// The key in the tower's state folder, made at the first start. A key that is there and cannot be used is never replaced: vehicles go by
/// it. Its public half is written whenever it is not there as it should be.
///
/// # Errors
/// If it cannot be used or made.
pub fn in_folder(folder: &Path) -> Result<SecretKey, Failure> {
    let path = folder.join(SECRET);
    let key = match read_secret(&path) {
        Err(Failure::Read { cause, .. }) if cause.kind() == ErrorKind::NotFound => make(folder)?,
        other => other?,
    };
    write_public(folder, key.public())?;
    Ok(key)
}

/// The key in `secret`, made if there is none, with its public half in `public`, to be copied to vehicles.
///
/// # Errors
/// If it cannot be used or made.
pub fn in_folders(secret: &Path, public: &Path) -> Result<(), Failure> {
    let key = in_folder(secret)?;
    private_folder(public).map_err(|cause| Failure::Write { path: public.to_owned(), cause })?;
    write_public(public, key.public())
}

/// Makes a key.
fn make(folder: &Path) -> Result<SecretKey, Failure> {
    let key = SecretKey::generate()?;
    private_folder(folder).map_err(|cause| Failure::Write { path: folder.to_owned(), cause })?;
    write_whole(&folder.join(SECRET), &key.to_text())?;
    Ok(key)
}

/// Leaves a file alone that holds this key. One that holds another, or nothing, was left behind by a start that was killed, or belongs to
/// a key that was removed since: a vehicle that goes by it would refuse every permission of this tower.
fn write_public(folder: &Path, key: PublicKey) -> Result<(), Failure> {
    let path = folder.join(PUBLIC);
    match read_public(&path) {
        Ok(there) if there == key => Ok(()),
        _ => write_whole(&path, &key.to_string()),
    }
}

/// A reader finds the whole key or nothing, also after a power loss: a tower that finds half a key does not start.
fn write_whole(path: &Path, line: &str) -> Result<(), Failure> {
    let written = regular_file::replace(path, 0o600, format!("{line}\n").as_bytes());
    written.map_err(|cause| Failure::Write { path: path.to_owned(), cause })
}

fn read<K: FromStr<Err = InvalidKey>>(path: &Path) -> Result<K, Failure> {
    let text = regular_file::read_text(path).map_err(|cause| Failure::Read { path: path.to_owned(), cause })?;
    text.parse().map_err(|cause| Failure::Invalid { path: path.to_owned(), cause })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::run_file::write_private;
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
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2, "the key and its public half");
    }

    #[test]
    fn the_public_half_is_written_again_unless_it_is_that_of_the_key() {
        #[track_caller]
        fn check(spoil: impl FnOnce(&Path)) {
            let folder = tempfile::tempdir().unwrap();
            let (state, public) = (folder.path().join("state"), folder.path().join("for-vehicles"));
            let made = in_folder(&state).unwrap().public();
            spoil(&state.join(PUBLIC));
            in_folders(&state, &public).unwrap();
            for it in [state, public] {
                assert_eq!(read_public(&it.join(PUBLIC)).unwrap(), made);
                assert_eq!(mode(&it.join(PUBLIC)), 0o600);
            }
        }
        check(|_| ());
        check(|path| std::fs::remove_file(path).unwrap());
        check(|path| std::fs::write(path, "").unwrap());
        check(|path| std::fs::write(path, "kittiwake-tower-public").unwrap());
        check(|path| std::fs::write(path, format!("{}\n", SecretKey::generate().unwrap().public())).unwrap());
        check(|path| std::fs::write(path.with_added_extension("part"), "left behind").unwrap());
    }

    #[test]
    fn a_public_half_that_is_right_is_left_alone() {
        use std::os::unix::fs::MetadataExt;
        let folder = tempfile::tempdir().unwrap();
        let file = || std::fs::metadata(folder.path().join(PUBLIC)).unwrap().ino();
        in_folder(folder.path()).unwrap();
        let before = file();
        in_folder(folder.path()).unwrap();
        assert_eq!(file(), before);
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
