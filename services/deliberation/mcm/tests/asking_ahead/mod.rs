//! Permissions that are asked for while an earlier step is flown.

use domain::skill::Goal;
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::Succeeded;

use crate::stories::fly;
use crate::stories::rig::{Rig, plan, step};

/// A step that asks for B ahead, `after_s` after its beginning.
fn asking_ahead(id: u64, goal: Goal, ask: &[&str], after_s: f64) -> v1::PlanStep {
    v1::PlanStep { ask_ahead: vec![v1::AskAhead { area: "B".into(), for_s: 60.0, after_s }], ..step(id, goal, ask) }
}

/// The step to the border of B, which asks for it.
fn to_the_border() -> v1::PlanStep {
    step(2, fly(120.0), &["B"])
}

/// In the air, in the first of three steps. It asks for B ahead after two seconds.
fn under_way() -> Rig {
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    rig.plan(plan(&[asking_ahead(1, fly(100.0), &[], 2.0), to_the_border(), step(3, fly(500.0), &[])]));
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.story();
    rig
}

/// The same, two seconds later: B has been asked for.
fn asked() -> Rig {
    let mut rig = under_way();
    rig.wait(2.0);
    assert_eq!(rig.story(), "ask B");
    rig
}

/// The control tower has decided about B.
fn decide(rig: &mut Rig, state: v1::PermissionState, valid_for_s: f64) {
    let reason = if state == v1::PermissionState::Granted { "" } else { "closed" };
    let line = v1::Permission {
        area: "B".into(),
        state: state as i32,
        reason: reason.into(),
        valid_for_s,
        decision: 1,
        ..Default::default()
    };
    rig.say(v1::PermissionLedger { permissions: vec![line], ..Default::default() });
}

/// The first step is flown to its end.
fn arrive(rig: &mut Rig) {
    rig.vehicle(true, Offboard, (0.0, 100.0, 10.0));
    rig.end_present(Succeeded);
}

#[test]
fn a_permission_is_asked_for_ahead_when_it_is_time() {
    let mut rig = under_way();
    rig.wait(1.9);
    assert_eq!(rig.story(), "");
    rig.wait(0.2);
    assert_eq!(rig.story(), "ask B");
    assert!(rig.decisions.iter().any(|it| it == "asking for area B ahead"), "{:?}", rig.decisions);
}

#[test]
fn an_answer_to_what_was_asked_ahead_follows_from_that_question() {
    let mut rig = asked();
    decide(&mut rig, v1::PermissionState::Granted, 900.0);
    let record = |kind: v1::DecisionKind| rig.records.iter().rev().find(|it| it.kind() == kind).expect("a record");
    let question = record(v1::DecisionKind::PermissionAsked);
    assert_eq!(question.text, "asking for area B ahead");
    assert_eq!(record(v1::DecisionKind::PermissionDecided).parent, question.sequence);
}

#[test]
fn granted_ahead_the_border_is_crossed_without_a_wait() {
    let mut rig = asked();
    decide(&mut rig, v1::PermissionState::Granted, 900.0);
    assert_eq!(rig.story(), "", "the step goes on");
    arrive(&mut rig);
    assert_eq!(rig.story(), "start fly 0 500 10", "the step to the border is over at once");
}

#[test]
fn what_is_held_already_is_not_asked_for_ahead() {
    let mut rig = under_way();
    decide(&mut rig, v1::PermissionState::Granted, 900.0);
    rig.wait(5.0);
    assert_eq!(rig.story(), "");
}

#[test]
fn refused_ahead_the_planner_hears_of_it_when_the_vehicle_turns_to_the_border() {
    let mut rig = asked();
    decide(&mut rig, v1::PermissionState::Denied, 0.0);
    rig.wait(3.0);
    assert_eq!(rig.story(), "", "it is no reason to end the step");
    arrive(&mut rig);
    let story = rig.story();
    assert!(!story.contains("ask B"), "{story}");
    assert!(story.contains("replan after 2 (area B: closed) [\"B\"]"), "{story}");
}

#[test]
fn a_grant_by_hand_after_a_refusal_counts() {
    let mut rig = asked();
    decide(&mut rig, v1::PermissionState::Denied, 0.0);
    let granted = v1::Permission {
        area: "B".into(),
        state: v1::PermissionState::Granted as i32,
        valid_for_s: 900.0,
        decision: 2,
        ..Default::default()
    };
    rig.say(v1::PermissionLedger { permissions: vec![granted], ..Default::default() });
    arrive(&mut rig);
    assert_eq!(rig.story(), "start fly 0 500 10");
}

#[test]
fn the_wait_for_an_answer_goes_on_in_the_step_that_needs_it() {
    let mut rig = asked();
    rig.wait(3.0);
    arrive(&mut rig);
    assert_eq!(rig.story(), "start fly 0 120 10", "it is asked for already");
    rig.execute();
    rig.wait(26.0);
    let story = rig.story();
    assert_eq!(story.matches("ask B").count(), 2, "{story}");
    assert!(!story.contains("replan"), "{story}");
    rig.wait(2.0);
    let story = rig.story();
    assert!(
        story.contains("replan after 2 (area B: no answer from the control tower after 3 tries) [\"B\"]"),
        "{story}"
    );
}

#[test]
fn silence_until_the_last_try_does_not_end_the_step_and_the_one_that_needs_it_asks_again() {
    let mut rig = asked();
    rig.wait(40.0);
    let story = rig.story();
    assert_eq!(story, "ask B\nask B");
    let noted = "area B is asked for again when it is needed: no answer from the control tower after 3 tries";
    assert!(rig.decisions.iter().any(|it| it == noted), "{:?}", rig.decisions);
    arrive(&mut rig);
    assert_eq!(rig.story(), "ask B\nstart fly 0 120 10");
}

#[test]
fn a_grant_that_is_too_short_by_then_is_asked_for_again() {
    let mut rig = asked();
    decide(&mut rig, v1::PermissionState::Granted, 40.0);
    rig.wait(20.0);
    assert_eq!(rig.story(), "");
    arrive(&mut rig);
    assert_eq!(rig.story(), "ask B\nstart fly 0 120 10");
}

#[test]
fn a_step_may_ask_for_an_area_and_for_the_next_one_ahead() {
    let mut rig = Rig::new();
    rig.vehicle(true, Loiter, (0.0, 0.0, 10.0));
    let first = asking_ahead(1, fly(100.0), &["A"], 2.0);
    rig.plan(plan(&[first, to_the_border()]));
    assert_eq!(rig.story(), "replan after 0 () []\nask A\nstart fly 0 100 10");
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 10.0, 10.0));
    rig.wait(2.0);
    assert_eq!(rig.story(), "ask B");
    // What ends the step is A alone.
    decide(&mut rig, v1::PermissionState::Granted, 900.0);
    assert_eq!(rig.story(), "");
    let granted = |area: &str| v1::Permission {
        area: area.into(),
        state: v1::PermissionState::Granted as i32,
        valid_for_s: 900.0,
        decision: 1,
        ..Default::default()
    };
    rig.say(v1::PermissionLedger { permissions: vec![granted("A"), granted("B")], ..Default::default() });
    assert_eq!(rig.story(), "start fly 0 120 10, giving up 1");
}

#[test]
fn what_interrupts_the_plan_ends_what_was_asked_for_ahead() {
    let mut rig = asked();
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "start stop, giving up 1");
    let stop = rig.execute();
    // Nobody waits for the answer any more.
    decide(&mut rig, v1::PermissionState::Denied, 0.0);
    rig.end(&stop, Succeeded, "");
    assert_eq!(rig.story(), "replan after 1 (interrupted by `obstacle`) []\nstart fly 0 100 10");
    rig.plan(plan(&[asking_ahead(4, fly(100.0), &[], 0.0), step(5, fly(120.0), &["B"])]));
    let story = rig.story();
    assert!(story.contains("ask B"), "{story}");
}

#[test]
fn a_manager_that_was_started_again_asks_ahead_for_its_new_plan() {
    /// `is_granted`: B was granted meanwhile. `expected`: how often it is asked for.
    #[track_caller]
    fn check(is_granted: bool, expected: usize) {
        let mut rig = asked().started_again();
        if is_granted {
            decide(&mut rig, v1::PermissionState::Granted, 900.0);
        }
        rig.vehicle(true, Offboard, (0.0, 60.0, 10.0));
        rig.plan(plan(&[asking_ahead(4, fly(100.0), &[], 1.0), step(5, fly(120.0), &["B"])]));
        rig.wait(1.5);
        let story = rig.story();
        assert_eq!(story.matches("ask B").count(), expected, "{story}");
    }
    check(false, 1);
    check(true, 0);
}
