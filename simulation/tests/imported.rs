//! A harbour of 1,296 zones by ED-269, and a plan of QGroundControl: imported, planned and flown.

use std::fmt::Write as _;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::file::Source;
use domain::geodesy::{LatLon, LocalFrame};
use domain::geometry::Ned;
use formats::Import;
use formats::assemble::{Assembled, Settings, assemble};
use kittiwake_proto::v1::MissionOutcome;

use crate::stories::support::{config_with, mission_file, simulation, simulation_of};

/// The side of the harbour's square cells, in metres; each has a zone in its middle.
const CELL_M: f64 = 400.0;
/// Cells from the take-off point to each side.
const CELLS: i32 = 18;

/// The harbour's frame: where the simulated vehicle stands.
fn frame() -> LocalFrame {
    LocalFrame::at(LatLon::new(54.0, 6.6).expect("a place at sea"))
}

/// As ED-269 and QGroundControl write places: one with the longitude first, one with the latitude.
fn lon_lat(north_m: f64, east_m: f64) -> String {
    let at = frame().lat_lon(Ned::new(north_m, east_m, 0.0));
    format!("[{}, {}]", at.longitude_deg(), at.latitude_deg())
}

fn lat_lon(north_m: f64, east_m: f64) -> String {
    let at = frame().lat_lon(Ned::new(north_m, east_m, 0.0));
    format!("{}, {}", at.latitude_deg(), at.longitude_deg())
}

/// 1,296 zones: circles and quadrangles, most of them prohibited, some with an authorisation or under conditions, some without
/// restriction, some only above the heights of the mission, some with a season and a schedule.
fn zones() -> String {
    let mut zones = String::new();
    let cells = (-CELLS..CELLS).flat_map(|row| (-CELLS..CELLS).map(move |column| (row, column)));
    for (number, (row, column)) in cells.enumerate() {
        let middle = |cell: i32| (f64::from(cell) + 0.5) * CELL_M;
        let (north_m, east_m) = (middle(row), middle(column));
        // Borders stay 50 m and more from the lines between cells, on which the mission's places lie.
        let radius_m = 90.0 + 10.0 * (number % 7) as f64;
        let restriction = match number % 13 {
            3 | 6 => "REQ_AUTHORISATION",
            5 => "CONDITIONAL",
            11 => "NO_RESTRICTION",
            _ => "PROHIBITED",
        };
        let applicability = if number % 5 == 0 {
            r#"{"permanent": "NO", "startDateTime": "2020-01-01T00:00:00Z", "endDateTime": "2040-01-01T00:00:00Z",
                "schedule": [{"day": ["ANY"], "startTime": "06:00:00Z", "endTime": "22:00:00Z"}]}"#
        } else {
            r#"{"permanent": "YES"}"#
        };
        // The take-off point is 20 m above sea level.
        let lower_m = if number % 9 == 4 { 200 } else { 0 };
        let projection = if number % 2 == 0 {
            format!(r#"{{"type": "Circle", "center": {}, "radius": {radius_m}}}"#, lon_lat(north_m, east_m))
        } else {
            let corner = |north: f64, east: f64| lon_lat(north_m + north * radius_m, east_m + east * radius_m);
            let [a, b, c, d] = [corner(-1.0, -0.3), corner(-0.2, 1.0), corner(1.0, 0.4), corner(0.3, -1.0)];
            format!(r#"{{"type": "Polygon", "coordinates": [[{a}, {b}, {c}, {d}, {a}]]}}"#)
        };
        let separator = if number == 0 { "" } else { "," };
        write!(
            zones,
            r#"{separator}
            {{"identifier": "Z{number:03}", "country": "DEU", "name": "Berth {number}", "type": "COMMON",
              "restriction": "{restriction}", "reason": ["SENSITIVE"], "applicability": [{applicability}],
              "zoneAuthority": [{{"name": "Harbour office", "purpose": "AUTHORIZATION"}}],
              "geometry": [{{"uomDimensions": "M", "lowerLimit": {lower_m}, "lowerVerticalReference": "AMSL",
                "upperLimit": 400, "upperVerticalReference": "AMSL", "horizontalProjection": {projection}}}]}}"#
        )
        .expect("a text takes everything");
    }
    format!(r#"{{"title": "Harbour", "features": [{zones}]}}"#)
}

/// Look at a place on a line between cells, land in the middle of zone 734, which needs an authorisation, and come back.
fn plan() -> String {
    let item = |command: i32, place: &str, height_m: f64| {
        format!(
            r#"{{"type": "SimpleItem", "command": {command}, "frame": 3, "params": [0, 0, 0, null, {place}, {height_m}]}}"#
        )
    };
    let items = [
        item(22, &lat_lon(0.0, 0.0), 30.0),
        item(16, &lat_lon(4.0 * CELL_M, 3.0 * CELL_M), 40.0),
        item(21, &lat_lon(2.5 * CELL_M, -3.5 * CELL_M), 0.0),
        item(20, "0, 0", 0.0),
    ];
    format!(
        r#"{{"fileType": "Plan", "mission": {{"plannedHomePosition": [{}, 20], "items": [{}]}}}}"#,
        lat_lon(0.0, 0.0),
        items.join(", ")
    )
}

#[track_caller]
fn imported() -> Assembled {
    let read = |name: &str, text: String| -> Import {
        formats::read(&Source { path: name.into(), text }).unwrap_or_else(|mistakes| panic!("{mistakes}"))
    };
    let settings = Settings {
        name: "harbour-zones".into(),
        origin: None,
        relief_m: None,
        ground: None,
        strict: false,
        allow_empty: false,
    };
    let files = [read("harbour.json", zones())];
    assemble(&read("berths.plan", plan()), &files, &settings).unwrap_or_else(|mistakes| panic!("{mistakes}"))
}

/// A plan of QGroundControl far from where the simulated vehicle is configured to stand: a look at a place on the other side of the
/// antimeridian, and back.
const REEF: &str = r#"{"fileType": "Plan", "mission": {"plannedHomePosition": [-16.5, 179.998, 5], "items": [
    {"type": "SimpleItem", "command": 22, "frame": 3, "params": [0, 0, 0, null, -16.5, 179.998, 20]},
    {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, -16.499, -179.998, 20]},
    {"type": "SimpleItem", "command": 20, "frame": 3, "params": [0, 0, 0, null, 0, 0, 0]}
]}}"#;

/// The mission file of [`REEF`].
#[track_caller]
fn reef(name: &str) -> std::path::PathBuf {
    let plan = formats::read(&Source { path: "reef.plan".into(), text: REEF.into() });
    let settings =
        Settings { name: "reef".into(), origin: None, relief_m: None, ground: None, strict: false, allow_empty: false };
    let assembled = plan.and_then(|plan| assemble(&plan, &[], &settings));
    mission_file(name, &assembled.unwrap_or_else(|mistakes| panic!("{mistakes}")).text)
}

#[test]
fn an_imported_mission_is_flown_from_its_own_origin() {
    let mut simulation = simulation(Some(&reef("reef")), Policy::Grant);
    let report = simulation.fly(Duration::from_secs(1200));
    let log = simulation.decision_log();
    let report = report.unwrap_or_else(|| panic!("no end:\n{log}"));
    assert_eq!(report.outcome(), MissionOutcome::Success, "\n{log}");
    let plans: Vec<_> = simulation.story(&["plan"]).into_iter().filter(|it| it.starts_with("plan ")).collect();
    // A thousandth of a degree of latitude is 110.66 m there, four of longitude are 427.06 m.
    assert_eq!(plans, ["plan 1: takeoff by 20 m; fly to (111, 427, 20)", "plan 2: fly to (0, 0, 10); land"], "\n{log}");
}

#[test]
fn a_mission_for_another_place_stays_on_the_ground() {
    let (config, mission) = (config_with("elsewhere", &[("at_mission_origin", "false")]), reef("elsewhere"));
    let mut simulation = simulation_of(&config, Some(&mission), Policy::Grant);
    let report = simulation.fly(Duration::from_secs(60));
    let log = simulation.decision_log();
    let report = report.unwrap_or_else(|| panic!("no end:\n{log}"));
    assert_eq!(report.outcome(), MissionOutcome::Failure, "\n{log}");
    let reason = &report.objectives[0].reason;
    let figures = " km from the vehicle's: -16.500000, 179.998000 and 54.000000, 6.600000, expected at most 5 m";
    assert!(reason.starts_with("the mission's origin is ") && reason.ends_with(figures), "{reason}");
    assert!(simulation.is_on_ground() && !log.contains("takeoff"), "\n{log}");
}

#[test]
fn a_harbour_is_imported_planned_and_flown() {
    let assembled = imported();
    // Each thirteenth of 1,296 zones, from the twelfth on, has no restriction.
    assert_eq!((assembled.objectives, assembled.areas), (3, 1_296 - 99));
    let path = mission_file("harbour-zones", &assembled.text);
    let mut simulation = simulation(Some(&path), Policy::Grant);
    let report = simulation.fly(Duration::from_secs(3000));
    simulation.pass(Duration::from_secs(60));
    let log = simulation.decision_log();
    let report = report.unwrap_or_else(|| panic!("no end:\n{log}"));
    assert_eq!(report.outcome(), MissionOutcome::Success, "\n{log}");
    assert_eq!(simulation.breaches(), [], "\n{log}");
    let story = [
        "plan 1: takeoff by 40 m; fly to (137, 100, 40), asking Z666; fly to (640, 466, 40); fly to (1286, 1114, 40); \
         fly to (1319, 1140, 40); fly to (1358, 1156, 40); fly to (1600, 1200, 40)",
        "asking for area Z666",
        "area Z666: granted",
        "transition: stop",
        // Some zones have hours, and none of them in the night in which the simulation begins.
        "plan 2: fly to (1556, 958, 40); fly to (1264, 237, 40); fly to (1027, -1232, 13), asking Z734; \
         fly to (1000, -1400, 10); land",
        "asking for area Z734",
        "area Z734: granted",
        "plan 3: takeoff by 10 m; fly to (763, -936, 10); fly to (0, 0, 10); land",
        "every objective is settled",
    ];
    assert_eq!(simulation.story(&["plan", "permission", "contingency"]), story, "\n{log}");
}
