//! When a zone applies, as ED-269 and ED-318 say it. Our areas have one window and hours of the week: the hull of all periods, and
//! the hours of all their schedules together, since an area that applies too long is on the safe side.

use domain::hours::WeeklyHours;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::content::Window;
use crate::findings::{Findings, Wrong};
use crate::json::{Node, short};
use crate::schedule::{self, Spans};

/// The hull of `periods`, each an object with `startDateTime`, `endDateTime` and `schedule`, and the hours of all of them. None
/// means always.
pub(crate) fn hull(
    periods: &[Node<'_>],
    remarks: &mut Vec<String>,
    findings: &mut Findings,
) -> Result<(Window, Option<WeeklyHours>), Wrong> {
    let read = periods.iter().map(|it| period(it, remarks, findings)).collect::<Result<Vec<_>, _>>()?;
    let (windows, spans): (Vec<Window>, Vec<Option<Spans>>) = read.into_iter().unzip();
    if let [_, second, ..] = periods {
        findings.note(&second.place, "a second period has no counterpart: the area applies from the first to the last");
    }
    let starts: Option<Vec<i64>> = windows.iter().map(|it| it.from_utc_ms).collect();
    let ends: Option<Vec<i64>> = windows.iter().map(|it| it.until_utc_ms).collect();
    let window = Window {
        from_utc_ms: starts.and_then(|it| it.into_iter().min()),
        until_utc_ms: ends.and_then(|it| it.into_iter().max()),
    };
    Ok((window, hours(periods, spans, findings)))
}

/// The hours of these periods together; a period without any applies at all of them.
fn hours(periods: &[Node<'_>], spans: Vec<Option<Spans>>, findings: &mut Findings) -> Option<WeeklyHours> {
    let scheduled = periods.iter().zip(&spans).find(|(_, spans)| spans.is_some()).map(|(period, _)| period)?;
    let place = format!("{}/schedule", scheduled.place);
    let Some(spans) = spans.into_iter().collect::<Option<Vec<Spans>>>() else {
        findings.note(&place, "another period has no schedule: the area applies at all hours");
        return None;
    };
    match WeeklyHours::new(spans.concat()) {
        Ok(hours) => Some(hours).filter(|it| !it.is_whole_week()),
        Err(invalid) => {
            findings.note(&place, format!("{invalid}: the area applies at all hours"));
            None
        }
    }
}

fn period(
    node: &Node<'_>,
    remarks: &mut Vec<String>,
    findings: &mut Findings,
) -> Result<(Window, Option<Spans>), Wrong> {
    node.object()?;
    node.note_unknown(&["permanent", "startDateTime", "endDateTime", "schedule"], findings);
    let schedule = node.list("schedule")?;
    remarks.extend(schedule.iter().map(|it| format!("Published schedule: {}", in_words(it))));
    let is_permanent = match node.get("permanent") {
        Some(it) => it.one_of(&[("YES", true), ("NO", false)])?,
        None => false,
    };
    let bound = |key| node.get(key).map(|it| moment(&it)).transpose();
    let window = Window { from_utc_ms: bound("startDateTime")?, until_utc_ms: bound("endDateTime")? };
    if is_permanent {
        if window != Window::default() {
            findings.note(&node.place, "permanent, and with dates besides: the area always applies");
        }
        if !schedule.is_empty() {
            findings.note(&node.place, "permanent, and with a schedule besides: the area applies at all hours");
        }
        return Ok((Window::default(), None));
    }
    Ok((checked(window, &node.place)?, schedule::spans(&schedule, findings)))
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

/// A date and time with its offset from UTC, in milliseconds since the Unix epoch.
pub(crate) fn moment(node: &Node<'_>) -> Result<i64, Wrong> {
    utc_ms(node.text()?).map_err(|message| Wrong::at(&node.place, message, "write it like 2026-05-01T08:00:00Z"))
}

/// As [`moment`], of a text; what is wrong with it otherwise.
pub(crate) fn utc_ms(text: &str) -> Result<i64, String> {
    let parsed = OffsetDateTime::parse(text.trim(), &Rfc3339);
    let moment =
        parsed.map_err(|_| format!("found `{}`, expected a date and time with Z or an offset", short(text)))?;
    // Our own files reach from the epoch on.
    let after_epoch = |ms: &i64| 0 <= *ms;
    i64::try_from(moment.unix_timestamp_nanos() / 1_000_000)
        .ok()
        .filter(after_epoch)
        .ok_or_else(|| format!("found `{}`, expected a date after 1970", short(text)))
}

/// The texts of a schedule in the order of the file.
fn in_words(schedule: &Node<'_>) -> String {
    let words = schedule.value.as_object().into_iter().flat_map(|it| it.iter()).map(|(key, value)| {
        let value = match value {
            serde_json::Value::Array(days) => days.iter().filter_map(|it| it.as_str()).collect::<Vec<_>>().join(" "),
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        format!("{key} {}", short(&value))
    });
    words.collect::<Vec<_>>().join(", ")
}
