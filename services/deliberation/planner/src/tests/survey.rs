//! Surveys: lines over a polygon, flown in order, with the areas on the way, and taken up again where they were left.

use super::*;
use v1::mission_request::Request as Ask;

/// Three lines of 200 m, to the north and back, 40 m up; then home.
fn field(more: &str) -> String {
    format!(
        "name = \"field\"\n[[objective]]\nname = \"look\"\nheight_m = 40.0\nflying = true\n\
         survey = {{ corners_m = [[100, 0], [300, 0], [300, 90], [100, 90]], spacing_m = 30 }}\n{more}\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0.0\neast_m = 0.0\nheight_m = 0.0\nflying = false\n"
    )
}

fn passed(story: &mut Story) -> u32 {
    story.status().objectives[0].survey.as_ref().unwrap().passed
}

#[test]
fn the_lines_are_flown_in_order_and_then_the_next_objective() {
    let mut story = Story::of(&field(""));
    check(
        &story.plan(),
        "1 takeoff 40 m
         2 position 100 15 40
         3 position 300 15 40
         4 position 300 45 40
         5 position 100 45 40
         6 position 100 75 40
         7 position 300 75 40",
    );
    story.fly(4);
    assert_eq!(passed(&mut story), 3);
    story.fly(3);
    check(&story.plan(), "8 position 0 0 10\n9 land");
    check(
        &story.objectives(),
        "look: success, 7 steps, 0 replans, asked []\nhome: waiting, 2 steps, 0 replans, asked []",
    );
}

#[test]
fn a_survey_that_was_interrupted_goes_on_where_it_was_left() {
    /// Interrupted at the third step, on the second line, and asked for a plan from there.
    #[track_caller]
    fn check_from(at: [f64; 3], expected: &str) {
        let mut story = Story::of(&field(""));
        story.plan();
        story.fly(4);
        story.airborne_at(at);
        story.interrupted = true;
        let found = story.fail(&[]);
        check(&found.lines().next().map(|it| it[it.find(' ').unwrap()..].to_owned()).unwrap_or_default(), expected);
    }
    // On the line, which is flown to its end.
    check_from([200.0, 46.0, 40.0], "position 100 45 40");
    // At its end, which nobody has reported as flown.
    check_from([100.0, 45.0, 40.0], "position 100 75 40");
    // Blown off it, or called away: from its beginning.
    check_from([200.0, 60.0, 40.0], "position 300 45 40");
    check_from([0.0, 0.0, 20.0], "position 300 45 40");
}

#[test]
fn on_the_way_round_an_area_a_line_is_not_left() {
    let area =
        "[[area]]\nname = \"mast\"\nkind = \"keep-out\"\ncorners_m = [[180, 40], [220, 40], [220, 50], [180, 50]]\n";
    let mut story = Story::of(&field(area));
    let plan = story.plan();
    check(
        &plan,
        "1 takeoff 40 m
         2 position 100 15 40
         3 position 300 15 40
         4 position 300 45 40
         5 position 230 30 40
         6 position 170 30 40
         7 position 100 45 40
         8 position 100 75 40
         9 position 300 75 40",
    );
    story.fly(5);
    story.airborne_at([200.0, 30.0, 40.0]);
    let found = story.fail(&[]);
    assert!(found.starts_with("10 position 170 30 40\n7 position 100 45 40"), "{found}");
}

#[test]
fn a_permission_is_asked_for_once_and_for_as_long_as_the_last_line_needs() {
    let area =
        "[[area]]\nname = \"A\"\nkind = \"permission\"\ncorners_m = [[180, -50], [220, -50], [220, 150], [180, 150]]\n";
    let mut story = Story::of(&field(area));
    let plan = story.plan();
    let asks: Vec<_> = plan.lines().filter(|it| it.contains("ask A")).collect();
    assert_eq!(asks.len(), 1, "{plan}");
    assert_eq!(plan.lines().filter(|it| it.contains("needs A")).count(), 3, "{plan}");
    let lasts_s = story.steps.iter().flat_map(|it| &it.ask_for_s).copied().fold(0.0, f64::max);
    assert!(50.0 < lasts_s, "{lasts_s} s");
    let denied = story.fail(&[]);
    assert!(denied.contains("ask A"), "{denied}");
}

#[test]
fn a_turn_that_cannot_be_reached_fails_the_survey_and_is_named() {
    let area = "from_utc = \"2020-01-01T00:00:00Z\"\n[[area]]\nname = \"x\"\nkind = \"keep-out\"\n\
                corners_m = [[280, 30], [320, 30], [320, 60], [280, 60]]\n";
    let area = area.split_once('\n').map(|(window, area)| format!("{area}{window}\n")).unwrap();
    let mut story = Story::of(&field(&area));
    story.plan();
    let told = story.objectives();
    assert!(told.starts_with("look: failure (") && told.contains("on the way to its turn at (300, 45, 40)"), "{told}");
}

#[test]
fn a_planner_that_is_started_again_goes_on_with_the_survey() {
    let text = field("");
    let mut story = Story::of(&text);
    story.plan();
    story.fly(5);
    story.restart();
    assert_eq!(passed(&mut story), 4);
    check(&story.plan(), "8 position 100 75 40\n9 position 300 75 40");
}

#[test]
fn all_lines_count_for_energy_order_and_deadlines() {
    let ask = |text: String| {
        let mut story = Story::of(REFERENCE);
        story.state.charge = Some(1.0);
        story.ask(Ask::Validate(v1::MissionText { text, wind: None }))
    };
    let reply = ask(field(""));
    assert!(reply.accepted, "{}", reply.text);
    let look = &reply.forecast[0];
    // 101 m to it, three lines, two ways between them, and the climb.
    assert!((look.length_m - (101.1 + 3.0 * 200.0 + 2.0 * 30.0 + 40.0)).abs() < 1.0, "{} m", look.length_m);
    let late = ask(field("reach_within_s = 60.0"));
    assert!(
        !late.forecast[0].reachable && late.forecast[0].reason.contains("s too late"),
        "{:?}",
        late.forecast[0].reason
    );
    // 100 lines of 3 km are more than any battery.
    let wide = field("").replace("[300, 0], [300, 90], [100, 90]", "[3100, 0], [3100, 3000], [100, 3000]");
    let refused = ask(wide.clone());
    assert!(!refused.accepted && refused.text.starts_with("the mission needs"), "{}", refused.text);
    let optional = ask(wide.replace("flying = true", "flying = true\noptional = true\nworth = 1.0"));
    assert!(optional.accepted && optional.text.contains("left out, worth 1: the mission needs"), "{}", optional.text);
    // A place beside the end of the last line comes after the survey, not before.
    let beside = "[[objective]]\nname = \"beside\"\nnorth_m = 400.0\neast_m = 75.0\nheight_m = 40.0\nflying = true\n";
    let free = field("").replacen("[[objective]]", &format!("order = \"free\"\n{beside}[[objective]]"), 1);
    let free = free.replace("name = \"home\"", "name = \"home\"\nafter = [\"look\", \"beside\"]");
    let order: Vec<_> = ask(free).forecast.into_iter().map(|it| it.objective).collect();
    assert_eq!(order, ["look", "beside", "home"]);
}
