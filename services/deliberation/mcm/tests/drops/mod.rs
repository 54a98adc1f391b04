//! A step that releases the load: flown, failed, interrupted, and flown by a manager that was started again.

use domain::geometry::Ned;
use domain::skill::Goal;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1::FlightMode::Loiter;
use kittiwake_proto::v1::SkillOutcome::{Succeeded, TimedOut};
use kittiwake_proto::v1::{self, Gripper};

use crate::stories::rig::{Rig, plan, step};

/// Hovering over the place, the step under way; with the request id of its skill.
fn releasing() -> (Rig, String) {
    let mut rig = Rig::new();
    rig.gripper = Gripper::Holding;
    rig.plan(plan(&[step(1, Goal::Release { over: Ned::new(0.0, 50.0, -10.0) }, &[])]));
    let skill = rig.execute();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    assert!(rig.story().contains("start release over 0 50"));
    (rig, skill)
}

/// The gripper's state in the open request to the planner.
fn told(rig: &Rig) -> Gripper {
    let state = rig.open().find_map(|it| match it {
        Request::Replan(it) => it.basis.as_ref()?.state.clone(),
        _ => None,
    });
    state.expect("the planner is asked or told").gripper()
}

#[test]
fn a_load_that_the_skill_has_seen_released_is_reported_as_released() {
    let (mut rig, request_id) = releasing();
    // The monitor's status is from before.
    let before = rig.introspection();
    let ended = v1::SkillEvent {
        skill_id: 1,
        request_id,
        kind: v1::SkillKind::Release as i32,
        state: v1::SkillState::Ended as i32,
        outcome: Succeeded as i32,
        ..Default::default()
    };
    rig.together(|rig| {
        rig.say(ended);
        rig.say(before);
    });
    assert_eq!(told(&rig), Gripper::Released);
}

#[test]
fn a_gripper_that_does_not_open_fails_the_step() {
    let (mut rig, skill) = releasing();
    rig.end(&skill, TimedOut, "release accepted, but the gripper holds its load");
    let story = rig.story();
    let failed = "replan after 1 (timed out: release accepted, but the gripper holds its load) []\nstart stop";
    assert_eq!(story, failed);
    assert_eq!(told(&rig), Gripper::Holding);
}

#[test]
fn a_contingency_in_between_comes_first_and_the_planner_hears_what_became_of_the_load() {
    let (mut rig, _) = releasing();
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "start stop, giving up 1");
    let stop = rig.execute();
    rig.gripper = Gripper::Released;
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.end(&stop, Succeeded, "");
    assert!(rig.story().starts_with("replan after 1 (interrupted by `obstacle`) []"));
    assert_eq!(told(&rig), Gripper::Released);
}

#[test]
fn a_manager_that_is_started_again_releases_nothing_by_itself() {
    let (mut rig, _) = releasing();
    rig.gripper = Gripper::Released;
    let mut rig = rig.started_again();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    let story = rig.story();
    assert!(story.starts_with("replan after 0 () []") && !story.contains("release"), "{story}");
    assert_eq!(told(&rig), Gripper::Released);
}

/// The vehicle itself is above it.
#[test]
fn no_load_falls_into_an_area_below_that_must_not_be_entered() {
    let release = || step(2, Goal::Release { over: Ned::new(0.0, 50.0, -10.0) }, &[]);
    let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
    let dock = v1::Area {
        name: "dock".into(),
        kind: v1::AreaKind::KeepOut as i32,
        corners: [(-20.0, 30.0), (20.0, 30.0), (20.0, 70.0), (-20.0, 70.0)].map(corner).to_vec(),
        ceiling_m: Some(5.0),
        ..Default::default()
    };
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, crate::stories::fly(50.0), &[]), release()]));
    let skill = rig.execute();
    rig.vehicle(true, Loiter, (0.0, 50.0, 10.0));
    rig.mission(v1::MissionStatus { areas: vec![dock], ..Default::default() });
    rig.story();
    rig.end(&skill, Succeeded, "");
    rig.wait(2.0);
    let story = rig.story();
    assert!(story.contains("replan after 2 (precondition not met: "), "{story}");
    assert!(!story.contains("start release"), "{story}");
}
