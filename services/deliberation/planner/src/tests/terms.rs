//! What a mission asks besides its places: energy, order, precedence, deadlines, stays.

use super::*;
use v1::mission_request::Request as Ask;

/// An objective of a mission file at `[north, east, height]`, in flight above the ground.
fn objective(name: &str, [north_m, east_m, height_m]: [f64; 3], more: &str) -> String {
    let flying = 0.0 < height_m;
    format!(
        "[[objective]]\nname = \"{name}\"\nnorth_m = {north_m:.1}\neast_m = {east_m:.1}\nheight_m = {height_m:.1}\n\
         flying = {flying}\n{more}\n"
    )
}

fn story(head: &str, objectives: &[String]) -> Story {
    let mut story = Story::of(&format!("name = \"terms\"\n{head}\n{}", objectives.concat()));
    story.state.charge = Some(1.0);
    story
}

/// The objectives in their order, each with its reason if it has failed.
fn outcomes(story: &mut Story) -> Vec<String> {
    let word = |it: &v1::Objective| match it.state() {
        v1::ObjectiveState::Failure => format!("{}: {}", it.name, it.reason),
        v1::ObjectiveState::Success => format!("{} reached", it.name),
        _ => it.name.clone(),
    };
    story.status().objectives.iter().map(word).collect()
}

/// `found` are as many as `expected`, and each begins as that does.
#[track_caller]
fn check_outcomes(story: &mut Story, expected: &[&str]) {
    let found = outcomes(story);
    let is_same = found.len() == expected.len() && found.iter().zip(expected).all(|(it, begin)| it.starts_with(begin));
    assert!(is_same, "expected {expected:#?}, got {found:#?}");
}

#[test]
fn a_mission_that_needs_more_than_the_battery_gives_is_not_begun() {
    let far = [objective("there", [0.0, 20_000.0, 0.0], ""), objective("back", [0.0, 0.0, 0.0], "")];
    let mut story = story("", &far);
    check(&story.plan(), "finished");
    let figures = "of 225 usable (300 of 300 Wh left, 25 % reserve)";
    let outcomes = outcomes(&mut story);
    assert!(outcomes[0].starts_with("there: the mission needs 1"), "{outcomes:?}");
    assert!(outcomes[1].starts_with("back: not attempted: the mission needs 1"), "{outcomes:?}");
    assert!(outcomes.iter().all(|it| it.ends_with(figures)), "{outcomes:?}");
}

#[test]
fn before_takeoff_what_is_worth_least_is_left_out() {
    let there_and_there = [
        objective("east", [0.0, 2500.0, 20.0], "optional = true\nworth = 1.0"),
        objective("north", [2500.0, 0.0, 20.0], "optional = true\nworth = 5.0"),
        objective("back", [0.0, 0.0, 0.0], ""),
    ];
    let mut story = story("", &there_and_there);
    assert!(story.plan().contains("position 2500 0 20"), "{:?}", story.steps);
    check_outcomes(&mut story, &["east: left out, worth 1: the mission needs 2", "north", "back"]);
}

#[test]
fn in_flight_a_battery_that_sinks_leaves_out_what_is_optional_and_what_has_no_way_back() {
    #[track_caller]
    fn check_with(charge: f64, optional: &str, expected: &[&str], flown: &str) {
        let objectives = [
            objective("near", [0.0, 500.0, 20.0], ""),
            objective("far", [0.0, 1500.0, 20.0], optional),
            objective("back", [0.0, 0.0, 0.0], ""),
        ];
        let mut story = story("", &objectives);
        story.plan();
        story.fly(story.steps.len());
        story.state.charge = Some(charge);
        let plan = story.plan();
        assert!(plan.contains(flown), "{plan}");
        check_outcomes(&mut story, expected);
    }
    let optional = "optional = true\nworth = 1.0";
    check_with(0.9, optional, &["near reached", "far", "back"], "position 0 1500 20");
    check_with(0.35, optional, &["near reached", "far: left out, worth 1: the mission needs", "back"], "position 0 0 ");
    let no_way_back = &["near reached", "far: the way there and back needs", "back"];
    check_with(0.35, "", no_way_back, "position 0 0 ");
    // The way home is flown on the reserve as well.
    check_with(0.1, "", no_way_back, "position 0 0 ");
}

#[test]
fn in_flight_what_is_worth_least_is_left_out_before_its_turn() {
    let objectives = [
        objective("near", [0.0, 500.0, 20.0], ""),
        objective("far", [0.0, 1500.0, 20.0], "optional = true\nworth = 1.0"),
        objective("back", [0.0, 0.0, 0.0], ""),
    ];
    let mut story = story("", &objectives);
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 100.0, 20.0]);
    story.state.charge = Some(0.4);
    let plan = story.plan();
    assert!(plan.contains("position 0 500 20"), "{plan}");
    check_outcomes(&mut story, &["near", "far: left out, worth 1: the mission needs", "back"]);
}

#[test]
fn a_free_order_is_chosen_at_the_first_plan_and_stays() {
    let line = [
        objective("third", [0.0, 300.0, 10.0], ""),
        objective("first", [0.0, 100.0, 10.0], ""),
        objective("last", [0.0, 0.0, 0.0], "after = [\"third\", \"second\"]"),
        objective("second", [0.0, 200.0, 10.0], ""),
    ];
    let mut story = story("order = \"free\"", &line);
    story.plan();
    check_outcomes(&mut story, &["first", "second", "third", "last"]);
    story.fly(story.steps.len());
    // From beyond the end another order would be shorter.
    story.airborne_at([0.0, 350.0, 10.0]);
    story.plan();
    check_outcomes(&mut story, &["first reached", "second", "third", "last"]);
}

#[test]
fn an_objective_that_is_left_out_leaves_out_no_other() {
    let round = [
        objective("home", [0.0, 0.0, 0.0], "after = [\"near\", \"far\"]"),
        objective("far", [4000.0, 2000.0, 20.0], "optional = true\nworth = 1.0"),
        objective("near", [0.0, 100.0, 10.0], ""),
    ];
    let mut story = story("order = \"free\"", &round);
    for place in ["position 0 100 10", "position 0 0 10"] {
        let plan = story.plan();
        assert!(plan.contains(place), "{plan}");
        story.fly(story.steps.len());
    }
    check(&story.plan(), "finished");
    let outcomes = outcomes(&mut story);
    assert!(outcomes.iter().any(|it| it.starts_with("far: left out, worth 1: the mission needs")), "{outcomes:?}");
    assert!(["near reached", "home reached"].iter().all(|it| outcomes.iter().any(|found| found == it)), "{outcomes:?}");
}

#[test]
fn an_objective_that_comes_too_late_has_failed() {
    let late = |more: &str| [objective("there", [0.0, 300.0, 10.0], more), objective("back", [0.0, 0.0, 0.0], "")];
    #[track_caller]
    fn check_late(objectives: [String; 2], waited_s: u64, expected: &str) {
        let mut story = story("", &objectives);
        story.plan();
        story.wait(waited_s);
        story.fly(story.steps.len());
        check_outcomes(&mut story, &[expected, "back"]);
    }
    check_late(late("reach_within_s = 20.0"), 0, "there: would be reached 13 s too late, 33 s from now");
    check_late(late("reach_within_s = 40.0"), 0, "there reached");
    check_late(late("reach_within_s = 40.0"), 45, "there: reached 5 s too late");
    check_late(late("reach_by_utc = \"2026-01-01T00:00:50Z\""), 45, "there reached");
    check_late(late("reach_by_utc = \"2026-01-01T00:00:50Z\""), 55, "there: reached 5 s too late");
    check_late(late("reach_within_s = 60.0\nreach_by_utc = \"2025-01-01T00:00:00Z\""), 0, "there: would be reached");
}

#[test]
fn a_step_of_the_wall_clock_moves_no_deadline_that_counts_from_the_first_plan() {
    #[track_caller]
    fn check_stepped(step_s: i64, waited_s: u64, expected: &str) {
        let there = objective("there", [0.0, 300.0, 10.0], "reach_within_s = 40.0");
        let mut story = story("", &[there, objective("back", [0.0, 0.0, 0.0], "")]);
        story.plan();
        story.now.utc_ms += step_s * 1000;
        story.wait(waited_s);
        story.fly(story.steps.len());
        check_outcomes(&mut story, &[expected, "back"]);
    }
    for step_s in [3600, -3600] {
        check_stepped(step_s, 0, "there reached");
        check_stepped(step_s, 45, "there: reached 5 s too late");
    }
}

#[test]
fn a_planner_that_is_started_again_keeps_the_order_and_the_deadlines() {
    let text = format!(
        "name = \"terms\"\norder = \"free\"\n{}{}",
        objective("far", [0.0, 300.0, 10.0], "reach_within_s = 60.0"),
        objective("near", [0.0, 100.0, 10.0], "")
    );
    let mut story = Story::of(&text);
    story.plan();
    check_outcomes(&mut story, &["near", "far"]);
    story.wait(50);
    story.restart();
    check_outcomes(&mut story, &["near", "far"]);
    story.airborne_at([0.0, 100.0, 10.0]);
    story.plan();
    check_outcomes(&mut story, &["near reached", "far: would be reached 10 s too late, 20 s from now"]);
}

#[test]
fn what_is_said_of_a_free_order_is_said_of_the_order_that_is_flown() {
    #[track_caller]
    fn check(deadline_s: f64, order: [&str; 3], expected: &str) {
        let text = format!(
            "name = \"line\"\norder = \"free\"\n{}{}{}",
            objective("near", [0.0, 100.0, 10.0], "dwell_s = 60.0"),
            objective("far", [0.0, 300.0, 10.0], &format!("reach_within_s = {deadline_s:.1}")),
            objective("end", [0.0, 400.0, 0.0], "after = [\"near\", \"far\"]")
        );
        let reply = Story::of(REFERENCE).ask(Ask::Validate(v1::MissionText { text, wind: None }));
        assert_eq!(reply.forecast.iter().map(|it| it.objective.as_str()).collect::<Vec<_>>(), order);
        assert_eq!(reply.order, expected);
    }
    // Up and down in 10 s, 10 s for each hundred metres, and a stay of 60 s.
    let best = "of all orders of 3 objectives that keep what is asked, flown straight, none takes less than";
    check(200.0, ["near", "far", "end"], &format!("{best} 110 s"));
    // In time only with the far one first.
    check(40.0, ["far", "near", "end"], &format!("{best} 150 s"));
    let late = "deadlines do not count in it, since no order was found that keeps all of them";
    check(20.0, ["near", "far", "end"], &format!("{best} 110 s; {late}"));
}

#[test]
fn of_an_order_of_many_objectives_it_is_said_how_much_better_another_may_be() {
    let places = (0..12).map(|it| [0.0, f64::from(1 + it * 7 % 12) * 100.0, 10.0]);
    let objectives: String = places.enumerate().map(|(it, place)| objective(&format!("o{it}"), place, "")).collect();
    let text = format!("name = \"line\"\norder = \"free\"\n{objectives}");
    let reply = Story::of(REFERENCE).ask(Ask::Validate(v1::MissionText { text, wind: None }));
    // Up and down in 10 s, and 1200 m out and back. The bound is the 1200 m that join all places, and 100 m home from the nearest.
    let expected = "the order of 12 objectives, flown straight, takes 250 s; no order takes less than 140 s";
    assert_eq!(reply.order, expected);
}

#[test]
fn a_mission_that_is_tried_out_is_answered_with_its_energy_and_its_order() {
    let ask = |story: &mut Story, text: String, wind| story.ask(Ask::Validate(v1::MissionText { text, wind }));
    let line = |name: &str, east_m: f64| objective(name, [0.0, east_m, 10.0], "");
    let text = format!("name = \"line\"\norder = \"free\"\n{}{}", line("b", 2000.0), line("a", 1000.0));
    let mut story = Story::of(REFERENCE);
    story.state.charge = Some(1.0);
    let reply = ask(&mut story, text.clone(), None);
    assert!(reply.accepted, "{}", reply.text);
    assert_eq!(reply.forecast.iter().map(|it| it.objective.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    assert!(reply.order.starts_with("of all orders of 2 objectives"), "{}", reply.order);
    let energy = reply.energy.unwrap();
    let sum_wh: f64 = reply.forecast.iter().map(|it| it.energy_wh).sum::<f64>() + energy.way_home_wh;
    assert!((energy.needs_wh - sum_wh).abs() < 1e-6 && 0.0 < energy.way_home_wh, "{energy:?}");
    let last = reply.forecast.last().and_then(|it| it.legs.last()).and_then(|it| it.charge).unwrap();
    assert!((last - (1.0 - (sum_wh - energy.way_home_wh) / 300.0)).abs() < 1e-6, "{last}");
    // The same mission in a storm, and with half a battery.
    let storm = v1::ForecastWind { speed_m_s: 20.0, from_deg: None };
    let refused = ask(&mut story, text.clone(), Some(storm));
    let too_windy =
        "objective `b`: cannot be flown in a wind of 20.0 m/s: the vehicle flies at most 15.0 m/s through the air";
    assert!(!refused.accepted && refused.text.starts_with(too_windy), "{}", refused.text);
    story.state.charge = Some(0.4);
    let refused = ask(&mut story, text.clone(), None);
    assert!(!refused.accepted && refused.text.ends_with("(120 of 300 Wh left, 25 % reserve)"), "{}", refused.text);
    let nonsense = v1::ForecastWind { speed_m_s: f64::NAN, from_deg: None };
    let refused = ask(&mut story, text, Some(nonsense));
    assert!(!refused.accepted && refused.text.starts_with("`wind` is NaN m/s"), "{}", refused.text);
}

/// Out with the wind, and back against it: 6 km in all.
#[test]
fn a_measured_wind_that_leaves_no_way_home_keeps_it_on_the_ground() {
    #[track_caller]
    fn check(wind: Option<(f64, f64)>, expected: &str) {
        let mut story = story("", &[objective("out", [0.0, 3000.0, 10.0], ""), objective("home", [0.0, 0.0, 0.0], "")]);
        story.wind = wind;
        let answer = story.plan();
        let told = format!("{answer}{}", outcomes(&mut story).join("; "));
        assert!(told.contains(expected), "{wind:?}: {told}");
    }
    check(None, "takeoff");
    // Weaker than the usual wind of 4 m/s, which is reckoned with anyway.
    check(Some((0.0, 3.0)), "takeoff");
    check(Some((0.0, 12.0)), "the mission needs ");
    // It passes, and is waited for.
    check(Some((0.0, 16.0)), "hold 10 s: cannot be flown in a wind of 16.0 m/s: the vehicle flies at most 15.0 m/s");
}
