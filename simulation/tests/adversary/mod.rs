//! Flights that somebody who did not write the flight logic thought of: two things wrong at once, orders in the wrong moment,
//! areas that open and close around the vehicle in each phase, and what happens after the end.
//!
//! A test that is ignored as a finding shows what the system does wrong; its message says what it ought to do.

mod changing_airspace;
mod closed_sky;
mod combinations;
mod findings;
mod orders;
mod sites;
mod two_things_wrong;
mod unusual_missions;

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::{self, Decision, MissionOutcome};
use simulation::{Machine, Setup, Simulation};
use v1::mission_request::Request as Ask;
use v1::operator_command::Verb;

use crate::stories::support::{config, config_with, each, mission_file, sample, simulation};

const LIMIT: Duration = Duration::from_secs(3000);

const ABORT: Verb = Verb::Abort(v1::AbortMission { overrides: false });
const PAUSE: Verb = Verb::Pause(v1::PauseMission { overrides: false });
const RETURN: Verb = Verb::Return(v1::ReturnHome { overrides: false });
const RESUME: Verb = Verb::Resume(v1::ResumeMission {});
const REPLAN: Verb = Verb::Replan(v1::ReplanMission {});
const START: Verb = Verb::Start(v1::StartMission {});

fn land_at(north_m: f64, east_m: f64) -> Verb {
    Verb::LandAt(v1::LandAt { position: Some(v1::Ned { north_m, east_m, down_m: 0.0 }), overrides: false })
}

/// A place in the air.
fn air(name: &str, north: f64, east: f64, height: f64) -> String {
    objective(name, north, east, height, true)
}

/// A place on the ground.
fn ground(name: &str, north: f64, east: f64) -> String {
    objective(name, north, east, 0.0, false)
}

fn objective(name: &str, north: f64, east: f64, height: f64, flying: bool) -> String {
    format!(
        "[[objective]]\nname = \"{name}\"\nnorth_m = {north:.1}\neast_m = {east:.1}\nheight_m = {height:.1}\nflying = {flying}\n"
    )
}

/// A rectangle from the south-west to the north-east corner, with further lines of the file.
fn area(name: &str, kind: &str, [south, west]: [f64; 2], [north, east]: [f64; 2], more: &str) -> String {
    format!(
        "[[area]]\nname = \"{name}\"\nkind = \"{kind}\"\n\
         corners_m = [[{south:.1}, {west:.1}], [{north:.1}, {west:.1}], [{north:.1}, {east:.1}], [{south:.1}, {east:.1}]]\n{more}\n"
    )
}

/// A window in seconds after the start of the simulation.
fn window(from_s: u64, until_s: Option<u64>) -> String {
    let utc = |it: u64| format!("2026-01-01T{:02}:{:02}:{:02}Z", it / 3600, it / 60 % 60, it % 60);
    let until = until_s.map_or_else(String::new, |it| format!("until_utc = \"{}\"\n", utc(it)));
    format!("from_utc = \"{}\"\n{until}", utc(from_s))
}

/// A mission of this text.
#[track_caller]
fn mission(name: &str, parts: &[String], permissions: Policy) -> Simulation<'static> {
    mission_with(&config(), name, parts, permissions)
}

#[track_caller]
fn mission_with(config: &std::path::Path, name: &str, parts: &[String], permissions: Policy) -> Simulation<'static> {
    let path = mission_file(&format!("adversary-{name}"), &format!("name = \"{name}\"\n{}", parts.concat()));
    let setup = Setup { config, mission: Some(&path), permissions, seed: 1, machine: Machine::Ideal };
    Simulation::new(&setup).unwrap_or_else(|mistakes| panic!("{mistakes}"))
}

fn s(seconds: u64) -> Duration {
    Duration::from_secs(seconds)
}

/// The moment this long after the start.
fn at_s(seconds: u64) -> domain::time::Time {
    domain::time::Time::after(s(seconds))
}

/// Flies until `there` holds for the place.
#[track_caller]
fn until(simulation: &mut Simulation<'_>, there: impl Fn(v1::Ned) -> bool) {
    let begun = simulation.now();
    while !simulation.position().is_some_and(&there) {
        simulation.pass(Duration::from_millis(100));
        assert!(simulation.now() - begun < s(1200), "it never gets there:\n{}", simulation.decision_log());
    }
}

/// Flies to the end, and a while longer for what must not happen then: on the ground, no breach, no request unanswered.
#[track_caller]
fn ends(simulation: &mut Simulation<'_>) -> v1::MissionReport {
    let report = simulation.fly(LIMIT);
    let Some(report) = report else {
        panic!("no end; at {:?}, breaches {:?}:\n{}", simulation.position(), simulation.breaches(), brief(simulation))
    };
    simulation.pass(s(60));
    let log = brief(simulation);
    assert_eq!(simulation.breaches(), [], "{log}");
    assert!(simulation.is_on_ground(), "in the air, {report:?}\n{log}");
    assert!(simulation.unanswered().is_empty(), "{:?}\n{log}", simulation.unanswered());
    assert!(!report.reason.is_empty(), "{log}");
    report
}

/// The same with this outcome.
#[track_caller]
fn ends_as(simulation: &mut Simulation<'_>, expected: MissionOutcome) -> v1::MissionReport {
    let report = ends(simulation);
    assert_eq!(report.outcome(), expected, "{}: {}", report.reason, brief(simulation));
    report
}

/// The decisions, shortened if there are far too many of them.
fn brief(simulation: &Simulation<'_>) -> String {
    let log = simulation.decision_log();
    let lines: Vec<&str> = log.lines().collect();
    if lines.len() < 160 {
        return log;
    }
    format!(
        "{}\n ... {} lines ...\n{}",
        lines[..90].join("\n"),
        lines.len() - 150,
        lines[lines.len() - 60..].join("\n")
    )
}

#[track_caller]
fn says(simulation: &Simulation<'_>, text: &str) {
    assert!(simulation.decision_log().contains(text), "`{text}` is missing:\n{}", brief(simulation));
}

fn count(simulation: &Simulation<'_>, text: &str) -> usize {
    simulation.decision_log().matches(text).count()
}

fn is_home(simulation: &Simulation<'_>) -> bool {
    simulation.position().is_some_and(|it| it.north_m.hypot(it.east_m) < 5.0)
}

/// Out and back, 300 m to the east.
fn out_and_back() -> Vec<String> {
    vec![air("look", 0.0, 300.0, 20.0), ground("home", 0.0, 0.0)]
}

fn with(mut parts: Vec<String>, more: String) -> Vec<String> {
    parts.push(more);
    parts
}
