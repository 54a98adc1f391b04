//! Processes that hang: alive, and doing nothing. They are noticed, and started again.

use std::io::Write;
use std::process::Command;

use nix::sys::signal::Signal;

use crate::stories::bad_messages::{say_flag, stranger};
use crate::support::processes::{Process, wait_until_gone};
use crate::support::{KITTIWAKE, System, wait_for};

#[test]
fn a_planner_that_hangs_is_killed_and_the_mission_is_achieved() {
    let system = System::on_long_leg("5");
    let session = stranger(&system.locator());
    let planner = system.process("planner");
    planner.signal(Signal::SIGSTOP);
    // In the air without a plan.
    say_flag(&session, "obstacle", true);
    system.wait_for("planner does not answer for 3s: killed");
    wait_for("the planner to be gone", || (!planner.runs()).then_some(()));
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
    // On a busy machine the planner is missed before the obstacle, or only inside an area.
    ending.expect_in_order(&["flag `planner_lost` raised: the planner has been silent for", "`planner_lost` is over"]);
    for before in ["`obstacle`: stop", "planner does not answer for 3s: killed"] {
        ending.expect_in_order(&[before, "fly to (0, 2000, 10); land"]);
    }
    assert!(!ending.lines.iter().any(|it| it.contains("planner_gone")), "{}", ending.lines.join("\n"));
}

#[test]
fn an_emergency_action_is_tried_again_when_the_skill_manager_is_back() {
    let system = System::on_long_leg("5");
    let session = stranger(&system.locator());
    let skill_manager = system.process("skill-manager");
    skill_manager.signal(Signal::SIGSTOP);
    say_flag(&session, "operator_abort", true);
    let ending = system.end();
    ending.expect(4, &["WAITING"]);
    // On a busy machine the first try fails only once the skill manager is seen to be dead.
    for before in [
        "`operator_abort`: land failed (try 1 of 2): failed: skill manager",
        "skill-manager does not answer for 3s: killed",
    ] {
        ending.expect_in_order(&["`operator_abort`: land", before, "over: `operator_abort`"]);
    }
}

#[test]
fn each_process_on_the_ground_and_in_the_air_is_started_again_when_it_hangs() {
    let system = System::start(&["--speed", "1"]);
    system.wait_for(" is up: ");
    for process in ["monitor", "gateway", "mcm", "control-tower", "router"] {
        let hung = system.process(process);
        hung.signal(Signal::SIGSTOP);
        system.wait_for(&format!("{process} does not answer for 3s: killed"));
        wait_for("another one", || {
            let found = system.children().into_iter().find(|(name, it)| name == process && it.runs())?;
            (found.1.id() != hung.id()).then_some(())
        });
    }
    let told = |process: &str| format!("{process} does not answer");
    system.launcher().signal(Signal::SIGINT);
    let ending = system.end();
    // Nobody else was taken for one that hangs.
    for innocent in ["planner", "skill-manager", "vehicle-sim"] {
        assert!(!ending.lines.iter().any(|it| it.contains(&told(innocent))), "{}", ending.lines.join("\n"));
    }
}

#[test]
fn one_that_hangs_while_the_router_is_away_is_started_again_too() {
    let system = System::start(&["--speed", "1"]);
    system.wait_for(" is up: ");
    let mcm = system.process("mcm");
    system.process("router").signal(Signal::SIGSTOP);
    mcm.signal(Signal::SIGSTOP);
    for process in ["router", "mcm"] {
        system.wait_for(&format!("{process} does not answer for 3s: killed"));
    }
    wait_for("another one", || {
        let found = system.children().into_iter().find(|(name, it)| name == "mcm" && it.runs())?;
        (found.1.id() != mcm.id()).then_some(())
    });
}

#[test]
fn a_launcher_that_is_told_of_no_death_by_who_started_it_asks_for_itself() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let program = folder.path().join("in-background");
    // As programs do that start others in the background. Another process writes it: what this one has open for writing cannot be started.
    let script = format!("#!/bin/sh\ntrap '' CHLD\nexec {KITTIWAKE} \"$@\"");
    let written =
        Command::new("sh").args(["-c", "echo \"$1\" >\"$0\" && chmod +x \"$0\""]).arg(&program).arg(script).status();
    assert!(written.expect("there is a shell").success());
    let system = System::of(&program, &["--speed", "1"], &[]);
    system.wait_for(" is up: ");
    system.process("planner").signal(Signal::SIGKILL);
    system.wait_for("planner ended by signal 9; it is started again");
}

#[test]
fn deaths_without_end_in_the_air_end_nothing() {
    let system = System::start(&["--speed", "2"]);
    system.wait_for("step 4 of 5: fly to (0, 500, 10)");
    // Five within half a minute end a system whose aircraft is on the ground.
    let kept = "the aircraft may be in the air, so it is started again";
    let told = [("planner ended by signal 9", 1), ("planner ended by signal 9", 2), ("planner ended by signal 9", 3)];
    let told = told.into_iter().chain([("planner ended by signal 9", 4), (kept, 1), (kept, 2)]);
    for (words, nth) in told {
        let planner = wait_for("a planner", || system.children().into_iter().find(|(name, _)| name == "planner"));
        planner.1.signal(Signal::SIGKILL);
        system.wait_for_nth(words, nth);
    }
    let ending = system.end();
    ending.expect(0, &["SUCCESS", "SUCCESS"]);
}

#[test]
fn a_launcher_whose_lines_nobody_reads_keeps_its_processes_up_and_ends_when_asked() {
    let (_reader, writer) = std::io::pipe().unwrap();
    let mut full = writer.try_clone().unwrap();
    // More than any pipe takes: it is full from here on.
    std::thread::spawn(move || full.write_all(&vec![b'x'; 64 << 20]));
    let system = System::speaking_to(writer, &["--speed", "5"]);
    let monitor = |other_than: Option<Process>| {
        wait_for("a monitor", || {
            let found = system.children().into_iter().find(|(name, it)| name == "monitor" && it.runs())?.1;
            other_than.is_none_or(|it| it.id() != found.id()).then_some(found)
        })
    };
    let first = monitor(None);
    first.signal(Signal::SIGKILL);
    monitor(Some(first));
    let children = system.children();
    system.launcher().signal(Signal::SIGTERM);
    wait_for("the launcher to end", || (!system.launcher().runs()).then_some(()));
    wait_until_gone(&children);
}
