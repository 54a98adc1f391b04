//! A system that has ended leaves no process, however it ended.

use gateway::access::Role;
use nix::sys::signal::Signal;

use crate::support::files::Files;
use crate::support::people::People;
use crate::support::processes::wait_until_gone;
use crate::support::{System, kittiwake, wait_for};

#[test]
fn a_killed_launcher_leaves_no_child_not_even_a_frozen_one() {
    // A group of processes that is inherited within its session is not hung up as an orphaned one: here this process inherits. (Nor is one
    // whose process is not seen to have stopped yet, as on a busy machine.)
    nix::sys::prctl::set_child_subreaper(true).expect("any process may inherit the orphans below it");
    let system = System::start(&[]);
    system.wait_for(" is up: ");
    let children = system.children();
    assert_eq!(children.len(), 8, "{children:?}");
    system.process("skill-manager").signal(Signal::SIGSTOP);
    system.launcher().signal(Signal::SIGKILL);
    wait_until_gone(&children);
}

#[test]
fn sigterm_ctrl_c_and_a_closed_terminal_end_everything_also_what_hangs() {
    for (signal, frozen) in [(Signal::SIGTERM, "planner"), (Signal::SIGINT, "router"), (Signal::SIGHUP, "monitor")] {
        let system = System::start(&[]);
        system.wait_for("step 1 of");
        let children = system.children();
        let ends_first = system.process("mcm");
        system.process(frozen).signal(Signal::SIGSTOP);
        system.launcher().signal(signal);
        if signal == Signal::SIGHUP {
            // The kernel says it, and then the shell: nobody has asked twice.
            wait_for("the mission manager to end", || (!ends_first.runs()).then_some(()));
            system.launcher().signal(signal);
        }
        let ending = system.end();
        wait_until_gone(&children);
        assert_eq!(ending.code, Some(130));
        assert_eq!(ending.report()["reason"], "interrupted");
        // What hangs does not end by itself. Together the limits are below five seconds.
        let limit = if frozen == "router" { "1s" } else { "2.5s" };
        ending.expect_in_order(&[&format!("{frozen} did not end within {limit}: killed")]);
    }
}

#[test]
fn without_exit_when_done_it_stays_up_after_the_mission() {
    let system = System::up(&["--speed", "50"], &[]);
    system.wait_for("mission over: success");
    // The gateway and the launcher may hear that in either order.
    wait_for("the report over HTTP", || {
        (system.status()["report"]["outcome"] == "MISSION_OUTCOME_SUCCESS").then_some(())
    });
    system.launcher().signal(Signal::SIGINT);
    system.end().expect(0, &["SUCCESS", "SUCCESS"]);
}

#[test]
fn a_process_that_dies_is_started_again_and_one_that_cannot_live_ends_the_system() {
    // On the ground: in the air nothing is given up.
    let files = Files::begun_by_operator();
    let config = files.config();
    let system = System::start(&["--speed", "1", "--config", config.to_str().unwrap()]);
    system.wait_for(" is up: ");
    // Killed once, it is started again; with the fifth time in a row the launcher gives up.
    for death in 1..=5 {
        let planner = wait_for("the planner to run", || {
            system.children().into_iter().find(|(name, it)| name == "planner" && it.runs())
        });
        planner.1.signal(Signal::SIGKILL);
        let said = if death < 5 { "planner ended by signal 9" } else { "planner ended 5 times" };
        system.wait_for_nth(said, if death < 5 { death } else { 1 });
    }
    let ending = system.end();
    assert_eq!(ending.code, Some(5));
    assert!(ending.report()["reason"].as_str().unwrap().starts_with("planner ended 5 times"));
}

#[test]
fn a_second_run_with_the_folders_of_the_first_one_ends_before_it_starts_anything() {
    let (people, state) = (People::new(&[("sam", Role::Safety)]), tempfile::tempdir().unwrap());
    let state = state.path().to_str().expect("a temporary folder has a plain name");
    let system = System::start(&["--access", people.folder(), "--state", state, "--speed", "1"]);
    system.wait_for(" is up: ");
    #[track_caller]
    fn check(args: &[&str], said: &str) {
        let output = kittiwake(&[&["up"], args].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{told}");
        assert!(told.contains(said) && told.lines().count() == 1, "expected `{said}`, found:\n{told}");
    }
    check(&["--access", people.folder()], "is in use by another process: end that one, or name another access folder");
    check(&["--state", state], "is in use by another process: end that one, or name another folder");
}
