//! Objectives with tasks, which processes of declared skills do.

use domain::declared_skill::{DeclaredSkill, DeclaredSkills};
use domain::file::Source;

use super::*;
use v1::mission_request::Request as Ask;

fn declared() -> DeclaredSkills {
    let skill = |name: &str, more: &str| {
        let text = format!(
            "version = 1\nsummary = \"Does it\"\nseconds = \"10 + 2 * length_m\"\nlimit_s = 120.0\n{more}\n\
             outcome = {{ done = \"success\", broken = \"failure\" }}\n\
             [input.length_m]\nleast = 0.0\nmost = 50.0\nusual = 5.0\n"
        );
        DeclaredSkill::read(&Source { path: format!("{name}.toml").into(), text }).unwrap()
    };
    let stands = skill("read", "vehicle = \"stands\"\npower_w = 3600.0");
    let flies =
        "version = 1\nsummary = \"Films\"\nvehicle = \"flies\"\npower_w = 3600.0\noutcome = { done = \"success\" }";
    let flies = DeclaredSkill::read(&Source { path: "film.toml".into(), text: flies.into() }).unwrap();
    DeclaredSkills::of(vec![skill("lower", "tries = 2\npower_w = 3600.0"), skill("photo", ""), stands, flies])
}

/// These tasks are done over (0, 200), in 15 m; then it lands at home.
fn text(tasks: &str) -> String {
    format!(
        "name = \"tasks\"\n\
         [[objective]]\nname = \"boat\"\nnorth_m = 0.0\neast_m = 200.0\nheight_m = 15.0\nflying = true\n{tasks}\n\
         [[objective]]\nname = \"back\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n"
    )
}

const BOTH: &str = "do = [{ skill = \"lower\", length_m = 12 }, { skill = \"photo\" }]";

fn story(tasks: &str) -> Story {
    let mut story = Story::of(&text(tasks));
    story.planner =
        Planner::new(&Config::for_tests(), &Rules::for_tests().aircraft, Pace::REAL_TIME).with_skills(declared());
    story
}

const OUT: &str = "\
    1 takeoff 15 m
    2 position 0 200 15
    3 stop
    4 lower 12
    5 photo 5";

#[test]
fn tasks_are_done_at_rest_in_their_order() {
    let mut story = story(BOTH);
    check(&story.plan(), OUT);
    story.fly(4);
    assert!(story.objectives().starts_with("boat: waiting"), "{}", story.objectives());
    assert_eq!(story.status().objectives[0].tasks_done, 1);
    story.fly(1);
    assert!(story.objectives().starts_with("boat: success"), "{}", story.objectives());
    assert!(story.plan().contains("position 0 0 10"));
}

#[test]
fn a_task_that_is_done_is_not_done_again() {
    #[track_caller]
    fn check_rest(story: &mut Story) {
        story.airborne_at([0.0, 150.0, 15.0]);
        let plan = story.plan();
        assert!(plan.contains("position 0 200 15") && plan.contains("photo"), "{plan}");
        assert!(!plan.contains("lower"), "{plan}");
    }
    let mut interrupted = story(BOTH);
    interrupted.plan();
    interrupted.fly(4);
    check_rest(&mut interrupted);
    let mut restarted = story(BOTH);
    restarted.plan();
    restarted.fly(4);
    restarted.restart();
    restarted.planner =
        Planner::new(&Config::for_tests(), &Rules::for_tests().aircraft, Pace::REAL_TIME).with_skills(declared());
    check_rest(&mut restarted);
}

#[test]
fn a_task_comes_after_a_drop_and_before_the_stay() {
    let mut story = story(&format!("drop = true\ndwell_s = 30.0\n{BOTH}"));
    story.state.gripper = v1::Gripper::Holding as i32;
    check(&story.plan(), "1 takeoff 15 m\n2 position 0 200 15\n3 stop\n4 release over 0 200\n5 lower 12\n6 photo 5");
    story.fly(6);
    story.state.gripper = v1::Gripper::Released as i32;
    check(&story.plan(), "hold 30 s: stays at `boat` for 30 s more");
}

#[test]
fn a_task_that_fails_is_tried_as_often_as_it_is_declared() {
    #[track_caller]
    fn check_tries(done: usize, tries: usize, reason: &str) {
        let mut story = story(BOTH);
        story.plan();
        story.fly(3 + done);
        story.airborne_at([0.0, 200.0, 15.0]);
        story.state.mode = v1::FlightMode::Loiter as i32;
        for _ in 1..tries {
            let again = story.fail(&[]);
            assert!(!again.contains("position"), "{again}");
        }
        assert!(story.fail(&[]).contains("position 0 0 10"));
        let objectives = story.objectives();
        assert!(objectives.starts_with(&format!("boat: failure ({reason}")), "{objectives}");
    }
    check_tries(0, 2, "lower failed 2 times in a row");
    check_tries(1, 1, "photo failed 1 times in a row");
}

#[test]
fn time_and_energy_of_tasks_are_forecast() {
    let forecast = |text: String| {
        let mut story = story("");
        let ask = Ask::Validate(v1::MissionText { text, wind: None });
        let ask = v1::MissionRequest { request: Some(ask), ..Default::default() };
        let reply = story.planner.try_out(&mission(&super::tasks::text("")), ask, story.now);
        let boat = &reply.forecast[0];
        assert!(boat.reachable, "{boat:?}");
        (boat.flight_time_s, boat.energy_wh)
    };
    let (without, with) = (forecast(text("")), forecast(text(BOTH)));
    // 10 s and 2 s a metre each; besides hovering the first takes a watt-hour a second.
    let (time_s, energy_wh) = (with.0 - without.0, with.1 - without.1);
    assert!((time_s - (34.0 + 20.0)).abs() < 5.0, "{time_s} s");
    assert!((energy_wh - 34.0 - 54.0 * 725.0 / 3600.0).abs() < 3.0, "{energy_wh} Wh");
    // Along the leg it takes as long as that, 20 s for 200 m.
    let along = forecast(text("along = [{ skill = \"film\" }]"));
    assert!(along.0 == without.0 && (along.1 - without.1 - 20.0).abs() < 1.0, "{along:?} {without:?}");
    // On the ground the vehicle takes nothing.
    let (without, with) = (forecast(landed("")), forecast(landed(READ)));
    assert!((with.0 - without.0 - 20.0).abs() < 0.1 && (with.1 - without.1 - 20.0).abs() < 0.1, "{with:?} {without:?}");
}

const READ: &str = "do = [{ skill = \"read\" }]";

/// The same on the ground.
fn landed(tasks: &str) -> String {
    text(tasks).replacen("height_m = 15.0\nflying = true", "height_m = 0.0\nflying = false", 1)
}

#[test]
fn on_the_ground_a_task_comes_after_the_landing_and_before_the_next_takeoff() {
    let mut story = Story::of(&landed(READ));
    story.planner =
        Planner::new(&Config::for_tests(), &Rules::for_tests().aircraft, Pace::REAL_TIME).with_skills(declared());
    check(&story.plan(), "1 takeoff 10 m\n2 position 0 200 10\n3 land\n4 read 5");
    story.fly(3);
    assert!(story.objectives().starts_with("boat: waiting"), "{}", story.objectives());
    story.fly(1);
    assert!(story.objectives().starts_with("boat: success"), "{}", story.objectives());
    assert!(story.plan().starts_with("5 takeoff"));
}

#[test]
fn a_task_along_a_leg_goes_with_its_flights_and_of_a_survey_with_its_lines() {
    #[track_caller]
    fn check(objective: &str, expected: &[&str]) {
        let mut story = story("along = [{ skill = \"film\" }]");
        let text = text("along = [{ skill = \"film\" }]").replacen("north_m = 0.0\neast_m = 200.0", objective, 1);
        story.mission = MissionStatus::beginning(&mission(&text));
        story.plan();
        let texts: Vec<&str> = story.steps.iter().map(|it| it.text.as_str()).collect();
        assert_eq!(texts, expected);
    }
    check("north_m = 0.0\neast_m = 200.0", &["takeoff by 15 m", "fly to (0, 200, 15) with film"]);
    check(
        "survey = { corners_m = [[100, 0], [300, 0], [300, 40], [100, 40]], spacing_m = 20 }",
        &[
            "takeoff by 15 m",
            "fly to (100, 10, 15)",
            "fly to (300, 10, 15) with film",
            "fly to (300, 30, 15) with film",
            "fly to (100, 30, 15) with film",
        ],
    );
}

#[test]
fn a_leg_that_begins_too_low_for_what_goes_with_it_begins_with_a_climb() {
    let high = "version = 1\nsummary = \"Maps\"\nvehicle = \"flies\"\npower_w = 3600.0\noutcome = { done = \"success\" }\n\
                precondition = \"position.height_m > 30 m\"";
    let high = DeclaredSkill::read(&Source { path: "map.toml".into(), text: high.into() }).unwrap();
    let plan = |height_m: f64| {
        let text = text("along = [{ skill = \"map\" }]").replacen("height_m = 15.0", "height_m = 40.0", 1);
        let mut story = Story::of(&text);
        let planner = Planner::new(&Config::for_tests(), &Rules::for_tests().aircraft, Pace::REAL_TIME);
        story.planner = planner.with_skills(DeclaredSkills::of(vec![high.clone()]));
        story.airborne_at([0.0, 50.0, height_m]);
        story.plan()
    };
    check(&plan(10.0), "1 position 0 50 40\n2 position 0 200 40");
    check(&plan(35.0), "1 position 0 200 40");
}

#[test]
fn a_task_that_has_failed_along_the_leg_fails_the_objective_at_its_end() {
    let mut story = story(&format!("along = [{{ skill = \"film\" }}]\n{BOTH}"));
    story.plan();
    story.fly(1);
    story.along_failure = Some("film broke".into());
    story.fly(3);
    assert!(story.objectives().starts_with("boat: waiting"), "{}", story.objectives());
    story.fly(1);
    assert!(story.objectives().starts_with("boat: failure (film broke)"), "{}", story.objectives());
    assert!(story.plan().contains("position 0 0 10"));
}

#[test]
fn a_mission_with_a_task_that_nothing_does_is_refused() {
    #[track_caller]
    fn check(tasks: &str, expected: &str) {
        let mut story = story("");
        let text = v1::MissionText { text: text(tasks), wind: None };
        let ask = v1::MissionRequest { request: Some(Ask::Validate(text)), ..Default::default() };
        let reply = story.planner.try_out(&mission(&super::tasks::text("")), ask, story.now);
        assert_eq!(reply.mistakes.len(), 1, "{reply:?}");
        assert!(reply.mistakes[0].contains(expected), "{reply:?}");
    }
    check("do = [{ skill = \"film\" }]", "8:7: skill `film` is used while the vehicle flies, not while it hovers");
    check("do = [{ skill = \"read\" }]", "8:7: skill `read` is used while the vehicle stands, not while it hovers");
    check(
        "along = [{ skill = \"photo\" }]",
        "8:10: skill `photo` is used while the vehicle hovers, not while it flies",
    );
    check("do = [{ skill = \"dig\" }]", "8:7: there is no declared skill `dig`");
    check(
        "do = [{ skill = \"lower\", length_m = 60 }]",
        "8:7: `length_m` of skill `lower` is 60, expected from 0 to 50",
    );
    // One that comes by another way is not begun.
    let mut story = Story::of(&text("do = [{ skill = \"dig\" }]"));
    super::check(&story.plan(), "finished");
    assert!(story.objectives().contains("there is no declared skill `dig`"), "{}", story.objectives());
}
