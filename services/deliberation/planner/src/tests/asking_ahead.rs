//! Permissions that are asked for before the step that needs them.

use super::*;
use v1::mission_request::Request as Ask;

/// What the present plan asks for ahead: the number of the step from 1, the area, and after how many seconds of the step.
fn ahead(story: &Story) -> Vec<(usize, &str, f64)> {
    let steps = story.steps.iter().enumerate();
    steps
        .flat_map(|(index, step)| step.ask_ahead.iter().map(move |it| (index + 1, it.area.as_str(), it.after_s)))
        .collect()
}

#[track_caller]
fn check_ahead(story: &Story, expected: &[(usize, &str, f64)]) {
    let found = ahead(story);
    let is_same = found.len() == expected.len()
        && std::iter::zip(&found, expected).all(|(a, b)| (a.0, a.1) == (b.0, b.1) && (a.2 - b.2).abs() < 0.01);
    assert!(is_same, "expected {expected:?}, got {found:?}");
}

/// An area that is landed in, and flown over: the vehicle asks for it where it has arrived. Its border is 50 s of flight away.
fn low() -> String {
    across(&area("low", "permission", [400.0, 600.0], "ceiling_m = 5.0"))
}

/// The takeoff takes 3.3 s, and the flight to 20 m before the border as many seconds as there are tens of metres.
#[test]
fn a_border_that_is_near_is_asked_for_in_the_step_before() {
    #[track_caller]
    fn check_areas(areas: &str, expected: &[(usize, &str, f64)]) {
        let mut story = Story::of(&across(areas));
        story.plan();
        check_ahead(&story, expected);
    }
    // Reached after 10.3 s, 7 s after the takeoff.
    check_areas(&area("A", "permission", [90.0, 300.0], ""), &[(1, "A", 2.333)]);
    // Reached after 5.3 s, less than the 8 s that an answer may take: at once.
    check_areas(&area("A", "permission", [40.0, 300.0], ""), &[(1, "A", 0.0)]);
    // The step to the border takes long enough itself.
    check_areas(&area("A", "permission", [110.0, 300.0], ""), &[]);
    // Two at one border.
    let both = area("A", "permission", [90.0, 300.0], "") + &area("B", "permission", [95.0, 300.0], "");
    check_areas(&both, &[(1, "A", 2.333), (1, "B", 2.333)]);
    // One behind the border of the other: asked for in the step that asks for that one.
    let behind = area("A", "permission", [300.0, 400.0], "") + &area("B", "permission", [330.0, 400.0], "");
    check_areas(&behind, &[(2, "B", 23.0)]);
    // What is asked for where the vehicle has arrived.
    check_areas(&area("low", "permission", [400.0, 600.0], "ceiling_m = 5.0"), &[(2, "low", 42.0)]);
}

#[test]
fn a_grant_must_hold_for_as_much_longer_as_it_is_asked_for_earlier() {
    let mut story = Story::of(&across(&area("A", "permission", [90.0, 300.0], "")));
    story.plan();
    let (ahead, own) = (story.steps[0].ask_ahead[0].for_s, story.steps[1].ask_for_s[0]);
    // At 2.3 s instead of 3.3 s.
    assert!((ahead - own - 1.0).abs() < 0.01, "{ahead} s and {own} s");
}

#[test]
fn what_is_held_is_not_asked_for_ahead() {
    let mut story = Story::of(&across(&area("A", "permission", [90.0, 300.0], "")));
    story.hold_permissions(&["A"]);
    story.plan();
    check_ahead(&story, &[]);
}

/// The stop before the landing asks for 50.8 s: 2 s of wait, 6.7 s of descent, a quarter and 10 s more, and 30 s. Asked 8 s
/// ahead it must hold for 58.8 s.
#[test]
fn what_is_granted_for_too_short_a_time_is_not_asked_for_ahead() {
    #[track_caller]
    fn check_granted(granted_s: f64, expected: &[(usize, &str, f64)]) {
        let mut story = Story::of(&low());
        story.plan();
        story.fly(1);
        story.airborne_at([0.0, 200.0, 10.0]);
        story.held = vec![v1::HeldPermission { area: "low".into(), valid_for_s: granted_s }];
        story.too_short = true;
        let plan = story.fail(&[("low", Some("granted for less than is needed"))]);
        assert!(plan.contains("stop, ask low"), "{plan}");
        check_ahead(&story, expected);
    }
    check_granted(55.0, &[]);
    check_granted(62.0, &[(1, "low", 22.0)]);
}

#[test]
fn what_was_refused_is_asked_for_once_more_by_the_step_that_needs_it_alone() {
    let mut story = Story::of(&low());
    story.plan();
    story.fly(1);
    story.airborne_at([0.0, 100.0, 10.0]);
    check(
        &story.fail(&[("low", Some("busy"))]),
        "5 position 0 500 10
         6 stop, ask low
         7 land, needs low",
    );
    check_ahead(&story, &[]);
}

#[test]
fn without_a_lead_time_nothing_is_asked_for_ahead() {
    let text = across(&area("A", "permission", [90.0, 300.0], ""));
    let mut story = Story::of(&text);
    let config = Config { ask_ahead_s: 0.0.try_into().unwrap(), ..Config::for_tests() };
    story.restart_with(&config);
    story.plan();
    check_ahead(&story, &[]);
}

#[test]
fn a_forecast_has_the_time_at_which_a_permission_is_asked_for() {
    #[track_caller]
    fn check_asked(border_m: f64, expected: (f64, bool)) {
        let text = across(&area("A", "permission", [border_m, 300.0], ""));
        let reply = Story::of(&text).ask(Ask::Validate(v1::MissionText { text, wind: None }));
        let legs = reply.forecast.into_iter().flat_map(|it| it.legs);
        let asked: Vec<v1::PermissionForecast> = legs.flat_map(|it| it.asks).collect();
        assert_eq!(asked.len(), 1, "{asked:?}");
        assert!((asked[0].asked_s - expected.0).abs() < 0.01, "{asked:?}");
        assert_eq!(asked[0].ahead, expected.1);
    }
    check_asked(90.0, (2.333, true));
    check_asked(110.0, (3.333, false));
}
