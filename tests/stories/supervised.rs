//! What a supervisor such as systemd observes of a process.

use std::io::{BufRead, BufReader};
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use crate::support::{KITTIWAKE, LIMIT, kittiwake, shipped, wait_for};

/// A process with a supervisor that waits two seconds for each sign of life.
struct Supervised {
    process: Child,
    signs: UnixDatagram,
    _folder: tempfile::TempDir,
}

impl Supervised {
    fn start(args: &[&str]) -> Supervised {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let socket = folder.path().join("notify");
        let signs = UnixDatagram::bind(&socket).expect("a socket can be bound");
        signs.set_read_timeout(Some(LIMIT)).expect("a limit can be set");
        let process = Command::new(KITTIWAKE)
            .args(args)
            .env("NOTIFY_SOCKET", &socket)
            .env("WATCHDOG_USEC", "2000000")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        Supervised { process, signs, _folder: folder }
    }

    /// The next notification to its supervisor.
    #[track_caller]
    fn sign(&self) -> String {
        let mut bytes = [0; 256];
        let length = self.signs.recv(&mut bytes).expect("a sign within the limit");
        String::from_utf8_lossy(&bytes[..length]).trim().to_owned()
    }
}

impl Drop for Supervised {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn each_process_says_that_it_is_ready_and_then_that_its_loop_turns() {
    let mut router = Supervised::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    let mut locator = String::new();
    let stdout = router.process.stdout.take().expect("it is a pipe");
    BufReader::new(stdout).read_line(&mut locator).expect("the router says where it listens");
    let config = shipped().join("kittiwake.toml").to_string_lossy().into_owned();
    let usual = ["--config", &config, "--connect", locator.trim()];
    let planner = Supervised::start(&[&["planner"], &usual[..]].concat());
    let gateway = Supervised::start(&[&["gateway"], &usual[..]].concat());
    for process in [&router, &planner, &gateway] {
        assert_eq!(process.sign(), "READY=1");
        for _ in 0..3 {
            assert_eq!(process.sign(), "WATCHDOG=1");
        }
    }
    check_health(&["--process", "router", "--connect", locator.trim()], 0, "router: router listens");
    let planner = ["--process", "planner", "--vehicle", "uav1", "--connect", locator.trim()];
    check_health(&planner, 0, "planner: up for ");
    check_health(&["--process", "gateway", "--config", &config, "--connect", locator.trim()], 0, "gateway: up for ");
    check_health(&["--process", "mcm", "--config", &config, "--connect", locator.trim()], 1, "mcm: not on the bus");
    drop(router);
    check_health(&planner, 1, "planner: no router reached at ");
}

/// The health of a process as a supervisor is told it in the end: on a crowded machine one answer may take longer than the
/// command waits.
#[track_caller]
fn check_health(args: &[&str], code: i32, said: &str) {
    wait_for(&format!("`{said}` of {args:?}"), || {
        let output = kittiwake(&[&["health"], args].concat());
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(told.lines().count(), 1, "{args:?}: {told}{}", String::from_utf8_lossy(&output.stderr));
        (output.status.code() == Some(code) && told.starts_with(said)).then_some(())
    });
    wait_for(&format!("the document of {args:?}"), || {
        let output = kittiwake(&[&["health", "--json"], args].concat());
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("it is JSON");
        assert_eq!(told["healthy"], output.status.success(), "{told}");
        (told["healthy"] == (code == 0)).then_some(())
    });
}

#[test]
fn the_unit_is_one_that_systemd_takes() {
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for name in ["kittiwake@.service", "kittiwake-config.service", "kittiwake.target"] {
        let unit = std::fs::read_to_string(deploy.join(name)).expect("the unit is there");
        // Only the installed program is missing on this machine.
        let unit = unit.replace("/usr/local/bin/kittiwake", KITTIWAKE);
        std::fs::write(folder.path().join(name), unit).expect("a file can be written");
    }
    let mut verify = Command::new("systemd-analyze");
    let output = match verify.arg("verify").arg(folder.path().join("kittiwake@mcm.service")).output() {
        Ok(output) => output,
        Err(_) => return eprintln!("SKIPPED: systemd-analyze is not installed, the unit is not verified"),
    };
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !said.contains("kittiwake"), "{said}");
}
