//! Objectives that release the vehicle's load.

use super::*;
use v1::mission_request::Request as Ask;

/// The load is dropped over (0, 200), from this height.
fn buoy(height_m: f64, more: &str) -> String {
    format!(
        "[[objective]]\nname = \"buoy\"\nnorth_m = 0.0\neast_m = 200.0\nheight_m = {height_m:.1}\nflying = true\n{more}\n"
    )
}

const BACK: &str = "[[objective]]\nname = \"back\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n";

fn text(objectives: &[&str]) -> String {
    format!("name = \"drops\"\n{}", objectives.concat())
}

fn story(more: &str) -> Story {
    let mut story = Story::of(&text(&[&buoy(30.0, &format!("drop = true\n{more}")), BACK]));
    gripper(&mut story, v1::Gripper::Holding);
    story
}

fn gripper(story: &mut Story, gripper: v1::Gripper) {
    story.state.gripper = gripper as i32;
}

const OUT_AND_DROP: &str = "\
    1 takeoff 30 m
    2 position 0 200 30
    3 stop
    4 release over 0 200";

#[test]
fn the_load_is_released_at_rest_over_the_place_and_that_reaches_it() {
    let mut story = story("");
    check(&story.plan(), OUT_AND_DROP);
    story.fly(3);
    check(
        &story.objectives(),
        "buoy: waiting, 4 steps, 0 replans, asked []\nback: waiting, 0 steps, 0 replans, asked []",
    );
    story.fly(1);
    check(
        &story.objectives(),
        "buoy: success, 4 steps, 0 replans, asked []\nback: waiting, 0 steps, 0 replans, asked []",
    );
    assert!(story.plan().contains("position 0 0 10"));
}

#[test]
fn a_vehicle_that_hovers_there_releases_at_once() {
    let mut story = story("");
    story.airborne_at([0.0, 201.0, 30.0]);
    story.state.mode = v1::FlightMode::Loiter as i32;
    check(&story.plan(), "1 release over 0 200");
}

/// The vehicle was seen to release it there, and nobody has reported that.
#[test]
fn a_load_that_was_released_is_not_released_again() {
    #[track_caller]
    fn check_reached(story: &mut Story) {
        story.airborne_at([0.0, 200.0, 30.0]);
        gripper(story, v1::Gripper::Released);
        let plan = story.plan();
        assert!(plan.contains("position 0 0 10") && !plan.contains("release"), "{plan}");
        let objectives = story.objectives();
        assert!(objectives.starts_with("buoy: success"), "{objectives}");
    }
    let mut manager_restarted = story("");
    manager_restarted.plan();
    check_reached(&mut manager_restarted);

    let mut planner_restarted = story("");
    planner_restarted.plan();
    planner_restarted.restart();
    check_reached(&mut planner_restarted);
}

#[test]
fn a_release_that_was_interrupted_after_it_had_happened_counts() {
    let mut story = story("");
    story.plan();
    story.fly(3);
    story.airborne_at([0.0, 150.0, 30.0]);
    gripper(&mut story, v1::Gripper::Released);
    story.interrupted = true;
    assert!(story.fail(&[]).contains("position 0 0 10"));
    assert!(story.objectives().starts_with("buoy: success"), "{}", story.objectives());
}

#[test]
fn a_load_that_is_lost_on_the_way_or_was_never_there_is_no_success() {
    #[track_caller]
    fn check_failed(story: &mut Story, reason: &str) {
        let expected = format!("buoy: failure ({reason})");
        let objectives = story.objectives();
        assert!(objectives.starts_with(&expected), "expected {expected}, got {objectives}");
    }
    let lost = "the load was lost before the place was reached";
    let mut noticed_by_a_plan = story("");
    noticed_by_a_plan.plan();
    noticed_by_a_plan.airborne_at([0.0, 100.0, 30.0]);
    gripper(&mut noticed_by_a_plan, v1::Gripper::Released);
    noticed_by_a_plan.plan();
    check_failed(&mut noticed_by_a_plan, lost);

    let mut noticed_by_a_step = story("");
    noticed_by_a_step.plan();
    noticed_by_a_step.fly(1);
    noticed_by_a_step.steps[0].goal_state.as_mut().unwrap().gripper = v1::Gripper::Released as i32;
    noticed_by_a_step.fly(1);
    check_failed(&mut noticed_by_a_step, lost);

    let mut never_there = story("");
    gripper(&mut never_there, v1::Gripper::Released);
    check(&never_there.plan(), "finished");
    check_failed(&mut never_there, "there is no load to release: the gripper is open already");
}

#[test]
fn a_second_drop_has_nothing_to_release() {
    let second = buoy(30.0, "drop = true\noptional = true\nworth = 1.0").replace("buoy", "second");
    let mut story = Story::of(&text(&[&buoy(30.0, "drop = true"), &second, BACK]));
    story.plan();
    story.fly(story.steps.len());
    assert!(story.plan().contains("position 0 0 10"));
    let objectives = story.objectives();
    let expected = "second: failure (there is no load to release: the gripper is open already), 0 steps";
    assert!(objectives.starts_with("buoy: success") && objectives.contains(expected), "{objectives}");
}

#[test]
fn a_drop_that_comes_next_in_the_air_needs_a_load_as_well() {
    let next = buoy(30.0, "drop = true").replace("200.0", "300.0");
    let mut story = Story::of(&text(&[&buoy(30.0, "").replace("buoy", "look"), &next, BACK]));
    story.airborne_at([0.0, 200.0, 30.0]);
    gripper(&mut story, v1::Gripper::Released);
    assert!(story.plan().contains("position 0 0 10"));
    let objectives = story.objectives();
    let expected = "buoy: failure (there is no load to release: the gripper is open already), 0 steps";
    assert!(objectives.starts_with("look: success") && objectives.contains(expected), "{objectives}");
}

#[test]
fn a_gripper_that_does_not_open_fails_the_objective_and_the_mission_goes_on() {
    let mut story = story("");
    story.plan();
    story.fly(3);
    gripper(&mut story, v1::Gripper::Holding);
    for _ in 1..5 {
        let plan = story.fail(&[]);
        assert!(plan.ends_with(" release over 0 200\n") && plan.lines().count() == 1, "{plan}");
    }
    assert!(story.fail(&[]).contains("position 0 0 10"));
    let objectives = story.objectives();
    assert!(objectives.starts_with("buoy: failure (release failed 5 times in a row"), "{objectives}");
}

#[test]
fn it_stays_after_the_release_and_releases_nothing_when_it_comes_back() {
    let mut story = story("dwell_s = 30.0");
    story.plan();
    story.fly(4);
    check(&story.plan(), "hold 30 s: stays at `buoy` for 30 s more");
    story.airborne_at([50.0, 200.0, 30.0]);
    let plan = story.plan();
    assert!(plan.contains("position 0 200 30") && !plan.contains("release"), "{plan}");
}

/// The rest of the mission is judged with the stay, and with no other release.
#[test]
fn while_it_stays_after_the_release_an_objective_is_inserted() {
    let mut story = story("dwell_s = 30.0");
    story.plan();
    story.fly(4);
    check(&story.plan(), "hold 30 s: stays at `buoy` for 30 s more");
    let position = Some(v1::Ned { north_m: 0.0, east_m: 300.0, down_m: -30.0 });
    let objective = Some(v1::NewObjective { name: "look".into(), position, flying: true });
    let reply = story.ask(Ask::Insert(v1::InsertObjective { index: 1, objective }));
    assert!(reply.accepted, "{}", reply.text);
    let buoy = &reply.forecast[0];
    assert_eq!((&*buoy.objective, buoy.reachable, buoy.stay_s), ("buoy", true, 30.0), "{}", buoy.reason);
}

#[test]
fn the_load_falls_through_no_area_without_its_permission() {
    let under = |kind: &str| {
        let mut story = Story::of(&format!(
            "{}{}",
            text(&[&buoy(60.0, "drop = true"), BACK]),
            area("dock", kind, [150.0, 250.0], "ceiling_m = 20.0")
        ));
        let plan = story.plan();
        (plan, story.objectives())
    };
    let (plan, _) = under("permission");
    assert!(plan.contains("stop, ask dock\n") && plan.contains("release over 0 200, needs dock"), "{plan}");
    let (plan, objectives) = under("keep-out");
    assert!(!plan.contains("release"), "{plan}");
    assert!(objectives.starts_with("buoy: failure (") && objectives.contains("dock"), "{objectives}");
}

#[test]
fn a_load_may_fall_into_water_and_not_among_people() {
    let over = |ground: &str| {
        let sea = area("sea", "no-landing", [150.0, 250.0], ground);
        let mut story = Story::of(&format!("{}{sea}", text(&[&buoy(60.0, "drop = true"), BACK])));
        story.plan()
    };
    assert!(over("ground = \"water\"").contains("release over 0 200"));
    for among_people in ["ground = \"people\"", ""] {
        assert!(!over(among_people).contains("release"), "{among_people}");
    }
}

#[test]
fn a_load_keeps_as_far_from_people_as_it_falls() {
    let is_dropped_from = |height_m: f64, ground: &str| {
        let aside = area("beach", "no-landing", [250.0, 350.0], ground);
        Story::of(&format!("{}{aside}", text(&[&buoy(height_m, "drop = true"), BACK]))).plan().contains("release over")
    };
    assert!(is_dropped_from(49.0, "ground = \"people\""));
    assert!(!is_dropped_from(51.0, "ground = \"people\""));
    assert!(is_dropped_from(51.0, "ground = \"water\""));
}

/// From 60 m it is at the ceiling, with its margin, after 3.8 s, and on the ground after 6 s; the vehicle would take 40 s.
#[test]
fn what_is_below_is_judged_by_the_time_that_the_load_falls() {
    let hovering_over = |kind: &str, more: &str| {
        let dock = area("dock", kind, [150.0, 250.0], &format!("ceiling_m = 20.0\n{more}"));
        let mut story = Story::of(&format!("{}{dock}", text(&[&buoy(60.0, "drop = true"), BACK])));
        gripper(&mut story, v1::Gripper::Holding);
        story.airborne_at([0.0, 200.0, 60.0]);
        story.state.mode = v1::FlightMode::Loiter as i32;
        story
    };
    let mut closed = hovering_over("keep-out", "until_utc = \"2026-01-01T00:00:10Z\"");
    check(&closed.plan(), "hold 11 s: area dock is closed for 11 s more");
    closed.wait(11);
    check(&closed.plan(), "1 release over 0 200");

    let mut asked = hovering_over("permission", "");
    check(&asked.plan(), "1 stop, ask dock\n2 release over 0 200, needs dock");
    // 2 s for the answer, 3 s for the release and 6 s for the fall; a quarter and 10 s more, and 30 s for the way out.
    let for_s = asked.steps[0].ask_for_s[0];
    assert!((for_s - 53.75).abs() < 1e-3, "{for_s} s");
}

#[test]
fn a_release_is_counted_in_time_and_energy() {
    let forecast = |more: &str| {
        let text = text(&[&buoy(30.0, more), BACK]);
        let reply = Story::of(REFERENCE).ask(Ask::Validate(v1::MissionText { text, wind: None }));
        assert!(reply.accepted, "{}", reply.text);
        (reply.forecast[0].flight_time_s, reply.forecast[0].energy_wh)
    };
    let ((time_s, energy_wh), (with_s, with_wh)) = (forecast(""), forecast("drop = true"));
    assert!((with_s - time_s - 3.0).abs() < 1e-6, "{with_s} {time_s}");
    assert!(energy_wh < with_wh, "{with_wh} {energy_wh}");
}
