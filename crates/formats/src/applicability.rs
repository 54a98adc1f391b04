//! When a zone applies, as ED-269 and ED-318 say it: each of its periods is one of ours.

use domain::hours::WeeklyHours;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::content::{Outline, Period, Window};
use crate::findings::{Findings, Wrong};
use crate::json::{Node, short};
use crate::schedule::{self, Daylight};
use crate::sun;
use crate::zones::Doubts;

/// The most periods of a zone. More become one from the first to the last.
const MOST_PERIODS: usize = 50;
/// From the year 9000 on: publishers write 9999 where there is no end.
const NEVER_MS: i64 = 221_845_392_000_000;
/// A smaller number is not a time in milliseconds: it would lie before 1973.
const LEAST_MS: i64 = 100_000_000_000;
const FIELDS: [&str; 4] = ["permanent", "startDateTime", "endDateTime", "schedule"];

/// The periods of a zone: a list of objects with `startDateTime`, `endDateTime` and `schedule`, or one of them. None means always.
pub(crate) fn periods<'a>(
    field: Option<Node<'_>>,
    outlines: impl Iterator<Item = &'a Outline>,
    remarks: &mut Vec<String>,
    doubts: &mut Doubts,
    findings: &mut Findings,
) -> Vec<Period> {
    let Some(field) = field else { return vec![Period::default()] };
    let list = if field.value.is_object() { Ok(vec![field.clone()]) } else { field.items() };
    let places = sun::places(outlines);
    let mut periods = Vec::new();
    for node in doubts.or(list, Vec::new()) {
        let read = period(&node, &places, remarks, doubts, findings);
        let read = doubts.or(read, Period::default());
        if !periods.contains(&read) {
            periods.push(read);
        }
    }
    if periods.is_empty() || periods.contains(&Period::default()) {
        return vec![Period::default()];
    }
    if MOST_PERIODS < periods.len() {
        let text =
            format!("it has more than {MOST_PERIODS} periods: it applies from the first to the last, all the time");
        findings.note(&field.place, text);
        let starts: Option<Vec<i64>> = periods.iter().map(|it| it.window.from_utc_ms).collect();
        let ends: Option<Vec<i64>> = periods.iter().map(|it| it.window.until_utc_ms).collect();
        let window = Window {
            from_utc_ms: starts.and_then(|it| it.into_iter().min()),
            until_utc_ms: ends.and_then(|it| it.into_iter().max()),
        };
        periods = vec![Period { window, hours: None }];
    }
    periods
}

fn period(
    node: &Node<'_>,
    places: &[domain::geodesy::LatLon],
    remarks: &mut Vec<String>,
    doubts: &mut Doubts,
    findings: &mut Findings,
) -> Result<Period, Wrong> {
    node.object()?;
    node.note_unknown(&[&FIELDS[..], &schedule::ENTRY].concat(), findings);
    let schedule = match node.get("schedule") {
        Some(it) if it.value.is_object() => vec![it],
        Some(it) => it.items()?,
        None if schedule::ENTRY.iter().any(|it| node.get(it).is_some()) => vec![node.clone()],
        None => Vec::new(),
    };
    remarks.extend(schedule.iter().map(|it| format!("Published schedule: {}", in_words(it))));
    let is_permanent = match node.get("permanent") {
        Some(it) if it.value.is_boolean() => it.boolean()?,
        Some(it) => it.one_of(&[("YES", true), ("NO", false), ("TRUE", true), ("FALSE", false)])?,
        None => false,
    };
    let bound = |key, side| node.get(key).map_or(Ok(None), |it| bound(&it, side));
    let window =
        Window { from_utc_ms: bound("startDateTime", Side::From)?, until_utc_ms: bound("endDateTime", Side::Until)? };
    if is_permanent && window != Window::default() {
        findings.note(&node.place, "permanent, and with dates besides: the area always applies");
    }
    if is_permanent && !schedule.is_empty() {
        findings.note(&node.place, "permanent, and with a schedule besides: the area applies at all hours");
    }
    if is_permanent {
        return Ok(Period::default());
    }
    let window = checked(window, &node.place)?;
    let spans = schedule::spans(&schedule, Daylight { places, window }, doubts, findings);
    let hours = spans.and_then(|spans| match WeeklyHours::new(spans) {
        Ok(hours) => Some(hours).filter(|it| !it.is_whole_week()),
        Err(invalid) => {
            findings.note(&format!("{}/schedule", node.place), format!("{invalid}: the area applies at all hours"));
            None
        }
    });
    Ok(Period { window, hours })
}

/// The window, if it does not end before it begins.
pub(crate) fn checked(window: Window, place: &str) -> Result<Window, Wrong> {
    match (window.from_utc_ms, window.until_utc_ms) {
        (Some(from), Some(until)) if until <= from => {
            Err(Wrong::at(place, "the period ends before it begins", "correct the dates, or leave the zone out"))
        }
        _ => Ok(window),
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    From,
    Until,
}

/// The beginning or the end of a period. `None`: long ago, or never.
fn bound(node: &Node<'_>, side: Side) -> Result<Option<i64>, Wrong> {
    // Milliseconds, as services of maps give dates.
    let ms = node.value.as_i64().filter(|it| LEAST_MS < *it);
    let ms = match ms {
        Some(ms) => ms,
        None => {
            let wrong = |message| Wrong::at(&node.place, message, "write it like 2026-05-01T08:00:00Z");
            bound_of(node.text()?, side).map_err(wrong)?
        }
    };
    let is_open = if side == Side::From { ms <= 0 } else { NEVER_MS <= ms };
    Ok(Some(ms).filter(|_| !is_open))
}

/// As [`bound`], of a text. A date without a time is the whole day; without an offset it may be that day anywhere on Earth, from
/// UTC+14 to UTC-12.
pub(crate) fn bound_of(text: &str, side: Side) -> Result<i64, String> {
    const HOUR_MS: i64 = 3_600_000;
    let text = text.trim();
    let year = text.get(..5).and_then(|it| it.strip_suffix('-')?.parse::<u16>().ok());
    match (side, year) {
        (Side::From, Some(..1970)) => return Ok(0),
        (Side::Until, Some(9000..)) => return Ok(NEVER_MS),
        _ => {}
    }
    let exactly = utc_ms(text);
    let anywhere = |text: &str| {
        let utc = utc_ms(&format!("{text}Z")).ok()?;
        Some(if side == Side::From { (utc - 14 * HOUR_MS).max(0) } else { utc + 12 * HOUR_MS })
    };
    let day = |text: &str| {
        let begins = anywhere(&format!("{text}T00:00:00"))?;
        Some(if side == Side::From { begins } else { begins + 24 * HOUR_MS })
    };
    exactly.or_else(|message| anywhere(text).or_else(|| day(text)).ok_or(message))
}

/// A date and time with its offset from UTC, in milliseconds since the Unix epoch.
pub(crate) fn moment(node: &Node<'_>) -> Result<i64, Wrong> {
    utc_ms(node.text()?).map_err(|message| Wrong::at(&node.place, message, "write it like 2026-05-01T08:00:00Z"))
}

/// As [`moment`], of a text; what is wrong with it otherwise.
pub(crate) fn utc_ms(text: &str) -> Result<i64, String> {
    // The end of a day is midnight, which the calendar calls 00:00 of the next one.
    let (text, more_ms) = match text.trim().split_once("T24:") {
        Some((date, rest)) => (format!("{date}T00:{rest}"), 24 * 3_600_000),
        None => (text.trim().to_owned(), 0),
    };
    let parsed = OffsetDateTime::parse(&with_seconds(&text), &Rfc3339);
    let moment =
        parsed.map_err(|_| format!("found `{}`, expected a date and time with Z or an offset", short(&text)))?;
    // Our own files reach from the epoch on.
    let after_epoch = |ms: &i64| 0 <= *ms;
    i64::try_from(moment.unix_timestamp_nanos() / 1_000_000)
        .ok()
        .map(|ms| ms + more_ms)
        .filter(after_epoch)
        .ok_or_else(|| format!("found `{}`, expected a date after 1970", short(&text)))
}

/// A date and a time, in which seconds may be missing, and a space may stand between them.
pub(crate) fn with_seconds(text: &str) -> String {
    let Some((date, time)) = text.split_once(['T', 't', ' ']) else { return text.to_owned() };
    match (time.get(..5), time.get(5..)) {
        (Some(minutes), Some(rest)) if !rest.starts_with(':') => format!("{date}T{minutes}:00{rest}"),
        _ => format!("{date}T{time}"),
    }
}

/// The texts of a schedule in the order of the file.
fn in_words(schedule: &Node<'_>) -> String {
    let entries = schedule.value.as_object().into_iter().flat_map(|it| it.iter());
    let words = entries.filter(|(key, _)| schedule::ENTRY.contains(&key.as_str())).map(|(key, value)| {
        let value = match value {
            serde_json::Value::Array(days) => days.iter().filter_map(|it| it.as_str()).collect::<Vec<_>>().join(" "),
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        format!("{key} {}", short(&value))
    });
    words.collect::<Vec<_>>().join(", ")
}
