//! The records of decisions: the value that led to each, what was rejected, and which decision it follows from.

use domain::decision::chain::chain;
use domain::skill::Goal;
use domain::wire::decision::told;
use kittiwake_proto::v1;
use kittiwake_proto::v1::DecisionKind;
use kittiwake_proto::v1::FlightMode::Land;
use kittiwake_proto::v1::SkillOutcome::{Failed, Rejected, Succeeded};
use kittiwake_proto::v1::operator_command::Verb;

use crate::stories::rig::{Rig, plan, step};
use crate::stories::{fly, under_way};

/// The monitor raises a flag by a value.
fn raise(rig: &mut Rig, name: &str, (value, threshold, unit): (f64, f64, &str), reason: &str) {
    rig.raise(v1::RaisedFlag {
        name: name.into(),
        reason: reason.into(),
        value: Some(value),
        threshold: Some(threshold),
        unit: unit.into(),
        ..Default::default()
    });
}

/// The last record of this kind about this flag.
#[track_caller]
fn last<'a>(rig: &'a Rig, kind: DecisionKind, flag: &str) -> &'a v1::DecisionRecord {
    let found = rig.records.iter().rev().find(|it| it.kind() == kind && it.flag == flag);
    found.unwrap_or_else(|| panic!("no {kind:?} of `{flag}` in {:#?}", rig.records))
}

fn rejected(record: &v1::DecisionRecord) -> Vec<(&str, &str)> {
    record.rejected.iter().map(|it| (it.what.as_str(), it.why.as_str())).collect()
}

#[test]
fn a_response_names_its_value_what_it_comes_before_and_where_it_goes() {
    let (mut rig, _) = under_way();
    let position = Some(v1::Ned { north_m: 20.0, east_m: 50.0, down_m: 0.0 });
    let field = v1::Site { name: "field".into(), position, kind: v1::SiteKind::Landing as i32 };
    rig.mission(v1::MissionStatus { sites: vec![field], ..Default::default() });
    rig.wait(1.0);
    rig.flag("obstacle", true);
    rig.execute();
    raise(&mut rig, "battery_low", (24.8, 25.0, "%"), "battery.charge_percent 24.80 %");

    let raised = last(&rig, DecisionKind::ContingencyRaised, "battery_low");
    assert_eq!((raised.value, raised.threshold, raised.unit.as_str()), (Some(24.8), Some(25.0), "%"));
    assert_eq!((raised.parent, raised.topic.as_str()), (0, "contingency"));
    let answered = last(&rig, DecisionKind::ContingencyAnswered, "battery_low");
    assert_eq!((answered.parent, answered.response.as_str(), answered.value), (raised.sequence, "divert", Some(24.8)));
    assert_eq!(rejected(answered), [("stop", "`obstacle` asks for it, which is less severe than divert")]);
    let place = last(&rig, DecisionKind::SiteChosen, "battery_low");
    assert_eq!((place.parent, place.response.as_str(), place.unit.as_str()), (answered.sequence, "home", "Wh"));
    assert!(place.value < place.threshold && place.response_reason.contains(" usable"), "{place:?}");
    assert_eq!(rejected(place), [("site `field`", "home comes first where it can be reached so well")]);

    // Its way is published, too: over home, and down.
    rig.wait(1.0);
    let way = rig.status().response_way.expect("it flies");
    assert_eq!((way.destination.as_str(), way.lands), ("home", true));
    let end = way.points.last().copied().expect("an end");
    assert_eq!((end.north_m, end.east_m, end.down_m), (0.0, 0.0, 0.0));
    assert!(1.0 < way.time_s && way.time_s < 300.0, "{way:?}");
}

#[test]
fn what_waits_follows_from_its_flag_and_is_named_by_the_response_that_comes_before_it() {
    let (mut rig, _) = under_way();
    rig.flag("battery_critical", true);
    rig.execute();
    rig.flag("link_lost", true);
    let raised = last(&rig, DecisionKind::ContingencyRaised, "link_lost").sequence;
    assert_eq!(last(&rig, DecisionKind::ContingencyWaits, "link_lost").parent, raised);
    let (mut rig, _) = under_way();
    rig.together(|rig| {
        rig.flag("operator_pause", true);
        rig.flag("obstacle", true);
    });
    let answered = last(&rig, DecisionKind::ContingencyAnswered, "obstacle");
    assert_eq!(rejected(answered), [("stop", "`operator_pause` asks for it and is less urgent than `obstacle`")]);
}

#[test]
fn a_try_that_fails_and_an_action_that_is_impossible_are_told_apart() {
    let (mut rig, _) = under_way();
    rig.flag("battery_critical", true);
    let answered = last(&rig, DecisionKind::ContingencyAnswered, "battery_critical").sequence;
    for (response, given_up) in [("land", None), ("land_elsewhere", Some("land"))] {
        let land = rig.execute();
        rig.end(&land, Rejected, "no");
        let failed = last(&rig, DecisionKind::ResponseFailed, "battery_critical");
        assert_eq!((failed.parent, failed.response.as_str()), (answered, response));
        assert_eq!(failed.rejected.first().map(|it| it.what.as_str()), given_up);
    }

    let (mut rig, _) = under_way();
    // What is left suffices for no way at all.
    let mut introspection = rig.introspection();
    introspection.battery = Some(v1::BatteryStatus { remaining: 0.02, ..Default::default() });
    rig.together(|rig| {
        rig.say(introspection);
        rig.flag("battery_low", true);
    });
    let skipped = last(&rig, DecisionKind::ResponseSkipped, "battery_low");
    assert_eq!((skipped.response.as_str(), skipped.rejected[0].what.as_str()), ("land_elsewhere", "divert"));
    let why = "no place to land at can be reached: home: the way needs ";
    assert!(skipped.rejected[0].why.contains(why), "{skipped:?}");
}

#[test]
fn a_new_plan_follows_from_the_step_that_failed_and_its_steps_from_the_plan() {
    let (mut rig, skill) = under_way();
    let begun = last(&rig, DecisionKind::StepBegun, "").sequence;
    rig.end(&skill, Failed, "it did not work");
    rig.execute();
    rig.plan(plan(&[step(7, fly(100.0), &["A"]), step(8, Goal::Land, &[])]));
    let failed = last(&rig, DecisionKind::StepFailed, "");
    assert_eq!(failed.parent, begun);
    let adopted = last(&rig, DecisionKind::PlanAdopted, "");
    assert_eq!(adopted.parent, failed.sequence);
    let begun = last(&rig, DecisionKind::StepBegun, "");
    assert_eq!(begun.parent, adopted.sequence);
    let asked = last(&rig, DecisionKind::PermissionAsked, "");
    assert_eq!((asked.parent, asked.text.as_str()), (begun.sequence, "asking for area A"));
    let asked = asked.sequence;
    let granted = v1::Permission {
        area: "A".into(),
        state: v1::PermissionState::Granted as i32,
        valid_for_s: 900.0,
        decision: 1,
        ..Default::default()
    };
    rig.say(v1::PermissionLedger { permissions: vec![granted], ..Default::default() });
    assert_eq!(last(&rig, DecisionKind::PermissionDecided, "").parent, asked);
}

#[test]
fn an_order_is_recorded_as_accepted_or_refused() {
    let (mut rig, _) = under_way();
    assert!(!rig.command(Verb::Start(v1::StartMission {})).done);
    let refused = last(&rig, DecisionKind::OrderRefused, "");
    assert!(refused.text.starts_with("anna: start: refused: "), "{refused:?}");
    assert!(rig.command(Verb::Pause(v1::PauseMission { overrides: false })).done);
    assert_eq!(last(&rig, DecisionKind::OrderAccepted, "").topic, "operator");
}

#[test]
fn numbers_never_begin_again() {
    fn numbers(rig: &Rig) -> Vec<u64> {
        rig.records.iter().map(|it| it.sequence).collect()
    }
    let (rig, _) = under_way();
    let before = numbers(&rig);
    assert!(before.windows(2).all(|pair| pair[0] < pair[1]), "{before:?}");
    let highest = before.last().copied().expect("a decision");
    let mut memory = rig.mcm.memory();
    let mut rig = rig.started_again();
    rig.flag("obstacle", true);
    let after = numbers(&rig);
    assert!(!after.is_empty() && after.iter().all(|it| highest < *it), "{before:?}, then {after:?}");
    // The same recording may go on with another mission, after a landing.
    (memory.configured, memory.flight) = ("another".into(), None);
    let mut rig = Rig::without_vehicle();
    assert!(rig.mcm.resume(memory).is_err());
    rig.flag("obstacle", true);
    let after = numbers(&rig);
    assert!(!after.is_empty() && after.iter().all(|it| highest < *it), "{before:?}, then {after:?}");
}

#[test]
fn three_faults_in_one_flight_are_told_as_a_chain() {
    let (mut rig, _) = under_way();
    rig.records.clear();
    rig.flag("obstacle", true);
    rig.execute();
    rig.end_present(Succeeded);
    rig.execute();
    let silent = "the link to the ground has been silent for 10.2 s";
    raise(&mut rig, "link_lost", (10.2, 10.0, "s"), silent);
    rig.execute();
    raise(&mut rig, "battery_critical", (9.9, 10.0, "%"), "battery.charge_percent 9.90 %");
    rig.execute();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.end_present(Succeeded);
    rig.wait(1.0);
    let contingencies = rig.records.iter().filter(|it| it.topic == "contingency").cloned().map(told);
    let records: Vec<_> = contingencies.collect();
    let expected = "\
00:00:00.0  Flag `obstacle` raised: by hand.
00:00:00.0    `obstacle`: stop.
00:00:00.0      `obstacle` is over.
00:00:00.0  Flag `link_lost` raised: the link to the ground has been silent for 10.2 s.
00:00:00.0    `link_lost`: stop.
00:00:00.0    `link_lost` waits behind `battery_critical`.
00:00:00.0    `link_lost` is over: the vehicle is on the ground.
00:00:00.0  `battery_critical`: 9.9 % is below 10 %.
00:00:00.0    `battery_critical`: land. Not stop: `link_lost` asks for it, which is less severe than land.
00:00:00.0      `battery_critical` is over.";
    assert_eq!(chain(&records).join("\n"), expected);
}
