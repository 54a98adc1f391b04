//! Every rule has a flight that breaks it, and one that does not.

use std::time::Duration;

use control_tower::policy::Policy;
use kittiwake_proto::v1::{self, MissionPhase};

use super::super::script::Choice;
use super::super::trouble::Trouble;
use super::*;
use crate::Machine;

fn at(seconds: u64) -> Time {
    Time::after(Duration::from_secs(seconds))
}

fn script(fault: Option<(&str, &[&str])>, settles: bool) -> Script {
    let fault = fault.map(|(name, args)| {
        let args = args.iter().map(|it| (*it).to_owned()).collect();
        (Duration::from_secs(60), Trouble::Fault { name: name.to_owned(), args })
    });
    let troubles = fault.into_iter().collect();
    Script { settles, ..Script::new(7, Choice::Configured, Policy::Grant, Machine::Ideal, troubles) }
}

fn over(outcome: MissionOutcome, reason: &str, place: Option<&str>) -> Ending {
    Ending::Over { outcome, reason: reason.to_owned(), place: place.map(str::to_owned) }
}

/// A flight that nothing is against, with twelve decisions, one every ten seconds.
fn flight() -> Evidence {
    Evidence {
        ending: over(MissionOutcome::Success, "every objective was achieved", Some("home")),
        until: at(300),
        breaches: Vec::new(),
        mode_storm: None,
        excursions: Vec::new(),
        stale: Vec::new(),
        unanswered: Vec::new(),
        panic: None,
        decisions: (1..=12).map(|number| (at(number * 10), format!("decision {number}"))).collect(),
    }
}

#[track_caller]
fn check(script: &Script, seen: &Evidence, expected: &[Rule]) {
    let rules: Vec<Rule> = judge(script, seen).iter().map(|it| it.rule).collect();
    assert_eq!(rules, expected, "{seen:?}");
}

#[test]
fn a_flight_that_keeps_the_rules_has_nothing_against_it() {
    check(&script(None, true), &flight(), &[]);
}

#[test]
fn what_the_witness_saw_counts_unless_the_vehicle_cannot_know_better() {
    let area = || "A".to_owned();
    let permission = v1::PermissionState::Denied;
    let breaches = vec![
        Breach::Entered { at: at(50), area: area(), permission },
        Breach::Stayed { at: at(80), area: area() },
        Breach::TookOff { at: at(90) },
        Breach::NoResponder { at: at(100), phase: MissionPhase::Over },
    ];
    let seen = Evidence { breaches, ..flight() };
    check(&script(None, true), &seen, &[Rule::Airspace, Rule::Airspace, Rule::Takeoff, Rule::Response]);
    check(
        &script(Some(("battery", &["0.2"])), true),
        &seen,
        &[Rule::Airspace, Rule::Airspace, Rule::Takeoff, Rule::Response],
    );
    // That somebody responds does not depend on it.
    check(&script(Some(("gnss_loss", &[])), true), &seen, &[Rule::Response]);
}

#[test]
fn storms_stale_setpoints_silence_and_panics_count() {
    let storm = ModeStorm { at: at(20), changes: 90, causes: 11 };
    check(&script(None, true), &Evidence { mode_storm: Some(storm), ..flight() }, &[Rule::Modes]);
    let stale = vec![StaleSetpoint { at: at(30), age: Duration::from_secs(3) }];
    let seen = Evidence { stale, ..flight() };
    check(&script(None, true), &seen, &[Rule::Setpoint]);
    check(&script(Some(("freeze", &["vehicle_status"])), true), &seen, &[]);
    let seen = Evidence { unanswered: vec![("planner", "planner/replan", 2)], ..flight() };
    check(&script(None, true), &seen, &[Rule::Reply]);
    let ending = Ending::Adrift { flies: true, phase: MissionPhase::Nominal };
    let seen = Evidence { panic: Some("index out of bounds".into()), ending, ..flight() };
    check(&script(None, true), &seen, &[Rule::Panic]);
}

#[test]
fn a_flight_ends_done_down_at_a_listed_place_down_with_a_reason_or_held_with_a_reason() {
    #[track_caller]
    fn ends(script: &Script, ending: Ending, is_fine: bool) {
        let expected: &[Rule] = if is_fine { &[] } else { &[Rule::End] };
        check(script, &Evidence { ending, ..flight() }, expected);
    }
    let (lost, settled, open) = (script(Some(("gnss_loss", &[])), true), script(None, true), script(None, false));
    ends(&settled, over(MissionOutcome::Failure, "objective `a` failed", Some("home")), true);
    ends(&settled, over(MissionOutcome::Emergency, "`battery_critical`: 9 %", None), true);
    ends(&settled, over(MissionOutcome::Emergency, "", None), false);
    ends(&settled, over(MissionOutcome::Success, "every objective was achieved", None), false);
    ends(&lost, over(MissionOutcome::Success, "every objective was achieved", None), true);
    ends(&settled, over(MissionOutcome::Crash, "`crashed`: it fell", None), false);
    ends(&lost, over(MissionOutcome::Crash, "`crashed`: it fell", None), true);
    for held in [Ending::Holds("response to `obstacle`".into()), Ending::Waits("waits for an operator".into())] {
        ends(&open, held.clone(), true);
        ends(&settled, held, false);
    }
    ends(&open, Ending::Adrift { flies: true, phase: MissionPhase::Nominal }, false);
}

#[test]
fn a_flight_too_high_or_on_below_the_reserve_counts() {
    let height = Excursion::Height { at: at(50), height_m: 140.0, most_m: 120.0 };
    let energy = Excursion::Energy { at: at(60), remaining: 0.1, reserve: 0.25 };
    let seen = Evidence { excursions: vec![height, energy], ..flight() };
    check(&script(None, true), &seen, &[Rule::Height, Rule::Energy]);
    check(&script(Some(("gnss_loss", &[])), true), &seen, &[Rule::Energy]);
}

#[test]
fn a_finding_has_the_ten_decisions_before_it() {
    let seen = Evidence { breaches: vec![Breach::TookOff { at: at(115) }], ..flight() };
    let findings = judge(&script(None, true), &seen);
    let before: Vec<&str> = findings[0].before.iter().map(|(_, text)| text.as_str()).collect();
    assert_eq!((before.len(), before[0], before[9]), (10, "decision 2", "decision 11"));
    let said = "seed 7, 115.0 s: it took off after the end or in answer to a flag";
    assert_eq!(findings[0].to_string(), said);
}
