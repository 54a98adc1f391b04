//! A real ArduPilot Copter, software in the loop with its built-in quadrotor, in a network namespace that has nothing but a loopback.
//!
//! The namespace is made by util-linux's `unshare`, which needs no privileges where users may make namespaces. The autopilot keeps its
//! parameters in a folder of its own, so that every story starts from the same ones.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::px4::support::{KITTIWAKE, SHORT, System, mission};

/// Names the executable.
const VARIABLE: &str = "KITTIWAKE_ARDUCOPTER";
/// The parameters that docs/autopilots.md asks for, where they are not the defaults.
const PARAMETERS: &str = "FS_THR_ENABLE 0\nBATT_FS_LOW_ACT 2\nBATT_FS_CRT_ACT 1\n";
/// In the namespace: the autopilot beside the system, and it ends with the system. It waits for who connects to port 5760.
const SCRIPT: &str = r#"
ip link set lo up || exit 90
(cd "$AUTOPILOT_FOLDER" && exec "$AUTOPILOT_PROGRAM" --model + --speedup 1 -I0 --home 47.3977,8.5456,488,0 \
  --defaults "$AUTOPILOT_DEFAULTS" >autopilot.log 2>&1) &
autopilot=$!
"$@"
code=$?
kill "$autopilot"
exit "$code"
"#;

/// The executable that the environment names.
#[track_caller]
fn program() -> PathBuf {
    let path = std::env::var_os(VARIABLE).unwrap_or_else(|| panic!("{VARIABLE} has to name an arducopter executable"));
    let path = PathBuf::from(path);
    path.canonicalize().unwrap_or_else(|cause| panic!("{VARIABLE}: {}: {cause}", path.display()))
}

/// Starts the system over an autopilot that was never started before.
fn start(program: &Path, name: &str, args: &[&str]) -> System {
    start_with("", program, name, args)
}

/// The same with further parameters.
fn start_with(parameters: &str, program: &Path, name: &str, args: &[&str]) -> System {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("arducopter-{name}"));
    // It is there only if an earlier run has left it.
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let own = folder.join("own.parm");
    std::fs::write(&own, format!("{PARAMETERS}{parameters}")).expect("a file");
    // The frame and the calibration of its simulated sensors are in its sources, four folders above `build/sitl/bin/arducopter`.
    let sources = program.ancestors().nth(4).expect("a build folder");
    let of_simulator = sources.join("Tools/autotest/default_params/copter.parm");
    let mut command = Command::new("unshare");
    command.args(["--user", "--map-root-user", "--net", "--", "sh", "-c", SCRIPT, "sh", KITTIWAKE]);
    command.args(["up", "--vehicle", "mavlink", "--connect-autopilot", "tcpout:127.0.0.1:5760", "--exit-when-done"]);
    command.args(args).env("AUTOPILOT_FOLDER", &folder).env("AUTOPILOT_PROGRAM", program);
    command.env("AUTOPILOT_DEFAULTS", format!("{},{}", of_simulator.display(), own.display()));
    System::start(command)
}

#[test]
fn without_an_autopilot_nothing_takes_off_and_it_is_said_why() {
    let mut command = Command::new(KITTIWAKE);
    command.args(["up", "--vehicle", "mavlink", "--connect-autopilot", "udpin:127.0.0.1:0"]);
    System::start(command).wait_for("no autopilot is heard");
}

#[test]
#[ignore = "needs an arducopter executable: KITTIWAKE_ARDUCOPTER=PATH cargo test --test stories -- --ignored autopilots::"]
fn a_short_mission_is_flown() {
    let program = program();
    let mission = mission("real-arducopter-short", SHORT);
    let (code, said) = start(&program, "short", &["--mission", mission.to_str().expect("a path")]).end();
    assert_eq!(code, Some(0), "{said}");
}

#[test]
#[ignore = "needs an arducopter executable: KITTIWAKE_ARDUCOPTER=PATH cargo test --test stories -- --ignored autopilots::"]
fn the_reference_mission_is_flown() {
    let program = program();
    let (code, said) = start(&program, "reference", &[]).end();
    assert_eq!(code, Some(0), "{said}");
}

#[test]
#[ignore = "needs an arducopter executable: KITTIWAKE_ARDUCOPTER=PATH cargo test --test stories -- --ignored autopilots::"]
fn with_a_silent_tower_it_flies_round_the_first_area_and_comes_home() {
    let program = program();
    let (code, said) = start(&program, "silent", &["--permissions", "silent"]).end();
    assert_eq!(code, Some(3), "{said}");
}

#[test]
#[ignore = "needs an arducopter executable: KITTIWAKE_ARDUCOPTER=PATH cargo test --test stories -- --ignored autopilots::"]
fn its_gripper_is_opened_by_a_declared_skill_or_refuses_and_the_mission_goes_on() {
    /// How a flight ends that opens the gripper over a place, and what is said.
    #[track_caller]
    fn check(name: &str, parameters: &str, code: i32, expected: &str) {
        let there = "[[objective]]\nname = \"there\"\nnorth_m = 0\neast_m = 40\nheight_m = 10\nflying = true\n\
                     do = [{ skill = \"gripper_release\" }]\n";
        let back = "[[objective]]\nname = \"back\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n";
        let mission = mission(&format!("real-arducopter-{name}"), &format!("name = \"release\"\n{there}{back}"));
        let args = ["--mission", mission.to_str().expect("a path")];
        let (found, said) = start_with(parameters, &program(), name, &args).end();
        assert_eq!(found, Some(code), "{said}");
        assert!(said.contains(expected), "`{expected}` is missing: {said}");
    }
    check("gripper", "GRIP_ENABLE 1\nGRIP_TYPE 1\nSERVO8_FUNCTION 28\n", 0, "succeeded: released");
    check("no-gripper", "", 3, "ended as `refused`: the command is refused by the autopilot: failed");
}
