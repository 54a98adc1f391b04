//! When a zone applies, as ED-269 and ED-318 say it. Our areas have one window: the hull of all periods, since an area that
//! applies too long is on the safe side. A schedule within a period is left out for the same reason, and becomes a remark.

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::content::Window;
use crate::findings::{Findings, Wrong};
use crate::json::{Node, short};

/// The hull of `periods`, each an object with `startDateTime`, `endDateTime` and `schedule`. None means always.
pub(crate) fn hull(periods: &[Node<'_>], remarks: &mut Vec<String>, findings: &mut Findings) -> Result<Window, Wrong> {
    let windows = periods.iter().map(|it| period(it, remarks, findings)).collect::<Result<Vec<_>, _>>()?;
    if let [_, second, ..] = periods {
        findings.note(&second.place, "a second period has no counterpart: the area applies from the first to the last");
    }
    let starts: Option<Vec<i64>> = windows.iter().map(|it| it.from_utc_ms).collect();
    let ends: Option<Vec<i64>> = windows.iter().map(|it| it.until_utc_ms).collect();
    Ok(Window {
        from_utc_ms: starts.and_then(|it| it.into_iter().min()),
        until_utc_ms: ends.and_then(|it| it.into_iter().max()),
    })
}

fn period(node: &Node<'_>, remarks: &mut Vec<String>, findings: &mut Findings) -> Result<Window, Wrong> {
    node.object()?;
    node.note_unknown(&["permanent", "startDateTime", "endDateTime", "schedule"], findings);
    let schedule = node.list("schedule")?;
    if !schedule.is_empty() {
        findings.note(
            &format!("{}/schedule", node.place),
            "a schedule has no counterpart: the area applies at all times of the period",
        );
        remarks.extend(schedule.iter().map(|it| format!("Published schedule: {}", in_words(it))));
    }
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
        return Ok(Window::default());
    }
    checked(window, &node.place)
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
