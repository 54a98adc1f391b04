//! Two editions of a data set, or of a mission's areas: what was closed, opened and changed.
//!
//! Zones are matched by their names; those whose names are new or gone, by their outlines. Both editions are in one local frame.

use std::collections::BTreeMap;

use domain::area::{Area, AreaKind};
use domain::geodesy::LocalFrame;
use domain::hours::WeeklyHours;
use domain::time::utc_text;
use geo::{Area as _, Centroid as _, Distance as _, Euclidean, LineString, Polygon};

use crate::content::{Height, Period, Reference, Rule, Zone};
use crate::local::{self, Side};

/// A zone as it is compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Several may have the same: the parts of a zone.
    pub name: String,
    /// The word for what it takes to enter.
    pub kind: &'static str,
    /// Its heights in words.
    pub band: String,
    /// When it applies, in words; none: always.
    pub times: Vec<String>,
    /// Its outline in the local frame: x is east, y is north, in metres.
    pub shape: Polygon<f64>,
}

/// A zone that is there in both editions, and is not the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// As it was.
    pub old: Item,
    /// As it is.
    pub new: Item,
    /// What has changed, in words.
    pub what: Vec<String>,
}

/// What differs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Difference {
    /// Zones that are new: they close airspace.
    pub closed: Vec<Item>,
    /// Zones that are gone: they open airspace.
    pub opened: Vec<Item>,
    /// Zones that are otherwise.
    pub changed: Vec<Change>,
    /// Zones that are the same.
    pub unchanged: Vec<Item>,
}

impl Difference {
    /// Whether nothing differs.
    pub fn is_empty(&self) -> bool {
        self.closed.is_empty() && self.opened.is_empty() && self.changed.is_empty()
    }
}

/// The zones of a data set in this frame.
pub fn of_zones(zones: &[Zone], frame: &LocalFrame) -> Vec<Item> {
    let item = |it: &Zone| {
        let (kind, side) = match it.rule {
            Rule::KeepOut => ("keep-out", Side::Contain),
            Rule::Permission => ("permission", Side::Contain),
            Rule::StayInside => ("stay inside", Side::Inscribe),
        };
        let always = it.periods.contains(&Period::default());
        let mut times: Vec<String> = it.periods.iter().filter(|_| !always).map(of_period).collect();
        times.sort();
        Item {
            name: it.name.clone(),
            kind,
            band: band(it.lower.map(of_height), it.upper.map(of_height)),
            times,
            shape: local::polygon(&it.outline, frame, side),
        }
    };
    zones.iter().map(item).collect()
}

/// The areas of a mission, in its own frame.
pub fn of_areas<'a>(areas: impl IntoIterator<Item = &'a Area>) -> Vec<Item> {
    let item = |it: &Area| {
        let above = |m: f64| format!("{} m above the take-off point", rounded(m));
        let time = of_window(it.from_utc_ms, it.until_utc_ms, it.hours.as_ref());
        Item {
            name: it.name.clone(),
            kind: match it.kind {
                AreaKind::KeepOut => "keep-out",
                AreaKind::Permission => "permission",
            },
            band: band(it.floor_m.map(above), it.ceiling_m.map(above)),
            times: Some(time).filter(|it| !it.is_empty()).into_iter().collect(),
            shape: it.polygon(),
        }
    };
    areas.into_iter().map(item).collect()
}

/// What differs between two editions.
pub fn compare(old: Vec<Item>, new: Vec<Item>) -> Difference {
    let mut difference = Difference::default();
    // The same in everything first: of several parts with one name the others are then few.
    let (old, new) = pair(old, new, |it| (it.name.clone(), it.content()), |_, new| difference.unchanged.push(new));
    let mut changes = Vec::new();
    let mut change = |old: Item, new: Item| changes.push((old, new));
    let (old, new) = pair(old, new, |it| (it.name.clone(), outline(&it.shape)), &mut change);
    let (old, new) = pair(old, new, |it| it.name.clone(), &mut change);
    let (opened, closed) = pair(old, new, |it| outline(&it.shape), &mut change);
    let changed = changes.into_iter().map(|(old, new)| Change { what: what_changed(&old, &new), old, new });
    Difference { closed, opened, changed: changed.collect(), ..difference }
}

/// Pairs items of the two lists that have the same key, in the order of the lists; returns the others.
fn pair<K: Ord>(
    old: Vec<Item>,
    new: Vec<Item>,
    key: impl Fn(&Item) -> K,
    mut paired: impl FnMut(Item, Item),
) -> (Vec<Item>, Vec<Item>) {
    let mut waiting: BTreeMap<K, std::collections::VecDeque<usize>> = BTreeMap::new();
    for (index, it) in old.iter().enumerate() {
        waiting.entry(key(it)).or_default().push_back(index);
    }
    let mut old: Vec<Option<Item>> = old.into_iter().map(Some).collect();
    let mut rest = Vec::new();
    for it in new {
        let before = waiting.get_mut(&key(&it)).and_then(|it| it.pop_front()).and_then(|index| old[index].take());
        match before {
            Some(before) => paired(before, it),
            None => rest.push(it),
        }
    }
    (old.into_iter().flatten().collect(), rest)
}

impl Item {
    /// Its rings, the outline first, each corner as metres north and east.
    pub fn rings(&self) -> Vec<Vec<(f64, f64)>> {
        let rings = std::iter::once(self.shape.exterior()).chain(self.shape.interiors());
        rings.map(|ring| ring.coords().map(|it| (it.y, it.x)).collect()).collect()
    }

    /// All but its name.
    fn content(&self) -> (&'static str, String, Vec<String>, Rings) {
        (self.kind, self.band.clone(), self.times.clone(), outline(&self.shape))
    }
}

/// Rings of corners in whole centimetres.
type Rings = Vec<Vec<(i64, i64)>>;

/// The outline, the same for any first corner and both directions.
fn outline(shape: &Polygon<f64>) -> Rings {
    let ring = |ring: &LineString<f64>| {
        let count = ring.0.len().saturating_sub(1);
        let centimetres = |m: f64| (m * 100.0).round() as i64;
        let mut corners: Vec<_> = ring.0.iter().take(count).map(|it| (centimetres(it.x), centimetres(it.y))).collect();
        let first = (0..corners.len()).min_by_key(|it| corners[*it]).unwrap_or_default();
        corners.rotate_left(first);
        if corners.last() < corners.get(1) {
            corners[1..].reverse();
        }
        corners
    };
    let mut holes: Rings = shape.interiors().iter().map(ring).collect();
    holes.sort();
    std::iter::once(ring(shape.exterior())).chain(holes).collect()
}

fn what_changed(old: &Item, new: &Item) -> Vec<String> {
    let mut what = Vec::new();
    let mut differs = |name: &str, old: &str, new: &str| {
        if old != new {
            what.push(format!("{name}: {old} -> {new}"));
        }
    };
    differs("renamed", &old.name, &new.name);
    differs("kind", old.kind, new.kind);
    differs("heights", &old.band, &new.band);
    differs("times", &times(old), &times(new));
    if outline(&old.shape) != outline(&new.shape) {
        what.push(moved(&old.shape, &new.shape));
    }
    what
}

/// When it applies.
pub fn times(it: &Item) -> String {
    if it.times.is_empty() { "always".into() } else { it.times.join("; ") }
}

fn moved(old: &Polygon<f64>, new: &Polygon<f64>) -> String {
    let square_km = |it: &Polygon<f64>| format!("{:.3} km2", it.unsigned_area() / 1e6);
    let distance_m = old.centroid().zip(new.centroid()).map_or(0.0, |(a, b)| Euclidean.distance(a, b));
    format!("outline: {} -> {}, its middle moved by {distance_m:.0} m", square_km(old), square_km(new))
}

fn band(lower: Option<String>, upper: Option<String>) -> String {
    format!("{} to {}", lower.unwrap_or_else(|| "ground".into()), upper.unwrap_or_else(|| "any height".into()))
}

fn of_height(height: Height) -> String {
    format!("{} m above {}", rounded(height.metres), reference(height.above))
}

/// The words for a reference.
pub fn reference(above: Reference) -> &'static str {
    match above {
        Reference::TakeOff => "the take-off point",
        Reference::Ground => "the ground",
        Reference::SeaLevel => "mean sea level",
        Reference::Ellipsoid => "the ellipsoid",
    }
}

/// To a centimetre, without a negative zero.
fn rounded(m: f64) -> f64 {
    (m * 100.0).round() / 100.0 + 0.0
}

fn of_period(period: &Period) -> String {
    of_window(period.window.from_utc_ms, period.window.until_utc_ms, period.hours.as_ref())
}

fn of_window(from_utc_ms: Option<i64>, until_utc_ms: Option<i64>, hours: Option<&WeeklyHours>) -> String {
    let from = from_utc_ms.map(|it| format!("from {}", utc_text(it)));
    let until = until_utc_ms.map(|it| format!("until {}", utc_text(it)));
    let hours = hours.map(|it| it.to_texts().join(", "));
    [from, until, hours].into_iter().flatten().collect::<Vec<_>>().join(" ")
}
