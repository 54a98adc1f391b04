//! What is flown is what the mission says, and what cannot be flown is given up.

use super::*;

#[test]
fn a_takeoff_that_fails_grows_no_waypoint_however_the_estimate_drifts() {
    let mut story = Story::of(REFERENCE);
    let plan = |first: u64| {
        format!(
            "{} takeoff 10 m
             {} position 0 90 10, hold, ask A
             {} position 0 360 10, hold, ask B, needs A
             {} position 0 500 10, needs B
             {} land, needs B",
            first,
            first + 1,
            first + 2,
            first + 3,
            first + 4
        )
    };
    check(&story.plan(), &plan(1));
    for drift in 1..4 {
        story.state.position = Some(v1::Ned { north_m: 0.0, east_m: -8.0 * f64::from(drift), down_m: 0.0 });
        check(&story.fail(&[]), &plan(1 + 5 * drift as u64));
    }
}

#[test]
fn a_mission_whose_takeoff_fails_again_and_again_is_given_up() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    for drift in 1..5 {
        story.state.position = Some(v1::Ned { north_m: 10.0 * f64::from(drift), ..Default::default() });
        assert!(story.fail(&[]).contains("takeoff"));
    }
    check(&story.fail(&[]), "finished");
    check(
        &story.objectives(),
        "deliver: failure (takeoff failed 5 times in a row: it failed), 25 steps, 4 replans, asked [A B]
         return: failure (not attempted: takeoff failed 5 times in a row: it failed), 0 steps, 0 replans, asked []",
    );
}

#[test]
fn a_mission_that_takes_more_actions_than_a_plan_may_have_is_given_up() {
    #[track_caller]
    fn check(depth_limit: u32, expected: &str) {
        let mut story = Story::of(&across(""));
        story.restart_with(&Config { depth_limit: depth_limit.try_into().unwrap(), ..Config::for_tests() });
        story.plan();
        assert_eq!(story.objectives().lines().next(), Some(expected), "{depth_limit}");
    }
    check(3, "there: waiting, 3 steps, 0 replans, asked []");
    check(2, "there: failure (no plan of at most 2 actions leads to it), 0 steps, 0 replans, asked []");
}

#[test]
fn a_step_that_is_interrupted_has_not_failed() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.interrupted = true;
    for drift in 1..20 {
        story.state.position = Some(v1::Ned { north_m: 10.0 * f64::from(drift), ..Default::default() });
        assert!(story.fail(&[]).contains("takeoff"), "interrupted {drift} times");
    }
    // A failure of its own is still the first one.
    story.interrupted = false;
    assert!(story.fail(&[]).contains("takeoff"));
}

#[test]
fn a_landing_that_fails_again_and_again_is_given_up_and_the_next_objective_is_begun_with_a_climb() {
    let mut story = Story::of(KEEP_OUT.replace("flying = true", "flying = false").as_str());
    story.plan();
    let steps = story.steps.len();
    story.fly(steps - 1);
    for height_m in [27.0, 27.5] {
        story.airborne_at([300.0, 0.0, height_m]);
        check(story.fail(&[]).split_once(' ').unwrap().1, "land");
    }
    story.airborne_at([300.0, 0.0, 2.0]);
    // The place is at 25 m, whatever the estimate says.
    check(
        &story.fail(&[]),
        "8 position 300 0 30
         9 position 210 -70 30
         10 position 90 -70 30
         11 position 0 0 10
         12 land",
    );
    assert_eq!(story.status().objectives[0].reason, "land failed 3 times in a row: it failed");
}

#[test]
fn a_vehicle_that_has_landed_below_a_deck_is_not_on_it() {
    let mut story = Story::of(&across("").replace("height_m = 0", "height_m = 30"));
    check(
        &story.plan(),
        "1 takeoff 40 m
         2 position 0 500 40
         3 land",
    );
    story.fly(2);
    let below =
        v1::PlanningState { position: Some(v1::Ned { east_m: 500.0, ..Default::default() }), ..Default::default() };
    let landing = story.steps.remove(0);
    story.flown(landing, below);
    check(&story.objectives(), "there: failure (the vehicle has landed 30 m below it), 3 steps, 0 replans, asked []");
}

#[test]
fn a_vehicle_that_has_landed_on_its_target_is_there_wherever_the_target_lies() {
    for (terms, expected) in [("land_on_target = true", "success"), ("", "waiting")] {
        let mut story = Story::of(&across("").replace("flying = false", &format!("flying = false\n{terms}")));
        story.plan();
        story.fly(2);
        let position = Some(v1::Ned { north_m: 8.0, east_m: 500.0, ..Default::default() });
        let landing = story.steps.remove(0);
        story.flown(landing, v1::PlanningState { position, ..Default::default() });
        assert!(story.objectives().starts_with(&format!("there: {expected}")), "{}", story.objectives());
    }
}

#[test]
fn objectives_two_and_a_half_metres_apart_are_two_places() {
    let objective = |name: &str, east_m: f64| {
        format!("[[objective]]\nname = \"{name}\"\nnorth_m = 0\neast_m = {east_m:.1}\nheight_m = 10\nflying = true\n")
    };
    let mut story =
        Story::of(&format!("name = \"close\"\n{}{}", objective("first", 100.0), objective("second", 102.5)));
    story.plan();
    story.fly(2);
    check(&story.plan(), "3 position 0 103 10");
}

#[test]
fn a_place_that_is_missed_again_and_again_is_given_up() {
    let mut story =
        Story::of(&across("").replace("flying = false", "flying = true").replace("height_m = 0", "height_m = 9"));
    for _ in 0..5 {
        story.plan();
        for step in std::mem::take(&mut story.steps) {
            story.airborne_at([0.0, 496.0, 9.0]);
            let state = story.state.clone();
            story.flown(step, state);
        }
    }
    let reason = "5 plans in a row have not reached it; the last one ended 4.0 m from it";
    assert_eq!(story.status().objectives[0].reason, reason);
}
