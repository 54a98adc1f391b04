//! Days and times of day at which zones apply: read where they are fixed, and on the safe side where they are not.

use super::{import, mission, notes, settings};
use domain::area::Area;
use domain::geodesy::{LatLon, Origin};
use formats::assemble::Settings;

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

/// The hours of each area, `always` for none, and what was said.
#[track_caller]
fn read(text: &str) -> (String, String) {
    let assembled = import("z.json", text, &settings()).unwrap_or_else(|it| panic!("{it}"));
    let hours = |area: &Area| area.hours.as_ref().map_or_else(|| "always".into(), |it| it.to_texts().join("; "));
    let hours: Vec<String> = mission(&assembled).areas.iter().map(hours).collect();
    (hours.join(" | "), notes(&assembled))
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
    // A day without times is a whole one.
    check(r#"{"day": ["SUN"]}"#, "Sun 00:00-24:00");
    check(r#"{"day": ["SUN"], "startTime": "12:00:00Z", "endTime": "24:00:00Z"}"#, "Sun 12:00-24:00");
    // The whole minutes that contain the time.
    check(r#"{"day": ["SUN"], "startTime": "12:00:59Z", "endTime": "23:59:59Z"}"#, "Sun 12:00-24:00");
    // Local time with its offset: the day begins on the one before.
    check(r#"{"day": ["MON"], "startTime": "01:00:00+02:00", "endTime": "03:00:00+02:00"}"#, "Sun 23:00-01:00");
    check(r#"{"day": "MON", "startTime": "08:00", "endTime": "09:00"}"#, "Mon 08:00-09:00");
    // Neither seconds nor an offset.
    check(r#"{"day": ["MON"], "startTime": "06:00Z", "endTime": "21:00Z"}"#, "Mon 06:00-21:00");
    // The sun at 54.0 north, 6.6 east, in all seasons: it rises from 03:00 to 07:53 and sets from 15:11 to 20:10 UTC, give or take ten minutes.
    check(r#"{"day": ["MON"], "startEvent": "SR", "endEvent": "SS"}"#, "Mon 02:50-20:20");
    check(r#"{"day": ["MON"], "startEvent": "SS", "endEvent": "SR"}"#, "Mon 15:01-08:03");
    check(r#"{"day": ["MON"], "startTime": "08:00:00Z", "endEvent": "SS"}"#, "Mon 08:00-20:20");
    // The whole week counts as no schedule.
    check(r#"{"day": ["ANY"]}"#, "always");
}

#[test]
fn the_sun_rises_and_sets_as_in_the_almanac() {
    /// The hours from sunrise to sunset on a day at a place.
    #[track_caller]
    fn check(latitude: f64, longitude: f64, day: &str, expected: &str) {
        let period = format!(
            r#"{{"startDateTime": "{day}T00:00Z", "endDateTime": "{day}T23:59Z", "schedule": [{{"startEvent": "SR", "endEvent": "SS"}}]}}"#
        );
        let text = ed_269(&period).replace("[6.61, 54.0]", &format!("[{}, {latitude}]", longitude + 0.01));
        let place = LatLon::new(latitude, longitude).unwrap();
        let origin = Some(Origin { place, altitude_m: None });
        let read = import("z.json", &text, &Settings { origin, ..settings() }).unwrap_or_else(|it| panic!("{it}"));
        let hours = mission(&read).areas[0].hours.as_ref().map(|it| it.to_texts().join("; "));
        assert_eq!(hours.as_deref().unwrap_or("always"), expected);
    }
    // Ten minutes more at both ends. Greenwich: 06:05 to 18:13, and 03:43 to 20:21.
    check(51.48, 0.0, "2026-03-20", "Mon-Sun 05:52-18:23");
    check(51.48, 0.0, "2026-06-21", "Mon-Sun 03:32-20:31");
    // Reykjavik: 02:55 to 00:03 on the next day. In Tromso the sun does not set on that day.
    check(64.15, -21.94, "2026-06-21", "Mon-Sun 02:44-00:15");
    check(69.65, 18.96, "2026-06-21", "always");
    check(-33.87, 151.21, "2026-06-21", "always");
}

#[test]
fn what_has_no_fixed_hour_applies_longer_and_is_told() {
    #[track_caller]
    fn check(entries: &str, hours: &str, said: &str) {
        let at = "/UASZoneList/0/applicability/0/schedule";
        assert_eq!(read(&ed_269(&scheduled(entries))), (hours.to_owned(), format!("{at}{said}\n")), "{entries}");
    }
    let by_sun =
        "/0: when it begins or ends cannot be said: the area applies on the whole day, and on the day after it";
    check(r#"{"day": ["SUN"], "startTime": "12:00:00Z"}"#, "Mon,Sun 00:00-24:00", by_sun);
    check(r#"{"day": ["SUN"], "endTime": "12:00:00Z"}"#, "Mon,Sun 00:00-24:00", by_sun);
    // In summer the sun sets after 18:00, in winter before.
    check(r#"{"day": ["MON"], "startTime": "18:00:00Z", "endEvent": "SS"}"#, "Mon,Tue 00:00-24:00", by_sun);
    // These are doubts: with --strict they are mistakes.
    let more = "it bars more";
    check(
        r#"{"day": ["HOL"], "startTime": "08:00:00Z", "endTime": "09:00:00Z"}"#,
        "Mon-Sun 08:00-09:00",
        "/0/day/0: a holiday may be any day: the area applies at these hours of every day",
    );
    check(
        r#"{"day": ["MON"], "startTime": "dawn", "endTime": "09:00:00Z"}"#,
        "always",
        &format!("/0/startTime: NOT UNDERSTOOD: found `dawn`, expected a time like 08:00:00Z: {more}"),
    );
    check("7", "always", &format!("/0: NOT UNDERSTOOD: an entry of a schedule is expected: {more}"));
    // One that is not understood is enough, and the others are looked at all the same.
    check(
        r#"{"day": ["MON"], "startTime": "08:00:00Z", "endTime": "09:00:00Z"}, {"day": ["TUE"], "endTime": 9}"#,
        "always",
        &format!("/1/endTime: NOT UNDERSTOOD: found ``, expected a time like 08:00:00Z: {more}"),
    );
}

#[test]
fn a_period_is_a_window_of_its_own_with_its_hours() {
    let monday = r#"{"startDateTime": "2026-04-01T00:00:00Z", "endDateTime": "2026-05-01T00:00:00Z",
        "schedule": [{"day": ["MON"], "startTime": "08:00:00Z", "endTime": "09:00:00Z"}]}"#;
    let friday = monday.replace("MON", "FRI").replace("2026", "2027");
    assert_eq!(read(&ed_269(&format!("{monday}, {friday}"))), ("Mon 08:00-09:00 | Fri 08:00-09:00".into(), "".into()));
    let unscheduled = r#"{"startDateTime": "2027-04-01T00:00:00Z", "endDateTime": "2027-05-01T00:00:00Z"}"#;
    assert_eq!(read(&ed_269(&format!("{monday}, {unscheduled}"))), ("Mon 08:00-09:00 | always".into(), "".into()));
    // A period that is there twice is one, and one that is permanent is all that is needed.
    assert_eq!(read(&ed_269(&format!("{monday}, {monday}"))).0, "Mon 08:00-09:00");
    assert_eq!(read(&ed_269(&format!(r#"{monday}, {{"permanent": "YES"}}"#))).0, "always");
    let permanent = monday.replacen('{', r#"{"permanent": "YES", "#, 1);
    let (hours, said) = read(&ed_269(&permanent));
    assert_eq!(hours, "always");
    assert!(said.contains("permanent, and with a schedule besides: the area applies at all hours"), "{said}");
}

#[test]
fn only_a_zone_of_very_many_periods_applies_in_between() {
    let period = |day: usize| {
        format!(
            r#"{{"startDateTime": "2026-{:02}-{:02}T08:00Z", "endDateTime": "2026-{0:02}-{1:02}T09:00Z"}}"#,
            1 + day / 28,
            1 + day % 28
        )
    };
    let periods = |count| ed_269(&(0..count).map(period).collect::<Vec<_>>().join(", "));
    let areas = |count| mission(&import("z.json", &periods(count), &settings()).unwrap()).areas.len();
    assert_eq!((areas(50), areas(51)), (50, 1));
    let (_, said) = read(&periods(51));
    assert!(said.contains("more than 50 periods: it applies from the first to the last, all the time"), "{said}");
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
