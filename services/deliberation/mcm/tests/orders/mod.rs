//! An operator's orders in each state, and what follows.

use domain::skill::Goal;
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::Succeeded;
use v1::operator_command::Verb;

use super::{fly, under_way};
use crate::stories::rig::{Rig, plan, step};

const START: Verb = Verb::Start(v1::StartMission {});
const PAUSE: Verb = Verb::Pause(v1::PauseMission { overrides: false });
const RESUME: Verb = Verb::Resume(v1::ResumeMission {});
const ABORT: Verb = Verb::Abort(v1::AbortMission { overrides: false });
const RETURN: Verb = Verb::Return(v1::ReturnHome { overrides: false });
const REPLAN: Verb = Verb::Replan(v1::ReplanMission {});

fn land_at(north_m: f64, east_m: f64) -> Verb {
    Verb::LandAt(v1::LandAt { position: Some(v1::Ned { north_m, east_m, down_m: 0.0 }), overrides: false })
}

fn acknowledge(flag: &str) -> Verb {
    Verb::Acknowledge(v1::AcknowledgeFlag { flag: flag.into() })
}

fn decide(revision: u64, approve: bool) -> Verb {
    Verb::DecidePlan(v1::DecidePlan { revision, approve })
}

/// A state that verbs are tried in.
#[derive(Debug, Clone, Copy)]
enum State {
    AwaitingStart,
    OnTheGround,
    /// At an objective on the way, which it has landed at.
    Delivering,
    /// Where nobody wanted it to land; the mission waits for an operator.
    LandedUnplanned,
    /// With a plan, number 3, that waits for approval.
    Proposed,
    Flying,
    Paused,
    Stopping,
    Returning,
    Aborting,
    Over,
}

fn in_state(state: State) -> Rig {
    match state {
        State::AwaitingStart => Rig::with(&[("start = \"at-once\"", "start = \"operator\"")]),
        State::OnTheGround => Rig::new(),
        State::Delivering => {
            let mut rig = Rig::new();
            rig.plan(plan(&[step(1, fly(500.0), &[]), step(2, Goal::Land, &[])]));
            rig.execute();
            rig.vehicle(true, Offboard, (0.0, 500.0, 10.0));
            rig.end_present(Succeeded);
            rig.execute();
            rig.vehicle(false, Land, (0.0, 500.0, 0.0));
            rig.end_present(Succeeded);
            rig
        }
        State::LandedUnplanned => {
            let (mut rig, _) = under_way();
            rig.vehicle(false, Loiter, (0.0, 50.0, 0.0));
            rig
        }
        State::Proposed => proposed("each-plan"),
        State::Flying => under_way().0,
        State::Paused => ordered(PAUSE),
        State::Returning => ordered(RETURN),
        State::Aborting => ordered(ABORT),
        State::Stopping => {
            let (mut rig, _) = under_way();
            rig.flag("obstacle", true);
            rig.execute();
            rig
        }
        State::Over => {
            let mut rig = ordered(ABORT);
            rig.vehicle(false, Land, (0.0, 50.0, 0.0));
            rig.end_present(Succeeded);
            rig.wait(1.0);
            rig
        }
    }
}

fn ordered(verb: Verb) -> Rig {
    let (mut rig, _) = under_way();
    assert!(rig.command(verb).done);
    rig.execute();
    rig
}

/// The answer to each verb in `state`: what is done, or why not, in words.
#[track_caller]
fn check(state: State, answers: [&str; 9]) {
    let (seen, approved) = (acknowledge("obstacle"), decide(3, true));
    let verbs = [START, PAUSE, RESUME, REPLAN, RETURN, land_at(0.0, 80.0), ABORT, seen, approved];
    for (verb, expected) in verbs.into_iter().zip(answers) {
        let reply = in_state(state).command(verb.clone());
        let mark = if reply.done { "" } else { "no: " };
        assert_eq!(format!("{mark}{}", reply.text), expected, "{verb:?} in {state:?}");
    }
}

#[test]
fn each_verb_in_each_state() {
    const OVER: &str = "no: the mission is over: `operator_abort`: ordered by anna";
    const NO_NEXT: &str =
        "no: the mission is over: `operator_abort`: ordered by anna; upload the next mission to fly again";
    const STARTED: &str = "no: the mission has started already";
    const NOT_YET: &str = "no: the mission has not started";
    const HOME_ALREADY: &str = "is on the ground there: stays, and ends the mission on the ground";
    const NOT_THERE: &str =
        "is on the ground at (0, 0) and does not fly to (0, 80): stays, and ends the mission on the ground";
    const NO_HOLD: &str = "no: it does not hold for an operator";
    const HOLDS: &str = "holds until resumed";
    const HOME: &str = "flies home, lands and ends the mission";
    const THERE: &str = "flies to (0, 80), lands there and ends the mission";
    const DOWN: &str = "lands here and ends the mission";
    const STAYS: &str = "ends the mission on the ground";
    const NO_FLAG: &str = "no: `obstacle` is not up";
    const NO_PLAN: &str = "no: no plan waits for approval";
    const ANEW: &str = "a new plan is made";
    check(
        State::AwaitingStart,
        ["the mission starts", NOT_YET, NOT_YET, NOT_YET, NOT_YET, NOT_YET, STAYS, NO_FLAG, NO_PLAN],
    );
    check(State::OnTheGround, [STARTED, HOLDS, NO_HOLD, ANEW, HOME_ALREADY, NOT_THERE, STAYS, NO_FLAG, NO_PLAN]);
    check(State::Proposed, [STARTED, HOLDS, NO_HOLD, ANEW, HOME_ALREADY, NOT_THERE, STAYS, NO_FLAG, "plan 3 is flown"]);
    let not_home = "is on the ground at (0, 500) and does not fly to (0, 0): stays, and ends the mission on the ground";
    let not_there =
        "is on the ground at (0, 500) and does not fly to (0, 80): stays, and ends the mission on the ground";
    check(State::Delivering, [STARTED, HOLDS, NO_HOLD, ANEW, not_home, not_there, STAYS, NO_FLAG, NO_PLAN]);
    let not_home = "is on the ground at (0, 50) and does not fly to (0, 0): stays, and ends the mission on the ground";
    let not_there =
        "is on the ground at (0, 50) and does not fly to (0, 80): stays, and ends the mission on the ground";
    let go = "the mission starts";
    check(State::LandedUnplanned, [go, NOT_YET, go, NOT_YET, not_home, not_there, STAYS, NO_FLAG, NO_PLAN]);
    check(State::Flying, [STARTED, HOLDS, NO_HOLD, ANEW, HOME, THERE, DOWN, NO_FLAG, NO_PLAN]);
    let (twice, on) = ("no: `operator_pause` is under way already", "goes on with a new plan");
    let up = "no: `operator_pause` is answered; a new plan is made when that is over";
    check(State::Paused, [STARTED, twice, on, up, HOME, THERE, DOWN, NO_FLAG, NO_PLAN]);
    // A response that is more severe than a hold is flown at once; another hold waits.
    let up = "no: `obstacle` is answered; a new plan is made when that is over";
    let later = "holds until resumed, but not before `obstacle` (stop, else hold_position, else stop); order it with override to \
                 have it at once";
    check(State::Stopping, [STARTED, later, NO_HOLD, up, HOME, THERE, DOWN, "`obstacle` acknowledged", NO_PLAN]);
    // The newest order counts.
    let home = "no: `operator_return` is under way already";
    let up = "no: `operator_return` is answered; a new plan is made when that is over";
    let replaces =
        "holds until resumed; `operator_return` no longer counts: order it again, or a resume flies the mission on";
    check(State::Returning, [STARTED, replaces, NO_HOLD, up, home, THERE, DOWN, NO_FLAG, NO_PLAN]);
    let down = "no: `operator_abort` is under way already";
    let up = "no: `operator_abort` is answered; a new plan is made when that is over";
    let replaces =
        "holds until resumed; `operator_abort` no longer counts: order it again, or a resume flies the mission on";
    check(State::Aborting, [STARTED, replaces, NO_HOLD, up, HOME, THERE, down, NO_FLAG, NO_PLAN]);
    check(State::Over, [NO_NEXT, OVER, OVER, OVER, OVER, OVER, OVER, NO_FLAG, NO_PLAN]);
}

#[test]
fn a_mission_that_waits_for_its_start_plans_nothing_before() {
    let mut rig = in_state(State::AwaitingStart);
    rig.wait(5.0);
    assert_eq!(rig.story(), "");
    assert!(rig.status().start_awaited);
    rig.command(START);
    assert_eq!(rig.story(), "replan after 0 () []");
    assert!(!rig.status().start_awaited);
}

#[test]
fn a_manager_that_comes_back_in_the_air_does_not_wait_for_a_start() {
    let mut rig = Rig::with(&[("start = \"at-once\"", "start = \"operator\"")]);
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    assert_eq!(rig.story(), "replan after 0 () []");
}

#[test]
fn an_aborted_mission_that_never_started_is_over() {
    let mut rig = in_state(State::AwaitingStart);
    rig.command(ABORT);
    rig.wait(1.0);
    assert_eq!(rig.story(), "start land\nreport Emergency: `operator_abort`: ordered by anna");
}

#[test]
fn a_pause_lasts_until_it_is_resumed() {
    let (mut rig, _) = under_way();
    rig.command(PAUSE);
    assert_eq!(rig.story(), "start stop, giving up 1");
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    rig.vehicle(true, Loiter, (0.0, 55.0, 10.0));
    rig.wait(60.0);
    assert_eq!(rig.story(), "");
    assert!(rig.status().paused);
    rig.command(RESUME);
    assert_eq!(rig.story(), "replan after 1 (interrupted by `operator_pause`) []\nstart stop");
    assert!(!rig.status().paused);
}

#[test]
fn who_resumes_during_a_response_that_ends_the_mission_hears_so() {
    let (mut rig, _) = under_way();
    rig.flag("battery_low", true);
    rig.execute();
    rig.command(PAUSE);
    let expected =
        "no longer holds; `battery_low` (divert, else land_elsewhere, else land) goes on, and ends the mission";
    assert_eq!(rig.command(RESUME).text, expected);
}

#[test]
fn the_vehicle_lands_at_the_place_that_was_ordered() {
    let (mut rig, _) = under_way();
    rig.command(land_at(30.0, 40.0));
    // Up to the height of returns first.
    assert_eq!(rig.story(), "start fly 0 50 15, giving up 1");
    let climb = rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 15.0));
    rig.end(&climb, Succeeded, "");
    assert_eq!(rig.story(), "start fly 30 40 15");
    let flight = rig.execute();
    rig.end(&flight, Succeeded, "");
    assert_eq!(rig.story(), "start land");
}

#[test]
fn a_landing_site_that_makes_no_sense_is_refused() {
    #[track_caller]
    fn refused(verb: Verb, expected: &str) {
        let (mut rig, _) = under_way();
        let reply = rig.command(verb);
        assert!(!reply.done && reply.text.contains(expected), "{}", reply.text);
        assert_eq!(rig.story(), "");
    }
    refused(Verb::LandAt(v1::LandAt::default()), "`position` is missing");
    refused(land_at(f64::NAN, 0.0), "`position` is north NaN, east 0.0, down 0.0, expected ");
    refused(land_at(0.0, 2e5), "the site is farther than 100000 m from the origin");
}

/// In the air, 15 m high and 10 m before area A, which lies from 60 m to 70 m east.
fn before_area(kind: v1::AreaKind, until_utc_ms: Option<i64>) -> Rig {
    before_area_at(kind, until_utc_ms, Vec::new())
}

/// The same with hours of the week.
fn before_area_at(kind: v1::AreaKind, until_utc_ms: Option<i64>, hours_utc: Vec<String>) -> Rig {
    let (mut rig, _) = under_way();
    let corner = |north_m, east_m| v1::Ned { north_m, east_m, down_m: 0.0 };
    let area = v1::Area {
        name: "A".into(),
        kind: kind as i32,
        corners: vec![corner(-9.0, 60.0), corner(9.0, 60.0), corner(9.0, 70.0), corner(-9.0, 70.0)],
        until_utc_ms,
        hours_utc,
        ..Default::default()
    };
    rig.mission(v1::MissionStatus { areas: vec![area], ..Default::default() });
    rig.vehicle(true, Offboard, (0.0, 50.0, 15.0));
    rig.story();
    rig
}

/// The rig's clock stands at midnight of a Thursday.
#[test]
fn a_place_is_judged_by_the_hours_of_the_area_around_it() {
    let order = |hours: &str| {
        let mut rig = before_area_at(v1::AreaKind::KeepOut, None, vec![hours.to_owned()]);
        rig.command(land_at(0.0, 65.0))
    };
    let now = order("Thu 00:00-01:00");
    assert_eq!((now.done, now.text.as_str()), (false, "the place lies in keep-out area `A`, which applies then"));
    assert!(order("Wed 22:00-24:00").done, "it is over");
    assert!(order("Fri 00:00-24:00").done, "it comes later");
}

#[test]
fn an_order_leads_round_an_area_that_may_not_be_entered_and_never_into_one() {
    let mut rig = before_area(v1::AreaKind::KeepOut, None);
    let reply = rig.command(land_at(0.0, 65.0));
    assert_eq!(reply.text, "the place lies in keep-out area `A`, which always applies");
    assert_eq!(rig.story(), "");
    assert!(rig.command(land_at(0.0, 80.0)).done);
    assert_eq!(rig.story(), "start fly 19 50 15, giving up 1");
}

/// The manager keeps the mission, so it is started again with its areas.
#[test]
fn a_manager_that_is_started_again_flies_round_the_areas_of_an_uploaded_mission() {
    let mut rig = before_area(v1::AreaKind::KeepOut, None);
    assert!(rig.command(land_at(0.0, 80.0)).done);
    let mut rig = rig.started_again();
    rig.vehicle(true, Offboard, (0.0, 50.0, 15.0));
    rig.wait(1.0);
    assert_eq!(rig.story(), "start fly 19 50 15");
}

#[test]
fn an_ordered_place_nearer_to_a_border_than_the_margin_is_refused() {
    let near = "the place lies 5.0 m from the border of area `A`, expected at least 10 m";
    for (kind, until_utc_ms) in [(v1::AreaKind::KeepOut, None), (v1::AreaKind::Permission, Some(i64::MAX))] {
        let mut rig = before_area(kind, until_utc_ms);
        assert_eq!(rig.command(land_at(0.0, 75.0)), v1::OperatorReply { done: false, text: near.into() });
        assert_eq!(rig.story(), "");
    }
    // Over before it arrives.
    let mut rig = before_area(v1::AreaKind::KeepOut, Some(0));
    assert!(rig.command(land_at(0.0, 75.0)).done);
}

#[test]
fn an_order_into_an_area_asks_for_its_permission_and_says_so() {
    let mut rig = before_area(v1::AreaKind::Permission, None);
    let reply = rig.command(land_at(0.0, 65.0));
    let text = "flies to (0, 65), lands there and ends the mission; asks for A first, which the only way leads through; \
                if refused: land_elsewhere, else land; order it with override to enter without permission";
    assert_eq!(reply, v1::OperatorReply { done: true, text: text.into() });
    assert_eq!(rig.story(), "ask A\nstart stop, giving up 1");
}

#[test]
fn an_order_to_another_place_takes_the_place_of_the_first_even_during_the_landing() {
    let mut rig = ordered(land_at(0.0, 80.0));
    rig.vehicle(true, Offboard, (0.0, 80.0, 15.0));
    rig.end_present(Succeeded);
    rig.execute();
    rig.story();
    assert!(!rig.command(land_at(0.0, 80.0)).done, "that is what it does");
    assert!(rig.command(land_at(30.0, 80.0)).done);
    assert_eq!(rig.story(), "start fly 30 80 15, giving up 3");
}

#[test]
fn the_pilot_in_command_may_override_what_may_be_overridden() {
    #[track_caller]
    fn check(flag: &str, expected: &str, story: &str) {
        let (mut rig, _) = under_way();
        rig.flag(flag, true);
        rig.execute();
        rig.story();
        let reply = rig.command(Verb::Pause(v1::PauseMission { overrides: true }));
        assert_eq!((reply.done, &*reply.text), (true, expected));
        assert_eq!(rig.story(), story);
    }
    check("battery_low", "holds until resumed", "start stop, giving up 2");
    let refused = "holds until resumed, but not before `estimator_lost` (land_now): that may not be overridden";
    check("estimator_lost", refused, "");
}

#[test]
fn the_same_order_is_refused_if_it_overrides_as_much_as_before() {
    let abort = |overrides| Verb::Abort(v1::AbortMission { overrides });
    for (first, second) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut rig = ordered(abort(first));
        assert_eq!(rig.command(abort(second)).done, first != second, "{first}, then {second}");
    }
}

#[test]
fn an_override_does_not_outlast_what_it_has_overridden() {
    let (mut rig, _) = under_way();
    rig.flag("battery_low", true);
    rig.execute();
    let pause = || Verb::Pause(v1::PauseMission { overrides: true });
    assert!(rig.command(pause()).done);
    rig.story();
    // Nobody knew of this one.
    rig.flag("battery_critical", true);
    assert_eq!(rig.story(), "start land, giving up 2");
    // Known, it may be overridden as well.
    assert_eq!(rig.command(pause()).text, "holds until resumed");
}

#[test]
fn a_new_plan_is_made_from_the_objective_and_counts_as_no_failure() {
    let (mut rig, _) = under_way();
    rig.command(REPLAN);
    assert_eq!(rig.story(), "replan after 0 () []\nstart fly 0 100 10, giving up 1");
}

#[test]
fn a_changed_mission_ends_the_step_of_the_old_one() {
    let (mut rig, _) = under_way();
    rig.change_mission(v1::MissionStatus::default(), true);
    assert_eq!(rig.story(), "replan after 0 () []\nstart fly 0 100 10, giving up 1");
    rig.execute();
    let plan_of_now = v1::Plan { steps: vec![step(9, fly(70.0), &[])], ..Default::default() };
    rig.plan(v1::replan_reply::Reply::Plan(plan_of_now));
    assert_eq!(rig.story(), "start fly 0 70 10, giving up 2");
}

#[test]
fn a_repeated_command_gets_the_first_answer_and_does_nothing() {
    let (mut rig, _) = under_way();
    let first = rig.command_as("k1", PAUSE);
    rig.story();
    assert_eq!(rig.command_as("k1", PAUSE), first);
    assert_eq!(rig.command_as("k1", ABORT), first);
    assert_eq!(rig.story(), "");
    assert_eq!(rig.command_as("", ABORT).text, "the order has no request id");
}

#[test]
fn an_acknowledgement_lasts_as_long_as_its_flag() {
    let (mut rig, _) = under_way();
    assert_eq!(rig.command(acknowledge("obstacle")).text, "`obstacle` is not up");
    rig.flag("obstacle", true);
    assert_eq!(rig.status().contingencies[0].acknowledged_by, "");
    assert_eq!(rig.command(acknowledge("obstacle")).text, "`obstacle` acknowledged");
    assert_eq!(rig.status().contingencies[0].acknowledged_by, "anna");
    assert_eq!(rig.command(acknowledge("obstacle")).text, "anna has acknowledged `obstacle` already");
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    assert!(rig.status().contingencies.is_empty());
}

/// On the ground with a plan that waits for approval.
fn proposed(policy: &str) -> Rig {
    let mut rig = Rig::with(&[("plan_approval = \"none\"", &format!("plan_approval = \"{policy}\""))]);
    let first = v1::Plan { steps: vec![step(1, fly(100.0), &[])], revision: 3, ..Default::default() };
    rig.plan(v1::replan_reply::Reply::Plan(first));
    rig
}

#[test]
fn a_plan_is_flown_once_it_is_approved() {
    let mut rig = proposed("each-plan");
    assert_eq!(rig.story(), "replan after 0 () []");
    let waiting = rig.status().plan_approval.unwrap();
    assert_eq!((waiting.left_s, waiting.approved_by_default), (60.0, false));
    assert_eq!(rig.command(decide(2, true)).text, "plan 3 waits for approval, not plan 2");
    assert!(rig.command(decide(3, true)).done);
    assert_eq!(rig.story(), "start fly 0 100 10");
    assert_eq!(rig.command(decide(3, true)).text, "no plan waits for approval");
}

#[test]
fn a_refused_plan_leaves_the_vehicle_holding() {
    let mut rig = proposed("each-plan");
    assert!(rig.command(decide(3, false)).done);
    assert_eq!(rig.story(), "replan after 0 () []\nstart stop");
    assert!(rig.status().paused);
}

#[test]
fn nobody_decides_and_the_default_counts() {
    let mut rig = proposed("each-plan");
    rig.story();
    rig.wait(59.0);
    assert_eq!(rig.story(), "");
    rig.wait(1.5);
    assert_eq!(rig.story(), "start stop");
}

/// The place of an order that another one has replaced counts for nothing any more.
#[test]
fn a_return_after_an_order_to_another_place_ends_at_home() {
    let mut rig = ordered(land_at(0.0, 80.0));
    assert!(rig.command(Verb::Return(v1::ReturnHome { overrides: false })).done);
    rig.vehicle(false, Land, (0.0, 0.0, 0.0));
    rig.wait(20.0);
    let report = rig.status().report.expect("it stands, and a return ends the mission");
    assert_eq!(report.reason, "`operator_return`: ordered by anna");
}

#[test]
fn only_replannings_wait_if_the_policy_says_so() {
    let mut rig = proposed("each-replanning");
    assert_eq!(rig.story(), "replan after 0 () []\nstart fly 0 100 10");
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.command(REPLAN);
    rig.execute();
    let again = || plan(&[step(2, fly(100.0), &[])]);
    rig.plan(again());
    assert!(rig.status().plan_approval.is_some());
    // Another one is wanted: that is a replanning as well, also for a manager that was started again.
    rig.command(REPLAN);
    rig.plan(again());
    assert!(rig.status().plan_approval.is_some());
    let mut rig = rig.started_again();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.plan(again());
    assert!(rig.status().plan_approval.is_some());
    // Of another mission it is the first.
    rig.change_mission(v1::MissionStatus::default(), true);
    assert!(rig.status().plan_approval.is_none());
    rig.story();
    rig.plan(v1::replan_reply::Reply::Plan(v1::Plan { steps: vec![step(3, fly(100.0), &[])], ..Default::default() }));
    assert_eq!(rig.story(), "start fly 0 100 10");
    // For the next process that is the same mission.
    rig.execute();
    let mut rig = rig.started_again();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.plan(again());
    assert!(rig.status().plan_approval.is_some());
}
