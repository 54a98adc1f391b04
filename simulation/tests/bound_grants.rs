//! A grant is for one flight and one place: nobody enters another area of its name by it, nor the same one in another flight.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1;
use simulation::{Memory, Simulation};
use v1::mission_request::Request as Ask;
use v1::operator_command::Verb;

use crate::stories::support;
use crate::stories::support::story::{LIMIT, kill, s};

/// Longer than any of these stories.
const FOR_GOOD: Duration = Duration::from_secs(3600);
/// To the east, and to either side.
const DEPTH_M: f64 = 50.0;
const WIDTH_M: f64 = 600.0;

/// To a place behind an area A, whose near border is so far to the east, and home. The way round it is long.
fn behind(near_m: f64) -> String {
    let (far_m, there_m) = (near_m + DEPTH_M, near_m + 80.0);
    format!(
        "name = \"behind {near_m}\"\n\
         [[objective]]\nname = \"there\"\nnorth_m = 0.0\neast_m = {there_m:.1}\nheight_m = 0.0\nflying = false\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n\
         [[area]]\nname = \"A\"\nkind = \"permission\"\n\
         corners_m = [[-{WIDTH_M}, {near_m}], [{WIDTH_M}, {near_m}], [{WIDTH_M}, {far_m}], [-{WIDTH_M}, {far_m}]]\n"
    )
}

fn begun(near_m: f64) -> Simulation<'static> {
    support::simulation(Some(&support::mission_file("behind", &behind(near_m))), Policy::Grant)
}

/// The first mission was flown through its area A, with its permission.
fn flown(near_m: f64) -> Simulation<'static> {
    let mut simulation = begun(near_m);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), v1::MissionOutcome::Success);
    simulation.pass(s(5));
    assert_eq!(simulation.breaches(), []);
    simulation
}

fn upload(simulation: &mut Simulation<'_>, near_m: f64) {
    simulation.ask(Ask::Upload(v1::MissionText { text: behind(near_m), wind: None }));
}

fn fly_next(simulation: &mut Simulation<'_>, near_m: f64) {
    upload(simulation, near_m);
    simulation.pass(s(5));
    simulation.order(Verb::Start(v1::StartMission {}));
}

fn asked(simulation: &Simulation<'_>) -> usize {
    simulation.decision_log().matches("asking for area A").count()
}

/// Two minutes, in which the vehicle flies up to an area A there, asks for it and does not enter it: it goes round. `meanwhile` happens each
/// second.
#[track_caller]
fn asks_and_stays_out(simulation: &mut Simulation<'_>, near_m: f64, mut meanwhile: impl FnMut(&mut Simulation<'_>)) {
    let asked_before = asked(simulation);
    for _ in 0..120 {
        meanwhile(simulation);
        simulation.pass(s(1));
        let v1::Ned { north_m, east_m, .. } = simulation.position().expect("a position");
        let is_inside = north_m.abs() < WIDTH_M && (near_m..near_m + DEPTH_M).contains(&east_m);
        assert!(!is_inside, "at {east_m} m east:\n{}", simulation.decision_log());
    }
    assert!(asked_before < asked(simulation), "{}", simulation.decision_log());
}

#[test]
fn the_next_flight_enters_nothing_by_the_grant_of_the_last_one() {
    // Another area of the same name, and the same one.
    for (near_m, restarts) in [(140.0, false), (60.0, false), (60.0, true)] {
        let mut simulation = flown(60.0);
        kill(&mut simulation, "control-tower", FOR_GOOD);
        if restarts {
            kill(&mut simulation, "mcm", s(1));
            simulation.pass(s(5));
        }
        fly_next(&mut simulation, near_m);
        asks_and_stays_out(&mut simulation, near_m, |_| {});
    }
}

#[test]
fn a_mission_that_is_uploaded_in_flight_enters_no_other_area_by_the_name_that_was_granted() {
    for restarted in [None, Some("mcm")] {
        let mut simulation = begun(60.0);
        assert!(simulation.fly_until("step 3 of 4", LIMIT), "{}", simulation.decision_log());
        kill(&mut simulation, "control-tower", FOR_GOOD);
        upload(&mut simulation, 140.0);
        if let Some(process) = restarted {
            kill(&mut simulation, process, s(1));
        }
        asks_and_stays_out(&mut simulation, 140.0, |_| {});
    }
}

#[test]
fn the_tower_answers_for_the_place_that_was_asked_for_also_after_it_was_started_again() {
    let mut simulation = begun(60.0);
    assert!(simulation.fly_until("step 3 of 4", LIMIT), "{}", simulation.decision_log());
    kill(&mut simulation, "control-tower", s(1));
    upload(&mut simulation, 140.0);
    let asked_before = asked(&simulation);
    let report = simulation.fly(LIMIT).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    assert_eq!(report.outcome(), v1::MissionOutcome::Success, "{}", simulation.decision_log());
    assert!(asked_before < asked(&simulation));
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}

#[test]
fn a_recorded_grant_of_an_earlier_flight_lets_nobody_in_while_the_tower_is_away() {
    for remembers in [true, false] {
        let mut simulation = flown(60.0);
        let recorded = simulation.ledger();
        assert!(recorded.permissions.iter().any(|it| it.state() == v1::PermissionState::Granted), "{recorded:?}");
        // The aircraft is off while the grant is taken back.
        match remembers {
            true => kill(&mut simulation, "mcm", s(10)),
            false => simulation.restart("mcm", s(10), Memory::Lost),
        }
        simulation.decide("A", v1::Decision::Revoke);
        simulation.pass(s(5));
        kill(&mut simulation, "control-tower", FOR_GOOD);
        simulation.pass(s(10));
        fly_next(&mut simulation, 60.0);
        asks_and_stays_out(&mut simulation, 60.0, |it| it.hear_again(&recorded));
        let log = simulation.decision_log();
        assert!(log.contains("not believed: it was given for another flight"), "{log}");
    }
}
