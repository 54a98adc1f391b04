//! A sample of each format: its result, and everything that is said about it.

use super::{check_mistake, import, mission, notes, settings, source};
use domain::area::{Area, AreaKind};
use formats::assemble::{Settings, assemble};

pub(super) const PLAN: &str = include_str!("samples/quay.plan");
pub(super) const ED_269: &str = include_str!("samples/zones_ed269.json");
pub(super) const ED_318: &str = include_str!("samples/zones_ed318.json");
pub(super) const GEO_JSON: &str = include_str!("samples/areas.geojson");
pub(super) const KML: &str = include_str!("samples/areas.kml");

/// A line for each area: what it is, its heights and its times.
pub(super) fn in_words(areas: &[Area]) -> Vec<String> {
    let line = |area: &Area| {
        let kind = if area.kind == AreaKind::Permission { "permission" } else { "keep-out" };
        let (floor, ceiling) = (area.floor_m, area.ceiling_m);
        let window = (area.from_utc_ms, area.until_utc_ms);
        let in_holes: usize = area.holes.iter().map(Vec::len).sum();
        let in_holes = if in_holes == 0 { String::new() } else { format!(" and {in_holes} in holes") };
        let corners = area.corners.len();
        format!("{}: {kind}, {corners} corners{in_holes}, {floor:?} to {ceiling:?}, {window:?}", area.name)
    };
    areas.iter().map(line).collect()
}

#[track_caller]
fn check(name: &str, text: &str, settings: &Settings, areas: &[&str], said: &str) {
    let assembled = import(name, text, settings).unwrap_or_else(|it| panic!("{it}"));
    assert_eq!(in_words(&mission(&assembled).areas), areas);
    assert_eq!(notes(&assembled), said);
}

#[test]
fn a_plan_becomes_objectives_and_areas() {
    let assembled =
        import("quay.plan", PLAN, &Settings { origin: None, ..settings() }).unwrap_or_else(|it| panic!("{it}"));
    let mission = mission(&assembled);
    let objectives: Vec<_> =
        mission.objectives.iter().map(|it| format!("{} {} {}", it.name, it.position, it.flying)).collect();
    assert_eq!(
        objectives,
        [
            "waypoint 1 (223, 0, 40) true",
            "waypoint 2 (334, 131, 45) true",
            "land 3 (445, 0, 0) false",
            "return (0, 0, 0) false"
        ]
    );
    assert_eq!(mission.objectives[0].terms.dwell.as_secs(), 5);
    let sites: Vec<_> =
        mission.sites.iter().map(|it| format!("{} {} {}", it.name, it.position, it.kind.word())).collect();
    assert_eq!(sites, ["rally 1 (0, -131, 0) landing"]);
    let corners = |it: &Area| it.rings().map(<[_]>::len).collect::<Vec<_>>();
    let areas: Vec<_> = mission.areas.iter().map(|it| (it.name.as_str(), it.kind, corners(it))).collect();
    // The circle has 24 sides; what is round the other fence has that as a hole.
    assert_eq!(areas, [("fence 1", AreaKind::KeepOut, vec![4, 4]), ("fence 2", AreaKind::KeepOut, vec![24])]);
    assert_eq!(
        notes(&assembled),
        "\
/mission/cruiseSpeed: the configuration says how fast a vehicle flies: not read
/mission/hoverSpeed: the configuration says how fast a vehicle flies: not read
/mission/firmwareType: the mission is flown by any vehicle: not read
/mission/vehicleType: the mission is flown by any vehicle: not read
/mission/items/0: the planner takes off by itself, and climbs to the height of the next place: no objective
/mission/items/2: kept, not flown yet: a command to camera, gimbal, speed or other payload
/mission/items/3: not read as a survey, since its polygon or its camera is missing
/mission/items/3: a pattern is read as its items, which QGroundControl has made
/mission/items/3/TransectStyleComplexItem/Items/1: kept, not flown yet: a command to camera, gimbal, speed or other payload
/mission/items/5: no takeoff stands between the landing before it and it: an autopilot may stay on the ground there, the planner takes off
/rallyPoints/points/0: a rally point is read as a site on the ground; how high to fly there is not read
/geoFence/polygons/0: a fence to stay inside is read as a keep-out area all round it
/mission/items/4: the ground there is not known: it counts as high as the take-off point; see --ground
/rallyPoints/points/0: the ground there is not known: it counts as high as the take-off point; see --ground
"
    );
}

#[test]
fn a_release_and_a_load_to_be_placed_become_drops() {
    /// `items` after a waypoint; whether each objective drops, and what is said.
    #[track_caller]
    fn check(items: &str, expected: &[bool], said: &str) {
        let text = format!(
            r#"{{"fileType": "Plan", "version": 1, "mission": {{"version": 2, "plannedHomePosition": [54, 6.6, 20], "items": [
            {{"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, 54.001, 6.6, 40]}}{items}]}}}}"#
        );
        let assembled =
            import("d.plan", &text, &Settings { origin: None, ..settings() }).unwrap_or_else(|it| panic!("{it}"));
        let drops: Vec<_> = mission(&assembled).objectives.iter().map(|it| it.terms.drop).collect();
        assert_eq!((drops.as_slice(), notes(&assembled).as_str()), (expected, said), "{items}");
    }
    let release = r#", {"type": "SimpleItem", "command": 211, "frame": 2, "params": [1, 0, 0, 0, 0, 0, 0]}"#;
    let grab = r#", {"type": "SimpleItem", "command": 211, "frame": 2, "params": [1, 1, 0, 0, 0, 0, 0]}"#;
    let place = r#", {"type": "SimpleItem", "command": 94, "frame": 3, "params": [5, 0, 0, 0, 54.002, 6.6, 30]}"#;
    let land = r#", {"type": "SimpleItem", "command": 21, "frame": 3, "params": [0, 0, 0, 0, 54.003, 6.6, 0]}"#;
    check("", &[false], "");
    check(release, &[true], "");
    check(
        grab,
        &[false],
        "/mission/items/1: kept, not flown yet: a command to camera, gimbal, speed or other payload\n",
    );
    check(
        &[release, release].concat(),
        &[true],
        "/mission/items/2: kept, not flown yet: a command to camera, gimbal, speed or other payload\n",
    );
    check(
        place,
        &[false, true],
        "/mission/items/1: a load to be placed is dropped from the height of its item: nothing descends with it\n",
    );
    check(
        &[land, release].concat(),
        &[false, false],
        "/mission/items/2: kept, not flown yet: a command to camera, gimbal, speed or other payload\n\
         /mission/items/1: the ground there is not known: it counts as high as the take-off point; see --ground\n",
    );
}

/// A survey of a field of 200 m by 90 m, as QGroundControl writes it.
const SURVEY: &str = r#"{"fileType": "Plan", "version": 1, "mission": {"version": 2, "plannedHomePosition": [54, 6.6, 20], "items": [{
    "type": "ComplexItem", "complexItemType": "survey", "version": 5, "angle": 0, "entryLocation": 0,
    "flyAlternateTransects": false, "splitConcavePolygons": false,
    "polygon": [[54.0009, 6.6], [54.0027, 6.6], [54.0027, 6.60137], [54.0009, 6.60137]],
    "TransectStyleComplexItem": {
        "CameraCalc": {"AdjustedFootprintSide": 30, "DistanceToSurface": 40, "DistanceMode": 1},
        "FollowTerrain": false, "Refly90Degrees": false, "TurnAroundDistance": 10,
        "Items": [{"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, null, 54.001, 6.601, 40]}]
    }}]}}"#;

#[test]
fn a_survey_of_a_plan_becomes_a_survey_if_it_can_be_one() {
    /// `lines`: of the survey, or 0 for the waypoint in its items.
    #[track_caller]
    fn check(find: &str, replace: &str, lines: usize, height_m: f64, said: &str) {
        assert!(SURVEY.contains(find), "{find}");
        let text = SURVEY.replacen(find, replace, 1);
        let assembled =
            import("s.plan", &text, &Settings { origin: None, ..settings() }).unwrap_or_else(|it| panic!("{it}"));
        let objective = &mission(&assembled).objectives[0];
        let found = objective.survey.as_ref().map_or(0, |it| it.turns().iter().filter(|it| it.ends_line).count());
        assert_eq!((found, objective.position.height_m().round()), (lines, height_m), "{objective:?}");
        assert!(notes(&assembled).starts_with(&format!("/mission/items/0: {said}")), "{}", notes(&assembled));
    }
    let as_survey = "a survey of the same polygon, angle and spacing";
    check("\"angle\": 0", "\"angle\": 0", 3, 40.0, as_survey);
    check("\"angle\": 0", "\"angle\": 90", 7, 40.0, as_survey);
    check("\"DistanceMode\": 1", "\"DistanceMode\": 2", 3, 20.0, as_survey);
    check("\"DistanceMode\": 1", "\"DistanceToSurfaceRelative\": true", 3, 40.0, as_survey);
    let why = "not read as a survey, since";
    check("\"DistanceMode\": 1", "\"DistanceMode\": 3", 0, 40.0, &format!("{why} its height is above the terrain"));
    check("\"FollowTerrain\": false", "\"FollowTerrain\": true", 0, 40.0, &format!("{why} it follows the terrain"));
    check("\"Refly90Degrees\": false", "\"Refly90Degrees\": true", 0, 40.0, &format!("{why} it is flown twice"));
    check("Transects\": false", "Transects\": true", 0, 40.0, &format!("{why} it skips every second line"));
    check("Side\": 30", "Side\": 3", 0, 40.0, &format!("{why} its lines are closer together than 5 m"));
    check("\"polygon\"", "\"area\"", 0, 40.0, &format!("{why} its polygon or its camera is missing"));
    check_mistake(
        "s.plan",
        SURVEY,
        "[54.0027, 6.6], ",
        "[54.0009, 6.60137], [54.0027, 6.6], ",
        "s.plan: /mission/items/0: a survey: it crosses",
    );
    check_mistake(
        "s.plan",
        SURVEY,
        "\"angle\": 0",
        "\"angle\": 1e3",
        "s.plan: /mission/items/0: a survey: its heading is 1000",
    );
    check_mistake("s.plan", SURVEY, "[54.0009, 6.6]", "[154, 6.6]", "s.plan: /mission/items/0/polygon/0: latitude 154");
}

#[test]
fn zones_of_ed_269_become_areas() {
    check(
        "zones.json",
        ED_269,
        &settings(),
        &[
            // 150 m above sea level are 130 m above the take-off point.
            "HBR001: keep-out, 24 corners, None to Some(130.0), (None, None)",
            // The summers of 2026 and 2027.
            "HBR002: permission, 4 corners and 3 in holes, None to None, (Some(1775001600000), Some(1793491199000))",
            "HBR002 2: permission, 4 corners and 3 in holes, None to None, (Some(1806537600000), Some(1824940800000))",
            "HBR003: permission, 4 corners, None to None, (None, None)",
        ],
        "\
/UASZoneList/2/colour: a field that is not in the format: not read
/UASZoneList/2/restriction: conditions cannot be checked on board: the area needs a permission
/UASZoneList/2/geometry/0/horizontalProjection/coordinates/0: the ring does not end where it begins: it is closed
/UASZoneList/2/geometry/0/horizontalProjection/coordinates/0: the corners run clockwise, against RFC 7946: read all the same
/UASZoneList/3/restriction: a zone without restriction has no counterpart: left out
/UASZoneList/1/geometry/0: its lower limit is above the ground, whose height is not known: it begins at the ground; see --ground and --relief
/UASZoneList/1/geometry/0: its upper limit is above the ground, whose height is not known: it has no upper limit; see --ground and --relief
/UASZoneList/4/geometry/0: it lies more than 100 km from the take-off point: left out
",
    );
}

#[test]
fn what_a_zone_says_to_humans_stands_beside_its_area() {
    let text = import("zones.json", ED_269, &settings()).unwrap().text;
    for line in [
        "# Name: Ferry terminal\n",
        "# Reason: SENSITIVE, POPULATION\n",
        "# Authority: Harbour office, +49 000, INFORMATION\n",
        "# Conditions: Ask by telephone\n",
        "# Published schedule: day MON TUE, endTime 04:00:00.00Z, startTime 22:00:00.00Z\n",
    ] {
        assert!(text.contains(line), "{line}{text}");
    }
}

#[test]
fn zones_of_ed_318_become_areas() {
    check(
        "zones.json",
        ED_318,
        &Settings { relief_m: Some(5.0), ..settings() },
        &[
            // 200 m above the ellipsoid; the geoid is not lower than 107 m below it, the take-off point is 20 m above it.
            "HB318A: keep-out, 24 corners, None to Some(287.0), (None, None)",
            // 100 feet above sea level, and 400 feet above ground that is at most 5 m higher than the take-off point.
            "HB318A 2: keep-out, 4 corners, Some(10.48) to Some(126.92), (None, None)",
            "HB318B: permission, 4 corners, None to None, (None, None)",
        ],
        "\
/features/1/properties/type: U-space needs an authorised flight: the area needs a permission
/features/0/geometry/geometries/0: its upper limit is above the ellipsoid: converted with the most that the geoid differs from it
",
    );
}

#[test]
fn polygons_of_geojson_become_areas() {
    check(
        "areas.geojson",
        GEO_JSON,
        &settings(),
        &[
            "lock: permission, 4 corners, Some(10.0) to Some(80.0), (None, Some(1796079600000))",
            "lock 2: permission, 4 corners, Some(10.0) to Some(80.0), (None, Some(1796079600000))",
            "feature 1: keep-out, 4 corners, None to None, (None, None)",
        ],
        "\
/features/1/properties/owner: a field that is not in the format: not read
/features/1: a polygon without `kind`: read as a keep-out area, the safe side
",
    );
}

/// What has a place and no word on what it is: a mistake in a mission, a note among areas.
#[test]
fn a_point_becomes_a_circle_if_it_says_how_large() {
    let file = |geometry: &str, properties: &str| {
        format!(r#"{{"type": "Feature", "properties": {{{properties}}}, "geometry": {geometry}}}"#)
    };
    let point = r#"{"type": "Point", "coordinates": [6.61, 54.0]}"#;
    let line = r#"{"type": "LineString", "coordinates": [[6.6, 54.0], [6.7, 54.0]]}"#;
    let collection = format!(r#"{{"type": "GeometryCollection", "geometries": [{point}, {line}]}}"#);
    let circle = import("a.geojson", &file(point, r#""radius": 100"#), &settings()).unwrap();
    assert_eq!(in_words(&mission(&circle).areas), ["feature 0: keep-out, 24 corners, None to None, (None, None)"]);
    for (geometry, expected) in [
        (point, "a.geojson: /geometry: a Point without `kind`\n  help: say what it is"),
        (line, "a.geojson: /geometry: a LineString without `kind`"),
        (&collection, "a.geojson: /geometry/geometries/0/geometry: a Point without `kind`"),
    ] {
        let text = file(geometry, "");
        let told = import("a.geojson", &text, &settings()).unwrap_err().to_string();
        assert!(told.starts_with(expected), "{told}");
        let areas = [formats::read(&source("a.geojson", &text)).unwrap()];
        let mission = formats::read(&source("quay.plan", PLAN)).unwrap();
        let read = assemble(&mission, &areas, &Settings { allow_empty: true, ..settings() }).unwrap();
        assert!(notes(&read).contains("without a radius: left out"), "{}", notes(&read));
    }
    let told = import("a.geojson", &file(line, r#""radius": 100"#), &settings()).unwrap_err().to_string();
    assert!(told.starts_with("a.geojson: /geometry: LineString with a radius"), "{told}");
}

#[test]
fn polygons_of_kml_become_areas() {
    check(
        "areas.kml",
        KML,
        &settings(),
        &[
            "crane: keep-out, 4 corners, None to Some(70.0), (Some(1777622400000), None)",
            "gate: permission, 4 corners, None to None, (None, None)",
        ],
        "\
line 4 column 5: a placemark without `kind`: read as a keep-out area, the safe side
line 27 column 9: a Point beside a polygon is its label: left out
",
    );
}

#[test]
fn a_mission_is_made_of_several_files() {
    let read = |name: &str, text: &str| formats::read(&source(name, text)).unwrap_or_else(|it| panic!("{it}"));
    let files = [read("z.json", ED_269), read("a.kml", KML)];
    let assembled = assemble(&read("quay.plan", PLAN), &files, &settings()).unwrap_or_else(|it| panic!("{it}"));
    let mission = mission(&assembled);
    let names: Vec<_> = mission.areas.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["fence 1", "fence 2", "HBR001", "HBR002", "HBR002 2", "HBR003", "crane", "gate"]);
    assert_eq!((mission.name.as_str(), mission.objectives.len()), ("sample", 4));
    assert!(assembled.text.starts_with("# Made by `kittiwake mission import` from quay.plan, z.json, a.kml.\n"));
}
