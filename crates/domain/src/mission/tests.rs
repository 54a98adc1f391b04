//! Mission files, right and wrong ones.

use super::*;
use crate::testing::check_mistake;

const GOOD: &str = r#"
name = "there"
[[objective]]
name = "deliver"
north_m = 0.0
east_m = 500.0
height_m = 0.0
flying = false
[[area]]
name = "A"
kind = "permission"
corners_m = [[-90.0, 110.0], [90.0, 110.0], [90.0, 290.0], [-90.0, 290.0]]
from_utc = "2026-05-01T08:00:00Z"
"#;

fn read(text: &str) -> Result<Mission, Mistakes> {
    Mission::read(&Source { path: "m.toml".into(), text: text.into() })
}

#[test]
fn a_good_file_is_a_mission() {
    let mission = read(GOOD).unwrap();
    assert_eq!(mission.objectives[0].position, Ned::new(0.0, 500.0, 0.0));
    assert_eq!(mission.areas[0].from_utc_ms, Some(1_777_622_400_000));
}

#[test]
fn every_mistake_is_reported_with_its_place() {
    #[track_caller]
    fn check(find: &str, replace: &str, expected: &str) {
        check_mistake(GOOD, find, replace, read, expected);
    }
    check("east_m = 500.0\n", "", "m.toml:5:11: objective `deliver` has no `east_m`");
    check("flying = false", "flying = false\nspeed = 3", "m.toml:9:1: unknown field `speed`, expected one of");
    check("flying = false", "flying = 0", "m.toml:8:10: invalid type: integer `0`, expected a boolean");
    check("500.0", "5e9", "m.toml:6:10: `east_m` is 5000000000, expected metres between");
    check("500.0", "nan", "m.toml:6:10: `east_m` is NaN, expected metres between");
    check("height_m = 0.0", "height_m = -110.1", "m.toml:7:12: objective `deliver` is inside the ground");
    check("flying = false", "flying = true", "m.toml:7:12: objective `deliver` is inside the ground");
    check(
        "height_m = 0.0\nflying = false",
        "height_m = 300.0\nflying = true",
        "m.toml:7:12: objective `deliver` is at height 300 m, expected at most 120 m: responses fly no higher",
    );
    check(
        "height_m = 0.0",
        "height_m = 115.0",
        "m.toml:7:12: objective `deliver` is at height 115 m, expected at most 110 m",
    );
    check(
        "east_m = 500.0\nheight_m = 0.0",
        "east_m = 9.0\nheight_m = 6.0",
        "m.toml:7:12: objective `deliver` lies at height 6 m, and the ground 9 m from there, at the take-off point, at 0 m",
    );
    let site = "[[site]]\nname = \"roof\"\nkind = \"landing\"\nnorth_m = 3.0\neast_m = 500.0\nheight_m = 40.0\n";
    check(
        "height_m = 0.0\nflying = false\n",
        &format!("height_m = 30.0\nflying = true\n{site}"),
        "m.toml:7:12: objective `deliver` flies at height 30 m, and the ground 3 m from there, at site `roof`, at 40 m",
    );
    check(
        "flying = false\n",
        &format!("flying = false\n{site}"),
        "m.toml:7:12: objective `deliver` lies at height 0 m, and the ground 3 m from there, at site `roof`, at 40 m",
    );
    check("[90.0, 110.0], [90.0, 290.0]", "[90.0, 290.0], [90.0, 110.0]", "m.toml:12:13: area `A` crosses itself");
    check("2026-05-01T08:00:00Z", "tomorrow", "m.toml:13:12: found `tomorrow`, expected a UTC date");
    check("kind = \"permission\"", "kind = \"open\"", "m.toml:11:8: unknown variant `open`");
    check("name = \"there\"", "name = \"there", "m.toml:2:14: ");
}

#[test]
fn a_place_that_cannot_be_used_is_told_with_its_place() {
    #[track_caller]
    fn check(find: &str, replace: &str, expected: &str) {
        // Nothing about the window: these areas always apply.
        let good = GOOD.replace("from_utc = \"2026-05-01T08:00:00Z\"\n", "");
        check_mistake(&good, find, replace, read, expected);
    }
    check(
        "kind = \"permission\"\ncorners_m = [[-90.0, 110.0], [90.0, 110.0]",
        "kind = \"keep-out\"\ncorners_m = [[-90.0, -20.0], [90.0, -20.0]",
        "m.toml:12:13: the take-off point lies in keep-out area `A`, which always applies",
    );
    check(
        "kind = \"permission\"\ncorners_m = [[-90.0, 110.0], [90.0, 110.0], [90.0, 290.0], [-90.0, 290.0]]",
        "kind = \"keep-out\"\ncorners_m = [[-90.0, 110.0], [90.0, 110.0], [90.0, 590.0], [-90.0, 590.0]]",
        "m.toml:5:11: objective `deliver` lies in keep-out area `A`, which always applies",
    );
    check(
        "[[-90.0, 110.0], [90.0, 110.0]",
        "[[-90.0, 4.0], [90.0, 4.0]",
        "m.toml:12:13: the take-off point lies 4.0 m from the border of area `A`, expected at least 10 m",
    );
    check(
        "east_m = 500.0",
        "east_m = 299.0",
        "m.toml:5:11: objective `deliver` lies 9.0 m from the border of area `A`, expected at least 10 m",
    );
    // Not the place itself lies in it.
    check(
        "kind = \"permission\"\ncorners_m = [[-90.0, 110.0], [90.0, 110.0]",
        "kind = \"keep-out\"\nfloor_m = 9.0\ncorners_m = [[-90.0, -20.0], [90.0, -20.0]",
        "m.toml:13:13: the take-off point lies in keep-out area `A`, which always applies; the area begins 9.0 m above the \
         place, and a takeoff or a landing there flies up to 10 m",
    );
}

#[test]
fn a_place_to_land_at_is_judged_as_those_of_a_mission() {
    #[track_caller]
    fn check(kind: AreaKind, until_utc_ms: Option<i64>, site: Ned, expected: Option<&str>) {
        let mut area = read(GOOD).unwrap().areas.remove(0);
        (area.kind, area.from_utc_ms, area.until_utc_ms) = (kind, None, until_utc_ms);
        assert_eq!(unfit_landing_site(site, [&area]).as_deref(), expected, "{site:?}");
    }
    let at = |east_m| Ned::new(0.0, east_m, 0.0);
    let near = Some("lies 9.0 m from the border of area `A`, expected at least 10 m");
    check(AreaKind::KeepOut, None, at(90.0), None);
    check(AreaKind::KeepOut, None, at(101.0), near);
    check(AreaKind::Permission, None, at(101.0), near);
    check(AreaKind::KeepOut, None, at(200.0), Some("lies in keep-out area `A`, which always applies"));
    check(AreaKind::KeepOut, Some(1), at(200.0), Some("lies in keep-out area `A`, which applies then"));
    check(AreaKind::Permission, None, at(200.0), None);
}

#[test]
fn a_place_inside_a_permission_area_or_below_one_is_no_mistake() {
    #[track_caller]
    fn check(find: &str, replace: &str) {
        assert!(GOOD.contains(find), "the test's own text lacks `{find}`");
        let read = read(&GOOD.replacen(find, replace, 1));
        assert!(read.is_ok(), "{}", read.unwrap_err());
    }
    check("east_m = 500.0", "east_m = 200.0");
    check("[90.0, 110.0]", "[90.0, -20.0]");
    check("east_m = 500.0", "east_m = 301.0");
    // The planner knows whether it applies.
    check("[[-90.0, 110.0], [90.0, 110.0]", "[[-90.0, 4.0], [90.0, 4.0]");
    check("corners_m = [[-90.0, 110.0], [90.0, 110.0]", "floor_m = 20.0\ncorners_m = [[-90.0, 4.0], [90.0, 4.0]");
    // It is brought down by a response.
    check("height_m = 0.0\nflying = false", "height_m = 10.0\nflying = true");
}

#[test]
fn a_place_that_wind_brings_too_near_to_a_border_is_told() {
    #[track_caller]
    fn check(east_m: &str, wind_m_s: f64, expected: &[&str]) {
        let text = GOOD.replacen("east_m = 500.0", &format!("east_m = {east_m}"), 1);
        assert_eq!(read(&text).unwrap().too_near_in_wind(wind_m_s), expected);
    }
    check("500.0", 8.0, &[]);
    check("309.0", 8.0, &[]);
    check(
        "307.0",
        8.0,
        &[
            "objective `deliver` lies 17.0 m from the border of area `A`: less than the 18 m that a wind of 8 m/s asks for",
        ],
    );
    check("307.0", 6.0, &[]);
    // Inside of the area there is nothing that it must not enter.
    check("285.0", 8.0, &[]);
}

#[test]
fn of_many_places_that_wind_brings_too_near_the_first_are_told() {
    let objective = |number| {
        format!("[[objective]]\nname = \"o{number}\"\nnorth_m = 0\neast_m = 307\nheight_m = 0\nflying = false\n")
    };
    let with = |count| read(&format!("{GOOD}{}", (0..count).map(objective).collect::<String>())).unwrap();
    assert_eq!(with(20).too_near_in_wind(8.0).len(), 20);
    let told = with(21).too_near_in_wind(8.0);
    assert_eq!((told.len(), told[20].as_str()), (21, "more places lie as near to a border"));
}

/// Objectives with the longest names, each with these further lines.
fn many_objectives(count: usize, lines: &str) -> String {
    let objective = |number| {
        format!(
            "[[objective]]\nname = \"{number:0>100}\"\nnorth_m = 0\neast_m = 500\nheight_m = 20\nflying = true\n{lines}\n"
        )
    };
    (0..count).map(objective).collect()
}

#[test]
fn whatever_is_wrong_with_a_mission_as_large_as_a_request_little_is_told_of_it() {
    /// Reads a mission with this after its name.
    #[track_caller]
    fn check(text: &str) {
        let mistakes = read(&format!("name = \"m\"\n{text}")).unwrap_err();
        assert!((1..=MOST_MISTAKES).contains(&mistakes.0.len()), "{} mistakes", mistakes.0.len());
        let told = mistakes.to_string();
        assert!(told.len() < 100_000, "{} bytes: {told:.300}", told.len());
    }
    let long = "x".repeat(30_000);
    let area = |lines: &str| {
        format!("[[area]]\nname = \"A\"\nkind = \"keep-out\"\ncorners_m = [[-9, -9], [9, -9], [9, 9]]\n{lines}\n")
    };
    // Names that nothing has: very many of one objective, as many as there are of each, and a long one.
    let very_many = format!("after = [{}]", "\"\",".repeat(12_000));
    check(&format!("{}{}", many_objectives(200, ""), many_objectives(1, &very_many)));
    check(&many_objectives(100, &format!("after = [{}]", "\"\",".repeat(100))));
    check(&many_objectives(100, &format!("after = [{}]", format!("\"{}\",", "y".repeat(97)).repeat(5))));
    check(&many_objectives(15, &format!("after = [\"{long}\", \"{long}\"]")));
    // Long values, where a text is expected and where none is.
    check(&many_objectives(30, &format!("reach_by_utc = \"{long}\"")));
    check(&many_objectives(3, &format!("worth = \"{long}\"")));
    check(&many_objectives(1, &format!("{long} = 1")));
    check(&many_objectives(1, &format!("flying = [{}", "[".repeat(30_000))));
    check(&many_objectives(1, &"= = =\n".repeat(10_000)));
    check(&format!("{}{}", many_objectives(1, ""), area(&format!("hours_utc = [\"{long}\"]"))));
    check(&format!("{}{}", many_objectives(1, ""), area("").replace("keep-out", &long)));
    check(&format!("{}{}", many_objectives(1, ""), area("").replace("\"A\"", &format!("\"{long}\""))));
    check(&format!("order = \"{long}\"\n{}", many_objectives(1, "")));
    // Mistakes of every objective, area and site, and of every pair of them.
    check(&many_objectives(500, "").replace("north_m = 0\n", ""));
    check(&many_objectives(500, "dwell_s = -1\nworth = 1\ndrop = true").replace("height_m = 20", "height_m = 900"));
    check(&many_objectives(1, &area("").repeat(600)));
    let areas: String = (0..600).map(|number| area("").replace("\"A\"", &format!("\"{number}\""))).collect();
    check(&format!("{}{areas}", many_objectives(300, "").replace("east_m = 500", "east_m = 10")));
    let site = "[[site]]\nname = \"s\"\nkind = \"landing\"\n";
    check(&format!("{}{}", many_objectives(1, ""), site.repeat(1_000)));
    check(&format!("{}{}", many_objectives(1, ""), site.repeat(32)));
    // Corners by the thousand, all of them wrong.
    let corners = "[999, 999],".repeat(5_000);
    check(&format!("volume = {{ corners_deg = [{corners}] }}\n{}", many_objectives(1, "")));
    check(&format!("volume = {{ corners_m = [{corners}] }}\n{}", many_objectives(1, "")));
    let survey = format!("survey = {{ corners_m = [{corners}], spacing_m = 30 }}");
    check(&many_objectives(1, &survey).replace("north_m = 0\neast_m = 500\n", ""));
}

#[test]
fn an_area_has_holes_in_metres_or_in_degrees() {
    let with = |holes: &str| GOOD.replacen("from_utc", &format!("{holes}\nfrom_utc"), 1);
    let metres = with("holes_m = [[[-50, 150], [50, 150], [50, 200]], [[-50, 250], [50, 250], [0, 280]]]");
    let mission = read(&metres).unwrap_or_else(|it| panic!("{it}"));
    let area = &mission.areas[0];
    let inside =
        [(0.0, 120.0), (0.0, 170.0), (0.0, 260.0)].map(|(north, east)| area.contains(Ned::new(north, east, 0.0)));
    assert_eq!((area.holes.len(), inside), (2, [true, false, false]));
    assert_ne!(mission.identity(), read(GOOD).unwrap().identity());
    let origin = "[origin]\nlatitude_deg = 54.0\nlongitude_deg = 6.6\n[[objective]]";
    let degrees = with("holes_deg = [[[53.9996, 6.602], [54.0004, 6.602], [54.0004, 6.603]]]");
    let mission = read(&degrees.replacen("[[objective]]", origin, 1)).unwrap_or_else(|it| panic!("{it}"));
    assert!(mission.areas[0].holes[0][0].distance_m(Ned::new(-44.5, 131.1, 0.0)) < 1.0, "{:?}", mission.areas);
}

#[test]
fn every_mistake_about_a_hole_is_reported_with_its_place() {
    #[track_caller]
    fn check(holes: &str, expected: &str) {
        check_mistake(GOOD, "from_utc", &format!("{holes}\nfrom_utc"), read, expected);
    }
    let good = "[[-50, 150], [50, 150], [50, 200]]";
    check(
        &format!("holes_m = [{good}, [[-50, 350], [50, 350], [50, 400]]]"),
        "m.toml:13:48: area `A` has a hole that is not inside its outline, hole 2",
    );
    check(
        &format!("holes_m = [{good}, [[-50, 160], [50, 160], [50, 180]]]"),
        "m.toml:13:48: area `A` has holes that overlap or touch, holes 1 and 2",
    );
    check("holes_m = [[[-50, 150], [50, 150]]]", "m.toml:13:12: area `A` has a hole that crosses itself or has fewer");
    check("holes_m = [[]]", "m.toml:13:12: area `A` has a hole that crosses itself or has fewer");
    check("holes_m = [[[-50, 150], [50, 150], [3e6, 0]]]", "m.toml:13:12: area `A` has a corner out of range");
    check(&format!("holes_m = [{good}]\nholes_deg = [{good}]"), "m.toml:10:8: area `A` has its holes twice");
    check(&format!("holes_deg = [{good}]"), "m.toml:13:14: a place in degrees in a mission whose origin");
    check("holes_deg = [[[154, 6]]]", "m.toml:13:14: latitude 154, longitude 6");
    check("holes_m = [[7]]", "m.toml:13:13: invalid type: integer `7`, expected");
    let many = format!("holes_m = [[{}[50, 200]]]", "[-50, 150],".repeat(4_000));
    check(&many, "m.toml:10:8: area `A` has 4005 corners, at most 4000 are allowed");
}

#[test]
fn an_identity_is_that_of_the_content() {
    let mission = read(GOOD).unwrap();
    assert_eq!(mission.identity(), "f2e4b90e170ad2eabcdd96fc13d89c3a");
    assert_eq!(read(&format!("# a comment\n{GOOD}")).unwrap().identity(), mission.identity());
    for (found, replaced) in
        [("500.0", "500.1"), ("\"there\"", "\"here\""), ("permission", "keep-out"), ("290.0", "291.0")]
    {
        let other = read(&GOOD.replacen(found, replaced, 1)).unwrap();
        assert_ne!(other.identity(), mission.identity(), "{found}");
    }
}

#[test]
fn two_objectives_with_one_name_are_refused() {
    let twice =
        format!("{GOOD}[[objective]]\nname = \"deliver\"\nnorth_m = 0\neast_m = 0\nheight_m = 0\nflying = false\n");
    let error = read(&twice).unwrap_err().to_string();
    assert!(error.starts_with("m.toml:15:8: two objectives with the name `deliver`"), "{error}");
}

#[test]
fn an_area_that_may_not_be_landed_in_is_barred_near_the_ground_and_has_no_height_of_its_own() {
    let text = GOOD.replacen("\"permission\"", "\"no-landing\"", 1);
    let area = &read(&text).unwrap().areas[0];
    assert_eq!((area.kind, area.floor_m, area.ceiling_m), (AreaKind::KeepOut, None, Some(3.0)));
    let error = read(&text.replacen("\"no-landing\"", "\"no-landing\"\nceiling_m = 9.0", 1)).unwrap_err().to_string();
    assert!(error.contains("may not be landed in, and has a height"), "{error}");
}

#[test]
fn the_ground_of_an_area_that_may_not_be_landed_in_is_people_unless_the_file_says_water() {
    let with = |kind: &str| read(&GOOD.replacen("\"permission\"", kind, 1));
    let check = |kind: &str, expected: Ground| assert_eq!(with(kind).unwrap().areas[0].ground, expected, "{kind}");
    check("\"permission\"", Ground::Nobody);
    check("\"no-landing\"", Ground::People);
    check("\"no-landing\"\nground = \"people\"", Ground::People);
    check("\"no-landing\"\nground = \"water\"", Ground::Water);
    for kind in ["\"no-landing\"\nground = \"nobody\"", "\"keep-out\"\nground = \"people\""] {
        let error = with(kind).unwrap_err().to_string();
        assert!(error.contains("has a kind of ground that bars no landing"), "{error}");
    }
    let error = with("\"no-landing\"\nground = \"lava\"").unwrap_err().to_string();
    assert!(error.contains("unknown variant `lava`, expected one of `nobody`, `water`, `people`"), "{error}");
}

#[test]
fn a_file_of_another_program_is_answered_by_the_command_that_imports_it() {
    #[track_caller]
    fn check(text: &str, expected: &str) {
        let told = Mission::read(&Source { path: "berths.plan".into(), text: text.into() }).unwrap_err().to_string();
        let help = "import it first: kittiwake mission import \"berths.plan\" --out \"berths.toml\"";
        assert_eq!(told, format!("berths.plan: this is {expected}, not a mission file\n  help: {help}"));
    }
    check("\u{feff}\n{ \"fileType\": \"Plan\" }", "a plan of QGroundControl");
    check("{\"type\": \"FeatureCollection\"}", "JSON");
    check("<?xml version=\"1.0\"?><kml/>", "XML");
    check("QGC WPL 110\n", "a mission of QGC WPL");
}
