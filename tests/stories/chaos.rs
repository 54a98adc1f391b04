//! A short campaign: the first run of each kind that a seed draws, and no violation.

use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::Parser;
use kittiwake_chaos::Means;
use kittiwake_chaos::args::Args;
use kittiwake_chaos::figures::{How, Loss};
use kittiwake_chaos::run::Run;
use kittiwake_chaos::schedule::Schedule;
use kittiwake_chaos::trouble::{Garbling, Kind, Layout, Trouble, Victim, Ways};

use crate::support::{KITTIWAKE, shipped};

/// Wall time that the death of a process may take, in seconds. Campaigns say how fast a system recovers; here other tests share
/// the machine, and a process may take long to start.
const INTERRUPTION_S: &str = "24";
/// More troubles than these would make a story longer, and say less about the one that it is about.
const MOST_TROUBLES: usize = 2;

/// Flies the first run of this layout that has such a trouble; fails with its story if the oracle has anything against it. How much
/// of the mission is achieved depends on the machine: a busy one loses more time with each death.
#[track_caller]
fn check(layout: Layout, is_about: impl Fn(&Trouble) -> bool) -> Run {
    // The mission takes longer.
    check_at(layout, |at, it| at.as_secs() < 100 && is_about(it))
}

/// The same, where it matters when in mission time the trouble begins.
#[track_caller]
fn check_at(layout: Layout, is_about: impl Fn(Duration, &Trouble) -> bool) -> Run {
    check_at_speed("20", layout, is_about)
}

/// The same, where mission time is to run this many times as fast as the wall clock.
#[track_caller]
fn check_at_speed(speed: &str, layout: Layout, is_about: impl Fn(Duration, &Trouble) -> bool) -> Run {
    let fits = |it: &Schedule| it.layout == layout && it.troubles.len() <= MOST_TROUBLES;
    // A clock is not set here, since not every machine can.
    let is_possible = |it: &Schedule| it.troubles.iter().all(|it| it.1.kind() != Kind::ClockStep);
    let mut schedules = (1..100_000).map(Schedule::of).filter(|it| fits(it) && is_possible(it));
    let find = |it: &Schedule| it.troubles.iter().find(|(at, it)| is_about(*at, it)).map(|it| it.1.clone());
    let (schedule, trouble) = schedules.find_map(|it| Some((it.clone(), find(&it)?))).expect("a seed draws it");
    let config = shipped().join("kittiwake.toml");
    let args = ["chaos", "--speed", speed, "--program", KITTIWAKE, "--config", config.to_str().unwrap()];
    let args = args.into_iter().chain(["--interruption", INTERRUPTION_S]);
    let (args, interrupted) = (Args::parse_from(args), AtomicBool::new(false));
    let run = kittiwake_chaos::one(&args, schedule.seed, &Means::default(), &interrupted).unwrap();
    let story: Vec<String> = run.story.iter().map(|(at_s, text)| format!("{at_s:7.1} s  {text}")).collect();
    let story = format!("seed {}: {schedule}\n{}", schedule.seed, story.join("\n"));
    assert!(run.violations.is_empty(), "{:?} in:\n{story}", run.violations);
    assert!(!run.outcome.is_empty(), "{story}");
    assert!(story.contains(&format!("chaos: {trouble}")) && !story.contains("chaos: no storm"), "not done:\n{story}");
    for (victim, times) in trouble.deaths() {
        let lost = run.losses.iter().filter(|it| it.victim == victim).count();
        assert!(times as usize <= lost, "{victim} was lost {lost} times:\n{story}");
    }
    run
}

#[test]
fn a_router_that_dies_breaks_no_rule() {
    check(Layout::OneRouter, |it| *it == Trouble::Kill(Victim::Router));
}

#[test]
fn a_manager_that_dies_twice_in_a_row_breaks_no_rule() {
    check(Layout::OneRouter, |it| *it == Trouble::CrashLoop(Victim::Mcm, 2));
}

#[test]
fn a_process_of_all_nodes_on_board_that_dies_twice_in_a_row_breaks_no_rule() {
    check(Layout::Composed, |it| *it == Trouble::CrashLoop(Victim::Onboard, 2));
}

#[test]
fn a_planner_that_comes_back_without_its_state_breaks_no_rule() {
    check(Layout::TwoRouters, |it| *it == Trouble::GarbledState(Victim::Planner, Garbling::Emptied));
}

#[test]
fn an_order_that_is_given_into_a_cut_link_is_not_obeyed_after_it() {
    let is_long = |it: &Trouble| it.link_is_faulty_for().as_secs_f64() > 5.0;
    check(Layout::TwoRouters, |it| matches!(it, Trouble::Cut(Ways::Both | Ways::Up, _, Some(_))) && is_long(it));
}

#[test]
fn an_aircraft_whose_computer_is_without_power_in_flight_breaks_no_rule() {
    // In the cruise, so that its vehicle flies on without it.
    let fits = |at: Duration, it: &Trouble| {
        it.kind() == Kind::CompanionOff && (30..100).contains(&at.as_secs()) && (2..6).contains(&it.lasts().as_secs())
    };
    let run = check_at(Layout::TwoRouters, fits);
    let off_s = run.schedule.companion_off().as_secs_f64();
    for victim in Victim::ON_COMPANION {
        let is_it = |it: &&Loss| it.victim == victim && it.how == How::CompanionOff;
        let loss = run.losses.iter().find(is_it).unwrap_or_else(|| panic!("{victim} was not lost: {:?}", run.losses));
        assert!(loss.resumed_s.is_some_and(|it| off_s <= it), "{victim} was off for less than {off_s} s: {loss:?}");
    }
}

#[test]
fn permissions_that_are_revoked_in_flight_are_heeded() {
    let is_soon = |at: Duration, it: &Trouble| *it == Trouble::Revocation && (20..60).contains(&at.as_secs());
    // The two seconds of wall time in which a process has to hear that are ten seconds of flight at this speed.
    let run = check_at_speed("5", Layout::OneRouter, is_soon);
    let is_revoked = |it: &str| it.starts_with("chaos: revoked: ");
    assert!(run.story.iter().any(|(_, it)| is_revoked(it)), "nothing was revoked: {:?}", run.story);
}

#[test]
fn a_storm_of_known_flags_breaks_no_rule() {
    check(Layout::OneRouter, |it| it.kind() == Kind::Storm);
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
