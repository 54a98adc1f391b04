//! What the manager does, in stories.

use domain::geometry::Ned;
use domain::skill::Goal;
use kittiwake_proto::topics::{Request, Response};
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::{Failed, Rejected, Succeeded};
use node::CallError;

mod interruptions;
mod orders;
mod restarts;
mod rig;
use rig::{Rig, plan, step};

fn fly(east_m: f64) -> Goal {
    let target = Ned::new(0.0, east_m, -10.0);
    Goal::Position { target, speed_limit_m_s: 10.0, yaw_rad: None, hold_at_target: false }
}

/// In the air, flying the first of two steps, the second one fetched.
fn under_way() -> (Rig, String) {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(100.0), &[]), step(2, Goal::Land, &[])]));
    let skill = rig.execute();
    rig.next(Some(step(2, Goal::Land, &[])));
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.story();
    (rig, skill)
}

#[test]
fn the_next_step_starts_in_the_tick_that_ends_the_last() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Succeeded, "");
    assert_eq!(rig.story(), "start land\ndone 1");
    rig.acknowledge_done();
    let skill = rig.execute();
    rig.next(None);
    rig.vehicle(false, Land, (0.0, 100.0, 0.0));
    rig.end(&skill, Succeeded, "");
    assert_eq!(rig.story(), "done 2");
    rig.acknowledge_done();
    assert_eq!(rig.story(), "replan after 0 () []");
}

#[test]
fn what_a_skill_has_shown_is_not_taken_back_by_an_introspection_from_before() {
    /// What the planner is told of the vehicle, by the open request.
    fn told(rig: &Rig) -> (bool, f64) {
        let state = rig.open().find_map(|it| match it {
            Request::StepDone(it) => it.state.clone(),
            Request::Replan(it) => it.state.clone(),
            _ => None,
        });
        let state = state.expect("a step was flown");
        (state.flying, state.position.expect("it is somewhere").east_m)
    }
    #[track_caller]
    fn check(order: fn(&mut Rig, v1::SkillEvent, v1::Introspection)) {
        let (mut rig, skill) = under_way();
        rig.end(&skill, Succeeded, "");
        rig.acknowledge_done();
        let request_id = rig.execute();
        rig.next(None);
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
        assert_eq!(told(&rig), (false, 101.0), "when the step is reported");
        rig.say(before);
        rig.acknowledge_done();
        assert_eq!(told(&rig), (false, 101.0), "when a plan is asked for");
        // What is newer counts.
        rig.plan(plan(&[step(3, fly(100.0), &[])]));
        let skill = rig.execute();
        rig.next(None);
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
    rig.next(None);
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
    // One request: no loiter flashes in between.
    assert_eq!(rig.story(), "start fly 0 100 10, giving up 2");
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
    assert_eq!(rig.story(), "start fly 0 0 15, giving up 2");
    let home = rig.execute();
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "");
    rig.end(&home, Succeeded, "");
    assert_eq!(rig.story(), "start land");
    let land = rig.execute();
    rig.vehicle(false, Land, (0.0, 0.0, 0.0));
    rig.end(&land, Succeeded, "");
    // Down and over; the flags below are still answered, on the ground by nothing that flies.
    let story = rig.story();
    assert!(story.starts_with("start stop"), "{story}");
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
fn an_emergency_action_that_fails_ends_the_mission_for_good() {
    let (mut rig, _) = under_way();
    rig.flag("battery_critical", true);
    assert_eq!(rig.story(), "start land, giving up 1");
    let land = rig.execute();
    rig.end(&land, Rejected, "no");
    assert_eq!(rig.story(), "start land");
    let land = rig.execute();
    rig.end(&land, Rejected, "no again");
    assert_eq!(rig.story(), "start stop");
    let hold = rig.execute();
    rig.end(&hold, Succeeded, "");
    assert_eq!(rig.story(), "report Emergency: `battery_critical`: the emergency action failed: rejected: no again");
    rig.wait(60.0);
    assert!(!rig.story().contains("start"), "nothing starts again");
}

#[test]
fn the_wait_at_a_border_ends_with_the_grant() {
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[step(1, fly(80.0), &["A"]), step(2, fly(500.0), &[])]));
    rig.execute();
    rig.next(Some(step(2, fly(500.0), &[])));
    assert_eq!(rig.story(), "replan after 0 () []\nask A\nstart fly 0 80 10");
    rig.vehicle(true, Offboard, (0.0, 40.0, 10.0));
    let granted = v1::Permission {
        area: "A".into(),
        state: v1::PermissionState::Granted as i32,
        valid_for_s: 900.0,
        decision: 1,
        ..Default::default()
    };
    rig.say(v1::PermissionLedger { permissions: vec![granted] });
    assert_eq!(rig.story(), "start fly 0 500 10, giving up 1\ndone 1");
}

#[test]
fn silence_is_asked_three_times_and_then_told_to_the_planner() {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(80.0), &["A"])]));
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 40.0, 10.0));
    rig.story();
    rig.wait(31.0);
    let story = rig.story();
    assert_eq!(story.matches("ask A").count(), 2, "{story}");
    assert!(
        story.contains("replan after 1 (area A: no answer from the control tower after 3 tries) [\"A\"]"),
        "{story}"
    );
}

#[test]
fn a_planner_that_is_gone_is_asked_again_while_the_vehicle_holds() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    rig.execute();
    rig.story();
    rig.answer(|it| matches!(it, Request::Replan(_)).then_some(Err(CallError::Unavailable)));
    rig.wait(1.1);
    assert_eq!(rig.story(), "replan after 1 (failed: x) []");
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
    rig.say(v1::PlannerStatus {
        objectives: vec![v1::Objective {
            name: "home".into(),
            state: v1::ObjectiveState::Success as i32,
            ..Default::default()
        }],
        current_objective: 1,
        ..Default::default()
    });
    rig.plan(v1::replan_reply::Reply::Finished(v1::Finished {}));
    assert_eq!(rig.story(), "replan after 0 () []\nreport Success: every objective was achieved");
}

#[test]
fn a_skill_that_is_given_up_before_its_id_is_known_is_cancelled_when_it_comes() {
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[step(1, fly(80.0), &[])]));
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "replan after 0 () []\nstart fly 0 80 10\nstart stop");
    // The first request is refused, the stop taken: nothing is left to cancel.
    let refusal = v1::SkillReply { skill_id: 0, refusal: "busy".into() };
    rig.answer(|it| matches!(it, Request::Skill(_)).then(|| Ok(Response::Skill(refusal.clone()))));
    rig.execute();
    assert_eq!(rig.story(), "");
}

#[test]
fn a_step_costs_one_request_for_its_skill_one_for_the_next_step_and_one_that_it_was_flown() {
    let (mut rig, skill) = under_way();
    assert_eq!(rig.open().count(), 0);
    rig.end(&skill, Succeeded, "");
    assert_eq!(rig.open().count(), 3);
}
