//! Who may reach the bus: by default nobody but the user who started it.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixListener;
use std::path::Path;

use crate::support::{System, kittiwake, wait_for};

fn mode(path: &Path) -> u32 {
    std::fs::metadata(path).expect("it is there").permissions().mode() & 0o777
}

#[test]
fn the_bus_is_behind_a_folder_that_nobody_else_can_enter() {
    let system = System::start(&[]);
    let locator = system.locator();
    let socket = Path::new(locator.strip_prefix("unixsock-stream/").expect("a Unix socket"));
    let folder = socket.parent().expect("it is in a folder");
    assert_eq!(mode(folder), 0o700);
    assert!(socket.exists());
    // The direct links are beside it.
    wait_for("the skill manager", || folder.join("skill-manager.sock").exists().then_some(()));
    let said = system.inject(&["flag", "battery_low"]);
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    // A system beside it has a folder of its own.
    let another = System::start(&[]);
    assert_ne!(another.locator(), locator);
}

#[test]
fn tcp_is_there_for_who_asks_for_it() {
    let system = System::start(&["--listen", "tcp/127.0.0.1:0"]);
    let locator = system.locator();
    assert!(locator.starts_with("tcp/127.0.0.1:") && !locator.ends_with(":0"), "{locator}");
}

#[test]
fn a_socket_that_is_not_to_be_used_is_refused_in_one_sentence() {
    #[track_caller]
    fn refused(path: &Path, said: &str) {
        let output = kittiwake(&["run", "router", "--listen", &format!("unixsock-stream/{}", path.display())]);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(5), "{told}");
        assert!(told.contains(said) && told.lines().count() == 1, "expected `{said}`, found:\n{told}");
    }
    let root = tempfile::tempdir().expect("a temporary folder can be made");
    let folder = root.path();
    std::fs::set_permissions(folder, PermissionsExt::from_mode(0o700)).unwrap();
    refused(&folder.join("n".repeat(100)).join("router.sock"), "at most 107 are possible: choose a shorter folder");
    std::fs::write(folder.join("file.sock"), "precious").unwrap();
    refused(&folder.join("file.sock"), "file.sock exists and is not a socket: remove it");
    let _taken = UnixListener::bind(folder.join("taken.sock")).unwrap();
    refused(&folder.join("taken.sock"), "taken.sock is in use: another process listens there");
    std::fs::set_permissions(folder, PermissionsExt::from_mode(0o755)).unwrap();
    refused(&folder.join("router.sock"), "may be entered by others (mode 755): `chmod 700` it");
}
