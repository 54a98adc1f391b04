//! Requests that are repeated, late, early or invalid.

use super::*;

fn next(story: &mut Story, after_step_id: u64) -> Option<u64> {
    match story.request(Request::NextStep(v1::NextStepRequest { after_step_id })) {
        Some(Response::NextStep(reply)) => reply.step.map(|it| it.id),
        other => panic!("{other:?}"),
    }
}

fn done(story: &mut Story, step_id: u64) -> v1::StepDoneReply {
    let state = Some(story.state.clone());
    match story.request(Request::StepDone(v1::StepDone { step_id, state })) {
        Some(Response::StepDone(reply)) => reply,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_next_step_is_given_before_and_after_the_present_one_is_done() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    assert_eq!(next(&mut story, 0), Some(1));
    assert_eq!(next(&mut story, 1), Some(2));
    assert_eq!(next(&mut story, 2), Some(3));
    story.fly(1);
    assert_eq!(next(&mut story, 1), Some(2));
    assert_eq!(next(&mut story, 5), None);
    assert_eq!(next(&mut story, 77), None);
}

#[test]
fn a_step_done_is_accepted_however_often_it_is_said() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(1);
    assert!(done(&mut story, 1).accepted);
    assert_eq!(next(&mut story, 1), Some(2));
    // That step 2 was done got lost on the way.
    assert!(done(&mut story, 3).accepted);
    assert_eq!(next(&mut story, 3), Some(4));
    let refused = done(&mut story, 77);
    assert_eq!((refused.accepted, refused.refusal.as_str()), (false, "step 77 is not of any plan made here"));
}

#[test]
fn an_emptied_plan_that_missed_its_goal_is_planned_again() {
    let mut story = Story::of(REFERENCE);
    story.hold_permissions(&["A", "B"]);
    story.plan();
    story.fly(2);
    story.state = v1::PlanningState {
        position: Some(v1::Ned { east_m: 480.0, ..Default::default() }),
        flying: false,
        ..story.state.clone()
    };
    assert!(done(&mut story, 3).accepted);
    check(
        &story.plan(),
        "4 takeoff 10 m, needs B
         5 position 0 500 10, needs B
         6 land, needs B",
    );
}

#[test]
fn a_repeated_request_gets_the_first_ones_answer() {
    let mut story = Story::of(REFERENCE);
    let first = story.plan();
    story.airborne_at([0.0, 50.0, 10.0]);
    story.requests = 0;
    check(&story.plan(), &first);
    assert_eq!(story.status().plan.unwrap().revision, 1);
    check(story.plan().lines().next().unwrap(), "6 position 0 90 10, hold, ask A");
}

#[test]
fn the_same_requests_get_the_same_answers() {
    let tell = || {
        let mut story = Story::of(HARBOUR);
        let mut told = story.plan();
        story.fly(1);
        told += &story.fail(&[("basin", Some("busy"))]);
        story.wait(40);
        told + &story.fail(&[("basin", None)]) + &story.objectives()
    };
    assert_eq!(tell(), tell());
}

#[test]
fn a_state_that_makes_no_sense_is_refused() {
    let mut story = Story::of(REFERENCE);
    let position = Some(v1::Ned { north_m: f64::NAN, ..Default::default() });
    let state = v1::PlanningState { position, ..Default::default() };
    let request = v1::ReplanRequest { request_id: "x".into(), state: Some(state.clone()), ..Default::default() };
    let Some(Response::Replan(reply)) = story.request(Request::Replan(request)) else { panic!("no reply") };
    assert!(render(&reply).starts_with("refused: `position` is north NaN"), "{reply:?}");
    story.plan();
    story.state = state;
    assert!(!done(&mut story, 1).accepted);
}

#[test]
fn a_step_that_fails_on_the_spot_again_and_again_is_given_up() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    for _ in 0..4 {
        assert!(story.fail(&[]).starts_with(&format!("{} takeoff", story.steps[0].id)));
    }
    // The second objective is where the vehicle stands.
    check(&story.fail(&[]), "finished");
    assert_eq!(story.status().objectives[0].reason, "takeoff failed 5 times in a row: it failed");
}

#[test]
fn the_status_goes_out_on_every_change_and_once_a_second() {
    let mut story = Story::of(REFERENCE);
    assert_eq!(story.status().objectives.len(), 2);
    assert_eq!(story.planner.deadline(), Some(Time::after(Duration::from_secs(1))));
    story.plan();
    assert_eq!(story.status().plan.unwrap().steps.len(), 5);
    story.wait(1);
    assert_eq!(story.status().areas.len(), 2);
}
