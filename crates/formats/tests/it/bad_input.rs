//! What cannot be read safely is reported with its place, and nothing is written.

use std::collections::BTreeSet;

use super::plans::{JUMP, WPL};
use super::samples::{ED_269, ED_318, GEO_JSON, KML, PLAN};
use super::{check_mistake, import, mission, notes, settings};
use formats::assemble::{Settings, assemble};
use proptest::prelude::*;

#[test]
fn a_wrong_zone_of_ed_269_is_reported_with_its_place() {
    #[track_caller]
    fn check(find: &str, replace: &str, expected: &str) {
        check_mistake("z.json", ED_269, find, replace, &format!("z.json: {expected}"));
    }
    let square = "[[6.606, 54.004], [6.609, 54.004], [6.609, 54.006], [6.606, 54.006], [6.606, 54.004]]";
    let at = "/UASZoneList/1/geometry/0/horizontalProjection/coordinates/0";
    // The shape.
    check(
        square,
        "[[6.606, 54.004], [6.609, 54.006], [6.609, 54.004], [6.606, 54.006], [6.606, 54.004]]",
        "/UASZoneList/1/geometry/0: the ring crosses or touches itself",
    );
    check(
        square,
        "[[6.606, 54.004], [6.609, 54.004], [6.606, 54.004]]",
        &format!("{at}: a ring of 2 different corners"),
    );
    check(
        square,
        "[[6.606, 54.004], [6.607, 54.004], [6.609, 54.004], [6.606, 54.004]]",
        "/UASZoneList/1/geometry/0: a ring that encloses 0.1 square metres",
    );
    check(
        square,
        "[[6.606, 154.004], [6.609, 54.004]]",
        &format!("{at}/0: latitude 154.004, longitude 6.606: expected"),
    );
    check(square, "[[6.606], [6.609, 54.004]]", &format!("{at}/0: expected a place, two numbers"));
    check(square, "7", &format!("{at}: expected a list of places"));
    check(
        "\"radius\": 100",
        "\"radius\": -1",
        "/UASZoneList/0/geometry/0/horizontalProjection/radius: a circle with a radius of -1 m",
    );
    check(
        "\"center\": [6.604, 54.001]",
        "\"center\": [54.001, 6.604]",
        "/UASZoneList/0/geometry/0: it lies near the take-off point if its latitudes and longitudes are exchanged",
    );
    // Heights and times.
    check(
        "\"lowerLimit\": 100",
        "\"lowerLimit\": 1000",
        "/UASZoneList/1/geometry/0: the upper limit 304.8 m is not above the lower limit 304.8 m",
    );
    check(
        "\"upperLimit\": 150, \"upperVerticalReference\": \"AMSL\"",
        "\"upperLimit\": 150",
        "/UASZoneList/0/geometry/0/upperLimit: its reference is missing",
    );
    check(
        "\"AMSL\"",
        "\"FL\"",
        "/UASZoneList/0/geometry/0/upperVerticalReference: found `FL`, expected AGL, GND, SFC, AMSL, MSL, ALT, WGS84",
    );
    check("2026-10-31", "2025-10-31", "/UASZoneList/1/applicability/0: the period ends before it begins");
    check(
        "2026-10-31T23:59:59Z",
        "soon",
        "/UASZoneList/1/applicability/0/endDateTime: found `soon`, expected a date and time",
    );
    // What a zone must have.
    check(
        "\"PROHIBITED\"",
        "\"CLOSED\"",
        "/UASZoneList/0/restriction: found `CLOSED`, expected PROHIBITED, REQ_AUTHORISATION",
    );
    check(
        "\"uomDimensions\": \"M\"",
        "\"uomDimensions\": \"YD\"",
        "/UASZoneList/0/geometry/0/uomDimensions: found `YD`, expected M, METERS, METRES, FT, FEET",
    );
}

#[test]
fn a_zone_without_restriction_needs_no_geometry() {
    let text = ED_269.replacen("\"NO_RESTRICTION\"", "\"PROHIBITED\"", 1);
    let told = import("z.json", &text, &settings()).unwrap_err().to_string();
    assert!(told.starts_with("z.json: /UASZoneList/3: zone `HBR004` has no geometry"), "{told}");
}

#[test]
fn a_wrong_file_of_another_format_is_reported_with_its_place() {
    #[track_caller]
    fn check(name: &str, good: &str, find: &str, replace: &str, expected: &str) {
        check_mistake(name, good, find, replace, &format!("{name}: {expected}"));
    }
    check(
        "z.json",
        ED_318,
        "\"subType\": \"Circle\"",
        "\"subType\": \"Ellipse\"",
        "/features/0/geometry/geometries/0/extent/subType: found `Ellipse`, expected Circle",
    );
    check(
        "z.json",
        ED_318,
        "\"uom\": \"ft\"",
        "\"uom\": \"yd\"",
        "/features/0/geometry/geometries/1/layer/uom: found `yd`, expected M, METERS, METRES, FT, FEET",
    );
    check(
        "z.json",
        ED_318,
        "\"USPACE\"",
        "\"CLOSED\"",
        "/features/1/properties/type: found `CLOSED`, expected PROHIBITED",
    );
    check(
        "a.geojson",
        GEO_JSON,
        "\"ceiling_m\": 80",
        "\"ceiling_m\": 10",
        "/features/0/geometry/coordinates/0: the upper limit 10 m is not above",
    );
    check(
        "a.geojson",
        GEO_JSON,
        "\"permission\"",
        "\"objective\"",
        "/features/0/geometry: the geometry is MultiPolygon, which does not fit",
    );
    check(
        "a.geojson",
        GEO_JSON,
        "\"permission\"",
        "\"closed\"",
        "/features/0/properties/kind: found `closed`, expected origin, objective",
    );
    check("a.kml", KML, "6.606,54.004,90", "6.606;54.004", "line 13 column 26: found `6.606;54.004`, expected a place");
    check("a.kml", KML, "<kml", "<kml <", "no valid XML: ");
    check("a.kml", KML, "permission", "open", "line 18 column 5: `kind` is `open`, expected keep-out or permission");
    check(
        "q.plan",
        PLAN,
        "\"frame\": 0",
        "\"frame\": 7",
        "/mission/items/3/TransectStyleComplexItem/Items/0: frame 7, expected 0",
    );
    check(
        "q.plan",
        PLAN,
        "\"frame\": 0",
        "\"frame\": 10",
        "/mission/items/3/TransectStyleComplexItem/Items/0: its height is above the ground, which is not known there",
    );
    check("q.plan", PLAN, "\"radius\": 200", "\"radius\": null", "/geoFence/circles/0/circle: `radius` is missing");
    check("q.plan", PLAN, "54.002, 6.6, 40", "94.002, 6.6, 40", "/mission/items/1: latitude 94.002");
    check(
        "q.plan",
        PLAN,
        "[[53.99, 6.58], [54.01, 6.58]",
        "[[53.99, 6.601], [54.01, 6.601]",
        "/geoFence/polygons/0: the take-off point lies outside of a fence",
    );
    check(
        "q.plan",
        PLAN,
        "54.002, 6.6, 40",
        "54.02, 6.6, 40",
        "/mission/items/1: `waypoint 1` lies outside of a fence to stay inside",
    );
    check(
        "q.plan",
        PLAN,
        "[54.0, 6.598, 25]",
        "[54.0, 96.598, 25]",
        "/rallyPoints/points/0: `rally 1` lies outside of a fence",
    );
    check("q.plan", PLAN, "[54.0, 6.598, 25]", "[94.0, 6.598, 25]", "/rallyPoints/points/0: latitude 94");
    check("q.plan", PLAN, "[54.0, 6.598, 25]", "[54.0]", "/rallyPoints/points/0: expected a place, two numbers");
    check("q.plan", PLAN, "[54.0, 6.598, 25]", "25", "/rallyPoints/points/0: expected a place, two numbers");
    check("q.plan", PLAN, "\"fileType\": \"Plan\"", "\"fileType\": \"Other\"", "this JSON is in none of the formats");
    check("q.plan", PLAN, "\"version\": 1,", "\"version\" 1,", "line 3 column 15: expected `:`");
}

/// The same mistakes in the formats that are not ED-269, and what each repairs.
#[test]
fn shapes_heights_and_times_are_judged_alike_in_all_formats() {
    /// What is said about a GeoJSON area with these rings and properties.
    fn geojson(rings: &str, properties: &str) -> Result<String, String> {
        let text = format!(
            r#"{{"type": "Feature", "properties": {{"kind": "keep-out"{properties}}},
                "geometry": {{"type": "Polygon", "coordinates": {rings}}}}}"#
        );
        import("a.geojson", &text, &Settings { strict: true, ..settings() })
            .map(|it| notes(&it))
            .map_err(|it| it.to_string())
    }
    #[track_caller]
    fn check(found: Result<String, String>, expected: Result<&str, &str>) {
        match (&found, expected) {
            (Ok(said), Ok(part)) => assert!(said.contains(part) && said.is_empty() == part.is_empty(), "{said}"),
            (Err(told), Err(part)) => assert!(told.starts_with(part), "expected `{part}`, got `{told}`"),
            _ => panic!("expected {expected:?}, got {found:?}"),
        }
    }
    const SQUARE: &str = "[[6.606, 54.004], [6.609, 54.004], [6.609, 54.006], [6.606, 54.006], [6.606, 54.004]]";
    const CLOCKWISE: &str = "[[6.606, 54.004], [6.606, 54.006], [6.609, 54.006], [6.609, 54.004], [6.606, 54.004]]";
    check(geojson(&format!("[{SQUARE}]"), ""), Ok(""));
    check(geojson(&format!("[{CLOCKWISE}]"), ""), Ok("the corners run clockwise, against RFC 7946: read all the same"));
    // A hole that is not one is filled, whatever is wrong with it.
    let filled = [
        ("[]", "/1: a hole: filled, the area covers it (a ring of 0 different corners has no area)"),
        ("7", "/1: a hole: filled, the area covers it (expected a list of places)"),
        (
            "[[6.607, 54.0045], [6.608, 54.0058], [6.608, 54.0045], [6.607, 54.0055], [6.607, 54.0045]]",
            ": a hole that crosses or touches a border: filled",
        ),
        ("[[7, 55], [8, 55], [8, 56], [7, 55]]", ": a hole that crosses or touches a border: filled"),
    ];
    for (hole, said) in filled {
        check(geojson(&format!("[{SQUARE}, {hole}]"), ""), Ok(&format!("/geometry/coordinates{said}")));
    }
    // A bow tie, and a ring that comes back along itself.
    let bow_tie = "[[6.606, 54.004], [6.609, 54.006], [6.609, 54.004], [6.606, 54.006], [6.606, 54.004]]";
    let spike =
        "[[6.606, 54.004], [6.609, 54.004], [6.609, 54.006], [6.609, 54.004], [6.606, 54.006], [6.606, 54.004]]";
    for ring in [bow_tie, spike] {
        let told = "a.geojson: /geometry/coordinates: the ring crosses or touches itself";
        check(geojson(&format!("[{ring}]"), ""), Err(told));
    }
    check(geojson("[]", ""), Err("a.geojson: a polygon without rings"));
    check(geojson("[[]]", ""), Err("a.geojson: /geometry/coordinates/0: a ring of 0 different corners has no area"));
    let point = "[[[6.606, 54.004], [6.606, 54.004], [6.606, 54.004], [6.606, 54.004]]]";
    check(geojson(point, ""), Err("a.geojson: /geometry/coordinates/0: a ring of 1 different corners has no area"));
    let square = format!("[{SQUARE}]");
    let window = r#", "from_utc": "2026-05-01T08:00:00Z", "until_utc": "2026-05-01T08:00:00Z""#;
    check(geojson(&square, window), Err("a.geojson: /properties: the period ends before it begins"));
    check(
        geojson(&square, r#", "hours_utc": ["Mon 08:00-09:00", "Mon"]"#),
        Err("a.geojson: /properties/hours_utc/1: found `Mon`, expected days and hours"),
    );
    check(geojson(&square, r#", "hours_utc": 8"#), Err("a.geojson: /properties/hours_utc: found 8, expected a list"));
    check(geojson(&square, r#", "hours": []"#), Ok("/properties/hours: a field that is not in the format: not read"));
    check_mistake(
        "a.kml",
        KML,
        "</begin>",
        "</begin><end>2020-01-01T00:00:00Z</end>",
        "a.kml: line 7 column 7: the period ends before it begins",
    );
}

#[test]
fn a_fence_to_stay_inside_that_reaches_too_far_is_cut_off() {
    let text = PLAN.replacen("[[53.99, 6.58], [54.01, 6.58]", "[[53.99, 2.58], [54.01, 2.58]", 1);
    let assembled = import("q.plan", &text, &settings()).unwrap();
    let told = format!("{:?}", assembled.notes);
    assert!(told.contains("it is cut off 140 km from the take-off point"), "{told}");
    domain::mission::Mission::read(&super::source("m.toml", &assembled.text)).unwrap();
}

#[test]
fn a_take_off_point_that_is_not_known_is_asked_for() {
    let told = import("z.json", ED_269, &Settings { origin: None, ..settings() }).unwrap_err().to_string();
    assert!(told.starts_with("z.json: the take-off point is not known\n  help: give it with --origin"), "{told}");
}

#[test]
fn a_byte_order_mark_is_read_over() {
    assert!(import("z.json", &format!("\u{feff}{ED_269}"), &settings()).is_ok());
}

/// Files that are made to exhaust a reader.
#[test]
fn hostile_files_are_refused() {
    #[track_caller]
    fn check(text: &str, expected: &str) {
        let told = import("f", text, &settings()).unwrap_err().to_string();
        assert!(told.contains(expected) && told.len() < 10_000, "{told:.300}");
    }
    let nested = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    check(&format!("{{\"features\": [{nested}]}}"), "/features/0: recursion limit exceeded");
    check(&format!("{{\"features\": [[{}0]]}}", "{},".repeat(300_000)), "/features/0: has more than 200000 objects");
    check(
        &format!("{{\"a\": [{}0]}}", "0,".repeat(5_000_000)),
        "/a: has more than 200000 objects or 4000000 list items",
    );
    check(&format!("{{\"features\": [{}0]}}", "0,".repeat(1_000_001)), "/features: more than 1000000 items");
    check(&"[".repeat(100_000), "EOF while parsing a list");
    check(&nested, "/0: recursion limit exceeded");
    check("{\"features\": [], \"features\": []}", "/features is there twice");
    check("<!DOCTYPE a [<!ENTITY b \"bb\">]><a>&b;</a>", "a document type definition");
    check("", "the file is empty");
    check("null", "none of the formats");
    check("PK\u{3}\u{4}", "none of the formats");
    // As many mistakes as zones, and one word for all beyond a hundred.
    check(&format!("{{\"UASZoneList\": [{}0]}}", "0,".repeat(100_000)), "/UASZoneList/99: found 0, expected an object");
}

/// The parser would be busy for minutes.
#[test]
fn xml_with_too_many_names_is_refused() {
    let numbers = || 0..3_000;
    let attributes: String = numbers().map(|it| format!(" a{it}='>'")).collect();
    let nested: String = numbers().map(|it| format!("<a xmlns:p{it} = '{it}'>")).collect();
    for text in [format!("<kml{attributes}/>"), format!("<kml>{nested}")] {
        let told = import("f", &text, &settings()).unwrap_err().to_string();
        assert!(told.contains("more than 200 attributes, or the file more than 200 prefixes"), "{told}");
    }
    // Not in comments and texts, and a prefix may be declared by each element.
    let others = format!("<?a {attributes}?><!-- {attributes} {nested} -->");
    let each = "<b xmlns:gx='x' xmlns='y'/>".repeat(1_000);
    let text = format!("{others}<kml><![CDATA[{attributes}{nested}]]>{each}</kml>");
    assert!(import("f", &text, &settings()).is_ok());
}

#[test]
fn nested_elements_are_read_without_recursion() {
    let text = format!("<kml>{}{}</kml>", "<a>".repeat(100_000), "</a>".repeat(100_000));
    let _ = import("f.kml", &text, &settings());
}

#[test]
fn what_is_said_fits_a_terminal() {
    let text = ED_269.replacen("colour", "\\u001b[2J\\u0007\\n", 1).replacen("Ferry terminal", "a\\nb = 3\\u001b", 1);
    let read = import("z.json", &text, &settings()).unwrap();
    assert!(notes(&read).chars().all(|it| it == '\n' || !it.is_control()), "{}", notes(&read));
    assert!(read.text.contains("# Name: a b = 3\n"), "{}", read.text);
}

/// Every sample with some bytes replaced, removed or repeated.
fn broken() -> impl Strategy<Value = String> {
    let samples = [PLAN, JUMP, WPL, ED_269, ED_318, GEO_JSON, KML];
    let change = (any::<prop::sample::Index>(), 0_usize..30, "[\\-0-9a-z\"{}\\[\\],:<>/ e.]{0,12}");
    (0..samples.len(), prop::collection::vec(change, 1..6)).prop_map(move |(sample, changes)| {
        let mut text: Vec<char> = samples[sample].chars().collect();
        for (index, length, replacement) in changes {
            if text.is_empty() {
                break;
            }
            let at = index.index(text.len());
            let end = (at + length).min(text.len());
            text.splice(at..end, replacement.chars());
        }
        text.into_iter().collect()
    })
}

/// `PROPTEST_CASES=2000000 cargo test -p formats broken` looks for about an hour.
fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|it| it.parse().ok()).unwrap_or(2_000)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever stands in a file: it is refused, or becomes a mission whose areas are sound.
    #[test]
    fn broken_files_become_mistakes_or_missions(text in broken()) {
        if let Ok(assembled) = import("f", &text, &settings()) {
            let mission = domain::mission::Mission::read(&super::source("m.toml", &assembled.text));
            if let Err(mistakes) = mission {
                // What only the reader of missions knows: places too high, too near to a border, or none at all.
                let known = ["too high", "expected at most", "lies", "without objectives", "inside the ground", "from the origin", "expected metres between"];
                for mistake in &mistakes.0 {
                    prop_assert!(known.iter().any(|it| mistake.message.contains(it)), "{mistake}");
                }
            }
            let names: BTreeSet<_> = assembled.text.lines().filter(|it| it.starts_with("name = ")).collect();
            prop_assert!(!names.is_empty());
        }
    }
}

/// A zone that is not understood bars more, and a file of areas that has none is refused.
#[test]
fn a_mistake_costs_a_zone_and_not_a_country() {
    /// What becomes of the first zone, and what is said.
    #[track_caller]
    fn check(find: &str, replace: &str, expected: &str, said: &str) {
        assert!(ED_269.contains(find), "{find}");
        let read =
            import("z.json", &ED_269.replacen(find, replace, 1), &settings()).unwrap_or_else(|it| panic!("{it}"));
        let area = &mission(&read).areas[0];
        let found =
            format!("{:?} {:?} to {:?}, {} corners", area.kind, area.floor_m, area.ceiling_m, area.corners.len());
        assert_eq!(found, expected);
        assert!(notes(&read).contains(&format!("NOT UNDERSTOOD: {said}")), "{}", notes(&read));
    }
    check("\"PROHIBITED\"", "\"CLOSED\"", "KeepOut None to Some(130.0), 24 corners", "found `CLOSED`");
    check("\"AMSL\"", "\"FL\"", "KeepOut None to None, 24 corners", "found `FL`");
    check("\"upperLimit\": 150", "\"upperLimit\": \"high\"", "KeepOut None to None, 24 corners", "found `high`");
    check(
        "\"type\": \"Circle\", \"center\": [6.604, 54.001], \"radius\": 100",
        "\"type\": \"Polygon\", \"coordinates\": [[[6.606, 54.004], [6.609, 54.006], [6.609, 54.004], [6.606, 54.006], [6.606, 54.004]]]",
        "KeepOut None to Some(130.0), 4 corners",
        "the ring crosses or touches itself: it covers all that its corners enclose",
    );
    // Nobody knows where a zone without a shape is, unless the places that are left lie far away.
    let bad = |place: &str| {
        ED_269.replacen("[6.606, 54.004]", place, 1).replacen("54.004], [6.609, 54.006]", "54.004], 7", 1)
    };
    let told = import("z.json", &bad("[6.606, 54.004]"), &settings()).unwrap_err().to_string();
    assert!(told.contains("coordinates/0/2: expected a place"), "{told}");
    let far =
        ED_269.replacen("[6.606, 54.004], [6.609, 54.004], [6.609, 54.006], [6.606, 54.006]", "[26.606, 54.004], 7", 1);
    let far = far.replacen("[6.606, 54.004]]", "[26.606, 54.004]]", 1).replacen(
        "[6.607, 54.0045], [6.608, 54.0045], [6.608, 54.005], [6.607, 54.0045]",
        "",
        1,
    );
    let read = import("z.json", &far, &settings()).unwrap_or_else(|it| panic!("{it}"));
    assert!(notes(&read).contains("and it lies far away: left out"), "{}", notes(&read));
    // A whole country round the take-off point has all its corners far away.
    let round =
        far.replacen("[26.606, 54.004], 7, [26.606, 54.004]", "[0, 50], [13, 50], [13, 58], 7, [0, 58], [0, 50]", 1);
    assert_ne!(round, far);
    let told = import("z.json", &round, &settings()).unwrap_err().to_string();
    assert!(told.contains("coordinates/0/3: expected a place"), "{told}");
}

#[test]
fn a_file_of_areas_without_any_is_refused() {
    let read = |text: &str| formats::read(&super::source("z.json", text)).unwrap();
    let mission = formats::read(&super::source("q.plan", PLAN)).unwrap();
    let far = ED_269.replace("6.6", "16.6").replace("6.5", "16.5");
    for text in [r#"{"features": []}"#, r#"{"type": "FeatureCollection", "features": []}"#, &far] {
        let told = assemble(&mission, &[read(text)], &settings()).unwrap_err().to_string();
        assert!(told.starts_with("z.json: no area was found in this file ("), "{told}");
        assert!(assemble(&mission, &[read(text)], &Settings { allow_empty: true, ..settings() }).is_ok());
    }
}
