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
fn a_pause_during_a_hold_is_no_wait_for_the_area() {
    let mut story = Story::of(&wall());
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 180.0, 10.0]);
    let hold = "hold 30 s: area W: denied by the control tower: busy; asked once more";
    check(&story.fail(&[("W", Some("busy"))]), hold);
    // The operator pauses the mission.
    story.wait(600);
    story.plan();
    story.hold_permissions(&["W"]);
    story.plan();
    // The grant is lost again before it was used.
    story.hold_permissions(&[]);
    story.plan();
    check(&story.fail(&[("W", Some("busy"))]), hold);
}

/// It would be asked for without end, at one moment: the tower answers at once.
#[test]
fn an_area_denied_twice_before_it_applies_is_not_asked_for_a_third_time() {
    let mut story = Story::of(&across(
        "[[area]]\nname = \"W\"\nkind = \"permission\"\nfrom_utc = \"2026-01-01T00:01:05Z\"\n\
         corners_m = [[-9000.0, 200.0], [9000.0, 200.0], [9000.0, 480.0], [-9000.0, 480.0]]\n",
    ));
    story.airborne_at([0.0, 180.0, 10.0]);
    check(
        &story.plan(),
        "1 position 0 180 10, hold, ask W
         2 position 0 500 10, needs W
         3 land",
    );
    let hold = "hold 30 s: area W: denied by the control tower: busy; asked once more";
    check(&story.fail(&[("W", Some("busy"))]), hold);
    story.wait(30);
    check(
        &story.plan(),
        "4 position 0 180 10, hold, ask W
         5 position 0 500 10, needs W
         6 land",
    );
    check(
        &story.fail(&[("W", Some("busy"))]),
        "7 position 9010 190 10
         8 position 9010 490 10
         9 position 0 500 10
         10 land",
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

/// The vehicle is blown beyond both areas before it has asked for the first: its way back leads through both, and so does its way on.
#[test]
fn a_permission_that_is_asked_for_twice_need_not_last_from_one_crossing_to_the_next() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 600.0, 10.0]);
    let plan = story.fail(&[]);
    let of_b: Vec<f64> = lengths(&story).into_iter().filter(|(area, _)| area == "B").map(|(_, for_s)| for_s).collect();
    // The way back: 2 s to the wait, 2 s of waiting and 20 s to the far border; a quarter and 10 s more, and 30 s for the way out.
    // The way on: as long as in the first plan.
    assert_eq!(of_b, [70.0, 102.0], "{plan}");
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
    story.restart_with(&config);
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
    let reason = "area W: denied by the control tower: busy; not worth more than 120 s of waiting";
    assert_eq!(story.status().objectives[0].reason, reason);
}

/// Asked for on the way, what each permission must hold for, in seconds.
fn lengths(story: &Story) -> Vec<(String, f64)> {
    let asked =
        |it: &v1::PlanStep| std::iter::zip(it.ask_permissions.clone(), it.ask_for_s.clone()).collect::<Vec<_>>();
    story.steps.iter().flat_map(asked).map(|(area, for_s)| (area, for_s.round())).collect()
}

#[test]
fn a_permission_is_asked_for_as_long_as_the_crossing_and_the_way_out_may_take() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    // From the start of the flight to the border to the far border of A; from there on into B, to the ground.
    assert_eq!(lengths(&story), [("A".into(), 79.0), ("B".into(), 102.0)]);
}

#[test]
fn no_permission_need_outlast_the_window_of_its_area() {
    let mut story =
        Story::of(&across(&area("A", "permission", [200.0, 300.0], "until_utc = \"2026-01-01T00:00:30Z\"")));
    story.plan();
    assert_eq!(lengths(&story), [("A".into(), 57.0)]);
}

/// A tower has granted `W` for this time while the vehicle was on its way there; it waits 20 m before it.
fn short_grant(mission_text: &str, granted_s: f64) -> Story {
    let mut story = Story::of(mission_text);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 180.0, 10.0]);
    story.held = vec![v1::HeldPermission { area: "W".into(), valid_for_s: granted_s }];
    story.too_short = true;
    story
}

#[test]
fn a_grant_that_is_too_short_is_told_as_that_and_not_tried_again() {
    let mut story = short_grant(&across(&area("W", "permission", [200.0, 700.0], "")), 49.9);
    check(&story.fail(&[("W", Some("granted for 50 s, 110 s are needed"))]), "finished");
    check(
        story.objectives().lines().next().unwrap(),
        "there: failure (the permission for area W holds for 50 s, 90 s are needed), 4 steps, 0 replans, asked [W]",
    );
}

#[test]
fn a_shorter_crossing_may_be_tried_with_a_grant_that_was_too_short_for_another() {
    let mut story = short_grant(&wall(), 70.0);
    check(
        &story.fail(&[("W", Some("granted for 70 s, 73 s are needed"))]),
        "5 position 0 500 10, needs W
         6 land",
    );
}

#[test]
fn an_area_whose_grants_are_too_short_is_flown_round() {
    let mut story = Story::of(REFERENCE);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 90.0, 10.0]);
    story.held = vec![v1::HeldPermission { area: "A".into(), valid_for_s: 40.0 }];
    story.too_short = true;
    check(
        &story.fail(&[("A", Some("granted for 40 s, 79 s are needed"))]),
        "6 position 100 100 10
         7 position 100 300 10
         8 position 69 362 10, hold, ask B
         9 position 0 500 10, needs B
         10 land, needs B",
    );
}

/// On the ground inside of W, whose grant was too short for the way out.
fn landed_by_a_short_grant(granted_s: f64) -> Story {
    let mut story = Story::of(&across(&area("W", "permission", [-100.0, 400.0], "")));
    story.plan();
    story.held = vec![v1::HeldPermission { area: "W".into(), valid_for_s: granted_s }];
    story.too_short = true;
    story
}

#[test]
fn a_new_grant_is_waited_for_on_the_ground_until_the_old_one_ends() {
    let mut story = landed_by_a_short_grant(40.0);
    let short = Some("granted for 40 s, 95 s are needed");
    let hold = |wait_s: u64| {
        format!(
            "hold {wait_s} s: the permission for area W holds for 40 s, 96 s are needed; asked for again once it has ended, in {wait_s} s"
        )
    };
    check(&story.fail(&[("W", short)]), &hold(41));
    // Asked before, it says the same again.
    story.wait(15);
    story.held[0].valid_for_s = 25.0;
    check(&story.plan(), &hold(26));
    story.wait(26);
    story.held.clear();
    let plan = story.plan();
    assert!(plan.contains("ask W"), "{plan}");
}

#[test]
fn new_grants_are_waited_for_no_longer_than_two_minutes_in_all() {
    let mut story = landed_by_a_short_grant(50.0);
    for _ in 0..2 {
        let hold = story.fail(&[("W", Some("too short"))]);
        assert!(hold.starts_with("hold 51 s"), "{hold}");
        story.wait(51);
        story.held.clear();
        assert!(story.plan().contains("ask W"));
        story.held = vec![v1::HeldPermission { area: "W".into(), valid_for_s: 50.0 }];
    }
    check(&story.fail(&[("W", Some("too short"))]), "finished");
    let reason = story.status().objectives[0].reason.clone();
    assert!(reason.starts_with("the permission for area W holds for 50 s"), "{reason}");
}

/// It stands 500 m east of home, around which H is; it is to look farther east, and then to come home.
fn away_from_home() -> Story {
    let look = "[[objective]]\nname = \"look\"\nnorth_m = 0.0\neast_m = 700.0\nheight_m = 10.0\nflying = true\n";
    let home = "[[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n";
    let mut story = Story::of(&format!("name = \"away\"\n{look}{home}{}", area("H", "permission", [-60.0, 60.0], "")));
    story.state.position = Some(v1::Ned { east_m: 500.0, ..Default::default() });
    story
}

#[test]
fn nothing_takes_off_where_the_permission_to_come_back_is_refused_or_too_short() {
    let mut story = away_from_home();
    check(&story.plan(), "1 stop, ask H\n2 takeoff 10 m\n3 position 0 700 10");
    assert!(story.fail(&[("H", Some("busy"))]).contains("asked once more"));
    story.wait(31);
    story.plan();
    let refused = story.fail(&[("H", Some("busy"))]);
    let told = format!("{refused}{}", story.objectives());
    assert!(told.contains("no takeoff without the permission to come back: "), "{told}");
    let mut story = away_from_home();
    story.plan();
    story.held = vec![v1::HeldPermission { area: "H".into(), valid_for_s: 20.0 }];
    story.too_short = true;
    let short = story.fail(&[("H", Some("too short"))]);
    let told = format!("{short}{}", story.objectives());
    assert!(told.contains("the one for area H holds for 20 s, "), "{told}");
}
