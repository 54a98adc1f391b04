//! Limits of the operating system that are met in flight.

use std::process::Command;

use crate::support::files::{Files, state_folder};
use crate::support::{System, wait_for};

#[test]
fn a_limit_on_the_size_of_files_fails_writes_and_ends_nothing() {
    let (files, state) = (Files::with_long_leg(), state_folder());
    let (config, state) = (files.config(), state.path().to_str().expect("a readable path"));
    let config = config.to_str().expect("a readable path");
    let system = System::up(&["--config", config, "--state", state, "--speed", "5"], &[]);
    system.wait_for_long_leg();
    let before = ids(&system);
    for id in before.iter().map(|(_, id)| *id).chain([system.pid() as i32]) {
        let limited = Command::new("prlimit").args(["--fsize=512:512", "--pid", &id.to_string()]).status();
        assert!(limited.is_ok_and(|it| it.success()), "the limit of {id} can be set");
    }
    wait_for("a write of the manager that fails", || {
        let flags = system.status()["contingencies"].to_string();
        flags.contains("memory_unwritable").then_some(())
    });
    assert_eq!(ids(&system), before, "every process is the one that it was");
}

#[test]
fn a_gateway_that_never_appears_takes_no_vehicle_from_the_air() {
    // An address of the documentation, which no machine has.
    let nowhere = ["--http", "192.0.2.1:8080", "--plain-http-beyond-loopback"];
    let files = Files::with_long_leg();
    let config = files.config();
    let config = config.to_str().expect("a readable path");
    let system = System::start(&[&["--config", config, "--speed", "4"], &nowhere[..]].concat());
    system.wait_for_long_leg();
    let on_board = ["router", "vehicle-sim", "monitor", "skill-manager", "planner", "mcm"];
    let before = on_board.map(|it| system.process(it).id());
    system.wait_for(
        "gateway; the aircraft may be in the air, so its processes are kept up until it is seen on the ground",
    );
    assert_eq!(on_board.map(|it| system.process(it).id()), before, "every process is the one that it was");
}

/// The processes by name, and their ids.
fn ids(system: &System) -> Vec<(String, i32)> {
    system.children().into_iter().map(|(name, process)| (name, process.id().as_raw())).collect()
}
