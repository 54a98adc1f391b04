//! When airspace of AIXM is active: its timesheets, as a schedule of ED-269, which says the same in other words.

use roxmltree::Node;
use serde_json::{Value, json};

use super::{Lines, LocalName as _, all};
use crate::content::{Doubt, Outline, Period, Window};
use crate::findings::Findings;
use crate::json::{self, short};
use crate::zones::Doubts;
use crate::{applicability, export};

const DAYS: [&str; 7] = ["MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN"];
/// Days that depend on a calendar of holidays, which nobody here has.
const CALENDAR: [&str; 7] = ["ANY", "WORK_DAY", "BEF_WORK_DAY", "AFT_WORK_DAY", "HOL", "BEF_HOL", "AFT_HOL"];

/// When a time slice is active within the time at which it is valid.
pub(super) struct Active<'a> {
    pub(super) slice: Node<'a, 'a>,
    pub(super) window: Window,
    pub(super) outlines: Vec<Outline>,
}

impl Active<'_> {
    /// The periods. What is not understood makes them longer.
    pub(super) fn periods(
        &self,
        lines: &Lines,
        remarks: &mut Vec<String>,
        doubts: &mut Vec<Doubt>,
        findings: &mut Findings,
    ) -> Vec<Period> {
        let always = vec![Period { window: self.window, hours: None }];
        let mut schedule = Vec::new();
        for activation in all(self.slice, "activation").flat_map(|it| all(it, "AirspaceActivation")) {
            // That something is not active at a time is not believed: it is active at all times that are not told.
            if activation.child_words("status").as_deref() == Some("INACTIVE") {
                continue;
            }
            let sheets: Vec<_> = all(activation, "timeInterval").flat_map(|it| all(it, "Timesheet")).collect();
            if sheets.is_empty() {
                return always;
            }
            for sheet in sheets.into_iter().filter(|it| it.child_words("excluded").as_deref() != Some("YES")) {
                match entries(sheet) {
                    Ok(entries) => schedule.extend(entries),
                    Err(message) => {
                        doubts.push(Doubt { place: lines.place(sheet), message });
                        return always;
                    }
                }
            }
        }
        if schedule.is_empty() {
            return always;
        }
        let [starts, ends] = [self.window.from_utc_ms, self.window.until_utc_ms].map(|it| it.map(export::utc));
        let value = json!({ "startDateTime": starts, "endDateTime": ends, "schedule": schedule });
        let node = json::Node { value: &value, place: lines.place(self.slice) };
        let mut found = Doubts::default();
        let periods = applicability::periods(Some(node), self.outlines.iter(), remarks, &mut found, findings);
        doubts.extend(found.0);
        periods
    }
}

/// The entries of a timesheet. Dates of the year are not told apart, so that it applies all year.
fn entries(sheet: Node<'_, '_>) -> Result<Vec<Value>, String> {
    let text = |name: &str| sheet.child_words(name);
    for name in ["startTimeRelativeEvent", "endTimeRelativeEvent"] {
        if text(name).is_some() {
            return Err(format!("`{name}` is not read"));
        }
    }
    let day = |name: &str| -> Result<Option<usize>, String> {
        let Some(day) = text(name) else { return Ok(None) };
        match DAYS.iter().position(|it| *it == day) {
            None if day == "BUSY_FRI" => Ok(Some(4)),
            None if !CALENDAR.contains(&day.as_str()) => Err(format!("found `{}`, expected a day", short(&day))),
            found => Ok(found),
        }
    };
    let (starts, ends) = (edge(&text, "start")?, edge(&text, "end")?);
    // In summer the hours are one hour earlier, in UTC: both are meant.
    let offset_min = offset(text("timeReference").as_deref().unwrap_or("UTC"))?;
    let is_adjusted =
        text("daylightSavingAdjust").as_deref() == Some("YES") || text("timeReference").is_some_and(|it| it == "UTCW");
    let offsets = if is_adjusted { vec![offset_min, offset_min + 60] } else { vec![offset_min] };
    let mut entries = Vec::new();
    for offset_min in offsets {
        let entry = |days: Value, starts: &Edge, ends: &Edge| {
            let mut entry = json!({ "day": days });
            starts.write(&mut entry, "start", offset_min);
            ends.write(&mut entry, "end", offset_min);
            entry
        };
        match (day("day")?, day("dayTil")?) {
            (Some(first), Some(last)) if first != last => {
                let [begins, midnight] = ["00:00", "24:00"].map(|it| Edge::Time(it.into()));
                entries.push(entry(json!([DAYS[first]]), &starts, &midnight));
                let between = (first + 1..first + 7).map(|it| it % 7).take_while(|it| *it != last);
                entries.extend(between.map(|it| entry(json!([DAYS[it]]), &begins, &midnight)));
                entries.push(entry(json!([DAYS[last]]), &begins, &ends));
            }
            (None, Some(_)) => return Err("`dayTil` after a day that is not one of the week".into()),
            (Some(day), _) => entries.push(entry(json!([DAYS[day]]), &starts, &ends)),
            (None, None) => entries.push(entry(json!(["ANY"]), &starts, &ends)),
        }
    }
    Ok(entries)
}

/// When a day's time begins or ends.
enum Edge {
    None,
    Time(String),
    Event(String),
}

fn edge(text: &impl Fn(&str) -> Option<String>, side: &str) -> Result<Edge, String> {
    match (text(&format!("{side}Time")), text(&format!("{side}Event"))) {
        (Some(_), Some(_)) => Err(format!("a `{side}Time` and a `{side}Event`")),
        (Some(time), None) => Ok(Edge::Time(time)),
        (None, Some(event)) => Ok(Edge::Event(event)),
        (None, None) => Ok(Edge::None),
    }
}

impl Edge {
    fn write(&self, entry: &mut Value, side: &str, offset_min: i32) {
        match self {
            Edge::None => {}
            Edge::Event(event) => entry[format!("{side}Event")] = json!(event),
            Edge::Time(time) => {
                let (sign, minutes) = (if offset_min < 0 { '-' } else { '+' }, offset_min.abs());
                entry[format!("{side}Time")] = json!(format!("{time}{sign}{:02}:{:02}", minutes / 60, minutes % 60));
            }
        }
    }
}

/// Minutes ahead of UTC.
fn offset(reference: &str) -> Result<i32, String> {
    let not_understood = || format!("`timeReference` is `{}`, expected UTC", short(reference));
    let rest = reference.strip_prefix("UTC").ok_or_else(not_understood)?;
    if rest.is_empty() || rest == "W" {
        return Ok(0);
    }
    let (hours, minutes) = rest.split_once(':').unwrap_or((rest, "0"));
    let hours: i32 = hours.parse().map_err(|_| not_understood())?;
    let minutes: i32 = minutes.parse().map_err(|_| not_understood())?;
    if !(-14..=14).contains(&hours) || !(0..60).contains(&minutes) {
        return Err(not_understood());
    }
    Ok(hours * 60 + if rest.starts_with('-') { -minutes } else { minutes })
}
