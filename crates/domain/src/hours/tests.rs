//! Hours written by hand, and what holds for all hours.

use std::time::Duration;

use proptest::prelude::*;

use super::*;
use crate::airspace::tests::{airspace, square};
use crate::airspace::{Airspace, Grants};
use crate::area::{Area, AreaKind};

const HOUR_MS: i64 = 60 * MINUTE_MS;
const DAY_MS: i64 = 24 * HOUR_MS;
/// 2026-01-05T00:00:00Z.
const A_MONDAY_MS: i64 = 1_767_571_200_000;

fn hours(texts: &[&str]) -> WeeklyHours {
    WeeklyHours::parse(texts).unwrap_or_else(|(index, invalid)| panic!("{index}: {invalid}"))
}

/// That many days and hours after a Monday.
fn at(day: i64, hour: i64, minute: i64) -> i64 {
    A_MONDAY_MS + day * DAY_MS + hour * HOUR_MS + minute * MINUTE_MS
}

#[test]
fn hours_cover_their_beginning_and_not_their_end() {
    #[track_caller]
    fn check(texts: &[&str], day: i64, hour: i64, minute: i64, expected: bool) {
        assert_eq!(hours(texts).covers(at(day, hour, minute)), expected, "{texts:?} on day {day} at {hour}:{minute}");
    }
    let office = &["Mon-Fri 08:00-18:00"];
    check(office, 0, 7, 59, false);
    check(office, 0, 8, 0, true);
    check(office, 4, 17, 59, true);
    check(office, 4, 18, 0, false);
    check(office, 5, 12, 0, false);
    // The same in another week, before the epoch too.
    check(office, 14, 8, 0, true);
    check(office, -7 * 3000, 8, 0, true);
    let night = &["Sat 22:00-02:00"];
    check(night, 5, 21, 59, false);
    check(night, 5, 23, 0, true);
    check(night, 6, 1, 59, true);
    check(night, 6, 2, 0, false);
    // Over the end of the week.
    let end = &["Sun 22:00-02:00"];
    check(end, 6, 23, 59, true);
    check(end, 7, 1, 59, true);
    check(end, 0, 1, 59, true);
    check(end, 0, 2, 0, false);
    // Over the end of the week by days.
    let weekend = &["Sat-Mon 10:00-11:00"];
    check(weekend, 0, 10, 30, true);
    check(weekend, 6, 10, 30, true);
    check(weekend, 4, 10, 30, false);
    check(&["Mon-Sun 00:00-24:00"], 3, 0, 0, true);
}

#[test]
fn the_next_change_is_where_a_window_begins_or_ends() {
    #[track_caller]
    fn check(texts: &[&str], from: i64, expected: Option<i64>) {
        assert_eq!(hours(texts).next_change(from), expected, "{texts:?}");
    }
    let office = &["Mon-Fri 08:00-18:00"];
    check(office, at(0, 0, 0), Some(at(0, 8, 0)));
    check(office, at(0, 8, 0), Some(at(0, 18, 0)));
    check(office, at(4, 18, 0), Some(at(7, 8, 0)));
    // At midnight nothing changes.
    check(&["Sun 22:00-02:00"], at(6, 23, 0), Some(at(7, 2, 0)));
    check(&["Mon 22:00-24:00", "Tue 00:00-04:00"], at(0, 22, 0), Some(at(1, 4, 0)));
    check(&["Mon-Sun 00:00-12:00", "Mon-Sun 12:00-24:00"], at(0, 0, 0), None);
}

#[test]
fn windows_are_told_from_the_present_one_on() {
    #[track_caller]
    fn check(texts: &[&str], from: i64, expected: &[(i64, i64)]) {
        let found: Vec<_> = hours(texts).windows_after(from).take(expected.len()).collect();
        assert_eq!(found, expected, "{texts:?}");
    }
    let office = &["Mon-Fri 08:00-18:00"];
    check(office, at(4, 9, 0), &[(at(4, 9, 0), at(4, 18, 0)), (at(7, 8, 0), at(7, 18, 0))]);
    check(office, at(5, 0, 0), &[(at(7, 8, 0), at(7, 18, 0)), (at(8, 8, 0), at(8, 18, 0))]);
    check(&["Mon-Sun 00:00-24:00"], at(1, 2, 3), &[(at(1, 2, 3), i64::MAX)]);
    assert_eq!(hours(&["Mon-Sun 00:00-24:00"]).windows_after(at(1, 2, 3)).count(), 1);
    // Two weeks ahead and no farther.
    let last = hours(&["Mon 08:00-09:00"]).windows_after(at(0, 9, 0)).last();
    assert_eq!(last, Some((at(21, 8, 0), i64::MAX)));
    // At the end of time the windows end as well.
    assert!(hours(office).windows_after(i64::MAX - 5).count() <= 2);
}

#[test]
fn hours_are_written_as_a_human_writes_them() {
    #[track_caller]
    fn check(texts: &[&str], expected: &[&str]) {
        assert_eq!(hours(texts).to_texts(), expected);
    }
    check(&["Mon-Fri 08:00-18:00"], &["Mon-Fri 08:00-18:00"]);
    check(&["sat,SUN 22:00-02:00"], &["Sat,Sun 22:00-02:00"]);
    check(&["Mon 08:00-10:00", "Mon 09:00-12:00"], &["Mon 08:00-12:00"]);
    check(&["Mon-Wed,Fri 00:00-24:00"], &["Mon-Wed,Fri 00:00-24:00"]);
    check(&["Mon-Sun 00:00-24:00"], &["Mon-Sun 00:00-24:00"]);
    check(&["Mon 22:00-24:00"], &["Mon 22:00-24:00"]);
    check(&["Mon 06:00-24:00", "Tue 00:00-07:00"], &["Mon 06:00-24:00", "Tue 00:00-07:00"]);
}

#[test]
fn what_is_no_hours_is_told() {
    #[track_caller]
    fn check(texts: &[&str], index: usize, expected: &str) {
        let (found, invalid) = WeeklyHours::parse(texts).unwrap_err();
        assert_eq!((found, invalid.to_string().as_str()), (index, expected));
    }
    check(&[], 0, "no hours, so that it would never apply");
    check(&["Mon"], 0, "found `Mon`, expected days and hours");
    check(&["Mon 08:00"], 0, "found `Mon 08:00`, expected days and hours");
    check(
        &["Mon 08:00-09:00", "Day 08:00-09:00"],
        1,
        "found `Day`, expected a day: Mon, Tue, Wed, Thu, Fri, Sat or Sun",
    );
    check(&["Mon- 08:00-09:00"], 0, "found ``, expected a day: Mon, Tue, Wed, Thu, Fri, Sat or Sun");
    check(&["Mon 8:00-09:00"], 0, "found `8:00`, expected a time of day from 00:00 to 24:00");
    check(&["Mon 08:00-25:00"], 0, "found `25:00`, expected a time of day from 00:00 to 24:00");
    check(&["Mon 08:60-09:00"], 0, "found `08:60`, expected a time of day from 00:00 to 24:00");
    check(&["Mon 08:00-08:00"], 0, "`Mon 08:00-08:00` begins and ends at the same time");
    check(&["Mon 24:00-00:00"], 0, "`Mon 24:00-00:00` begins and ends at the same time");
    // Every other minute for an hour and more.
    let many: Vec<(i64, i64)> = (0..51).map(|it| (2 * it, 1)).collect();
    assert_eq!(WeeklyHours::new(many), Err(InvalidHours::TooMany));
}

fn any_hours() -> impl Strategy<Value = WeeklyHours> {
    let span = (-2 * WEEK..2 * WEEK, 1..2 * DAY);
    prop::collection::vec(span, 1..6).prop_map(|spans| WeeklyHours::new(spans).expect("a few spans, none empty"))
}

proptest! {
    #[test]
    fn the_next_change_flips_what_is_covered_and_nothing_does_before(
        hours in any_hours(),
        from in -4_000_000_000_000_i64..4_000_000_000_000,
        part in 0.0..1.0_f64,
    ) {
        match hours.next_change(from) {
            None => prop_assert!(hours.is_whole_week()),
            Some(change) => {
                prop_assert!(from < change && change - from <= WEEK_MS);
                let between = from + ((change - from) as f64 * part) as i64;
                prop_assert_eq!(hours.covers(between.min(change - 1)), hours.covers(from));
                prop_assert_ne!(hours.covers(change), hours.covers(from));
            }
        }
    }

    #[test]
    fn windows_are_what_is_covered(hours in any_hours(), from in 0_i64..4_000_000_000_000, after in 0..WEEK_MS) {
        let moment = from + after;
        let is_in_window = hours.windows_after(from).any(|(begins, ends)| begins <= moment && moment < ends);
        prop_assert_eq!(is_in_window, hours.covers(moment));
        let windows: Vec<_> = hours.windows_after(from).collect();
        prop_assert!(windows.windows(2).all(|pair| pair[0].0 < pair[0].1 && pair[0].1 < pair[1].0));
    }

    /// The clock of the airspace stands 20 s before a minute begins, so steps of 20 s meet every border.
    #[test]
    fn an_area_bars_a_stay_if_any_moment_of_it_or_of_the_way_out_lies_in_its_hours(
        spans in prop::collection::vec((0..WEEK, 1..200_i64), 1..5),
        begins in 0..30_000_u64,
        lasts in 0..200_u64,
    ) {
        let hours = WeeklyHours::new(spans).expect("a few spans, none empty");
        let areas = [Area { hours: Some(hours.clone()), ..square(AreaKind::KeepOut) }];
        let grants = Grants::new();
        let airspace = Airspace { lead: Duration::from_secs(40), ..airspace(&areas, &grants) };
        let (from_s, until_s) = (20 * begins, 20 * (begins + lasts));
        let now_ms = airspace.clock.utc_ms;
        let expected = (from_s..=until_s + 40).step_by(20).any(|after_s| hours.covers(now_ms + after_s as i64 * 1000));
        let barred = airspace.bars(&areas[0], Duration::from_secs(from_s), Duration::from_secs(until_s));
        prop_assert_eq!(barred.is_some(), expected);
    }

    #[test]
    fn hours_come_back_from_their_texts(hours in any_hours()) {
        prop_assert_eq!(WeeklyHours::parse(&hours.to_texts()), Ok(hours));
    }

    #[test]
    fn any_text_is_hours_or_a_mistake(text in "[A-Za-z0-9:, -]{0,30}|(Mon|Tue|Sun)(-(Sat|Wed))? [0-2][0-9]:[0-9]{2}-[0-2][0-9]:[0-6][0-9]") {
        if let Ok(hours) = WeeklyHours::parse(&[text]) {
            prop_assert_eq!(WeeklyHours::parse(&hours.to_texts()), Ok(hours));
        }
    }
}
