//! A short campaign: troubles drawn from fixed seeds, and no violation.

use std::process::Command;
use std::sync::atomic::AtomicBool;

use clap::Parser;
use kittiwake_chaos::args::Args;
use kittiwake_chaos::schedule::Schedule;
use kittiwake_chaos::trouble::{Garbling, Trouble, Victim};

use crate::support::{KITTIWAKE, shipped};

/// Flies the run of a seed; fails with its story if the oracle has anything against it. How much of the mission is achieved depends
/// on the machine: a busy one loses more time with each death.
#[track_caller]
fn check(seed: u64, is_about: impl Fn(&Trouble) -> bool) {
    let schedule = Schedule::of(seed);
    assert!(schedule.troubles.iter().any(|it| is_about(&it.1)), "seed {seed} is another story now: {schedule}");
    let config = shipped().join("kittiwake.toml");
    let args = ["chaos", "--speed", "20", "--program", KITTIWAKE, "--config", config.to_str().unwrap()];
    let run = kittiwake_chaos::one(&Args::parse_from(args), seed, false, &AtomicBool::new(false)).unwrap();
    let story: Vec<String> = run.story.iter().map(|(at_s, text)| format!("{at_s:7.1} s  {text}")).collect();
    let story = story.join("\n");
    assert!(run.violations.is_empty(), "{:?} in:\n{story}", run.violations);
    assert!(!run.outcome.is_empty(), "{story}");
}

#[test]
fn a_router_and_a_planner_that_die_and_a_manager_that_pauses_break_no_rule() {
    check(2, |it| *it == Trouble::Kill(Victim::Router));
}

#[test]
fn a_manager_that_dies_twice_in_a_row_breaks_no_rule() {
    check(101, |it| *it == Trouble::CrashLoop(Victim::Mcm, 2));
}

#[test]
fn a_planner_that_comes_back_without_its_state_breaks_no_rule() {
    let emptied = Trouble::GarbledState(Victim::Planner, Garbling::Emptied);
    check(102, |it| *it == emptied);
}

#[test]
fn the_campaign_is_started_by_its_name_or_it_is_said_how_to_build_it() {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let program = folder.path().join("kittiwake");
    std::fs::hard_link(KITTIWAKE, &program).unwrap();
    let output = Command::new(program).args(["chaos", "--runs", "3"]).output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("kittiwake-chaos is missing: build it with `cargo build"), "{said}");
}
