//! What a supervisor such as systemd observes of a process.

use std::io::{BufRead, BufReader};
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, ExitStatus, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

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

    /// Whether it gets as far as to say that it is ready.
    #[track_caller]
    fn gets_ready(&mut self) -> bool {
        self.signs.set_nonblocking(true).expect("a socket can be changed");
        let ready = wait_for("a sign, or the end", || match self.signs.recv(&mut [0; 256]) {
            Ok(_) => Some(true),
            Err(_) => self.ending().map(|_| false),
        });
        self.signs.set_nonblocking(false).expect("a socket can be changed");
        ready
    }

    /// How it ended, if it did.
    fn ending(&mut self) -> Option<ExitStatus> {
        self.process.try_wait().expect("the process was started")
    }

    fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.process.id() as i32), signal).expect("the process is there");
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

/// A router, and where it listens.
fn router() -> (Supervised, String) {
    let mut router = Supervised::start(&["run", "router", "--listen", "tcp/127.0.0.1:0"]);
    let mut locator = String::new();
    let stdout = router.process.stdout.take().expect("it is a pipe");
    BufReader::new(stdout).read_line(&mut locator).expect("the router says where it listens");
    (router, locator.trim().to_owned())
}

#[test]
fn each_process_says_that_it_is_ready_and_then_that_its_loop_turns() {
    let (router, locator) = router();
    let config = shipped().join("kittiwake.toml").to_string_lossy().into_owned();
    let usual = ["--config", &config, "--connect", &locator];
    let planner = Supervised::start(&[&["run", "planner"], &usual[..]].concat());
    let gateway = Supervised::start(&[&["run", "gateway"], &usual[..]].concat());
    for process in [&router, &planner, &gateway] {
        assert_eq!(process.sign(), "READY=1");
        for _ in 0..3 {
            assert_eq!(process.sign(), "WATCHDOG=1");
        }
    }
    check_health(&["--process", "router", "--connect", &locator], 0, "router: router listens");
    let planner = ["--process", "planner", "--vehicle", "uav1", "--connect", &locator];
    check_health(&planner, 0, "planner: up for ");
    check_health(&["--process", "gateway", "--config", &config, "--connect", &locator], 0, "gateway: up for ");
    check_health(&["--process", "mcm", "--config", &config, "--connect", &locator], 1, "mcm: not on the bus");
    drop(router);
    check_health(&planner, 1, "planner: no router reached at ");
}

#[test]
fn a_supervisor_that_reads_nothing_stops_nobody() {
    let (_router, locator) = router();
    let config = shipped().join("kittiwake.toml").to_string_lossy().into_owned();
    let _planner = Supervised::start(&["run", "planner", "--config", &config, "--connect", &locator]);
    // Linux queues this many unread notifications; the planner sends two a second.
    let kept = std::fs::read_to_string("/proc/sys/net/unix/max_dgram_qlen").expect("Linux says how many it keeps");
    let kept: f64 = kept.trim().parse().expect("a number");
    let long_s = kept.min(20.0) / 2.0 + 3.0;
    wait_for("a planner that is up for longer", || {
        let output = kittiwake(&["health", "--process", "planner", "--vehicle", "uav1", "--connect", &locator]);
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        let up_s: f64 = told.strip_prefix("planner: up for ")?.split(' ').next()?.parse().ok()?;
        (long_s < up_s).then_some(())
    });
}

#[test]
fn of_two_managers_of_one_vehicle_the_older_one_ends_also_after_it_was_stopped() {
    let (_router, locator) = router();
    let config = shipped().join("kittiwake.toml").to_string_lossy().into_owned();
    let manager =
        || Supervised::start(&["run", "mcm", "--vehicle", "uav1", "--config", &config, "--connect", &locator]);
    let mut first = manager();
    assert!(first.gets_ready());
    first.signal(Signal::SIGSTOP);
    // As long as the router takes the first one for alive, a second one ends at once.
    let mut second = wait_for("a second manager that stays", || {
        let mut it = manager();
        it.gets_ready().then_some(it)
    });
    first.signal(Signal::SIGCONT);
    let ending = wait_for("the end of the older one", || first.ending());
    assert_eq!(ending.code(), Some(2));
    assert_eq!(second.sign(), "WATCHDOG=1");
    assert_eq!(second.ending(), None);
}

/// The health of a process as a supervisor sees it in the end: on a crowded machine one answer may take longer than the
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
