//! The schedule of a period in ED-269 and ED-318: days of the week with times of day, or with sunrise and sunset.
//!
//! Times are in UTC unless they have an offset. What cannot be read applies longer rather than shorter.

use domain::geodesy::LatLon;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use crate::applicability::with_seconds;
use crate::content::Window;
use crate::findings::{Findings, Wrong};
use crate::json::{Node, short};
use crate::sun::Event;
use crate::zones::Doubts;

/// Parts of a week: for each, its first minute after Monday 00:00 UTC, and its length in minutes.
pub(crate) type Spans = Vec<(i64, i64)>;

const DAY: i64 = 24 * 60;
/// The first Monday after the Unix epoch, as a date and in seconds.
const A_MONDAY: (&str, i64) = ("1970-01-05", 4 * 86_400);
const DAYS: [&str; 7] = ["MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN"];
pub(crate) const ENTRY: [&str; 5] = ["day", "startTime", "startEvent", "endTime", "endEvent"];

/// Where and when a schedule holds: what the sun depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Daylight<'a> {
    pub(crate) places: &'a [LatLon],
    pub(crate) window: Window,
}

/// When an area applies in a period with these entries; `None`: at all its times.
pub(crate) fn spans(
    schedule: &[Node<'_>],
    daylight: Daylight<'_>,
    doubts: &mut Doubts,
    findings: &mut Findings,
) -> Option<Spans> {
    // Look at every entry, to report all that is not understood.
    let entries = schedule.iter().map(|it| doubts.or(spans_of(it, daylight, findings).map(Some), None));
    let entries: Vec<Option<Spans>> = entries.collect();
    let spans = entries.into_iter().collect::<Option<Vec<Spans>>>()?;
    if spans.is_empty() { None } else { Some(spans.concat()) }
}

fn spans_of(entry: &Node<'_>, daylight: Daylight<'_>, findings: &mut Findings) -> Result<Spans, Wrong> {
    if entry.object().is_err() {
        return Err(Wrong::at(&entry.place, "an entry of a schedule is expected", ""));
    }
    entry.note_unknown(&ENTRY, findings);
    let days = days(entry, findings)?;
    // Whole minutes that contain the time.
    let starts = edge(entry, "startTime", "startEvent", daylight, |seconds| seconds.div_euclid(60))?;
    let ends = edge(entry, "endTime", "endEvent", daylight, |seconds| (seconds + 59).div_euclid(60))?;
    let (starts, ends) = match (starts, ends) {
        (Edge::Between(starts), Edge::Between(ends)) => (starts, ends),
        (Edge::Missing, Edge::Missing) => ((0, 0), (DAY, DAY)),
        _ => return Ok(whole_days(entry, &days, findings)),
    };
    let lasts = if starts.1 < ends.0 {
        ends.1 - starts.0
    } else if ends.1 <= starts.0 {
        // An end that is not after the beginning lies on the next day.
        match (ends.1 - starts.0).rem_euclid(DAY) {
            0 => DAY,
            minutes => minutes,
        }
    } else {
        return Ok(whole_days(entry, &days, findings));
    };
    Ok(days.into_iter().map(|day| (day * DAY + starts.0, lasts)).collect())
}

/// A night whose end is missing ends on the next day, and far from Greenwich so does a day.
fn whole_days(entry: &Node<'_>, days: &[i64], findings: &mut Findings) -> Spans {
    let text = "when it begins or ends cannot be said: the area applies on the whole day, and on the day after it";
    findings.note(&entry.place, text);
    days.iter().map(|day| (day * DAY, 2 * DAY)).collect()
}

/// When an entry begins or ends: a minute of the day, or, in its season, the earliest and the latest one.
enum Edge {
    Between((i64, i64)),
    Missing,
    Unknown,
}

fn edge(
    entry: &Node<'_>,
    time: &str,
    event: &str,
    daylight: Daylight<'_>,
    minute: fn(i64) -> i64,
) -> Result<Edge, Wrong> {
    if let Some(event) = entry.get(event) {
        let minutes = event.one_of(&Event::NAMES)?.minutes(daylight.places, daylight.window);
        return Ok(minutes.map_or(Edge::Unknown, Edge::Between));
    }
    let Some(time) = entry.get(time) else { return Ok(Edge::Missing) };
    let minute = minute(seconds_of_day(&time)?);
    Ok(Edge::Between((minute, minute)))
}

/// Counted from Monday.
fn days(entry: &Node<'_>, findings: &mut Findings) -> Result<Vec<i64>, Wrong> {
    let Some(node) = entry.get("day") else { return Ok((0..7).collect()) };
    // Some authorities publish a single day as a text.
    let listed = node.items().unwrap_or_else(|_| vec![node.clone()]);
    let mut days = Vec::new();
    for day in listed {
        let name = day.text().unwrap_or_default().trim().to_ascii_uppercase();
        match (name.as_str(), (0..7).zip(DAYS).find(|(_, known)| *known == name)) {
            ("ANY", _) => days.extend(0..7),
            ("HOL", _) => {
                findings.note(&day.place, "a holiday may be any day: the area applies at these hours of every day");
                days.extend(0..7);
            }
            (_, Some((index, _))) => days.push(index),
            _ => {
                let message = format!("found `{}`, expected {} or ANY", short(&name), DAYS.join(", "));
                return Err(Wrong::at(day.place.clone(), message, ""));
            }
        }
    }
    if days.is_empty() { Ok((0..7).collect()) } else { Ok(days) }
}

/// Seconds after midnight UTC; less than none, or more than a day has, for a time with an offset.
fn seconds_of_day(node: &Node<'_>) -> Result<i64, Wrong> {
    let text = node.text().unwrap_or_default().trim();
    let (date, monday_s) = A_MONDAY;
    // The end of a day is midnight, which the calendar calls 00:00 of the next one.
    let (time, more_s) = match text.strip_prefix("24:") {
        Some(rest) => (format!("00:{rest}"), 86_400),
        None => (text.to_owned(), 0),
    };
    let dated = with_seconds(&format!("{date}T{time}"));
    let moment =
        OffsetDateTime::parse(&dated, &Rfc3339).or_else(|_| OffsetDateTime::parse(&format!("{dated}Z"), &Rfc3339));
    let not_understood =
        |_| Wrong::at(&node.place, format!("found `{}`, expected a time like 08:00:00Z", short(text)), "");
    Ok(moment.map_err(not_understood)?.unix_timestamp() - monday_s + more_s)
}
