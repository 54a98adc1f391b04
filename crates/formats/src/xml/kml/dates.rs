//! The moments of KML: a date and time, a date, a month or a year, each with or without an offset from UTC.

use crate::applicability::{Side, bound_of, utc_ms};

const DAY_MS: i64 = 86_400_000;

/// Where a period begins or ends; `None`: it begins before 1970, and no flight does. It ends with the end of its last day, month or year.
pub(super) fn bound(text: &str, side: Side) -> Result<Option<i64>, String> {
    let text = text.trim();
    let year = text.get(..4).and_then(|it| it.parse::<u16>().ok());
    if side == Side::From && year.is_some_and(|it| it < 1970) {
        return Ok(None);
    }
    let whole = [10, 7, 4].into_iter().find_map(|length| whole(text.split_at_checked(length)?, side));
    whole.map_or_else(|| bound_of(text, side), Ok).map(Some)
}

/// The beginning or the end of a day, a month or a year.
fn whole((date, offset): (&str, &str), side: Side) -> Option<i64> {
    let numbers: Vec<u16> = date
        .split('-')
        .map(|it| it.parse().ok().filter(|_| it.bytes().all(|it| it.is_ascii_digit())))
        .collect::<Option<_>>()?;
    let (first, next) = match (numbers.as_slice(), side) {
        (&[year], Side::From) => (format!("{year:04}-01-01"), 0),
        (&[year], Side::Until) => (format!("{:04}-01-01", year.checked_add(1)?), 0),
        (&[year, month], Side::From) => (format!("{year:04}-{month:02}-01"), 0),
        (&[year, 12], Side::Until) => (format!("{:04}-01-01", year.checked_add(1)?), 0),
        (&[year, month], Side::Until) => (format!("{year:04}-{:02}-01", month.checked_add(1)?), 0),
        (&[_, _, _], Side::From) => (date.to_owned(), 0),
        (&[_, _, _], Side::Until) => (date.to_owned(), DAY_MS),
        _ => return None,
    };
    let moment = format!("{first}T00:00:00{offset}");
    // Without an offset it may be that day anywhere on Earth.
    let bound = if offset.is_empty() { bound_of(&moment, side) } else { utc_ms(&moment) };
    Some(bound.ok()? + next)
}
