//! Days and times of day at which zones apply: read where they are fixed, and on the safe side where they are not.

use super::{import, mission, notes, settings};

/// A zone of ED-269 with these periods.
fn ed_269(periods: &str) -> String {
    format!(
        r#"{{"UASZoneList": [{{
            "identifier": "Z", "country": "DEU", "type": "COMMON", "restriction": "PROHIBITED",
            "applicability": [{periods}], "zoneAuthority": [],
            "geometry": [{{"uomDimensions": "M", "horizontalProjection":
                {{"type": "Circle", "center": [6.61, 54.0], "radius": 100}}}}]}}]}}"#
    )
}

/// A zone of ED-318 with these periods.
fn ed_318(periods: &str) -> String {
    format!(
        r#"{{"type": "FeatureCollection", "features": [{{"type": "Feature",
            "properties": {{"identifier": "Z", "country": "DEU", "type": "PROHIBITED", "variant": "COMMON",
                "limitedApplicability": [{periods}], "zoneAuthority": []}},
            "geometry": {{"type": "Point", "coordinates": [6.61, 54.0],
                "extent": {{"subType": "Circle", "radius": 100}}}}}}]}}"#
    )
}

/// The hours of the one area, `always` for none, and what was said.
#[track_caller]
fn read(text: &str) -> (String, String) {
    let assembled = import("z.json", text, &settings()).unwrap_or_else(|it| panic!("{it}"));
    let hours = mission(&assembled).areas[0].hours.as_ref().map(|it| it.to_texts().join("; "));
    (hours.unwrap_or_else(|| "always".into()), notes(&assembled))
}

fn scheduled(entries: &str) -> String {
    format!(r#"{{"permanent": "NO", "schedule": [{entries}]}}"#)
}

#[test]
fn fixed_times_become_hours() {
    #[track_caller]
    fn check(entries: &str, expected: &str) {
        for text in [ed_269(&scheduled(entries)), ed_318(&format!(r#"{{"schedule": [{entries}]}}"#))] {
            assert_eq!(read(&text), (expected.to_owned(), String::new()), "{entries}");
        }
    }
    check(r#"{"day": ["MON"], "startTime": "08:00:00.00Z", "endTime": "18:00:00.00Z"}"#, "Mon 08:00-18:00");
    check(
        r#"{"day": ["MON", "TUE", "WED"], "startTime": "08:00:00Z", "endTime": "18:00:00Z"},
           {"day": ["SAT"], "startTime": "22:00:00Z", "endTime": "02:00:00Z"}"#,
        "Mon-Wed 08:00-18:00; Sat 22:00-02:00",
    );
    check(r#"{"day": ["ANY"], "startTime": "06:00:00Z", "endTime": "07:00:00Z"}"#, "Mon-Sun 06:00-07:00");
    check(r#"{"startTime": "06:00:00Z", "endTime": "07:00:00Z"}"#, "Mon-Sun 06:00-07:00");
    // A day without times is a whole one, and a time that is missing is midnight.
    check(r#"{"day": ["SUN"]}"#, "Sun 00:00-24:00");
    check(r#"{"day": ["SUN"], "startTime": "12:00:00Z"}"#, "Sun 12:00-24:00");
    check(r#"{"day": ["SUN"], "startTime": "12:00:00Z", "endTime": "24:00:00Z"}"#, "Sun 12:00-24:00");
    // The whole minutes that contain the time.
    check(r#"{"day": ["SUN"], "startTime": "12:00:59Z", "endTime": "23:59:59Z"}"#, "Sun 12:00-24:00");
    // Local time with its offset: the day begins on the one before.
    check(r#"{"day": ["MON"], "startTime": "01:00:00+02:00", "endTime": "03:00:00+02:00"}"#, "Sun 23:00-01:00");
    check(r#"{"day": "MON", "startTime": "08:00", "endTime": "09:00"}"#, "Mon 08:00-09:00");
    // All of the week is no schedule.
    check(r#"{"day": ["ANY"]}"#, "always");
}

#[test]
fn what_has_no_fixed_hour_applies_longer_and_is_told() {
    #[track_caller]
    fn check(entries: &str, hours: &str, said: &str) {
        let at = "/UASZoneList/0/applicability/0/schedule";
        assert_eq!(read(&ed_269(&scheduled(entries))), (hours.to_owned(), format!("{at}{said}\n")), "{entries}");
    }
    let by_sun =
        "/0: sunrise and sunset have no fixed hour: the area applies on the whole day, and on the day after it";
    check(r#"{"day": ["MON"], "startEvent": "SR", "endEvent": "SS"}"#, "Mon,Tue 00:00-24:00", by_sun);
    check(r#"{"day": ["MON"], "startEvent": "SS", "endEvent": "SR"}"#, "Mon,Tue 00:00-24:00", by_sun);
    check(r#"{"day": ["MON"], "startTime": "08:00:00Z", "endEvent": "SS"}"#, "Mon,Tue 00:00-24:00", by_sun);
    check(r#"{"day": ["ANY"], "startEvent": "SR", "endEvent": "SS"}"#, "always", by_sun);
    let always = "the area applies at all times of the period";
    check(
        r#"{"day": ["HOL"], "startTime": "08:00:00Z", "endTime": "09:00:00Z"}"#,
        "always",
        &format!("/0/day/0: found `HOL`, expected MON, TUE, WED, THU, FRI, SAT, SUN or ANY: {always}"),
    );
    check(
        r#"{"day": ["MON"], "startTime": "dawn", "endTime": "09:00:00Z"}"#,
        "always",
        &format!("/0/startTime: found `dawn`, expected a time like 08:00:00Z: {always}"),
    );
    check("7", "always", &format!("/0: this is no entry of a schedule: {always}"));
    // One that is not understood is enough, and the others are looked at all the same.
    check(
        r#"{"day": ["MON"], "startTime": "08:00:00Z", "endTime": "09:00:00Z"}, {"day": ["TUE"], "endTime": 9}"#,
        "always",
        &format!("/1/endTime: found ``, expected a time like 08:00:00Z: {always}"),
    );
}

#[test]
fn periods_share_their_hours() {
    let monday = r#"{"startDateTime": "2026-04-01T00:00:00Z", "endDateTime": "2026-05-01T00:00:00Z",
        "schedule": [{"day": ["MON"], "startTime": "08:00:00Z", "endTime": "09:00:00Z"}]}"#;
    let friday = monday.replace("MON", "FRI").replace("2026", "2027");
    let second = "/UASZoneList/0/applicability/1: a second period has no counterpart: the area applies from the first to the last\n";
    assert_eq!(read(&ed_269(&format!("{monday}, {friday}"))), ("Mon,Fri 08:00-09:00".into(), second.into()));
    let unscheduled = r#"{"startDateTime": "2027-04-01T00:00:00Z", "endDateTime": "2027-05-01T00:00:00Z"}"#;
    let other =
        "/UASZoneList/0/applicability/0/schedule: another period has no schedule: the area applies at all hours\n";
    assert_eq!(read(&ed_269(&format!("{monday}, {unscheduled}"))), ("always".into(), format!("{second}{other}")));
    let permanent = monday.replacen('{', r#"{"permanent": "YES", "#, 1);
    let (hours, said) = read(&ed_269(&permanent));
    assert_eq!(hours, "always");
    assert!(said.contains("permanent, and with a schedule besides: the area applies at all hours"), "{said}");
}

#[test]
fn hours_stand_in_the_mission_file_and_the_schedule_beside_them() {
    let text = ed_269(&scheduled(r#"{"day": ["MON", "TUE"], "startTime": "22:00:00Z", "endTime": "04:00:00Z"}"#));
    let written = import("z.json", &text, &settings()).unwrap_or_else(|it| panic!("{it}")).text;
    assert!(written.contains("hours_utc = [\"Mon,Tue 22:00-04:00\"]\n"), "{written}");
    assert!(written.contains("# Published schedule: day MON TUE, "), "{written}");
}

#[test]
fn too_many_times_apply_always() {
    let entry = |minute: usize| {
        let (hour, minute) = (minute / 60, minute % 60);
        format!(
            r#"{{"day": ["MON"], "startTime": "{hour:02}:{minute:02}:00Z", "endTime": "{hour:02}:{:02}:00Z"}}"#,
            minute + 1
        )
    };
    let entries: Vec<String> = (0..51).map(|it| entry(10 * it)).collect();
    let (hours, said) = read(&ed_269(&scheduled(&entries.join(", "))));
    assert_eq!(hours, "always");
    assert!(said.contains("more than 50 separate times in a week: the area applies at all hours"), "{said}");
}
