//! What a data set has, in numbers: for who checks an edition before it is used.

use std::collections::BTreeMap;
use std::path::Path;

use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use geo::{Contains as _, Distance as _, Euclidean};

use crate::Import;
use crate::compare::reference;
use crate::content::{Doubt, Outline, Period, Rule, Zone};
use crate::findings::{Findings, Wrong};
use crate::heights;
use crate::local::{self, Side};
use crate::shape::turn_deg;
use crate::zones::WITHOUT_RESTRICTION;

/// The counts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    /// All zones; the parts of one count each.
    pub zones: usize,
    /// By the word for what it takes to enter.
    pub kinds: BTreeMap<&'static str, usize>,
    /// Zones without restriction, which are left out.
    pub without_restriction: usize,
    /// Limits by the words for their reference.
    pub references: BTreeMap<&'static str, usize>,
    /// Zones without an upper limit.
    pub without_upper_limit: usize,
    /// Zones with hours of the week.
    pub with_hours: usize,
    /// Zones that apply in periods from or until a date.
    pub with_periods: usize,
    /// What was not understood; such a zone bars more.
    pub doubts: Vec<Doubt>,
    /// Zones whose shape cannot be read.
    pub without_shape: Vec<Doubt>,
    /// The southern- and western-most corner, and the northern- and eastern-most; the west is greater than the east across the
    /// antimeridian. `None` without zones.
    pub bounds: Option<[LatLon; 2]>,
}

/// The counts of these zones of a file.
pub fn inspect(import: &Import, zones: &[Zone]) -> Summary {
    let mut summary = Summary {
        zones: zones.len(),
        without_restriction: import.notes.iter().filter(|it| it.text == WITHOUT_RESTRICTION).count(),
        without_shape: import.content.without_shape().collect(),
        bounds: bounds(zones),
        ..Summary::default()
    };
    for zone in zones {
        let kind = match zone.rule {
            Rule::KeepOut => "keep-out",
            Rule::Permission => "permission",
            Rule::StayInside => "stay inside",
        };
        *summary.kinds.entry(kind).or_default() += 1;
        for height in [zone.lower, zone.upper].into_iter().flatten() {
            *summary.references.entry(reference(height.above)).or_default() += 1;
        }
        summary.without_upper_limit += usize::from(zone.upper.is_none());
        let has = |of: fn(&Period) -> bool| usize::from(zone.periods.iter().any(of));
        summary.with_hours += has(|it| it.hours.is_some());
        summary.with_periods += has(|it| it.window != Default::default());
        summary.doubts.extend(zone.doubts.iter().cloned());
        summary.doubts.extend(doubts_of_shape(zone));
    }
    summary
}

/// What an import would not understand of its shape and its limits. The frame is its own: no take-off point is needed.
fn doubts_of_shape(zone: &Zone) -> impl Iterator<Item = Doubt> {
    let frame = LocalFrame::at(first_place(&zone.outline));
    // What is said about holes is said by an import.
    let mut findings = Findings::about(Path::new(""));
    let shape = local::checked(local::polygon(&zone.outline, &frame, Side::Contain), &zone.source, &mut findings).err();
    let doubt = |it: Wrong| Doubt { place: it.place, message: it.message };
    [shape, heights::exchanged(zone)].into_iter().flatten().map(doubt)
}

fn first_place(outline: &Outline) -> LatLon {
    match outline {
        Outline::Polygon { border, .. } => border[0],
        Outline::Circle { centre, .. } => *centre,
    }
}

/// The zones of which some part lies within this many metres of a place.
pub fn within(zones: &[Zone], place: LatLon, metres: f64) -> Vec<Zone> {
    let frame = LocalFrame::at(place);
    let here = geo::Point::new(0.0, 0.0);
    let is_near = |it: &&Zone| {
        let polygon = local::polygon(&it.outline, &frame, Side::Contain);
        polygon.contains(&here) || Euclidean.distance(&here, polygon.exterior()) <= metres
    };
    zones.iter().filter(is_near).cloned().collect()
}

/// The corners of the box round all zones.
pub fn bounds(zones: &[Zone]) -> Option<[LatLon; 2]> {
    let first = first_place(&zones.first()?.outline);
    let (mut south, mut north) = (f64::INFINITY, f64::NEG_INFINITY);
    let (mut west, mut east) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut add = |it: LatLon| {
        (south, north) = (south.min(it.latitude_deg()), north.max(it.latitude_deg()));
        let turn = turn_deg(first, it);
        (west, east) = (west.min(turn), east.max(turn));
    };
    for zone in zones {
        match &zone.outline {
            Outline::Polygon { border, .. } => border.iter().copied().for_each(&mut add),
            Outline::Circle { centre, radius_m } => {
                let frame = LocalFrame::at(*centre);
                for (north, east) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
                    add(frame.lat_lon(Ned::new(north * radius_m, east * radius_m, 0.0)));
                }
            }
        }
    }
    let longitude = |turn: f64| (first.longitude_deg() + turn + 540.0).rem_euclid(360.0) - 180.0;
    Some([LatLon::new(south, longitude(west)).ok()?, LatLon::new(north, longitude(east)).ok()?])
}

/// Where the frame of a comparison has its origin: in the middle of a box.
pub fn middle([low, high]: [LatLon; 2]) -> LatLon {
    let latitude = f64::midpoint(low.latitude_deg(), high.latitude_deg());
    let width = (high.longitude_deg() - low.longitude_deg()).rem_euclid(360.0);
    let longitude = (low.longitude_deg() + width / 2.0 + 540.0).rem_euclid(360.0) - 180.0;
    LatLon::new(latitude, longitude).unwrap_or(low)
}

/// How often each kind of doubt occurs, most frequent first. A kind is the message without what was found.
pub fn kinds(doubts: &[Doubt]) -> Vec<(String, usize)> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for doubt in doubts {
        *counts.entry(kind(doubt)).or_default() += 1;
    }
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|it| std::cmp::Reverse(it.1));
    counts
}

/// The field of a doubt, where its place ends with one, and its message with `..` for what was found: texts in backticks after "found",
/// and numbers.
fn kind(doubt: &Doubt) -> String {
    let field = doubt.place.rsplit('/').next().filter(|it| it.chars().all(char::is_alphabetic) && !it.is_empty());
    let mut parts = doubt.message.split('`');
    let mut message = parts.next().unwrap_or_default().to_owned();
    let mut is_quoted = true;
    for part in parts {
        match is_quoted && message.ends_with("found ") {
            true => message += "..",
            false if is_quoted => message += &format!("`{part}`"),
            false => message += part,
        }
        is_quoted = !is_quoted;
    }
    let mut plain = String::new();
    let mut in_number = false;
    for character in message.chars() {
        let is_number = character.is_ascii_digit() || (in_number && character == '.');
        match (is_number, in_number) {
            (true, true) => {}
            (true, false) => plain.push_str(".."),
            (false, _) => plain.push(character),
        }
        in_number = is_number;
    }
    field.map_or_else(|| plain.clone(), |field| format!("{field}: {plain}"))
}
