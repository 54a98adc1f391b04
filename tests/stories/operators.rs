//! The commands other than `up`.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use crate::support::{KITTIWAKE, System, kittiwake};

#[test]
fn every_command_explains_itself() {
    let commands = [
        "up",
        "demo",
        "doctor",
        "certs",
        "run",
        "px4-check",
        "autopilot-check",
        "simulate",
        "replay",
        "inject",
        "status",
        "vehicle",
        "mission",
        "permission",
        "audit",
        "why",
    ];
    let overview = String::from_utf8(kittiwake(&["--help"]).stdout).unwrap();
    for command in commands {
        assert!(overview.contains(command), "{command} is not in the overview");
        let help = kittiwake(&[command, "--help"]);
        assert!(help.status.success() && !help.stdout.is_empty(), "{command}");
    }
}

#[test]
fn an_injection_is_checked_and_the_status_is_printed() {
    #[track_caller]
    fn check(system: &System, args: &[&str], code: i32, part: &str) {
        let output = system.inject(args);
        let printed = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert_eq!(output.status.code(), Some(code), "{args:?}: {printed}");
        assert!(printed.contains(part), "{args:?}: {printed}");
    }
    let system = System::start(&["--speed", "1"]);
    system.wait_for(" is up: ");
    check(&system, &["flag", "obstcle"], 2, "did you mean `obstacle`?");
    check(&system, &["fault", "batery", "0.5"], 2, "did you mean `battery`?");
    check(&system, &["fault", "battery", "2"], 2, "expected 0 to 1");
    check(&system, &["fault", "wind", "3", "-4"], 0, "north 3, east -4");
    check(&system, &["fault"], 0, "swallow_acks COUNT");
    assert_eq!(system.status()["vehicle"], "uav1");
    let screen = kittiwake(&["status", "--pid", &system.pid().to_string()]);
    let screen = String::from_utf8_lossy(&screen.stdout).into_owned();
    assert!(screen.starts_with("uav1") && screen.lines().count() < 25, "{screen}");
}

#[test]
fn with_two_systems_the_commands_ask_which_one() {
    let (one, other) = (System::start(&["--speed", "1"]), System::start(&["--speed", "1"]));
    let (first, second) = (one.locator(), other.locator());
    one.wait_for("status: ");
    other.wait_for("status: ");
    let output = kittiwake(&["status"]);
    let printed = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert!(printed.contains(&first) && printed.contains(&second), "{printed}");
    let output = kittiwake(&["status", "--connect", &second]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn an_injection_without_a_system_is_unavailable() {
    let mut router = Command::new(KITTIWAKE)
        .args(["run", "router", "--listen", "tcp/127.0.0.1:0", "--exit-with-parent"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut locator = String::new();
    BufReader::new(router.stdout.take().unwrap()).read_line(&mut locator).unwrap();
    for what in [&["flag", "obstacle"][..], &["fault", "battery", "0.5"]] {
        let output = kittiwake(&[&["inject"], what, &["--connect", locator.trim()]].concat());
        let printed = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert!(printed.contains("unavailable"), "{printed}");
    }
    drop(router.stdin.take());
    assert!(router.wait().unwrap().success(), "the router ends with its parent");
}
