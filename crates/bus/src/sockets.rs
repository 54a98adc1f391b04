//! Unix sockets: who may reach a router is decided by the folder its socket is in, so that folder is checked before anything
//! listens or connects.
//!
//! Zenoh takes any path, replaces whatever is there, and says in its developers' words what goes wrong.

use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use nix::unistd::geteuid;

/// What locators of Unix sockets begin with.
const PREFIX: &str = "unixsock-stream/";

/// What Linux takes as the path of a socket, in bytes (`sun_path` of unix(7), without the closing zero).
const LONGEST: usize = 107;

/// Why a socket is not used.
#[derive(Debug, thiserror::Error)]
pub enum InvalidSocket {
    /// The operating system takes no such path.
    #[error("the socket's path {path} has {bytes} bytes, at most {LONGEST} are possible: choose a shorter folder")]
    TooLong {
        /// The path.
        path: PathBuf,
        /// Its length.
        bytes: usize,
    },
    /// There is no folder for it, and none can be made.
    #[error("the socket's folder {folder} cannot be used: {cause}")]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the operating system said.
        cause: std::io::Error,
    },
    /// The owner of the folder could put another socket there.
    #[error(
        "the socket's folder {folder} belongs to user {owner}, and this process runs as user {own}: choose another folder"
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// Whose it is.
        owner: u32,
        /// Who we are.
        own: u32,
    },
    /// A user who may enter the folder may fly.
    #[error("the socket's folder {folder} may be entered by others (mode {mode:o}): `chmod 700` it, or choose another")]
    Open {
        /// The folder.
        folder: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// It would be overwritten.
    #[error("{path} exists and is not a socket: remove it, or choose another path")]
    InTheWay {
        /// The path.
        path: PathBuf,
    },
    /// Somebody listens there.
    #[error("{path} is in use: another process listens there")]
    InUse {
        /// The path.
        path: PathBuf,
    },
}

/// The locator of the Unix socket at `path`.
pub fn locator_of(path: &Path) -> String {
    format!("{PREFIX}{}", path.display())
}

/// A locator in a form that Zenoh takes, of the transports that are built in.
///
/// # Errors
/// What is wrong with it, and what is expected.
pub fn read_locator(text: &str) -> Result<String, String> {
    let expected = "expected `unixsock-stream/PATH`, `tcp/HOST:PORT` or `tls/HOST:PORT`, such as `tcp/127.0.0.1:7447`";
    if let Some(path) = path_in(text) {
        // Whether one may listen there is a question of its own: `check_to_listen`.
        let is_named = !path.as_os_str().is_empty();
        return if is_named { Ok(text.to_owned()) } else { Err(format!("no path; {expected}")) };
    }
    let address = text.strip_prefix("tcp/").or_else(|| text.strip_prefix("tls/")).ok_or(expected)?;
    let address = address.split(['?', '#']).next().unwrap_or_default();
    match address.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => Ok(text.to_owned()),
        _ => Err(format!("found `{address}`, which is not a host and a port from 0 to 65535; {expected}")),
    }
}

/// The socket's path in a locator; `None` if it names none.
pub fn path_in(locator: &str) -> Option<&Path> {
    let path = locator.strip_prefix(PREFIX)?;
    Some(Path::new(path.split(['?', '#']).next().unwrap_or_default()))
}

/// Makes sure that one may listen at `path`: in a folder that belongs to this user alone, which is made if it is missing, and
/// where there is nothing, or a socket that a process has left behind.
///
/// # Errors
/// With what is wrong first.
pub fn check_to_listen(path: &Path) -> Result<(), InvalidSocket> {
    check_length(path)?;
    let folder = folder_of(path);
    let unusable = |cause| InvalidSocket::Folder { folder: folder.to_owned(), cause };
    match std::fs::DirBuilder::new().mode(0o700).create(folder) {
        Err(cause) if cause.kind() != ErrorKind::AlreadyExists => return Err(unusable(cause)),
        _ => {}
    }
    let found = std::fs::metadata(folder).map_err(unusable)?;
    if !found.is_dir() {
        return Err(unusable(ErrorKind::NotADirectory.into()));
    }
    let own = geteuid().as_raw();
    if found.uid() != own {
        return Err(InvalidSocket::Foreign { folder: folder.to_owned(), owner: found.uid(), own });
    }
    let mode = found.mode() & 0o777;
    if mode & 0o077 != 0 {
        return Err(InvalidSocket::Open { folder: folder.to_owned(), mode });
    }
    let path = path.to_owned();
    match std::fs::symlink_metadata(&path) {
        Err(cause) if cause.kind() == ErrorKind::NotFound => Ok(()),
        Err(cause) => Err(unusable(cause)),
        Ok(it) if !it.file_type().is_socket() => Err(InvalidSocket::InTheWay { path }),
        // One that nobody listens to refuses; zenoh replaces it.
        Ok(_) => match UnixStream::connect(&path) {
            Err(cause) if matches!(cause.kind(), ErrorKind::ConnectionRefused | ErrorKind::NotFound) => Ok(()),
            _ => Err(InvalidSocket::InUse { path }),
        },
    }
}

/// Makes sure that what listens at `path`, now or later, is a process of this user or of root's: the folder is theirs, and nobody else
/// can put a socket into it. Root trusts every user's.
///
/// # Errors
/// With what is wrong first.
pub(crate) fn check_to_connect(path: &Path) -> Result<(), InvalidSocket> {
    check_length(path)?;
    let folder = folder_of(path);
    let own = geteuid().as_raw();
    match std::fs::metadata(folder) {
        Ok(it) if it.uid() != own && it.uid() != 0 && own != 0 => {
            Err(InvalidSocket::Foreign { folder: folder.to_owned(), owner: it.uid(), own })
        }
        Ok(it) if it.mode() & 0o022 != 0 => {
            Err(InvalidSocket::Open { folder: folder.to_owned(), mode: it.mode() & 0o777 })
        }
        // One that is missing may be made later: processes are started in any order.
        _ => Ok(()),
    }
}

/// What to say about `locator` when nothing answers there, if zenoh's own words say less.
pub(crate) fn why_unreachable(locator: &str) -> Option<String> {
    let path = path_in(locator)?;
    match std::fs::symlink_metadata(path) {
        Err(cause) => Some(format!("{}: {cause}; is the router running?", path.display())),
        Ok(it) if !it.file_type().is_socket() => Some(format!("{} is not a socket", path.display())),
        Ok(_) => {
            UnixStream::connect(path).err().map(|cause| format!("{}: {cause}; is the router running?", path.display()))
        }
    }
}

fn check_length(path: &Path) -> Result<(), InvalidSocket> {
    let bytes = path.as_os_str().len();
    if LONGEST < bytes { Err(InvalidSocket::TooLong { path: path.to_owned(), bytes }) } else { Ok(()) }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|it| !it.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::net::UnixListener;

    #[track_caller]
    fn refused(path: &Path, said: &str) {
        let refusal = check_to_listen(path).unwrap_err().to_string();
        assert!(refusal.contains(said), "{refusal}");
    }

    fn mode(folder: &Path, mode: u32) {
        std::fs::set_permissions(folder, std::fs::Permissions::from_mode(mode)).unwrap();
    }

    #[test]
    fn a_socket_needs_a_folder_of_its_users_own() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("run");
        let socket = folder.join("router.sock");
        check_to_listen(&socket).unwrap();
        assert_eq!(std::fs::metadata(&folder).unwrap().mode() & 0o777, 0o700, "it was made");
        check_to_listen(&socket).unwrap();
        for open in [0o755, 0o710, 0o701] {
            mode(&folder, open);
            refused(&socket, &format!("may be entered by others (mode {open:o}): `chmod 700` it"));
        }
        refused(&root.path().join("a/b/router.sock"), "cannot be used: No such file");
        std::fs::write(root.path().join("file"), "").unwrap();
        refused(&root.path().join("file/router.sock"), "cannot be used: not a directory");
    }

    #[test]
    fn the_folder_of_another_user_is_refused_by_both_ends() {
        let root = tempfile::tempdir().unwrap();
        let nobody = 65_534;
        let (folder, own) = match geteuid().is_root() {
            // Root may hand a folder to somebody else; another user finds one of root's.
            true => {
                std::os::unix::fs::chown(root.path(), Some(nobody), None).unwrap();
                (root.path(), 0)
            }
            false => (Path::new("/"), geteuid().as_raw()),
        };
        let owner = std::fs::metadata(folder).unwrap().uid();
        refused(&folder.join("router.sock"), &format!("belongs to user {owner}, and this process runs as user {own}"));
        check_to_connect(&folder.join("router.sock")).expect("root trusts every user, and every user root");
    }

    #[test]
    fn a_folder_into_which_others_can_put_a_socket_is_refused_by_both_ends() {
        let root = tempfile::tempdir().unwrap();
        let socket = root.path().join("router.sock");
        for open in [0o1777, 0o770] {
            mode(root.path(), open);
            refused(&socket, "may be entered by others");
            let refusal = check_to_connect(&socket).unwrap_err().to_string();
            assert!(refusal.contains("may be entered by others"), "{refusal}");
        }
        mode(root.path(), 0o700);
        check_to_connect(&socket).unwrap();
    }

    #[test]
    fn what_is_in_the_way_is_not_replaced_and_what_was_left_behind_is() {
        let root = tempfile::tempdir().unwrap();
        mode(root.path(), 0o700);
        let socket = root.path().join("router.sock");
        std::fs::write(&socket, "precious").unwrap();
        refused(&socket, "exists and is not a socket: remove it");
        assert_eq!(std::fs::read_to_string(&socket).unwrap(), "precious");
        assert!(why_unreachable(&locator_of(&socket)).unwrap().contains("is not a socket"));
        std::fs::remove_file(&socket).unwrap();
        assert!(why_unreachable(&locator_of(&socket)).unwrap().contains("is the router running?"));
        let listener = UnixListener::bind(&socket).unwrap();
        refused(&socket, "is in use: another process listens there");
        assert_eq!(why_unreachable(&locator_of(&socket)), None);
        drop(listener);
        assert!(socket.exists(), "it is left behind");
        check_to_listen(&socket).unwrap();
    }

    #[test]
    fn a_path_that_is_too_long_is_refused_by_both_ends() {
        let path = PathBuf::from(format!("/tmp/{}/router.sock", "n".repeat(100)));
        refused(&path, "has 117 bytes, at most 107 are possible: choose a shorter folder");
        assert!(check_to_connect(&path).is_err());
    }

    #[test]
    fn a_locator_that_nothing_can_listen_at_is_refused_with_what_is_expected() {
        #[track_caller]
        fn check(locator: &str, expected: Result<(), &str>) {
            let found = read_locator(locator);
            match (&found, expected) {
                (Ok(it), Ok(())) => assert_eq!(it, locator),
                (Err(found), Err(expected)) => assert!(found.starts_with(expected), "{found}"),
                _ => panic!("{locator}: {found:?}"),
            }
        }
        let forms = "expected `unixsock-stream/PATH`, `tcp/HOST:PORT` or `tls/HOST:PORT`";
        for fine in
            ["unixsock-stream//run/a.sock", "tcp/127.0.0.1:0", "tls/[::1]:7448", "tls/ground-router:7448#so_rcvbuf=1"]
        {
            check(fine, Ok(()));
        }
        check("foo", Err(forms));
        check("udp/127.0.0.1:7447", Err(forms));
        check("unixsock-stream/", Err("no path; expected"));
        check("tcp/127.0.0.1:999999", Err("found `127.0.0.1:999999`, which is not a host and a port from 0 to 65535"));
        check("tcp/:7447", Err("found `:7447`"));
        check("tcp/7447", Err("found `7447`"));
    }

    #[test]
    fn a_locator_names_a_path() {
        #[track_caller]
        fn check(locator: &str, expected: Option<&str>) {
            assert_eq!(path_in(locator), expected.map(Path::new), "{locator}");
        }
        check("unixsock-stream//run/kittiwake/router.sock", Some("/run/kittiwake/router.sock"));
        check("unixsock-stream/here/router.sock?a=b#c=d", Some("here/router.sock"));
        check("tcp/127.0.0.1:7447", None);
        assert_eq!(path_in(&locator_of(Path::new("/a/b"))), Some(Path::new("/a/b")));
    }
}
