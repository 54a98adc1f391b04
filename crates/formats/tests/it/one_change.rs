//! Each feed with one thing changed at a time: no area may vanish, shrink or apply less without a word.

use super::golden::{FEEDS, loud, over_ground};
use super::samples::GEO_JSON;
use super::{import, mission, try_mission};
use domain::area::{Area, AreaKind};
use domain::hours::WeeklyHours;
use serde_json::{Value, json};

/// The places of all values in a document but the numbers of positions, as JSON pointers.
fn places(value: &Value, at: &str, places: &mut Vec<String>) {
    if !at.is_empty() {
        places.push(at.to_owned());
    }
    match value {
        Value::Object(members) => {
            members.iter().for_each(|(key, it)| self::places(it, &format!("{at}/{}", key.replace('/', "~1")), places));
        }
        Value::Array(items) if !items.iter().any(Value::is_number) => {
            items.iter().enumerate().for_each(|(index, it)| self::places(it, &format!("{at}/{index}"), places));
        }
        _ => {}
    }
}

/// What people and programs do to a value. `None`: it is not there.
fn changes(value: &Value) -> Vec<Option<Value>> {
    let mut changes = vec![
        None,
        Some(Value::Null),
        Some(json!("")),
        Some(json!({})),
        Some(json!([])),
        Some(json!(true)),
        Some(json!("x")),
    ];
    changes.push(Some(json!([value])));
    match value {
        Value::String(text) => {
            changes.extend([text.to_lowercase(), text.to_uppercase(), format!(" {text} ")].map(|it| Some(json!(it))))
        }
        Value::Number(number) => changes.push(Some(json!(number.to_string()))),
        Value::Array(items) => {
            if let [only] = items.as_slice() {
                changes.push(Some(only.clone()));
            }
        }
        _ => {}
    }
    changes
}

/// With that change. One in a list is not removed: the list then says something else.
fn changed(document: &Value, place: &str, change: &Option<Value>) -> Option<Value> {
    let mut document = document.clone();
    match change {
        Some(value) => *document.pointer_mut(place)? = value.clone(),
        None => {
            let (parent, key) = place.rsplit_once('/')?;
            document.pointer_mut(parent)?.as_object_mut()?.remove(&key.replace("~1", "/"))?;
        }
    }
    Some(document)
}

/// Whether `area` bars all that `before` did: as strictly, at all its heights and times, all round its middle.
fn bars(area: &Area, before: &Area) -> bool {
    let low = |it: Option<f64>| it.unwrap_or(f64::NEG_INFINITY);
    let high = |it: Option<f64>| it.unwrap_or(f64::INFINITY);
    let is_as_long = (area.from_utc_ms.is_none()
        || area.from_utc_ms <= before.from_utc_ms && before.from_utc_ms.is_some())
        && (area.until_utc_ms.is_none() || before.until_utc_ms <= area.until_utc_ms && before.until_utc_ms.is_some())
        && covers(area.hours.as_ref(), before.hours.as_ref());
    let box_of = |it: &Area| {
        let of = |number: fn(&domain::geometry::Ned) -> f64| {
            it.corners
                .iter()
                .map(number)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(it), high.max(it)))
        };
        [of(|it| it.north_m), of(|it| it.east_m)]
    };
    let is_as_wide = box_of(area).iter().zip(box_of(before)).all(|(a, b)| a.0 <= b.0 + 1.0 && b.1 <= a.1 + 1.0);
    (area.kind == before.kind || area.kind == AreaKind::KeepOut)
        && low(area.floor_m) <= low(before.floor_m)
        && high(before.ceiling_m) <= high(area.ceiling_m)
        && is_as_long
        && is_as_wide
}

/// Whether these hours are all of the others, and perhaps more. `None`: always.
fn covers(hours: Option<&WeeklyHours>, others: Option<&WeeklyHours>) -> bool {
    // A week from a Monday on, by the quarter of an hour.
    let moments = (0..7 * 96).map(|quarter| 345_600_000 + quarter * 900_000);
    let at = |hours: Option<&WeeklyHours>, ms| hours.is_none_or(|it| it.covers(ms));
    hours.is_none() || moments.into_iter().all(|ms| at(hours, ms) || !at(others, ms))
}

/// Without it a zone says something else, which is as good: a period that is not permanent has its dates.
const SAYS_SOMETHING_ELSE: [&str; 1] = ["/permanent"];

#[test]
fn nothing_vanishes_without_a_word() {
    // `KITTIWAKE_SWEEP=all` makes every change.
    let step = if std::env::var("KITTIWAKE_SWEEP").is_ok_and(|it| it == "all") { 1 } else { 8 };
    let mut count = 0;
    let mut lost = Vec::new();
    for (name, text) in FEEDS.into_iter().chain([("areas.geojson", GEO_JSON)]) {
        let feed: Value = serde_json::from_str(text.trim_start_matches('\u{feff}')).unwrap();
        let list = if feed.get("UASZoneList").is_some() { "UASZoneList" } else { "features" };
        for zone in feed[list].as_array().unwrap() {
            let mut document = feed.clone();
            document[list] = json!([zone]);
            let read = |document: &Value| import(name, &document.to_string(), &over_ground());
            let good = read(&document).unwrap();
            if !loud(&good).is_empty() {
                continue;
            }
            let before = mission(&good).areas;
            let mut all = Vec::new();
            places(zone, &format!("/{list}/0"), &mut all);
            for place in all {
                for change in changes(document.pointer(&place).unwrap()) {
                    count += 1;
                    let is_nothing = change.as_ref().is_none_or(|it| it.is_null() || *it == "");
                    let is_else = is_nothing && SAYS_SOMETHING_ELSE.iter().any(|it| place.ends_with(it));
                    if count % step != 0 || is_else {
                        continue;
                    }
                    let Some(changed) = changed(&document, &place, &change) else { continue };
                    let Ok(read) = read(&changed) else { continue };
                    // An import that makes no mission that can be flown is refused.
                    let Ok(after) = try_mission(&read) else { continue };
                    let after = after.areas;
                    let all_bar = before.iter().all(|it| after.iter().any(|after| bars(after, it)));
                    if !all_bar && loud(&read).is_empty() {
                        lost.push(format!("{name} {place} {change:?}"));
                    }
                }
            }
        }
    }
    assert!(lost.is_empty() && 10_000 < count, "{} of {count}:\n{}", lost.len(), lost.join("\n"));
}
