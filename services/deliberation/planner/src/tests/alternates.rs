//! Where a flight could end early, as a validation names it for each leg.

use super::*;
use v1::mission_request::Request as Ask;

/// A look 1,500 m to the east and back, with this in the file besides.
fn far_out(more: &str) -> String {
    format!(
        "name = \"far\"\n[[objective]]\nname = \"look\"\nnorth_m = 0\neast_m = 1500\nheight_m = 20\nflying = true\n\
         [[objective]]\nname = \"home\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n{more}"
    )
}

fn site(name: &str, kind: &str, north_m: f64, east_m: f64) -> String {
    format!("[[site]]\nname = \"{name}\"\nkind = \"{kind}\"\nnorth_m = {north_m:.1}\neast_m = {east_m:.1}\n")
}

/// For each leg of the first objective: where to, and its alternate.
fn alternates(text: &str, charge: Option<f64>) -> Vec<(String, v1::Alternate)> {
    let mut story = Story::of(text);
    story.state.charge = charge;
    let reply = story.ask(Ask::Validate(v1::MissionText { text: text.into(), wind: None }));
    let legs = reply.forecast.into_iter().take(1).flat_map(|it| it.legs);
    legs.map(|it| (it.text, it.alternate.expect("it was looked for"))).collect()
}

/// Name, permissions and reach of the alternate of the leg to 1,500 m.
#[track_caller]
fn check(more: &str, charge: Option<f64>, expected: (&str, &[&str], bool)) {
    let found = alternates(&far_out(more), charge);
    let (_, it) = found.iter().find(|it| it.0.contains("1500")).unwrap_or_else(|| panic!("{found:?}"));
    let permissions: Vec<&str> = it.permissions.iter().map(String::as_str).collect();
    assert_eq!((it.name.as_str(), &*permissions, it.why_not.is_empty()), expected, "{found:?}");
}

#[test]
fn each_leg_has_the_best_alternate_of_its_worst_place() {
    let field = site("field", "landing", 100.0, 900.0);
    let found = alternates(&far_out(&field), Some(1.0));
    let names: Vec<_> = found.iter().map(|(_, it)| it.name.as_str()).collect();
    assert_eq!(names, ["home", "field"], "{found:?}");
    // From the end of the leg, 608 m away, and not from its middle.
    let length_m = found[1].1.length_m.unwrap();
    assert!((608.0..640.0).contains(&length_m), "{length_m}");
    assert!(found[1].1.charge.is_some_and(|it| 0.5 < it && it < 0.9), "{found:?}");
}

#[test]
fn a_landing_comes_before_a_ditch_and_what_is_free_before_what_must_be_asked_for() {
    let (field, pond) = (site("field", "landing", 100.0, 900.0), site("pond", "ditch", 0.0, 1450.0));
    let round_field = "[[area]]\nname = \"P\"\nkind = \"permission\"\n\
                       corners_m = [[60.0, 850.0], [140.0, 850.0], [140.0, 950.0], [60.0, 950.0]]\n";
    check("", None, ("home", &[], true));
    check(&pond, None, ("home", &[], true));
    check(&format!("{pond}{field}"), None, ("field", &[], true));
    check(&format!("{field}{round_field}"), None, ("home", &[], true));
    let closed_home = "[[area]]\nname = \"K\"\nkind = \"permission\"\n\
                       corners_m = [[-60.0, -60.0], [60.0, -60.0], [60.0, 60.0], [-60.0, 60.0]]\n";
    // The takeoff asks for the area round home, which is held from then on.
    check(&format!("{field}{round_field}{closed_home}"), None, ("home", &[], true));
}

#[test]
fn that_nothing_is_within_the_battery_is_said_with_the_nearest_place() {
    let sites = format!("{}{}", site("field", "landing", 100.0, 900.0), site("pond", "ditch", 0.0, 1450.0));
    // At the end of the leg 16 Wh are left: enough for the pond, which takes 7, and not for the field, which takes 22.
    check(&sites, Some(0.2), ("pond", &[], true));
    check(&sites, Some(0.05), ("field", &[], false));
    let found = alternates(&far_out(&sites), Some(0.05));
    assert!(found[1].1.why_not.starts_with("the way needs "), "{found:?}");
}
