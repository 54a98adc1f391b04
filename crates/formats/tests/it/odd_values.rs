//! One zone in both standards with odd values: its area, or why it is refused.

use super::golden::{in_words, loud, over_ground};
use super::{import, mission};

const PERIOD: &str = r#""startDateTime": "2027-05-01T00:00:00Z", "endDateTime": "2027-06-01T00:00:00Z""#;
const RING: &str = "[[6.61, 54.01], [6.62, 54.01], [6.62, 54.02], [6.61, 54.02], [6.61, 54.01]]";

/// The zone in ED-269 and in ED-318. The limits have the names of the latter.
fn texts(limits: &str, ring: &str, period: &str) -> [String; 2] {
    let in_ed_269 = [
        ("lowerReference", "lowerVerticalReference"),
        ("upperReference", "upperVerticalReference"),
        ("\"lower\"", "\"lowerLimit\""),
        ("\"upper\"", "\"upperLimit\""),
        ("uom", "uomDimensions"),
    ];
    let volume = in_ed_269.iter().fold(limits.to_owned(), |text, (of_318, of_269)| text.replace(of_318, of_269));
    [
        format!(
            r#"{{"features": [{{"identifier": "Z", "country": "XXX", "type": "COMMON", "restriction": "PROHIBITED",
                "applicability": [{{{period}}}], "geometry": [{{{volume},
                "horizontalProjection": {{"type": "Polygon", "coordinates": [{ring}]}}}}]}}]}}"#
        ),
        format!(
            r#"{{"type": "FeatureCollection", "features": [{{"type": "Feature", "properties": {{"identifier": "Z", "country": "XXX",
                "type": "PROHIBITED", "variant": "COMMON", "limitedApplicability": [{{{period}}}]}},
                "geometry": {{"type": "Polygon", "coordinates": [{ring}], "layer": {{{limits}}}}}}}]}}"#
        ),
    ]
}

/// In both standards: the area without its name and kind, and what is not understood.
#[track_caller]
fn check_text(texts: [String; 2], expected: &str, doubt: &str) {
    for text in texts {
        let read = import("z.json", &text, &over_ground()).unwrap_or_else(|it| panic!("{it}\n{text}"));
        let words: Vec<String> = mission(&read).areas.iter().map(in_words).collect();
        let words = words.iter().map(|it| it.replacen("Z | keep-out | ", "", 1)).collect::<Vec<_>>().join("; ");
        let said = loud(&read).join("; ");
        assert_eq!(words, expected, "{text}");
        assert!(said.contains(doubt) && said.is_empty() == doubt.is_empty(), "{said}\n{text}");
    }
}

#[test]
fn heights() {
    #[track_caller]
    fn check(limits: &str, expected: &str, doubt: &str) {
        let always = r#""permanent": "YES""#;
        let texts = texts(limits, RING, always);
        let texts = texts.map(|it| it.replace(&format!(r#", "limitedApplicability": [{{{always}}}]"#), ""));
        check_text(texts, &format!("{expected} | always"), doubt);
    }
    let limits = |lower: &str, upper: &str, uom: &str| {
        format!(r#""lower": {lower}, "lowerReference": "AGL", "upper": {upper}, "upperReference": "AGL", "uom": {uom}"#)
    };
    check(&limits("0", "120", "\"M\""), "ground to 130", "");
    check(&limits("\"0\"", "\"120\"", "\"m\""), "ground to 130", "");
    check(&limits("100", "400", "\"FT\""), "20.48 to 131.92", "");
    check(&limits("-10", "120", "\"M\""), "ground to 130", "");
    check(&limits("120", "120", "\"M\""), "ground to unlimited", "is not above the lower limit");
    check(&limits("200", "120", "\"M\""), "ground to unlimited", "is not above the lower limit");
    check(&limits("50", "null", "\"M\""), "40 to unlimited", "");
    check(&limits("null", "120", "\"M\""), "ground to 130", "");
    check(&limits("\"\"", "\"\"", "\"M\""), "ground to unlimited", "");
    check(&limits("\"GND\"", "\"UNL\"", "\"M\""), "ground to unlimited", "");
    check(&limits("50", "99999", "\"M\""), "40 to unlimited", "");
    // Metres or feet: of a number without its unit nothing is known.
    check(&limits("0", "120", "null"), "ground to unlimited", "its unit is missing");
    check(&limits("50", "120", "\"yards\""), "ground to unlimited", "found `yards`");
    check(&limits("true", "{}", "\"M\""), "ground to unlimited", "expected a number");
    // FL 10 is 304.8 m: less 10 % and 600 m, and less 60 m, for a floor.
    check(
        r#""lower": 10, "lowerReference": "STD", "upper": 1000, "upperReference": "AMSL", "uom": "FL""#,
        "-385.68 to unlimited",
        "",
    );
    // One limit that is not understood leaves the other.
    check(
        r#""lower": 0, "lowerReference": "AGL", "upper": 120, "upperReference": "QNH", "uom": "M""#,
        "ground to unlimited",
        "found `QNH`",
    );
    check(
        r#""lower": 80, "lowerReference": "QNH", "upper": 120, "upperReference": "AMSL", "uom": "M""#,
        "ground to 60",
        "found `QNH`",
    );
}

#[test]
fn dates() {
    #[track_caller]
    fn check(find: &str, replace: &str, expected: &str, doubt: &str) {
        assert!(PERIOD.contains(find), "{find}");
        let limits = r#""lower": 0, "lowerReference": "AGL", "upper": 120, "upperReference": "AGL", "uom": "M""#;
        let texts = texts(limits, RING, &PERIOD.replacen(find, replace, 1));
        check_text(texts, &format!("ground to 130 | {expected}"), doubt);
    }
    let (from, until) = ("2027-05-01T00:00:00Z", "2027-06-01T00:00:00Z");
    check(from, from, &format!("{from} to {until}"), "");
    check(from, "2027-05-01T00:00Z", &format!("{from} to {until}"), "");
    check(from, "2027-05-01 00:00:00Z", &format!("{from} to {until}"), "");
    check(from, "2027-05-01T02:00:00+02:00", &format!("{from} to {until}"), "");
    // Anywhere on Earth: from UTC+14 to UTC-12.
    check(from, "2027-05-01T00:00:00", &format!("2027-04-30T10:00:00Z to {until}"), "");
    check(from, "2027-05-01", &format!("2027-04-30T10:00:00Z to {until}"), "");
    check(until, "2027-05-31", &format!("{from} to {until}").replace("06-01T00", "06-01T12"), "");
    // Long ago, and never.
    for long_ago in ["1900-01-01T00:00:00Z", "1900-01-01", "0001-01-01T00:00:00Z"] {
        check(from, long_ago, &format!("until {until}"), "");
    }
    for never in ["9999-12-31T23:59:59Z", "9999-12-31", "9999-12-31T23:59:59-05:00"] {
        check(until, never, &format!("from {from}"), "");
    }
    check(&format!("\"{from}\""), "null", &format!("until {until}"), "");
    // Midnight, and a leap second.
    check(until, "2027-05-31T24:00:00Z", &format!("{from} to {until}"), "");
    check(until, "2027-05-31T24:00Z", &format!("{from} to {until}"), "");
    check(until, "2027-06-30T23:59:60Z", &format!("{from} to 2027-06-30T23:59:59.999000000Z"), "");
    // Nobody knows whether it is over.
    check(until, "1900-01-01T00:00:00Z", "always", "expected a date after 1970");
    check(until, from, "always", "the period ends before it begins");
    check(until, "2027-02-30T00:00:00Z", "always", "expected a date and time");
    check(until, "31.05.2027", "always", "expected a date and time");
    check(&format!("\"{until}\""), "12", "always", "found 12, expected a text");
    // Milliseconds, as services of maps give them.
    check(&format!("\"{until}\""), "1811808000000", &format!("{from} to {until}"), "");
}

#[test]
fn rings() {
    let limits = r#""lower": 0, "lowerReference": "AGL", "upper": 120, "upperReference": "AGL", "uom": "M""#;
    let good = "ground to 130 | 2027-05-01T00:00:00Z to 2027-06-01T00:00:00Z";
    let check = |ring: &str, doubt: &str| check_text(texts(limits, ring, PERIOD), good, doubt);
    check(RING, "");
    check(&RING.replace(", [6.61, 54.01]]", "]"), "");
    check("[[6.61, 54.01], [6.61, 54.02], [6.62, 54.02], [6.62, 54.01], [6.61, 54.01]]", "");
    check(&RING.replace("54.01]", "54.01, 20.5]"), "");
    check(&RING.replace("54.01]", "54.01, 20.5, 0]"), "");
    check("[[6.61, 54.01], [6.62, 54.02], [6.62, 54.01], [6.61, 54.02], [6.61, 54.01]]", "crosses or touches itself");
    #[track_caller]
    fn refused(ring: &str, expected: &str) {
        let limits = r#""lower": 0, "lowerReference": "AGL", "upper": 120, "upperReference": "AGL", "uom": "M""#;
        for text in texts(limits, ring, PERIOD) {
            let told =
                import("z.json", &text, &over_ground()).map(|_| "read".to_owned()).unwrap_or_else(|it| it.to_string());
            assert!(told.contains(expected), "{told}\n{text}");
        }
    }
    let exchanged = "[[54.01, 6.61], [54.01, 6.62], [54.02, 6.62], [54.02, 6.61], [54.01, 6.61]]";
    refused(exchanged, "if its latitudes and longitudes are exchanged");
    refused(&format!("[{RING}]"), "expected a place, two numbers");
    refused("[]", "a ring of 0 different corners");
    refused(&RING.replace("6.62", "\"6.62\""), "expected a place, two numbers");
    refused(&RING.replace("6.62", "null"), "expected a place, two numbers");
}

#[test]
fn documents() {
    let limits = r#""lower": 0, "lowerReference": "AGL", "upper": 120, "upperReference": "AGL", "uom": "M""#;
    let [in_ed_269, in_ed_318] = texts(limits, RING, PERIOD);
    let zone = in_ed_269.strip_prefix("{\"features\": [").and_then(|it| it.strip_suffix("]}")).unwrap().to_owned();
    let good = "ground to 130 | 2027-05-01T00:00:00Z to 2027-06-01T00:00:00Z";
    let check = |text: &str, expected: &str| check_text([text.to_owned(), text.to_owned()], expected, "");
    check(&in_ed_269, good);
    check(&format!("\u{feff}  {in_ed_318}"), good);
    // Norway publishes a list without anything round it.
    check(&format!("[{zone}]"), good);
    check(&format!(r#"{{"UASZoneList": [{zone}], "features": []}}"#), good);
    check(&format!("[{zone}, {zone}]"), &format!("{good}; Z 2 | keep-out | {good}"));
    #[track_caller]
    fn refused(text: &str, expected: &str) {
        let told =
            import("z.json", text, &over_ground()).map(|_| "read".to_owned()).unwrap_or_else(|it| it.to_string());
        assert!(told.contains(expected), "{told}\n{text}");
    }
    refused(&format!("[{zone}"), "EOF while parsing");
    refused("[null]", "/0: found nothing, expected an object");
    refused("[7]", "/0: found 7, expected an object");
    refused("[]", "this JSON is in none of the formats that are read");
    refused(&format!(r#"{{"features": {{"features": [{zone}]}}}}"#), "this JSON is in none of the formats");
    refused(&format!(r#"{{"features": [[{zone}]]}}"#), "/features/0: found a list, expected an object");
    refused(&format!(r#"{{"features": [{in_ed_318}]}}"#), "/features/0: `geometry` is missing");
    refused(&in_ed_318.replace("\"geometry\"", "\"Geometry\""), "/features/0: `geometry` is missing");
    refused(&in_ed_269.replace("\"horizontalProjection\"", "\"projection\""), "`type` is missing");
}
