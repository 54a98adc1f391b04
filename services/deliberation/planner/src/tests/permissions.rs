//! What becomes of a plan when permissions come, go and do not come.

use super::*;

/// One area across the way that is too long to fly round.
fn wall() -> String {
    across(
        "[[area]]\nname = \"W\"\nkind = \"permission\"\n\
         corners_m = [[-9000.0, 200.0], [9000.0, 200.0], [9000.0, 300.0], [-9000.0, 300.0]]\n",
    )
}

#[test]
fn an_area_held_already_is_not_asked_for() {
    let mut story = Story::of(&wall());
    story.hold_permissions(&["W"]);
    check(
        &story.plan(),
        "1 takeoff 10 m
         2 position 0 500 10, needs W
         3 land",
    );
}

#[test]
fn a_hold_lasts_until_the_area_may_be_asked_again() {
    let mut story = Story::of(&wall());
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 180.0, 10.0]);
    let hold = "area W: denied by the control tower: busy; asked once more";
    check(&story.fail(&[("W", Some("busy"))]), &format!("hold 30 s: {hold}"));
    story.wait(10);
    check(&story.plan(), &format!("hold 20 s: {hold}"));
    story.wait(20);
    check(
        &story.plan(),
        "5 position 0 180 10, hold, ask W
         6 position 0 500 10, needs W
         7 land",
    );
}

#[test]
fn a_late_grant_clears_the_denial() {
    let mut story = Story::of(&wall());
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 180.0, 10.0]);
    story.fail(&[("W", Some("busy"))]);
    story.wait(10);
    story.hold_permissions(&["W"]);
    check(
        &story.plan(),
        "5 position 0 500 10, needs W
         6 land",
    );
    // Lost again before it was used: it is asked for as if it had never been denied.
    story.hold_permissions(&[]);
    check(
        &story.plan(),
        "7 position 0 180 10, hold, ask W
         8 position 0 500 10, needs W
         9 land",
    );
}

#[test]
fn a_permission_that_is_lost_before_the_border_is_asked_for_again() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(2);
    story.airborne_at([0.0, 100.0, 10.0]);
    story.hold_permissions(&[]);
    // The rest of the plan counts on B being asked where it is, and on nothing else.
    check(
        &story.fail(&[]),
        "6 position 0 100 10, hold, ask A
         7 position 0 360 10, hold, ask B, needs A
         4 position 0 500 10, needs B
         5 land, needs B",
    );
}

#[test]
fn a_permission_revoked_inside_leads_out_the_shortest_way() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(2);
    story.airborne_at([0.0, 130.0, 10.0]);
    story.hold_permissions(&[]);
    check(
        &story.fail(&[]),
        "6 position 0 90 10, hold, ask A
         7 position 0 360 10, hold, ask B, needs A
         4 position 0 500 10, needs B
         5 land, needs B",
    );
}

#[test]
fn a_permission_revoked_over_the_landing_place_leads_out_and_back() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(4);
    story.hold_permissions(&[]);
    story.airborne_at([0.0, 500.0, 6.0]);
    check(
        &story.fail(&[]),
        "6 position 0 580 6, hold, ask B
         7 position 0 500 6, needs B
         8 land, needs B",
    );
}

#[test]
fn a_denied_area_is_left_before_its_back_off_is_waited_for() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(3);
    // Inside B, which is revoked and then denied.
    story.airborne_at([0.0, 400.0, 10.0]);
    story.hold_permissions(&[]);
    check(&story.fail(&[("B", Some("closed"))]), "6 position 0 360 10");
    story.fly(1);
    check(&story.plan(), "hold 30 s: area B: denied by the control tower: closed; asked once more");
}

#[test]
fn a_step_that_fails_for_another_reason_keeps_what_comes_after_it() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 40.0, 10.0]);
    check(
        &story.fail(&[]),
        "6 position 0 90 10, hold, ask A
         3 position 0 360 10, hold, ask B, needs A
         4 position 0 500 10, needs B
         5 land, needs B",
    );
    // At its goal already, it still has to ask.
    story.airborne_at([0.0, 90.0, 10.0]);
    check(
        &story.fail(&[]),
        "7 position 0 90 10, hold, ask A
         3 position 0 360 10, hold, ask B, needs A
         4 position 0 500 10, needs B
         5 land, needs B",
    );
    check(story.objectives().lines().next().unwrap(), "deliver: waiting, 7 steps, 2 replans, asked [A B]");
}

#[test]
fn holding_for_one_area_ends_after_its_limit() {
    // Back-offs of 50 s: the third would exceed 120 s in total. A lost grant starts a new back-off.
    let mission_text = across(&area("W", "permission", [200.0, 700.0], ""));
    let mut story = Story::of(&mission_text);
    let config = Config { retry_after_denial_s: 50.0.try_into().unwrap(), ..Config::for_tests() };
    story.planner = Planner::new(&config, mission(&mission_text), Pace::REAL_TIME);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 180.0, 10.0]);
    for _ in 0..2 {
        check(
            &story.fail(&[("W", Some("busy"))]),
            "hold 50 s: area W: denied by the control tower: busy; asked once more",
        );
        story.wait(50);
        story.hold_permissions(&["W"]);
        story.plan();
        story.hold_permissions(&[]);
        story.plan();
    }
    check(&story.fail(&[("W", Some("busy"))]), "finished");
    let reason = "area W: denied by the control tower and not worth more than 120 s of waiting: busy";
    assert_eq!(story.status().objectives[0].reason, reason);
}
