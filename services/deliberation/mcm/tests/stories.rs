//! Stories of the mission manager.

use domain::geometry::Ned;
use domain::skill::Goal;
use kittiwake_proto::topics::{Message, Request, Response};
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::{Failed, Rejected, Succeeded, TimedOut};
use kittiwake_proto::v1::operator_command::Verb;
use node::CallError;

mod after_the_end;
mod allocations;
mod alternates;
mod asking_ahead;
mod deciding;
mod drops;
mod harm;
mod interruptions;
mod late_plans;
mod memory;
mod narrowing;
mod orders;
mod permissions;
mod progress;
mod restarts;
mod restarts_in_flight;
mod rig;
mod signed;
mod timing;
mod why;
use rig::{Rig, plan, step};

#[global_allocator]
static ALLOCATOR: counting_allocator::Counting = counting_allocator::Counting;

fn fly(east_m: f64) -> Goal {
    let target = Ned::new(0.0, east_m, -10.0);
    Goal::Position { target, speed_limit_m_s: 10.0, yaw_rad: None, hold_at_target: false }
}

/// In the air, in the first of two steps; the second one is fetched.
fn under_way() -> (Rig, String) {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(100.0), &[]), step(2, Goal::Land, &[])]));
    let skill = rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.story();
    (rig, skill)
}

#[test]
fn the_next_step_starts_in_the_tick_that_ends_the_last() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Succeeded, "");
    assert_eq!(rig.story(), "start land");
    let skill = rig.execute();
    rig.vehicle(false, Land, (0.0, 100.0, 0.0));
    rig.end(&skill, Succeeded, "");
    assert_eq!(rig.story(), "replan after 0 () []");
}

#[test]
fn what_a_skill_has_shown_is_not_taken_back_by_an_introspection_from_before() {
    /// The vehicle's state in the open request to the planner.
    fn told(rig: &Rig) -> (bool, f64) {
        let state = rig.open().find_map(|it| match it {
            Request::Replan(it) => it.basis.as_ref()?.state.clone(),
            _ => None,
        });
        let state = state.expect("a step was flown");
        (state.flying, state.position.expect("it is somewhere").east_m)
    }
    #[track_caller]
    fn check(order: fn(&mut Rig, v1::SkillEvent, v1::Introspection)) {
        let (mut rig, skill) = under_way();
        rig.end(&skill, Succeeded, "");
        let request_id = rig.execute();
        rig.vehicle(true, Land, (0.0, 100.0, 2.0));
        let before = rig.introspection();
        let measured = before.land_detected.map_or(0, |it| it.timestamp_us) + 1;
        let landed = v1::SkillEvent {
            skill_id: 2,
            request_id,
            kind: v1::SkillKind::Land as i32,
            state: v1::SkillState::Ended as i32,
            outcome: Succeeded as i32,
            position: Some(v1::Ned { east_m: 101.0, ..Default::default() }),
            position_timestamp_us: measured,
            landed_timestamp_us: measured,
            ..Default::default()
        };
        order(&mut rig, landed, before.clone());
        assert_eq!(told(&rig), (false, 101.0));
        // A newer state counts.
        rig.plan(plan(&[step(3, fly(100.0), &[])]));
        let skill = rig.execute();
        rig.vehicle(true, Offboard, (0.0, 110.0, 10.0));
        rig.vehicle(true, Offboard, (0.0, 110.0, 10.0));
        rig.end(&skill, Succeeded, "");
        assert_eq!(told(&rig), (true, 110.0));
    }
    check(|rig, landed, before| {
        rig.together(|rig| {
            rig.say(before);
            rig.say(landed);
        })
    });
    check(|rig, landed, before| {
        rig.together(|rig| {
            rig.say(landed);
            rig.say(before);
        })
    });
    check(|rig, landed, before| {
        rig.say(landed);
        rig.say(before);
    });
}

#[test]
fn a_mode_is_held_against_a_skill_only_once_it_has_flown_its_own() {
    let mut rig = Rig::new();
    let mut flown = step(1, fly(100.0), &[]);
    let invariant = v1::Condition { mode: Some(Offboard as i32), ..Default::default() };
    flown.nominal.as_mut().expect("it has parameters").invariant = Some(invariant);
    rig.plan(plan(&[flown]));
    rig.execute();
    rig.story();
    rig.wait(0.5);
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    assert_eq!(rig.story(), "", "that may be from before");
    rig.vehicle(true, Offboard, (0.0, 10.0, 10.0));
    rig.vehicle(true, Loiter, (0.0, 10.0, 10.0));
    let story = rig.story();
    assert!(story.starts_with("replan after 1 (invariant not met: the flight mode is loiter"), "{story}");
}

#[test]
fn a_failed_step_is_replanned_while_a_transition_flies() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "it did not work");
    assert_eq!(rig.story(), "replan after 1 (failed: it did not work) []\nstart fly 0 100 10");
    rig.execute();
    rig.plan(plan(&[step(7, fly(100.0), &[])]));
    // One request: the vehicle does not loiter in between.
    assert_eq!(rig.story(), "start fly 0 100 10, giving up 2");
}

#[test]
fn a_transition_is_told_until_it_has_ended() {
    for outcome in [Succeeded, Failed] {
        let (mut rig, skill) = under_way();
        rig.end(&skill, Failed, "it did not work");
        let transition = rig.execute();
        rig.wait(1.0);
        assert!(rig.status().in_transition);
        rig.end(&transition, outcome, "");
        rig.wait(1.0);
        assert!(!rig.status().in_transition, "after {outcome:?}");
    }
}

#[test]
fn a_flag_stops_the_step_and_the_mission_goes_on_by_a_new_plan() {
    let (mut rig, _) = under_way();
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "start stop, giving up 1");
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    assert_eq!(rig.story(), "replan after 1 (interrupted by `obstacle`) []\nstart fly 0 100 10");
}

#[test]
fn a_more_urgent_flag_preempts_a_less_urgent_one_does_not() {
    let (mut rig, _) = under_way();
    rig.flag("operator_pause", true);
    assert_eq!(rig.story(), "start stop, giving up 1");
    rig.execute();
    rig.flag("battery_low", true);
    assert_eq!(rig.story(), "start fly 0 50 15, giving up 2");
    let climb = rig.execute();
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "");
    rig.vehicle(true, Offboard, (0.0, 50.0, 15.0));
    rig.end(&climb, Succeeded, "");
    assert_eq!(rig.story(), "start fly 0 0 15");
    let home = rig.execute();
    rig.end(&home, Succeeded, "");
    assert_eq!(rig.story(), "start land");
    let land = rig.execute();
    rig.vehicle(false, Land, (0.0, 0.0, 0.0));
    rig.end(&land, Succeeded, "");
    assert_eq!(rig.story(), "");
    rig.wait(1.0);
    // On the ground and over: no flag is left to answer.
    assert_eq!(rig.story(), "report Emergency: `battery_low`: by hand");
    assert!(rig.status().contingencies.is_empty());
}

#[test]
fn a_response_is_not_interrupted_because_its_value_is_good_again() {
    let (mut rig, _) = under_way();
    rig.flag("battery_low", true);
    rig.execute();
    rig.story();
    rig.flag("battery_low", false);
    rig.wait(1.0);
    assert_eq!(rig.story(), "");
}

#[test]
fn a_response_goes_down_its_chain_and_up_again_for_as_long_as_it_flies() {
    let (mut rig, _) = under_way();
    rig.flag("battery_critical", true);
    assert_eq!(rig.story(), "start land, giving up 1");
    // Two tries of each action, with growing pauses, and then all of them again.
    let (land, home) = ("start land", "start fly 0 50 15");
    let expected =
        [(0.0, land), (0.6, home), (1.1, home), (2.1, land), (4.1, land), (8.1, land), (8.1, land), (8.1, home)];
    for (pause_s, next) in expected {
        let flown = rig.execute();
        rig.end(&flown, Rejected, "no");
        if 0.2 < pause_s {
            rig.wait(pause_s - 0.2);
            assert_eq!(rig.story(), "", "it is too early for the next try");
        }
        rig.wait(0.2_f64.min(pause_s));
        assert_eq!(rig.story(), next);
    }
    let flown = rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 15.0));
    rig.end(&flown, Succeeded, "");
    assert_eq!(rig.story(), "start fly 0 0 15", "it has climbed to the height of returns");
    let flown = rig.execute();
    rig.end(&flown, Succeeded, "");
    assert_eq!(rig.story(), land);
    let flown = rig.execute();
    rig.vehicle(false, Land, (0.0, 0.0, 0.0));
    rig.end(&flown, Succeeded, "");
    rig.wait(1.0);
    assert_eq!(rig.story(), "report Emergency: `battery_critical`: by hand");
}

#[test]
fn a_landing_that_did_not_come_down_goes_elsewhere() {
    let (mut rig, _) = under_way();
    rig.mission(v1::MissionStatus {
        objectives: vec![v1::Objective {
            name: "deck".into(),
            position: Some(v1::Ned { north_m: 0.0, east_m: 90.0, down_m: -30.0 }),
            state: v1::ObjectiveState::Waiting as i32,
            ..Default::default()
        }],
        ..Default::default()
    });
    rig.flag("operator_abort", true);
    for _ in 0..2 {
        let land = rig.execute();
        rig.vehicle(true, Land, (0.0, 50.0, 2.0));
        rig.end(&land, TimedOut, "still 2.0 m");
        rig.wait(0.6);
    }
    // The deck is nearer than home; it is approached from above.
    let story = rig.story();
    assert!(story.ends_with("start fly 0 50 45"), "{story}");
}

#[test]
fn a_row_that_holds_never_lands_and_yields_to_what_demands_more() {
    let (mut rig, _) = under_way();
    rig.flag("obstacle", true);
    for _ in 0..3 {
        let stop = rig.execute();
        rig.end(&stop, Rejected, "no");
        rig.wait(4.1);
    }
    let expected = ["start stop, giving up 1", "start stop", "start stop", "start fly 0 50 10"];
    assert_eq!(rig.story(), expected.join("\n"), "three tries, then another way to hold");
    rig.execute();
    rig.flag("operator_abort", true);
    assert_eq!(rig.story(), "start land, giving up 5");
}

#[test]
fn a_flag_that_waits_or_does_not_count_is_recorded_as_such() {
    let (mut rig, _) = under_way();
    rig.flag("battery_critical", true);
    rig.execute();
    rig.flag("operator_return", true);
    rig.vehicle(true, Land, (0.0, 50.0, 5.0));
    rig.flag("link_lost", true);
    let told: Vec<&str> = rig.decisions.iter().map(String::as_str).filter(|it| !it.contains("raised")).collect();
    assert_eq!(
        told[told.len() - 3..],
        [
            "`battery_critical`: land",
            "`operator_return` waits behind `battery_critical`",
            "`link_lost` waits behind `battery_critical`",
        ]
    );
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[step(1, Goal::Land, &[])]));
    rig.execute();
    rig.flag("link_lost", true);
    assert_eq!(rig.decisions.last().map(String::as_str), Some("`link_lost` does not count while landing"));
}

#[test]
fn after_a_landing_that_nobody_planned_the_mission_waits_for_an_operator() {
    let landed = || {
        let (mut rig, _) = under_way();
        rig.vehicle(false, Land, (0.0, 50.0, 0.0));
        assert_eq!(rig.story(), "cancel skill 1");
        rig.wait(60.0);
        assert_eq!(rig.story(), "", "it asks for no plan");
        assert!(rig.status().start_awaited);
        rig
    };
    let mut rig = landed();
    assert_eq!(rig.command(Verb::Resume(v1::ResumeMission {})).text, "the mission starts");
    assert_eq!(rig.story(), "replan after 0 () []");
    let mut rig = landed().started_again();
    rig.wait(60.0);
    assert_eq!(rig.story(), "", "another process waits too");
    let mut rig = landed();
    rig.wait(600.0);
    assert_eq!(
        rig.story(),
        "report Failure: landed although nothing had ordered it, and no operator resumed the mission within 600 s"
    );
}

#[test]
fn a_mission_that_is_over_in_the_air_brings_the_vehicle_down() {
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 50.0, 20.0));
    rig.plan(v1::replan_reply::Reply::Finished(v1::Finished {}));
    assert_eq!(rig.story(), "replan after 0 () []\nstart fly 0 0 20");
    rig.execute();
    assert!(
        rig.command(Verb::Abort(v1::AbortMission { overrides: false })).done,
        "orders that bring it down are obeyed"
    );
    assert_eq!(rig.story(), "start land, giving up 1");
    let land = rig.execute();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.end(&land, Succeeded, "");
    rig.wait(1.0);
    assert_eq!(rig.story(), "report Success: every objective was achieved");
}

#[test]
fn a_crash_is_a_crash_whatever_was_answered_before() {
    let (mut rig, _) = under_way();
    rig.flag("battery_critical", true);
    let land = rig.execute();
    rig.vehicle(false, Land, (0.0, 50.0, 0.0));
    rig.end(&land, Succeeded, "");
    rig.flag("crashed", true);
    rig.wait(1.0);
    assert_eq!(rig.story().lines().last(), Some("report Crash: `crashed`: by hand"));
}

#[test]
fn the_wait_at_a_border_ends_with_the_grant() {
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[step(1, fly(80.0), &["A"]), step(2, fly(500.0), &[])]));
    rig.execute();
    assert_eq!(rig.story(), "replan after 0 () []\nask A\nstart fly 0 80 10");
    rig.vehicle(true, Offboard, (0.0, 40.0, 10.0));
    let granted = v1::Permission {
        area: "A".into(),
        state: v1::PermissionState::Granted as i32,
        valid_for_s: 900.0,
        decision: 1,
        ..Default::default()
    };
    rig.say(v1::PermissionLedger { permissions: vec![granted], ..Default::default() });
    assert_eq!(rig.story(), "start fly 0 500 10, giving up 1");
}

#[test]
fn an_area_is_left_by_the_quickest_way_in_the_wind_as_it_is() {
    #[track_caller]
    fn check(wind: Option<v1::WindEstimate>, expected: &str) {
        let (mut rig, _) = under_way();
        let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
        let corners = [(-200.0, 100.0), (200.0, 100.0), (200.0, 400.0), (-200.0, 400.0)].map(corner).to_vec();
        let area = v1::Area { name: "A".into(), kind: v1::AreaKind::Permission as i32, corners, ..Default::default() };
        rig.mission(v1::MissionStatus { areas: vec![area], ..Default::default() });
        let granted = v1::Permission {
            area: "A".into(),
            state: v1::PermissionState::Granted as i32,
            valid_for_s: 20.0,
            decision: 1,
            ..Default::default()
        };
        rig.say(v1::PermissionLedger { permissions: vec![granted], ..Default::default() });
        rig.wind = wind;
        rig.vehicle(true, Offboard, (0.0, 240.0, 10.0));
        rig.wait(0.3);
        let story = rig.story();
        assert!(story.contains(expected), "{story}");
    }
    check(None, "start fly 0 80 10");
    // From the nearest border.
    check(Some(v1::WindEstimate { north_m_s: 0.0, east_m_s: 12.0 }), "start fly 0 420 10");
}

#[test]
fn a_silent_tower_is_asked_three_times_and_then_counts_as_a_denial() {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(80.0), &["A"])]));
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 40.0, 10.0));
    rig.story();
    rig.wait(16.0);
    // What an operator sees meanwhile: the time waited, and its limit.
    let awaited = rig.status().awaited;
    assert!(matches!(awaited.as_slice(), [it] if it.area == "A" && it.limit_s == 30.0), "{awaited:?}");
    assert!((14.0..=17.0).contains(&awaited[0].waited_s), "{awaited:?}");
    rig.wait(15.0);
    assert_eq!(rig.status().awaited, []);
    let story = rig.story();
    assert_eq!(story.matches("ask A").count(), 2, "{story}");
    assert!(
        story.contains("replan after 1 (area A: no answer from the control tower after 3 tries) [\"A\"]"),
        "{story}"
    );
}

#[test]
fn a_request_that_the_tower_refuses_is_denied_for_its_reason() {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(80.0), &["A"])]));
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 40.0, 10.0));
    rig.story();
    let receipt = v1::PermissionReceipt { received: false, refusal: "256 areas are kept".into() };
    rig.answer(|it| matches!(it, Request::Permission(_)).then(|| Ok(Response::Permission(receipt.clone()))));
    let story = rig.story();
    let why = "area A: the control tower has refused the request: 256 areas are kept";
    assert!(story.contains(&format!("replan after 1 ({why}) [\"A\"]")), "{story}");
    assert!(rig.decisions.iter().any(|it| it == why), "{:?}", rig.decisions);
    let denials = rig.open().find_map(|it| if let Request::Replan(it) = it { Some(it.denials.clone()) } else { None });
    assert!(denials.is_some_and(|it| !it[0].silent), "it was no silence");
    rig.wait(40.0);
    assert!(!rig.story().contains("ask A"), "nothing more is awaited");
}

#[test]
fn a_planner_that_is_gone_is_asked_again_while_the_vehicle_holds() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    rig.execute();
    rig.story();
    rig.answer(|it| matches!(it, Request::Replan(_)).then_some(Err(CallError::Unavailable)));
    rig.wait(1.1);
    assert_eq!(rig.story(), "start stop, giving up 2\nreplan after 1 (failed: x) []");
}

/// The vehicle holds meanwhile, and the planner is asked with growing pauses.
#[test]
fn a_plan_that_makes_no_sense_is_refused_before_it_is_flown() {
    #[track_caller]
    fn check(break_it: impl Fn(&mut v1::PlanStep), expected: &str) {
        let (mut rig, skill) = under_way();
        rig.end(&skill, Failed, "x");
        rig.execute();
        rig.story();
        let mut rests = "start stop, giving up 2\n";
        for pause in [1.1, 2.1, 4.1] {
            let mut broken = step(7, fly(80.0), &[]);
            break_it(&mut broken);
            rig.plan(plan(&[broken]));
            assert_eq!(rig.story(), format!("{rests}planner/replan refused: {expected}"));
            if !std::mem::take(&mut rests).is_empty() {
                rig.execute();
            }
            rig.wait(pause - 0.2);
            assert_eq!(rig.story(), "", "it is too early to ask again");
            rig.wait(0.2);
            assert_eq!(rig.story(), "replan after 1 (failed: x) []");
        }
        rig.plan(plan(&[step(8, fly(80.0), &[])]));
        assert_eq!(rig.story(), "start fly 0 80 10, giving up 3", "a plan that makes sense is flown");
    }
    check(|it| it.nominal = None, "`nominal` is missing");
    check(|it| it.id = 0, "`id` is missing");
    check(
        |it| it.nominal.as_mut().unwrap().goal = Some(Goal::Takeoff { climb_m: f64::NAN }.into()),
        "`climb_m` is NaN, expected more than zero",
    );
    check(
        |it| it.nominal.as_mut().unwrap().invariant = Some(v1::Condition { mode: Some(77), ..Default::default() }),
        "`mode` is missing",
    );
}

#[test]
fn a_planner_that_refuses_the_request_is_asked_again() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    rig.execute();
    rig.story();
    rig.plan(v1::replan_reply::Reply::Refused(v1::PlanRefusal { reason: "`state` is missing".into() }));
    rig.wait(1.1);
    assert_eq!(rig.story(), "start stop, giving up 2\nreplan after 1 (failed: x) []");
}

#[test]
fn without_a_step_that_failed_the_transition_is_a_stop() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    rig.execute();
    rig.plan(plan(&[step(7, fly(80.0), &[])]));
    let flown = rig.execute();
    rig.story();
    rig.end(&flown, Succeeded, "");
    assert!(rig.story().contains("start stop"), "not on towards the goal of the step before");
}

#[test]
fn a_message_that_makes_no_sense_is_refused_and_changes_nothing() {
    #[track_caller]
    fn check(message: impl Into<Message>, expected: &str) {
        let (mut rig, _) = under_way();
        rig.story();
        rig.say(message);
        assert_eq!(rig.story(), expected);
        rig.wait(0.2);
        assert_eq!(rig.story(), "", "it flies on");
    }
    let granted = v1::Permission { area: "A".into(), state: 2, valid_for_s: f64::NAN, ..Default::default() };
    check(
        v1::PermissionLedger { permissions: vec![granted], ..Default::default() },
        "permission/ledger refused: `valid_for_s` is NaN, expected seconds, zero or more",
    );
    check(v1::SkillEvent { skill_id: 1, ..Default::default() }, "skill/event refused: `state` is missing");
}

#[test]
fn a_transition_that_fails_raises_its_flag() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    let transition = rig.execute();
    rig.story();
    rig.end(&transition, Failed, "y");
    assert_eq!(rig.story(), "start stop");
}

#[test]
fn a_mission_without_anything_left_to_do_ends_with_a_report() {
    let mut rig = Rig::new();
    rig.mission(v1::MissionStatus {
        objectives: vec![v1::Objective {
            name: "home".into(),
            position: Some(v1::Ned::default()),
            state: v1::ObjectiveState::Success as i32,
            ..Default::default()
        }],
        current_objective: 1,
        ..Default::default()
    });
    rig.plan(v1::replan_reply::Reply::Finished(v1::Finished {}));
    assert_eq!(rig.story(), "replan after 0 () []");
    rig.wait(1.0);
    assert_eq!(rig.story(), "report Success: every objective was achieved");
}

#[test]
fn a_planner_of_another_version_is_refused_by_its_version() {
    let mut rig = Rig::new();
    rig.story();
    rig.answer_plan(plan(&[step(1, fly(80.0), &[])]), 0);
    let why = "the planner speaks version 1 of the questions about plans, expected 4: start both from one version of the program";
    assert_eq!(rig.story(), format!("planner/replan refused: {why}"));
    assert!(rig.decisions.iter().any(|it| it.contains(why)), "{:?}", rig.decisions);
}

#[test]
fn a_skill_that_is_given_up_before_its_id_is_known_is_cancelled_when_it_comes() {
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[step(1, fly(80.0), &[])]));
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "replan after 0 () []\nstart fly 0 80 10\nstart stop");
    // The first request is refused and the stop is accepted: nothing is left to cancel.
    let refusal = v1::SkillReply { skill_id: 0, refusal: "busy".into() };
    rig.answer(|it| matches!(it, Request::Skill(_)).then(|| Ok(Response::Skill(refusal.clone()))));
    rig.execute();
    assert_eq!(rig.story(), "");
}

#[test]
fn a_step_costs_one_request_for_its_skill() {
    let (mut rig, skill) = under_way();
    assert_eq!(rig.open().count(), 0);
    rig.end(&skill, Succeeded, "");
    assert_eq!(rig.open().count(), 1);
}

#[test]
fn listed_flags_without_a_row_are_counted_once_and_leave_room_for_the_decisions() {
    let (mut rig, _) = under_way();
    rig.decisions.clear();
    let named = |it: u32| v1::RaisedFlag { name: format!("unheard_of_{it}"), ..Default::default() };
    for _ in 0..3 {
        rig.say(v1::Introspection { flags: (0..2000).map(named).collect(), ..Default::default() });
    }
    assert_eq!(rig.decisions, [""; 0]);
    assert_eq!(rig.story().lines().filter(|it| it.contains("has no row")).count(), 2000, "each is counted");
    rig.flag("obstacle", true);
    assert!(rig.decisions.iter().any(|it| it.contains("flag `obstacle` raised")), "{:?}", rig.decisions);
}

#[test]
fn flags_that_rise_and_fall_all_the_time_leave_room_for_the_decisions() {
    let (mut rig, _) = under_way();
    rig.flag("motor_failure", true);
    rig.decisions.clear();
    for _ in 0..400 {
        rig.flag("battery_stale", true);
        rig.wait(0.01);
        rig.flag("battery_stale", false);
        rig.wait(0.01);
    }
    let about = |rig: &Rig, part: &str| rig.decisions.iter().filter(|it| it.contains(part)).count();
    assert!(2 < about(&rig, "flag `battery_stale` raised") && rig.decisions.len() < 20, "{:?}", rig.decisions);
    rig.wait(10.0);
    assert_eq!(about(&rig, "flag `battery_stale` raised: by hand (397 more times in 10 s)"), 1, "{:?}", rig.decisions);
}
