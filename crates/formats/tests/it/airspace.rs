//! Data sets: what they have, what differs between two of them, and a new one in place of an old one.

use domain::feed::Feed;
use domain::file::Source;
use domain::geodesy::LocalFrame;
use domain::mission::Mission;
use formats::assemble::{Settings, assemble, assemble_airspace};
use formats::compare::{Difference, compare, of_areas, of_zones};
use formats::content::Doubt;
use formats::inspect::{bounds, inspect, kinds, middle, within};
use formats::replace::without_feeds;
use serde_json::{Value, json};

use super::{origin, settings, source};

/// A data set of ED-269 with these zones.
fn data_set(zones: &[Value]) -> formats::Import {
    let text = json!({
        "title": "Zones of Nowhere", "createdAt": "2026-05-01T00:00:00Z", "features": zones,
        "metadata": { "validFrom": "2026-05-01T00:00:00Z", "validTo": "2026-06-01T00:00:00Z" },
    });
    formats::read(&source("zones.json", &text.to_string())).unwrap_or_else(|it| panic!("{it}"))
}

/// A square zone, that many hundredths of a degree north of the take-off point.
fn zone(name: &str, north: u32, restriction: &str) -> Value {
    let south = 54.0 + f64::from(north) / 100.0;
    json!({
        "identifier": name, "country": "XXX", "name": name, "type": "COMMON", "restriction": restriction,
        "reason": ["AIR_TRAFFIC"], "applicability": [{ "permanent": "YES" }],
        "geometry": [{
            "uomDimensions": "M", "lowerLimit": 0, "lowerVerticalReference": "AGL",
            "upperLimit": 120, "upperVerticalReference": "AMSL",
            "horizontalProjection": { "type": "Polygon", "coordinates":
                [[[6.61, south], [6.62, south], [6.62, south + 0.005], [6.61, south + 0.005], [6.61, south]]] },
        }],
    })
}

#[test]
fn a_data_set_is_counted() {
    let mut night = zone("N", 3, "PROHIBITED");
    night["applicability"] = json!([{ "startDateTime": "2026-05-01T00:00:00Z", "endDateTime": "2026-05-02T00:00:00Z",
        "schedule": [{ "day": ["MON"], "startTime": "20:00:00Z", "endTime": "22:00:00Z" }] }]);
    let mut crossed = zone("C", 4, "PROHIBITED");
    crossed["geometry"][0]["horizontalProjection"]["coordinates"] =
        json!([[[6.61, 54.0], [6.62, 54.01], [6.62, 54.0], [6.61, 54.01], [6.61, 54.0]]]);
    let import = data_set(&[
        zone("A", 1, "REQ_AUTHORISATION"),
        zone("B", 2, "NO_RESTRICTION"),
        night,
        crossed,
        zone("D", 5, "FORBIDDEN"),
        zone("E", 6, "BANNED"),
        json!({ "identifier": "L", "country": "XXX", "restriction": "PROHIBITED", "geometry": [] }),
    ]);
    let found = inspect(&import, &import.content.zones);
    assert_eq!((found.zones, found.without_restriction, found.with_hours, found.with_periods), (5, 1, 1, 1));
    assert_eq!(found.kinds.into_iter().collect::<Vec<_>>(), [("keep-out", 4), ("permission", 1)]);
    let references: Vec<_> = found.references.into_iter().collect();
    assert_eq!(references, [("mean sea level", 5), ("the ground", 5)]);
    assert_eq!(found.without_shape.len(), 1);
    assert!(found.without_shape[0].message.contains("zone `L` has no geometry"), "{:?}", found.without_shape);
    let told = kinds(&found.doubts);
    assert_eq!(told.iter().map(|it| it.1).collect::<Vec<_>>(), [2, 1], "{told:?}");
    assert!(told[0].0.starts_with("restriction: found .., expected PROHIBITED"), "{told:?}");
    assert!(told[1].0.ends_with("the ring crosses or touches itself"), "{told:?}");
    let [low, high] = found.bounds.unwrap();
    let corners = [low, high].map(|it| format!("{:.3} {:.3}", it.latitude_deg(), it.longitude_deg()));
    assert_eq!(corners, ["54.000 6.610", "54.065 6.620"]);
    let near = within(&import.content.zones, origin().place, 2_000.0);
    assert_eq!(near.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["A", "C"]);
}

#[test]
fn a_kind_of_doubt_is_what_several_have_in_common() {
    #[track_caller]
    fn check(place: &str, message: &str, expected: &str) {
        let doubt = Doubt { place: place.into(), message: message.into() };
        assert_eq!(kinds(&[doubt]), [(expected.to_owned(), 1)]);
    }
    check("/features/3/restriction", "found `X`, expected A", "restriction: found .., expected A");
    check("/features/3", "`lowerLimit` is missing", "`lowerLimit` is missing");
    check("/features/3", "a ring that encloses 0.1 square metres", "a ring that encloses .. square metres");
    check("line 7", "found `a`, expected `b`", "found .., expected `b`");
}

#[test]
fn the_box_round_zones_may_lie_across_the_antimeridian() {
    let mut fiji = zone("F", 0, "PROHIBITED");
    fiji["geometry"][0]["horizontalProjection"]["coordinates"] =
        json!([[[179.9, -17.0], [-179.9, -17.0], [-179.9, -16.0], [179.9, -16.0], [179.9, -17.0]]]);
    let corners = bounds(&data_set(&[fiji]).content.zones).unwrap();
    assert!((corners[0].longitude_deg() - 179.9).abs() < 1e-9 && (corners[1].longitude_deg() + 179.9).abs() < 1e-9);
    let centre = middle(corners);
    assert!(centre.latitude_deg() == -16.5 && 179.99 < centre.longitude_deg().abs(), "{centre:?}");
    assert_eq!(bounds(&[]), None);
}

/// The difference in a line for each zone.
fn told(found: &Difference) -> Vec<String> {
    let closed = found.closed.iter().map(|it| format!("closed {}", it.name));
    let opened = found.opened.iter().map(|it| format!("opened {}", it.name));
    let changed = found.changed.iter().map(|it| format!("changed {}: {}", it.new.name, it.what.join("; ")));
    closed.chain(opened).chain(changed).collect()
}

#[test]
fn what_differs_between_two_editions_is_told() {
    #[track_caller]
    fn check(new: &[Value], expected: &[&str], unchanged: usize) {
        let frame = LocalFrame::at(origin().place);
        let old = [zone("A", 1, "PROHIBITED"), zone("B", 2, "PROHIBITED"), zone("B", 3, "PROHIBITED")];
        let items = |zones: &[Value]| of_zones(&data_set(zones).content.zones, &frame);
        let found = compare(items(&old), items(new));
        assert_eq!(
            (told(&found), found.unchanged.len()),
            (expected.iter().map(|it| (*it).to_owned()).collect(), unchanged)
        );
        assert_eq!(found.is_empty(), expected.is_empty());
    }
    let [a, b, c] = [zone("A", 1, "PROHIBITED"), zone("B", 2, "PROHIBITED"), zone("B", 3, "PROHIBITED")];
    let with = |it: &Value, pointer: &str, value: Value| {
        let mut changed = it.clone();
        *changed.pointer_mut(pointer).unwrap() = value;
        changed
    };
    // The order of zones and corners does not matter.
    let ring = "/geometry/0/horizontalProjection/coordinates";
    let turned = json!([[[6.62, 54.015], [6.62, 54.01], [6.61, 54.01], [6.61, 54.015], [6.62, 54.015]]]);
    check(&[c.clone(), with(&a, ring, turned), b.clone()], &[], 3);
    check(&[a.clone(), b.clone()], &["opened B"], 2);
    check(&[a.clone(), b.clone(), c.clone(), zone("D", 4, "PROHIBITED")], &["closed D"], 3);
    let kind = with(&a, "/restriction", json!("REQ_AUTHORISATION"));
    check(&[kind, b.clone(), c.clone()], &["changed A: kind: keep-out -> permission"], 2);
    let band = with(&a, "/geometry/0/upperLimit", json!(60));
    let expected = "changed A: heights: 0 m above the ground to 120 m above mean sea level -> 0 m above the ground to 60 m above mean sea level";
    check(&[band, b.clone(), c.clone()], &[expected], 2);
    let times = with(&a, "/applicability", json!([{ "startDateTime": "2026-05-01T00:00:00Z" }]));
    check(&[times, b.clone(), c.clone()], &["changed A: times: always -> from 2026-05-01T00:00:00Z"], 2);
    check(&[zone("Z", 1, "PROHIBITED"), b.clone(), c.clone()], &["changed Z: renamed: A -> Z"], 2);
    let moved = "changed B: outline: 0.365 km2 -> 0.364 km2, its middle moved by 2226 m";
    check(&[a.clone(), b.clone(), zone("B", 5, "PROHIBITED")], &[moved], 2);
}

const MISSION: &str = "\
# Ours.
name = \"m\"

[origin]
latitude_deg = 54.0
longitude_deg = 6.6
altitude_m = 20.0

[[objective]]
name = \"look\"
north_m = 0.0
east_m = 0.0
height_m = 20.0
flying = true

# The pier.
[[area]]
name = \"A\" # as the harbour calls it
kind = \"keep-out\"
corners_m = [
  [200.0, 100.0], # the bollard
  [300.0, 100.0],
  [300.0, 200.0],
]
";

fn read(text: &str) -> Mission {
    Mission::read(&Source { path: "m.toml".into(), text: text.into() }).unwrap_or_else(|it| panic!("{it}\n{text}"))
}

#[test]
fn a_new_edition_takes_the_place_of_the_old_one_and_leaves_the_missions_own_areas_alone() {
    let own = vec!["A".to_owned()];
    let edition = |zones: &[Value]| {
        assemble_airspace(&[data_set(zones)], origin(), &own, &Settings { origin: None, ..settings() })
            .unwrap_or_else(|it| panic!("{it}"))
    };
    let first = edition(&[zone("A", 1, "PROHIBITED"), zone("B", 2, "REQ_AUTHORISATION")]);
    let with_first = format!("{MISSION}{}", first.text);
    let mission = read(&with_first);
    let names: Vec<&str> = mission.areas.iter().map(|it| it.name.as_str()).collect();
    assert_eq!((first.areas, names), (2, vec!["A", "A 2", "B"]), "the mission's own area keeps its name");
    let expected = Feed {
        name: "zones.json".into(),
        provider: Some("Zones of Nowhere".into()),
        issued_utc_ms: Some(1_777_593_600_000),
        valid_from_utc_ms: Some(1_777_593_600_000),
        valid_until_utc_ms: Some(1_780_272_000_000),
        areas: vec!["A 2".into(), "B".into()],
    };
    assert_eq!(mission.feeds, [expected]);
    // What a human wrote is still there to the letter.
    assert_eq!(without_feeds(&source("m.toml", &with_first)).unwrap(), MISSION);
    let second = read(&format!("{MISSION}{}", edition(&[zone("B", 2, "REQ_AUTHORISATION")]).text));
    let found = compare(of_areas(&mission.areas), of_areas(&second.areas));
    assert_eq!((told(&found), found.unchanged.len()), (vec!["opened A 2".to_owned()], 2));
    // An area that did not change is the same to the last digit: its grants hold.
    assert_eq!(mission.areas[2], second.areas[1]);
}

#[test]
fn an_import_names_its_feeds_and_not_its_own_areas() {
    let text =
        assemble(&data_set(&[zone("A", 1, "PROHIBITED")]), &[data_set(&[zone("B", 2, "PROHIBITED")])], &settings());
    let objective = MISSION.split("\n\n").find(|it| it.contains("[[objective]]")).unwrap();
    let mission = read(&format!("{}\n{objective}\n", text.unwrap_or_else(|it| panic!("{it}")).text));
    assert_eq!((mission.feed_of("A"), mission.feed_of("B").map(|it| it.name.as_str())), (None, Some("zones.json")));
}

#[test]
fn where_a_file_is_not_toml_is_told() {
    let wrong = without_feeds(&source("m.toml", "name = ")).unwrap_err().to_string();
    assert!(wrong.starts_with("m.toml:1:"), "{wrong}");
    let inline = "area = [{ name = \"Z\", feed = \"z\" }, { name = \"a\" }]\n";
    let left: toml::Table = without_feeds(&source("m.toml", inline)).unwrap().parse().unwrap();
    assert_eq!(left["area"].as_array().unwrap().len(), 1);
}
