//! Heights above the ground, where that is known.

use super::samples::{ED_318, PLAN};
use super::{import, mission, notes, origin, settings};
use domain::geodesy::{LatLon, Origin};
use domain::ground::GroundModel;
use domain::mission::Mission;
use formats::assemble::Settings;

/// Altitudes by latitude and longitude.
struct Model(fn(f64, f64) -> Option<f64>);

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Model")
    }
}

impl GroundModel for Model {
    fn altitude_m(&self, at: LatLon) -> Option<f64> {
        self.0(at.latitude_deg(), at.longitude_deg())
    }

    /// Of a slope, which is lowest and highest at a corner.
    fn bounds_m(&self, corners: &[LatLon]) -> Option<[f64; 2]> {
        let altitudes: Vec<f64> = corners.iter().map(|it| self.altitude_m(*it)).collect::<Option<_>>()?;
        Some([altitudes.iter().copied().fold(f64::MAX, f64::min), altitudes.iter().copied().fold(f64::MIN, f64::max)])
    }
}

/// At 22 m where missions begin, and 10 m higher every thousandth of a degree to the north.
const SLOPE: Model = Model(|latitude, _| Some(22.0 + (latitude - 54.0) * 10_000.0));
/// Level, with a ridge of 60 m at 54.002.
const RIDGE: Model = Model(|latitude, _| Some(22.0 + (60.0 - (latitude - 54.002).abs() * 200_000.0).max(0.0)));
/// Nothing is known north of 54.003.
const EDGE: Model = Model(|latitude, _| Some(22.0).filter(|_| latitude < 54.003));

/// A plan without the altitude of its home; each item is a command, a frame, a latitude and a height.
fn plan(items: &[(u16, u8, f64, f64)]) -> String {
    let item = |(command, frame, latitude, height): &(u16, u8, f64, f64)| {
        format!(
            r#"{{"type": "SimpleItem", "command": {command}, "frame": {frame}, "autoContinue": true,
            "params": [0, 0, 0, null, {latitude}, 6.6, {height}]}}"#
        )
    };
    let items: Vec<String> = items.iter().map(item).collect();
    format!(
        r#"{{"fileType": "Plan", "version": 1, "mission": {{"version": 2, "plannedHomePosition": [54, 6.6, null],
        "items": [{}]}}}}"#,
        items.join(", ")
    )
}

fn over(model: &Model) -> Settings<'_> {
    Settings { origin: None, ground: Some(model), ..settings() }
}

/// What the mission flies to, and its origin's altitude.
fn heights(model: &Model, items: &[(u16, u8, f64, f64)]) -> (Vec<f64>, Option<f64>) {
    let assembled = import("g.plan", &plan(items), &over(model)).unwrap_or_else(|it| panic!("{it}"));
    let Mission { objectives, origin, .. } = mission(&assembled);
    let heights = objectives.iter().map(|it| it.position.height_m()).collect();
    (heights, origin.and_then(|it| it.altitude_m))
}

#[track_caller]
fn check_refused(model: &Model, items: &[(u16, u8, f64, f64)], expected: &str) {
    let told = import("g.plan", &plan(items), &over(model)).map(|_| ()).unwrap_err().to_string();
    assert!(told.starts_with(&format!("g.plan: {expected}")), "{told}");
}

#[test]
fn heights_above_the_ground_become_heights_above_the_takeoff_point() {
    let items = [(16, 10, 54.001, 40.0), (16, 11, 54.002, 30.0), (16, 3, 54.002, 50.0), (16, 0, 54.002, 82.0)];
    assert_eq!(heights(&SLOPE, &items), (vec![50.0, 50.0, 50.0, 60.0], Some(22.0)));
    // Lower ground than that of the take-off point; the vehicle is still above that.
    assert_eq!(heights(&SLOPE, &[(16, 10, 53.998, 40.0)]).0, [20.0]);
    check_refused(
        &EDGE,
        &[(16, 10, 54.004, 40.0)],
        "/mission/items/0: its height is above the ground, which is not known",
    );
    check_refused(&SLOPE, &[(16, 10, 54.001, -1.0)], "/mission/items/0: it is flown to at -1 m above the ground");
    let without = Settings { origin: None, ..settings() };
    let told = import("g.plan", &plan(&[(16, 10, 54.001, 40.0)]), &without).unwrap_err().to_string();
    assert!(told.contains("its height is above the ground, which is not known there\n  help: give a model"), "{told}");
}

#[test]
fn a_landing_and_a_site_are_as_high_as_the_ground_there() {
    assert_eq!(heights(&SLOPE, &[(16, 3, 54.001, 60.0), (21, 3, 54.002, 0.0)]).0, [60.0, 20.0]);
    // Lower than the take-off point.
    assert_eq!(heights(&SLOPE, &[(16, 3, 54.001, 60.0), (21, 3, 53.9996, 0.0)]).0, [60.0, -4.0]);
    // Home is where it is, whatever a model says.
    assert_eq!(heights(&SLOPE, &[(16, 3, 54.001, 60.0), (20, 2, 0.0, 0.0)]).0, [60.0, 0.0]);
    let assembled = import("quay.plan", PLAN, &over(&SLOPE)).unwrap_or_else(|it| panic!("{it}"));
    assert!(!notes(&assembled).contains("the ground there is not known"), "{}", notes(&assembled));
    assert!(assembled.text.contains("name = \"rally 1\""), "{}", assembled.text);
    let assembled = import("g.plan", &plan(&[(16, 3, 54.001, 60.0), (21, 3, 54.004, 0.0)]), &over(&EDGE)).unwrap();
    let said =
        "/mission/items/1: the ground there is not known: it counts as high as the take-off point; see --ground\n";
    assert_eq!(notes(&assembled), said);
}

#[test]
fn a_leg_that_comes_near_the_ground_is_refused() {
    let ridge = [(16, 10, 54.001, 50.0), (16, 10, 54.003, 50.0)];
    check_refused(&RIDGE, &ridge, "/mission/items/1: the leg from `waypoint 1` comes within -");
    // Half of the lower height is left over the ridge: 100 m above the ground are 40 m above it.
    check_refused(
        &RIDGE,
        &[(16, 10, 54.001, 100.0), (16, 10, 54.003, 100.0)],
        "/mission/items/1: the leg from `waypoint 1` comes",
    );
    heights(&RIDGE, &[(16, 3, 54.001, 110.0), (16, 10, 54.002, 50.0), (16, 10, 54.003, 110.0)]);
    // The other end may be given in another way, and the first leg begins above the take-off point.
    check_refused(
        &RIDGE,
        &[(16, 10, 54.001, 50.0), (16, 3, 54.003, 50.0)],
        "/mission/items/1: the leg from `waypoint 1`",
    );
    check_refused(&RIDGE, &[(16, 10, 54.003, 50.0)], "/mission/items/0: the leg from `the take-off point` comes");
    // What has no height above the ground is flown as it is.
    heights(&RIDGE, &[(16, 3, 54.001, 50.0), (16, 3, 54.003, 50.0)]);
    check_refused(
        &Model(|latitude, _| Some(22.0).filter(|_| (latitude - 54.002).abs() > 0.0002)),
        &ridge,
        "/mission/items/1: the leg from `waypoint 1` leads over 54.00",
    );
}

#[test]
fn limits_above_the_ground_are_those_above_the_ground_of_the_zone() {
    /// The ceiling of the zone whose upper limit is 400 feet above the ground.
    #[track_caller]
    fn check(settings: &Settings<'_>, expected_m: f64) {
        let assembled = import("zones.json", ED_318, settings).unwrap_or_else(|it| panic!("{it}"));
        let area = mission(&assembled).areas.into_iter().find(|it| it.name == "HB318A 2").unwrap();
        let ceiling_m = area.ceiling_m.unwrap();
        assert!((ceiling_m - expected_m).abs() < 0.02, "{ceiling_m}, expected {expected_m}");
    }
    let level = Model(|_, _| Some(22.0));
    let with = |model| Settings { ground: Some(model), ..settings() };
    check(&with(&level), 121.92);
    let higher = Model(|latitude, longitude| Some(if (latitude, longitude) == (54.0, 6.6) { 22.0 } else { 30.0 }));
    check(&with(&higher), 129.92);
    // The model before the relief, and the relief where the model ends.
    check(&Settings { relief_m: Some(5.0), ..with(&higher) }, 129.92);
    let at_origin = Model(|latitude, longitude| Some(22.0).filter(|_| (latitude, longitude) == (54.0, 6.6)));
    check(&Settings { relief_m: Some(5.0), ..with(&at_origin) }, 126.92);
}

#[test]
fn an_altitude_that_the_ground_does_not_have_is_refused() {
    let level = Model(|_, _| Some(153.0));
    let told = import("g.plan", &plan(&[(16, 3, 54.001, 40.0)]), &Settings { origin: Some(origin()), ..over(&level) });
    let told = told.unwrap_err().to_string();
    let expected = "g.plan: the take-off point is given at 20 m above sea level, and the ground there is at 153 m";
    assert!(told.starts_with(expected), "{told}");
    let near = Origin { altitude_m: Some(140.0), ..origin() };
    let near = Settings { origin: Some(near), ..over(&level) };
    let assembled = import("g.plan", &plan(&[(16, 0, 54.001, 180.0), (16, 10, 54.001, 40.0)]), &near).unwrap();
    let found = mission(&assembled);
    // Above sea level by the altitude that was given, above the ground by the model alone.
    let heights: Vec<f64> = found.objectives.iter().map(|it| it.position.height_m()).collect();
    assert_eq!((heights.as_slice(), found.origin.unwrap().altitude_m), (&[40.0, 40.0][..], Some(140.0)));
}
