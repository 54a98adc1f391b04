//! Over water or people, with the only place to land at closed, taken or circled: the flight ends there all the same, or waits as long as
//! it can.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::operator_command::Verb;
use kittiwake_proto::v1::{self, Decision};
use simulation::Simulation;

use crate::stories::support::{mission_file, simulation};

const SQUARE: &str = "corners_m = [[-70.0, -70.0], [70.0, -70.0], [70.0, 70.0], [-70.0, 70.0]]\n";

/// 300 m out over ground of this kind, a stay there, and back home, round which 40 m are land.
fn out_over(name: &str, ground: &str, stay_s: u32, more: &str) -> Simulation<'static> {
    let text = format!(
        "name = \"{name}\"\n\
         [[objective]]\nname = \"look\"\nnorth_m = 0.0\neast_m = 300.0\nheight_m = 20.0\nflying = true\ndwell_s = {stay_s}.0\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n\
         [[area]]\nname = \"below\"\nkind = \"no-landing\"\nground = \"{ground}\"\n\
         corners_m = [[-4000.0, -4000.0], [4000.0, -4000.0], [4000.0, 4000.0], [-4000.0, 4000.0]]\n\
         holes_m = [[[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]]]\n{more}"
    );
    simulation(Some(&mission_file(&format!("last-moment-{name}"), &text)), Policy::Grant)
}

/// The same over land, without a stay.
fn out_over_land(name: &str, more: &str) -> Simulation<'static> {
    let text = format!(
        "name = \"{name}\"\n\
         [[objective]]\nname = \"look\"\nnorth_m = 0.0\neast_m = 300.0\nheight_m = 20.0\nflying = true\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n{more}"
    );
    simulation(Some(&mission_file(&format!("last-moment-{name}"), &text)), Policy::Grant)
}

fn harbour() -> String {
    format!("[[area]]\nname = \"harbour\"\nkind = \"permission\"\n{SQUARE}")
}

#[track_caller]
fn until(simulation: &mut Simulation<'_>, there: impl Fn(v1::Ned) -> bool) {
    let begun = simulation.now();
    while !simulation.position().is_some_and(&there) {
        simulation.pass(Duration::from_millis(200));
        let log = simulation.decision_log();
        assert!(simulation.now() - begun < Duration::from_secs(900), "it never gets there:\n{log}");
    }
}

#[track_caller]
fn ends_at_home(simulation: &mut Simulation<'_>) {
    simulation.fly(Duration::from_secs(2400)).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let at = simulation.position().expect("a position");
    assert!(at.north_m.hypot(at.east_m) < 25.0, "{at:?}\n{}", simulation.decision_log());
}

#[test]
fn a_low_battery_waits_for_a_home_that_opens_in_time() {
    let pad = format!(
        "[[area]]\nname = \"pad\"\nkind = \"keep-out\"\n{SQUARE}\
         from_utc = \"2026-01-01T00:02:00Z\"\nuntil_utc = \"2026-01-01T00:03:55Z\"\n"
    );
    let mut simulation = out_over("opens", "water", 230, &pad);
    simulation.pass(Duration::from_secs(140));
    simulation.inject_fault("battery", &["0.24"]);
    ends_at_home(&mut simulation);
}

#[test]
fn what_circles_does_not_take_the_battery() {
    let mut simulation = out_over("circled", "people", 0, "");
    until(&mut simulation, |it| 250.0 < it.east_m);
    simulation.inject_fault("circling", &["0", "0", "20", "60", "8", "uncrewed"]);
    simulation.inject_fault("battery", &["0.4"]);
    ends_at_home(&mut simulation);
    assert!(simulation.decision_log().contains("no longer out of the way: home"), "{}", simulation.decision_log());
}

/// The tower grants home after twelve minutes.
#[test]
fn an_operator_who_is_silent_puts_no_healthy_vehicle_into_the_sea() {
    let mut simulation = out_over("silent", "water", 0, &harbour());
    until(&mut simulation, |it| 200.0 < it.east_m);
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation.decide_for("harbour", Decision::Deny, None);
    simulation.pass(Duration::from_secs(720));
    simulation.decide_for("harbour", Decision::Grant, None);
    ends_at_home(&mut simulation);
}

#[test]
fn over_land_who_waited_for_an_operator_does_not_wait_again_for_a_way_home() {
    let mut simulation = out_over_land("land", &harbour());
    until(&mut simulation, |it| 200.0 < it.east_m);
    simulation.order(Verb::Pause(v1::PauseMission { overrides: false }));
    simulation.decide_for("harbour", Decision::Deny, None);
    let report = simulation.fly(Duration::from_secs(900));
    let log = simulation.decision_log();
    assert!(report.is_some() && log.contains("`operator_silent`: return_home"), "{log}");
    assert!(!log.contains("`operator_silent` waits"), "{log}");
}

#[test]
fn who_is_low_over_a_pad_in_the_sea_leaves_an_area_that_is_revoked() {
    let mut simulation = out_over("low", "water", 0, &harbour());
    until(&mut simulation, |it| 290.0 < it.east_m);
    until(&mut simulation, |it| it.east_m < 10.0 && -1.6 < it.down_m);
    simulation.decide_for("harbour", Decision::Revoke, None);
    simulation.pass(Duration::from_secs(120));
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}

#[test]
fn a_plain_abort_after_a_takeover_is_no_abort_with_override() {
    let mut simulation = out_over("twice", "people", 60, "");
    until(&mut simulation, |it| 70.0 < it.east_m);
    simulation.order(Verb::Abort(v1::AbortMission { overrides: true }));
    simulation.inject_fault("pilot_takes_over", &["hold"]);
    simulation.pass(Duration::from_secs(10));
    simulation.order(Verb::Abort(v1::AbortMission { overrides: false }));
    ends_at_home(&mut simulation);
}

#[test]
fn an_override_counts_during_the_abort_under_way() {
    let mut simulation = out_over("overridden", "people", 60, "");
    until(&mut simulation, |it| 250.0 < it.east_m);
    simulation.order(Verb::Abort(v1::AbortMission { overrides: false }));
    until(&mut simulation, |it| it.east_m < 230.0);
    simulation.order(Verb::Abort(v1::AbortMission { overrides: true }));
    simulation.fly(Duration::from_secs(600)).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let at = simulation.position().expect("a position");
    assert!(190.0 < at.east_m, "{at:?}\n{}", simulation.decision_log());
}

#[test]
fn an_abort_waits_until_the_way_down_is_clear() {
    let mut simulation = out_over_land("beneath", "");
    until(&mut simulation, |it| 200.0 < it.east_m);
    simulation.inject_fault("circling", &["0", "230", "5", "30", "5", "uncrewed"]);
    simulation.pass(Duration::from_secs(3));
    simulation.order(Verb::Abort(v1::AbortMission { overrides: false }));
    simulation.pass(Duration::from_secs(60));
    let log = simulation.decision_log();
    assert!(log.contains("other traffic is too near to the way down"), "{log}");
    assert!(!simulation.is_on_ground(), "{log}");
    simulation.inject_fault("clear", &[]);
    assert!(simulation.fly(Duration::from_secs(300)).is_some(), "{}", simulation.decision_log());
}

#[test]
fn whose_position_is_in_doubt_stays_while_traffic_comes_near() {
    let mut simulation = out_over_land("doubt", "");
    until(&mut simulation, |it| 200.0 < it.east_m);
    simulation.inject_fault("position_jump", &["0", "60"]);
    assert!(simulation.fly_until("`position_jumped`: ", Duration::from_secs(30)), "{}", simulation.decision_log());
    simulation.inject_fault("head_on", &["300", "10", "uncrewed"]);
    let log = |it: &Simulation<'_>| it.decision_log();
    assert!(simulation.fly_until("`drone_near`: avoid", Duration::from_secs(60)), "{}", log(&simulation));
    simulation.pass(Duration::from_secs(2));
    assert!(log(&simulation).contains("stays: its position is in doubt"), "{}", log(&simulation));
}

/// Home is closed for good, and the battery suffices for ground 560 m away.
#[test]
fn free_ground_far_off_is_better_than_the_sea() {
    let beach = [[-600.0, 260.0], [-520.0, 260.0], [-520.0, 340.0], [-600.0, 340.0]];
    let text = format!(
        "name = \"beach\"\n\
         [[objective]]\nname = \"look\"\nnorth_m = 0.0\neast_m = 300.0\nheight_m = 20.0\nflying = true\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n\
         [[area]]\nname = \"below\"\nkind = \"no-landing\"\nground = \"water\"\n\
         corners_m = [[-4000.0, -4000.0], [4000.0, -4000.0], [4000.0, 4000.0], [-4000.0, 4000.0]]\n\
         holes_m = [[[-40.0, -40.0], [40.0, -40.0], [40.0, 40.0], [-40.0, 40.0]], {beach:?}]\n{}",
        harbour()
    );
    let mut simulation = simulation(Some(&mission_file("last-moment-beach", &text)), Policy::Grant);
    until(&mut simulation, |it| 250.0 < it.east_m);
    simulation.decide_for("harbour", Decision::Revoke, None);
    simulation.inject_fault("battery", &["0.4"]);
    simulation.fly(Duration::from_secs(2400)).unwrap_or_else(|| panic!("no end:\n{}", simulation.decision_log()));
    let at = simulation.position().expect("a position");
    let is_ashore = (-600.0..-520.0).contains(&at.north_m) && (260.0..340.0).contains(&at.east_m);
    assert!(is_ashore, "{at:?}\n{}", simulation.decision_log());
}
