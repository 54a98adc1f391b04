//! The reference mission, under every way the control tower may behave.

use super::*;

#[test]
fn the_first_plan_waits_before_each_border() {
    let mut story = Story::of(REFERENCE);
    check(
        &story.plan(),
        "1 takeoff 10 m
         2 position 0 90 10, hold, ask A
         3 position 0 360 10, hold, ask B, needs A
         4 position 0 500 10, needs B
         5 land, needs B",
    );
}

#[test]
fn with_every_permission_granted_both_objectives_are_reached() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(5);
    // Both permissions are still held.
    check(
        &story.plan(),
        "6 takeoff 10 m, needs B
         7 position 0 0 10, needs A B
         8 land",
    );
    story.fly(3);
    check(&story.plan(), "finished");
    check(
        &story.objectives(),
        "deliver: success, 5 steps, 0 replans, asked [A B]
         return: success, 3 steps, 0 replans, asked []",
    );
}

#[test]
fn a_permission_that_has_expired_is_asked_for_again_on_the_way_back() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(5);
    story.hold_permissions(&["B"]);
    check(
        &story.plan(),
        "6 takeoff 10 m, needs B
         7 position 0 310 10, hold, ask A, needs B
         8 position 0 0 10, needs A
         9 land",
    );
}

#[test]
fn areas_of_a_silent_tower_are_flown_round_until_the_goal_itself_needs_one() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 90.0, 10.0]);
    story.wait(30);
    check(
        &story.fail(&[("A", None)]),
        "6 position 100 100 10
         7 position 100 300 10
         8 position 69 362 10, hold, ask B
         9 position 0 500 10, needs B
         10 land, needs B",
    );
    story.fly(2);
    story.airborne_at([69.0, 362.0, 10.0]);
    story.wait(30);
    check(
        &story.fail(&[("B", None)]),
        "11 position 100 300 10
         12 position 100 100 10
         13 position 0 0 10
         14 land",
    );
    story.fly(4);
    check(&story.plan(), "finished");
    check(
        &story.objectives(),
        "deliver: failure (area B: no answer from the control tower), 10 steps, 1 replans, asked [A B]
         return: success, 4 steps, 0 replans, asked []",
    );
}

#[test]
fn a_tower_that_denies_is_asked_once_more_where_there_is_no_way_round() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 5.0, 10.0]);
    check(
        &story.fail(&[("A", Some("busy"))]),
        "6 position 100 100 10
         7 position 100 300 10
         8 position 69 362 10, hold, ask B
         9 position 0 500 10, needs B
         10 land, needs B",
    );
    story.fly(2);
    story.wait(40);
    check(&story.fail(&[("B", Some("busy"))]), "hold 30 s: area B: denied by the control tower: busy; asked once more");
    assert_eq!(story.status().hold, "area B: denied by the control tower: busy; asked once more");
    story.wait(30);
    check(
        &story.plan(),
        "11 position 69 362 10, hold, ask B
         12 position 0 500 10, needs B
         13 land, needs B",
    );
    check(
        &story.fail(&[("B", Some("busy"))]),
        "14 position 100 100 10
         15 position 0 0 10
         16 land",
    );
    check(
        &story.objectives(),
        "deliver: failure (area B: denied twice by the control tower: busy), 13 steps, 2 replans, asked [A B]
         return: waiting, 3 steps, 0 replans, asked []",
    );
}
