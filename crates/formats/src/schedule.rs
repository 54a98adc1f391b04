//! The schedule of a period in ED-269 and ED-318: days of the week with times of day, or with sunrise and sunset.
//!
//! Times are in UTC unless they have an offset. What has no fixed hour, or cannot be read, applies longer rather than shorter.

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::findings::Findings;
use crate::json::{Node, short};

/// Parts of a week: each begins at a minute after Monday 00:00 UTC and lasts so many minutes.
pub(crate) type Spans = Vec<(i64, i64)>;

const DAY: i64 = 24 * 60;
/// The first Monday after the Unix epoch, as a date and in seconds.
const A_MONDAY: (&str, i64) = ("1970-01-05", 4 * 86_400);
const DAYS: [&str; 7] = ["MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN"];
const ENTRY: [&str; 5] = ["day", "startTime", "startEvent", "endTime", "endEvent"];

/// When an area applies in a period with these entries; `None`: at all its times.
pub(crate) fn spans(schedule: &[Node<'_>], findings: &mut Findings) -> Option<Spans> {
    // Every entry is looked at, so that all that is not understood is told.
    let entries: Vec<Option<Spans>> = schedule.iter().map(|it| spans_or_note(it, findings)).collect();
    let spans = entries.into_iter().collect::<Option<Vec<Spans>>>()?;
    if spans.is_empty() { None } else { Some(spans.concat()) }
}

fn spans_or_note(entry: &Node<'_>, findings: &mut Findings) -> Option<Spans> {
    match spans_of(entry, findings) {
        Ok(spans) => Some(spans),
        Err((place, what)) => {
            findings.note(&place, format!("{what}: the area applies at all times of the period"));
            None
        }
    }
}

/// The place of what is not understood, and what it is.
type NotUnderstood = (String, String);

fn spans_of(entry: &Node<'_>, findings: &mut Findings) -> Result<Spans, NotUnderstood> {
    if entry.object().is_err() {
        return Err((entry.place.clone(), "this is no entry of a schedule".into()));
    }
    entry.note_unknown(&ENTRY, findings);
    let days = days(entry)?;
    if entry.get("startEvent").or_else(|| entry.get("endEvent")).is_some() {
        let text = "sunrise and sunset have no fixed hour: the area applies on the whole day, and on the day after it";
        findings.note(&entry.place, text);
        // A night ends on the next day, and far from Greenwich so does a day.
        return Ok(days.into_iter().map(|day| (day * DAY, 2 * DAY)).collect());
    }
    let time = |key: &str| entry.get(key).map(|it| seconds_of_day(&it)).transpose();
    // Whole minutes that contain the time.
    let begins = time("startTime")?.map_or(0, |seconds| seconds.div_euclid(60));
    let ends = time("endTime")?.map_or(DAY, |seconds| (seconds + 59).div_euclid(60));
    // An end that is not after the beginning lies on the next day.
    let lasts = match (ends - begins).rem_euclid(DAY) {
        0 => DAY,
        minutes => minutes,
    };
    Ok(days.into_iter().map(|day| (day * DAY + begins, lasts)).collect())
}

/// Counted from Monday.
fn days(entry: &Node<'_>) -> Result<Vec<i64>, NotUnderstood> {
    let Some(node) = entry.get("day") else { return Ok((0..7).collect()) };
    // Some authorities publish a single day as a text.
    let listed = node.items().unwrap_or_else(|_| vec![node.clone()]);
    let mut days = Vec::new();
    for day in listed {
        let name = day.text().unwrap_or_default();
        match (name, (0..7).zip(DAYS).find(|(_, known)| *known == name)) {
            ("ANY", _) => days.extend(0..7),
            (_, Some((index, _))) => days.push(index),
            _ => {
                return Err((
                    day.place.clone(),
                    format!("found `{}`, expected {} or ANY", short(name), DAYS.join(", ")),
                ));
            }
        }
    }
    if days.is_empty() { Ok((0..7).collect()) } else { Ok(days) }
}

/// Seconds after midnight UTC; less than none, or more than a day has, for a time with an offset.
fn seconds_of_day(node: &Node<'_>) -> Result<i64, NotUnderstood> {
    let text = node.text().unwrap_or_default().trim();
    let (date, monday_s) = A_MONDAY;
    // The end of a day is midnight, which the calendar calls 00:00 of the next one.
    let (time, more_s) = match text.strip_prefix("24:") {
        Some(rest) => (format!("00:{rest}"), 86_400),
        None => (text.to_owned(), 0),
    };
    let parse = |zone: &str| OffsetDateTime::parse(&format!("{date}T{time}{zone}"), &Rfc3339);
    let moment = parse("").or_else(|_| parse("Z")).or_else(|_| parse(":00Z"));
    let not_understood = |_| (node.place.clone(), format!("found `{}`, expected a time like 08:00:00Z", short(text)));
    Ok(moment.map_err(not_understood)?.unix_timestamp() - monday_s + more_s)
}
