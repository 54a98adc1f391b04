//! Feeds in the shapes in which authorities publish their zones, and the areas that become of each.
//!
//! The feeds were made for this project: the shapes are those of the public feeds, the places, names and texts are not. The areas were computed
//! apart from this program: of a polygon by integrating the authalic sine over the longitude on the ellipsoid of WGS 84, with its sides straight
//! in latitude and longitude in 200 pieces each; of a circle as pi times its radius squared, which its polygon exceeds by 0.6 %.
//! Heights: the take-off point is 60 m above sea level, and the ground lies at most 10 m above or below it.

use super::{import, mission, origin, settings};
use domain::area::{Area, AreaKind};
use domain::geodesy::Origin;
use domain::geometry::Ned;
use formats::assemble::{Assembled, Settings};

/// Every feed with its file.
pub(super) const FEEDS: [(&str, &str); 12] = [
    ("che.json", include_str!("golden/che.json")),
    ("fin.json", include_str!("golden/fin.json")),
    ("lux.json", include_str!("golden/lux.json")),
    ("lva.json", include_str!("golden/lva.json")),
    ("est.geojson", include_str!("golden/est.geojson")),
    ("swe.json", include_str!("golden/swe.json")),
    ("irl.geojson", include_str!("golden/irl.geojson")),
    ("dnk.geojson", include_str!("golden/dnk.geojson")),
    ("esp.geojson", include_str!("golden/esp.geojson")),
    ("bel.geojson", include_str!("golden/bel.geojson")),
    ("deu.geojson", include_str!("golden/deu.geojson")),
    ("usa.geojson", include_str!("golden/usa.geojson")),
];

/// As the cases say: over ground at 60 m.
pub(super) fn over_ground() -> Settings<'static> {
    Settings { origin: Some(Origin { altitude_m: Some(60.0), ..origin() }), relief_m: Some(10.0), ..settings() }
}

/// A line for each area but its size: its name, kind, heights above the take-off point and times.
pub(super) fn in_words(area: &Area) -> String {
    let kind = if area.kind == AreaKind::Permission { "permission" } else { "keep-out" };
    let height = |it: Option<f64>, none: &str| it.map_or_else(|| none.to_owned(), |it| it.to_string());
    let (floor, ceiling) = (height(area.floor_m, "ground"), height(area.ceiling_m, "unlimited"));
    format!("{} | {kind} | {floor} to {ceiling} | {}", area.name, when(area))
}

fn when(area: &Area) -> String {
    let utc = |ms: i64| {
        let since_epoch = std::time::Duration::from_millis(u64::try_from(ms).unwrap());
        humantime::format_rfc3339(std::time::UNIX_EPOCH + since_epoch).to_string()
    };
    let window = match (area.from_utc_ms, area.until_utc_ms) {
        (None, None) => None,
        (Some(from), None) => Some(format!("from {}", utc(from))),
        (None, Some(until)) => Some(format!("until {}", utc(until))),
        (Some(from), Some(until)) => Some(format!("{} to {}", utc(from), utc(until))),
    };
    let hours = area.hours.as_ref().map(|it| it.to_texts().join("; "));
    let parts: Vec<String> = window.into_iter().chain(hours).collect();
    if parts.is_empty() { "always".into() } else { parts.join(", ") }
}

/// In square metres, by the shoelace formula in the local frame.
fn size_m2(area: &Area) -> f64 {
    let size_m2 = |ring: &Vec<Ned>| {
        let next = ring.iter().cycle().skip(1);
        let doubled: f64 = ring.iter().zip(next).map(|(a, b)| a.east_m * b.north_m - b.east_m * a.north_m).sum();
        doubled.abs() / 2.0
    };
    size_m2(&area.corners) - area.holes.iter().map(size_m2).sum::<f64>()
}

/// What limits a flight and was not read as it stands there, or not at all.
pub(super) fn loud(assembled: &Assembled) -> Vec<String> {
    let is_loud = |text: &str| text.contains("NOT UNDERSTOOD") || text.contains("left out");
    assembled.notes.iter().filter(|it| is_loud(&it.text)).map(|it| format!("{}: {}", it.place, it.text)).collect()
}

/// Each line ends with the size of the area in square metres, which may be wrong by 1 %.
#[track_caller]
fn check(feed: &str, areas: &[&str], said: &[&str]) {
    let xml = ("gbr.xml", include_str!("golden/gbr.xml"));
    let text = FEEDS.iter().chain([&xml]).find(|(name, _)| *name == feed).unwrap().1;
    check_text(feed, text, areas, said);
}

#[track_caller]
fn check_text(name: &str, text: &str, areas: &[&str], said: &[&str]) {
    let assembled = import(name, text, &over_ground()).unwrap_or_else(|it| panic!("{it}"));
    let mission = mission(&assembled);
    let (lines, sizes): (Vec<&str>, Vec<f64>) = areas
        .iter()
        .map(|it| it.rsplit_once(" | ").unwrap())
        .map(|(line, size)| (line, size.parse::<f64>().unwrap()))
        .unzip();
    assert_eq!(mission.areas.iter().map(in_words).collect::<Vec<_>>(), lines);
    for (area, size) in mission.areas.iter().zip(sizes) {
        let found = size_m2(area);
        assert!((found / size - 1.0).abs() < 0.01, "{}: {found:.0} m2, expected {size} m2", area.name);
    }
    assert_eq!(loud(&assembled), said);
}

/// Switzerland (BAZL): ED-269 in `UASZoneList`, limits that are null, HTML in messages, local time with its offset.
#[test]
fn switzerland() {
    check(
        "che.json",
        &[
            "CHX0001 | permission | ground to unlimited | always | 29188",
            "CHX0002 | keep-out | ground to 160 | always | 7068583",
            "CHX0003 | permission | 110 to unlimited | always | 36559665",
            "CHX0004 | permission | ground to 310 | 2027-03-01T00:00:00Z to 2027-10-31T22:59:59Z, Mon-Fri 06:30-18:00 | 29174",
        ],
        &["/UASZoneList/4/restriction: a zone without restriction has no counterpart: left out"],
    );
}

/// Finland (Traficom): ED-269 in feet and metres, small letters, numbers as texts, a night from sunset to sunrise, holidays.
#[test]
fn finland() {
    check(
        "fin.json",
        &[
            "EFX1 | permission | ground to 131.92 | always | 3141593",
            "EFX2 | keep-out | -60 to 336.24 | always | 2912148",
            // The sun sets at 19:53 UTC on 31 May, and rises at 03:10 on it; later and earlier in June. Ten minutes more.
            "EFX3 | keep-out | ground to 160 | 2027-06-01T00:00:00Z to 2027-07-01T00:00:00Z, Mon-Sun 19:42-03:20 | 29153",
            "EFX4 | keep-out | ground to 160 | Mon-Sun 06:00-08:00; Fri,Sat 20:00-04:00 | 29146",
        ],
        &["/features/4/geometry/0: it lies more than 100 km from the take-off point: left out"],
    );
}

/// Luxembourg (DAC): ED-269 behind a byte order mark, three-number positions, dates without times and "9999-12-31", a ring that is not closed, and two zones of one name.
#[test]
fn luxembourg() {
    check(
        "lux.json",
        &[
            "LUX01 | keep-out | ground to 130 | always | 29181",
            "LUX02 | permission | ground to 130 | always | 29178",
            "LUX03 | permission | 40 to 130 | always | 29174",
            "LUX03 2 | permission | ground to 130 | from 2026-04-30T10:00:00Z | 29171",
            "LUX05 | keep-out | ground to 130 | always | 29167",
        ],
        &[
            "/features/4/restriction: NOT UNDERSTOOD: found `FORBIDDEN`, expected PROHIBITED, REQ_AUTHORISATION, REQ_AUTHORIZATION, CONDITIONAL, USPACE, NO_RESTRICTION, INFORMATION: it bars more",
        ],
    );
}

/// Latvia (LGS): ED-269 whose limits have two references, event days, flight levels.
#[test]
fn latvia() {
    check(
        "lva.json",
        &[
            "EVX2 | permission | ground to 702 | always | 29185",
            "EVX3 | keep-out | ground to 1160 | 2027-08-05T11:00:00Z to 2027-08-05T22:59:00Z | 29181",
            "EVX3 2 | keep-out | ground to 1160 | 2027-08-29T11:00:00Z to 2027-08-29T22:59:00Z | 29181",
            "EVX4 | keep-out | ground to unlimited | always | 29178",
            // 95 * 30.48 m are 2895.6 m; 10 % and 400 m more, and 60 m less.
            "EVX5 | keep-out | ground to 3525.16 | always | 29174",
            // 245 * 30.48 m are 7467.6 m; 10 % and 600 m less, and 60 m less. FL 660 is higher than a mission can say.
            "EVX6 | keep-out | 6060.84 to unlimited | always | 29171",
        ],
        &[
            "/features/0/geometry/0: it would end at 100 m above the take-off point and begin at 110 m: nothing is there, left out",
            "/features/3/geometry/0: NOT UNDERSTOOD: the upper limit 120 m is not above the lower limit 200 m: it has no limits of height",
        ],
    );
}

/// Estonia (EANS): ED-269 fields in the properties of GeoJSON, with the limits in an object or a list, and fields for a map.
#[test]
fn estonia() {
    check(
        "est.geojson",
        &[
            "EEX1 | permission | ground to 130 | always | 29188",
            "EEX3 | keep-out | 111 to unlimited | always | 8758578055",
            "X990126 | keep-out | ground to 1838.8 | 2027-08-18T05:00:00Z to 2027-08-22T18:00:00Z | 29181",
            "EEX5 | keep-out | ground to unlimited | always | 29178",
        ],
        &[
            "/features/1/properties/restriction: a zone without restriction has no counterpart: left out",
            "/features/4/properties/lower: NOT UNDERSTOOD: found `0 M AGL`, expected a number: it bars more",
            "/features/4/properties/upper: NOT UNDERSTOOD: found `120 M AGL`, expected a number: it bars more",
        ],
    );
}

/// Sweden (LFV): ED-318 with names in languages, circles as points with an extent, times without seconds, four-number positions.
#[test]
fn sweden() {
    check(
        "swe.json",
        &[
            "ESX1 | permission | ground to 160 | 2026-01-01T00:00:00Z to 2027-12-31T23:59:00Z, Mon 06:00-21:00 | 29188",
            "ESX2 | keep-out | ground to 130 | always | 785398",
            "ESX3 | permission | 244.8 to 549.6 | always | 29174",
            // 100 m above the ellipsoid are at most 207 m above sea level.
            "ESX4 | keep-out | ground to 147 | 2027-05-01T22:00:00Z to 2027-05-03T04:00:00Z | 29171",
        ],
        &[],
    );
}

/// Ireland (IAA): ED-318 with MultiPolygon and GeometryCollection, several periods, a zone without a layer.
#[test]
fn ireland() {
    check(
        "irl.geojson",
        &[
            "EIX1 | permission | ground to 130 | always | 29230",
            "EIX1 2 | permission | ground to 130 | always | 29223",
            // 500 feet above sea level: 152.4 m.
            "EIX2 | keep-out | ground to 92.4 | 2027-06-05T11:00:00Z to 2027-06-05T22:30:00Z | 29216",
            "EIX2 2 | keep-out | ground to 92.4 | 2027-06-19T11:00:00Z to 2027-06-19T22:30:00Z | 29216",
            "EIX3 | keep-out | ground to 70 | always | 29209",
            "EIX3 2 | keep-out | 20 to 100 | always | 125664",
            "EIX4 | permission | ground to unlimited | always | 29237",
        ],
        &[],
    );
}

/// Denmark (Trafikstyrelsen): a colour in `Farve`, no heights.
#[test]
fn denmark() {
    check(
        "dnk.geojson",
        &[
            "Lufthavn | permission | ground to unlimited | always | 2915394",
            "Fængsel | permission | ground to unlimited | always | 29160",
            "Ny farve | keep-out | ground to unlimited | always | 29160",
            "zone 3 | permission | ground to unlimited | always | 29160",
        ],
        &["/features/2/properties/Farve: NOT UNDERSTOOD: `9` is not a known Farve: it bars more"],
    );
}

/// Spain (ENAIRE): ED-318 flattened by a map service, empty texts for what is absent, dates in milliseconds.
#[test]
fn spain() {
    check(
        "esp.geojson",
        &[
            "XX45 | permission | 35 to 910 | always | 29195",
            "XXP1 | keep-out | ground to 854.4 | 2027-01-01T00:00:00Z to 2027-02-01T00:00:00Z, Mon 06:00-20:00 | 29195",
            "XXC1 | permission | ground to unlimited | always | 29195",
            // 1803859200000 ms after the epoch.
            "XXP2 | keep-out | ground to 130 | from 2027-03-01T00:00:00Z | 29195",
        ],
        &[],
    );
}

/// Belgium (DroneGuide): heights in metres above the ground in the names of the fields.
#[test]
fn belgium() {
    check(
        "bel.geojson",
        &[
            "EBX1 | permission | ground to 467.2 | always | 29125",
            "EBX2 | keep-out | ground to 131.92 | always | 29125",
            "EBX3 | permission | 110 to unlimited | always | 29125",
            "EBX5 | keep-out | ground to 130 | always | 29125",
        ],
        &[
            "/features/3: a zone without restriction: left out",
            "/features/4/properties: NOT UNDERSTOOD: `restriction` is missing: it bars more",
        ],
    );
}

/// Germany (dipul): a kind of place in `type_code`, feet, metres and flight levels.
#[test]
fn germany() {
    check(
        "deu.geojson",
        &[
            "Beispiel (CTR) | permission | ground to 702 | always | 29195",
            // FL 100 is 3048 m; 10 % and 400 m more, and 60 m less.
            "ED-R 999 | keep-out | ground to 3692.8 | always | 29195",
            "Beispielmoor | permission | ground to unlimited | always | 29195",
            "Einsatz | keep-out | ground to 310 | 2027-05-01T08:00:00Z to 2027-05-01T20:00:00Z | 29195",
            "Neuartig | keep-out | ground to 110 | always | 29195",
            // 381.233608 feet above sea level: 116.2 m.
            "Beispiel Zone 4 | permission | 56.2 to 702 | always | 29195",
        ],
        &["/features/4/properties/type_code: NOT UNDERSTOOD: `NEUE_ART` is not a known type_code: it bars more"],
    );
}

/// United States (UAS Facility Map): a permission up to the ceiling of each cell, nothing above it.
#[test]
fn united_states() {
    check(
        "usa.geojson",
        &[
            // 400 feet are 121.92 m, 100 feet 30.48 m.
            "KXXX | permission | ground to 131.92 | always | 506726",
            "KXXX above | keep-out | 111.92 to unlimited | always | 506726",
            "KXXX 2 | keep-out | ground to unlimited | always | 506726",
            "XXX | permission | ground to 40.48 | always | 506726",
            "XXX above | keep-out | 20.48 to unlimited | always | 506726",
            "KXXX 3 | keep-out | ground to unlimited | always | 506726",
            "KXXX 4 | keep-out | ground to unlimited | always | 506726",
        ],
        &[
            "/features/3/properties: NOT UNDERSTOOD: its ceiling is missing: it bars more",
            "/features/4/properties/UNIT: NOT UNDERSTOOD: found `Furlongs`, expected M, METERS, METRES, FT, FEET, KM, NM, NMI: it bars more",
        ],
    );
}

/// United Kingdom: AIXM 5.1.
#[test]
fn united_kingdom() {
    check(
        "gbr.xml",
        &[
            "EGXU001A | keep-out | ground to 619.6 | from 2026-10-01T00:00:00Z | 43101445",
            "EGXU001B | keep-out | ground to 619.6 | always | 29174",
            "EGXD999 | permission | 244.8 to 8554.36 | always | 29167",
            "EGXP998 | keep-out | ground to 90 | 2027-05-01T08:00:00Z to 2027-05-03T18:00:00Z | 29160",
        ],
        &[],
    );
}

/// The files of the project's collection.
#[test]
fn the_cases_are_read_as_their_table_says() {
    macro_rules! check {
        ($file:literal, $areas:expr, $said:expr) => {
            check_text($file, include_str!(concat!("golden/cases/", $file)), &$areas, &$said);
        };
    }
    check!(
        "no-seconds.json",
        ["ESU1 | permission | ground to 160 | 2026-01-01T00:00:00Z to 2027-12-31T23:59:00Z, Mon 06:00-21:00 | 29194"],
        []
    );
    check!(
        "mixed-limits.json",
        ["NEAR | keep-out | ground to 110 | always | 29193"],
        [
            "/features/0/geometry/0: it would end at 100 m above the take-off point and begin at 110 m: nothing is there, left out"
        ]
    );
    check!(
        "far-unreadable.json",
        ["NEAR | keep-out | ground to 130 | always | 29194"],
        ["/features/0/geometry/0: it lies more than 100 km from the take-off point: left out"]
    );
    check!(
        "two-weeks-apart.json",
        [
            "STADIUM | keep-out | ground to 1160 | 2027-08-05T11:00:00Z to 2027-08-05T22:59:00Z | 29194",
            "STADIUM 2 | keep-out | ground to 1160 | 2027-08-29T11:00:00Z to 2027-08-29T22:59:00Z | 29194",
        ],
        []
    );
    check!(
        "ed269-in-geojson.json",
        [
            "AUTH | permission | ground to 130 | always | 29194",
            "ABOVE | keep-out | 111 to unlimited | always | 8758578055",
        ],
        ["/features/1/properties/restriction: a zone without restriction has no counterpart: left out"]
    );
    check!("flattened-ed318.geojson", ["XX45 | permission | 35 to 910 | always | 29194"], []);
    // A square of 13.1 km by 11.1 km, without one of 2.6 km by 2.2 km round the take-off point.
    check!("hole-home.geojson", ["all but the field | keep-out | ground to unlimited | always | 140120000"], []);
    check!("aixm.xml", ["EGX001A | keep-out | ground to unlimited | always | 29194"], []);
    check!("comment.kml", ["commented | keep-out | ground to unlimited | always | 138664"], []);
    let told = import("track.gpx", include_str!("golden/cases/track.gpx"), &over_ground()).unwrap_err().to_string();
    assert!(told.contains("this is GPX"), "{told}");
}

#[test]
fn a_feed_says_its_edition() {
    let edition = |feed: &str| {
        let text = FEEDS.iter().find(|(name, _)| *name == feed).unwrap().1;
        formats::read(&super::source(feed, text)).unwrap_or_else(|it| panic!("{it}")).content.edition
    };
    let swedish = edition("swe.json");
    assert_eq!(swedish.provider.as_deref(), Some("Example office"));
    // 1 August and 13 August 2026, and 10 September 2027, 00:00 UTC.
    assert_eq!(swedish.issued_utc_ms, Some(1_785_542_400_000));
    assert_eq!(swedish.valid.from_utc_ms, Some(1_786_579_200_000));
    assert_eq!(swedish.valid.until_utc_ms, Some(1_820_534_400_000));
    // 1 October 2026, 04:00 UTC.
    assert_eq!(edition("che.json").issued_utc_ms, Some(1_790_827_200_000));
    assert_eq!(edition("lux.json").provider.as_deref(), Some("UAS zones"));
}
