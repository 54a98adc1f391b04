//! `kittiwake airspace check`.

use formats::Import;
use formats::content::Doubt;
use formats::inspect::{Summary, inspect, kinds, within};
use serde_json::{Value, json};

use crate::airspace::args::{CheckArgs, Reach};
use crate::airspace::{counts, edition, read};
use crate::outcome::Outcome;
use crate::output;
use crate::output::visible::one_line;
use crate::plan::now;

/// Doubts that are listed of one file; programs get all.
const MOST_LISTED: usize = 100;

/// Prints what each data set has. What is found wrong decides the exit code, also if others are good.
pub(super) fn check(args: &CheckArgs, as_json: bool) -> Outcome {
    let utc_ms = now().utc_ms;
    let (mut documents, mut wrong) = (Vec::new(), Vec::new());
    for path in &args.files {
        let found = match read(path) {
            Ok(import) => File::of(&import, args.reach, utc_ms),
            Err(mistakes) => {
                wrong.push(mistakes.to_string());
                continue;
            }
        };
        if as_json {
            documents.push(found.document());
        } else {
            found.lines().iter().for_each(|it| output::line(one_line(it)));
        }
        wrong.extend(found.why_refused(args.strict).into_iter().map(|why| format!("{}: {why}", path.display())));
    }
    if as_json {
        output::line(format_args!("{:#}", json!({ "files": documents, "refused": wrong })));
    }
    wrong.iter().for_each(output::error_line);
    if wrong.is_empty() { Outcome::Success } else { Outcome::BadInput }
}

/// What is said of a file.
struct File {
    path: String,
    format: String,
    feed: domain::feed::Feed,
    found: Summary,
    utc_ms: i64,
    notes: usize,
}

impl File {
    fn of(import: &Import, reach: Reach, utc_ms: i64) -> File {
        let zones = &import.content.zones;
        let found = match reach.origin {
            Some(origin) => inspect(import, &within(zones, origin.place, reach.within * 1000.0)),
            None => inspect(import, zones),
        };
        let (format, notes) = (import.format.to_string(), import.notes.len());
        File { path: import.path.display().to_string(), format, feed: import.feed(), found, utc_ms, notes }
    }

    fn lines(&self) -> Vec<String> {
        let Summary { zones, without_restriction, doubts, without_shape, .. } = &self.found;
        let mut lines = vec![format!("{}: {}", self.path, self.format)];
        lines.push(format!("  edition: {}", self.feed.in_words()));
        lines.extend(self.feed.out_of_date(self.utc_ms).map(|it| format!("  WARNING: {it}")));
        let kinds_of_zone = if *zones == 0 { String::new() } else { format!(" ({})", counts(&self.found.kinds)) };
        lines.push(format!(
            "  zones: {zones}{kinds_of_zone}; left out, since without restriction: {without_restriction}"
        ));
        let without = self.found.without_upper_limit;
        let limits = self.found.references.iter().map(|(words, count)| format!("{count} above {words}, "));
        lines.push(format!("  limits: {}zones without an upper one: {without}", limits.collect::<String>()));
        lines.push(format!(
            "  times: zones with hours: {}, in periods: {}",
            self.found.with_hours, self.found.with_periods
        ));
        if let Some([low, high]) = self.found.bounds {
            let place = |it: domain::geodesy::LatLon| format!("{:.5}, {:.5}", it.latitude_deg(), it.longitude_deg());
            lines.push(format!("  from {} to {}", place(low), place(high)));
        }
        if 0 < self.notes {
            lines.push(format!("  notes: {}; `kittiwake airspace import` lists them", self.notes));
        }
        if !doubts.is_empty() {
            lines.push(format!("  NOT UNDERSTOOD: {}; such a zone bars more", doubts.len()));
            lines.extend(kinds(doubts).into_iter().map(|(kind, count)| format!("    {count} x {kind}")));
            lines.extend(listed(doubts));
        }
        if !without_shape.is_empty() {
            lines.push(format!("  ZONES WITHOUT A SHAPE THAT CAN BE READ: {}", without_shape.len()));
            lines.extend(listed(without_shape));
        }
        lines
    }

    fn document(&self) -> Value {
        let Summary { doubts, without_shape, bounds, .. } = &self.found;
        let places = |list: &[Doubt]| -> Vec<Value> {
            list.iter().map(|it| json!({ "place": it.place, "message": it.message })).collect()
        };
        let kinds: Vec<Value> =
            kinds(doubts).into_iter().map(|(kind, count)| json!({ "kind": kind, "count": count })).collect();
        let bounds = bounds.map(|[low, high]| {
            json!({ "south": low.latitude_deg(), "west": low.longitude_deg(),
                "north": high.latitude_deg(), "east": high.longitude_deg() })
        });
        json!({
            "file": self.path,
            "format": self.format,
            "edition": edition(&self.feed, self.utc_ms),
            "zones": self.found.zones,
            "kinds": self.found.kinds,
            "withoutRestriction": self.found.without_restriction,
            "limitsAbove": self.found.references,
            "withoutUpperLimit": self.found.without_upper_limit,
            "withHours": self.found.with_hours,
            "inPeriods": self.found.with_periods,
            "bounds": bounds,
            "notes": self.notes,
            "kindsOfDoubt": kinds,
            "notUnderstood": places(doubts),
            "withoutShape": places(without_shape),
        })
    }

    fn why_refused(&self, strict: bool) -> Vec<String> {
        let Summary { zones, doubts, without_shape, .. } = &self.found;
        let mut why = Vec::new();
        match (without_shape.len(), *zones) {
            (0, 0) => why.push("no zone was found".to_owned()),
            (0, _) => {}
            (count, _) => {
                why.push(format!("{count} zones have no shape that can be read: nobody knows where they lie"))
            }
        }
        if strict && !doubts.is_empty() {
            why.push(format!("--strict: not understood: {}", doubts.len()));
        }
        why.extend(self.feed.out_of_date(self.utc_ms).filter(|_| strict).map(|it| format!("--strict: {it}")));
        why
    }
}

/// A line for each of the first.
fn listed(doubts: &[Doubt]) -> Vec<String> {
    let lines = doubts.iter().take(MOST_LISTED).map(|it| format!("    at {}: {}", it.place, it.message));
    let more = doubts.len().saturating_sub(MOST_LISTED);
    lines.chain((0 < more).then(|| format!("    and {more} more: --json has all"))).collect()
}
