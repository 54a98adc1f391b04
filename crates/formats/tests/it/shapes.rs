//! Areas lie where the zones lie, or cover more.

use super::{import, mission, notes, settings};
use domain::geodesy::{LatLon, LocalFrame, Origin};
use domain::geometry::Ned;
use formats::assemble::{Assembled, Settings};
use proptest::prelude::*;

fn zone(projection: &str) -> String {
    format!(
        r#"{{"UASZoneList": [{{"identifier": "Z", "restriction": "PROHIBITED", "geometry":
            [{{"uomDimensions": "M", "horizontalProjection": {projection}}}]}}]}}"#
    )
}

fn polygon(corners: &[[f64; 2]]) -> String {
    zone(&format!(r#"{{"type": "Polygon", "coordinates": [{corners:?}]}}"#))
}

/// A ring of longitudes and latitudes from a take-off point.
#[track_caller]
fn read(latitude: f64, longitude: f64, corners: &[[f64; 2]]) -> Assembled {
    let place = LatLon::new(latitude, longitude).unwrap();
    let settings = Settings { origin: Some(Origin { place, altitude_m: None }), ..settings() };
    import("z.json", &polygon(corners), &settings).unwrap_or_else(|it| panic!("{it}"))
}

proptest! {
    #[test]
    fn the_area_of_a_circle_contains_it_and_little_more(
        latitude in 53.3..54.7_f64, longitude in 5.5..7.7_f64, radius_m in 1.0..30_000.0_f64, direction in 0.0..360.0_f64,
    ) {
        let text = zone(&format!(r#"{{"type": "Circle", "center": [{longitude}, {latitude}], "radius": {radius_m}}}"#));
        // Not too near to the take-off point for a mission, and not so far from it that the zone is left out.
        let origin = LatLon::new(54.0, 6.6).unwrap();
        let centre = LatLon::new(latitude, longitude).unwrap();
        let local = LocalFrame::at(origin).local(centre);
        let distance_m = local.horizontal_distance_m(Ned::default());
        prop_assume!(radius_m * 1.01 + 20.0 < distance_m && distance_m < 100_000.0);
        let assembled = import("z.json", &text, &settings()).unwrap();
        let area = &mission(&assembled).areas[0];
        // A place at a distance from the centre on the Earth.
        let at = |distance_m: f64| {
            let (sin, cos) = direction.to_radians().sin_cos();
            let there = LocalFrame::at(centre).lat_lon(Ned::new(distance_m * cos, distance_m * sin, 0.0));
            LocalFrame::at(origin).local(there)
        };
        prop_assert!(area.contains(at(radius_m)));
        prop_assert!(!area.contains(at(radius_m * 1.0092)));
    }

    #[test]
    fn a_circle_to_stay_inside_is_surrounded(direction in 0.0..360.0_f64, radius_m in 100.0..20_000.0_f64) {
        let plan = format!(
            r#"{{"fileType": "Plan", "mission": {{"items": []}}, "geoFence": {{"circles": [
                {{"inclusion": true, "circle": {{"center": [54.0, 6.6], "radius": {radius_m}}}}}]}}}}"#
        );
        let areas = mission(&import("q.plan", &plan, &settings()).unwrap()).areas;
        let (sin, cos) = direction.to_radians().sin_cos();
        let is_closed = |distance_m: f64| {
            areas.iter().any(|it| it.contains(Ned::new(distance_m * cos, distance_m * sin, 0.0)))
        };
        prop_assert!(!is_closed(radius_m * 0.99));
        prop_assert!((0..50).all(|step| is_closed(radius_m + f64::from(step) * 10.0 - 1e-3)));
    }
}

#[test]
fn a_fence_of_any_shape_is_surrounded() {
    // A horseshoe: open to the east, the take-off point in its western part.
    let corners = "[[53.99, 6.58], [54.01, 6.58], [54.01, 6.64], [54.005, 6.64], [54.005, 6.61], [53.995, 6.61], [53.995, 6.64], [53.99, 6.64]]";
    let plan = format!(
        r#"{{"fileType": "Plan", "mission": {{"items": []}}, "geoFence": {{"polygons": [{{"inclusion": true, "polygon": {corners}}}]}}}}"#
    );
    let areas = mission(&import("q.plan", &plan, &settings()).unwrap()).areas;
    #[track_caller]
    fn check(areas: &[domain::area::Area], latitude: f64, longitude: f64, expected: bool) {
        let frame = LocalFrame::at(LatLon::new(54.0, 6.6).unwrap());
        let at = frame.local(LatLon::new(latitude, longitude).unwrap());
        assert_eq!(areas.iter().any(|it| it.contains(at)), expected, "{latitude} {longitude}");
    }
    check(&areas, 54.0, 6.6, false);
    check(&areas, 54.0075, 6.635, false);
    check(&areas, 53.9925, 6.635, false);
    // Between the arms, and outside.
    check(&areas, 54.0, 6.62, true);
    check(&areas, 54.0, 6.643, true);
    check(&areas, 54.012, 6.61, true);
    check(&areas, 54.0, 6.578, true);
    // Far outside too: a vehicle there flies back in.
    check(&areas, 54.3, 6.6, true);
    check(&areas, 54.0, 5.2, true);
}

/// An area of this border and these holes, in degrees of longitude and latitude.
#[track_caller]
fn holed(border: &str, holes: &[&str]) -> (domain::area::Area, String) {
    let rings = [&[border], holes].concat().join(", ");
    let text = format!(
        r#"{{"type": "Feature", "properties": {{"kind": "keep-out"}}, "geometry": {{"type": "Polygon", "coordinates": [{rings}]}}}}"#
    );
    let assembled = import("a.geojson", &text, &settings()).unwrap_or_else(|it| panic!("{it}"));
    (mission(&assembled).areas[0].clone(), notes(&assembled))
}

const BORDER: &str = "[[6.5, 53.95], [6.7, 53.95], [6.7, 54.05], [6.5, 54.05], [6.5, 53.95]]";
/// Round the take-off point.
const HOME: &str = "[[6.58, 53.99], [6.58, 54.01], [6.62, 54.01], [6.62, 53.99], [6.58, 53.99]]";

#[test]
fn holes_are_kept_and_those_that_cannot_be_are_filled_and_listed() {
    #[track_caller]
    fn check(holes: &[&str], kept: usize, said: &str) {
        let (area, notes) = holed(BORDER, holes);
        assert_eq!((area.holes.len(), notes.as_str()), (kept, said));
        assert!(!area.contains(Ned::default()) && area.contains(Ned::new(0.0, 3_000.0, 0.0)));
    }
    let other = "[[6.64, 54.0], [6.64, 54.001], [6.65, 54.001], [6.64, 54.0]]";
    check(&[HOME], 1, "");
    check(&[HOME, other], 2, "");
    let at = "/geometry/coordinates";
    let touches = format!("{at}: a hole that crosses or touches a border: filled, the area covers it\n");
    check(&[HOME, "[[6.69, 54.0], [6.71, 54.0], [6.69, 54.001], [6.69, 54.0]]"], 1, &touches);
    check(&[HOME, "[[6.62, 54.01], [6.63, 54.01], [6.63, 54.02], [6.62, 54.01]]"], 1, &touches);
    check(&[HOME, "[[6.64, 54.0], [6.65, 54.002], [6.65, 54.0], [6.64, 54.001], [6.64, 54.0]]"], 1, &touches);
    let small = format!("{at}: a hole of less than a square metre: filled, the area covers it\n");
    check(&[HOME, "[[6.64, 54.0], [6.640001, 54.0], [6.64, 54.000001], [6.64, 54.0]]"], 1, &small);
    let none = format!("{at}/2: a hole: filled, the area covers it (a ring of 2 different corners has no area)\n");
    check(&[HOME, "[[6.64, 54.0], [6.65, 54.001], [6.64, 54.0]]"], 1, &none);
}

#[test]
fn a_zone_without_end_round_a_hole_is_near_if_the_hole_is() {
    let (area, notes) = holed("[[0.0, 50.0], [13.0, 50.0], [13.0, 58.0], [0.0, 58.0], [0.0, 50.0]]", &[HOME]);
    assert!(!area.contains(Ned::default()) && area.contains(Ned::new(0.0, 3_000.0, 0.0)));
    assert_eq!((area.corners.len(), area.holes.len()), (4, 1), "{notes}");
    assert!(notes.contains("it is cut off 140 km"), "{notes}");
}

#[test]
fn holes_of_kml_are_kept() {
    let ring = |corners: &str| format!("<LinearRing><coordinates>{corners}</coordinates></LinearRing>");
    let outer = ring("6.5,53.95 6.7,53.95 6.7,54.05 6.5,54.05 6.5,53.95");
    let home = ring("6.58,53.99 6.58,54.01 6.62,54.01 6.62,53.99 6.58,53.99");
    let other = ring("6.64,54.0 6.64,54.001 6.65,54.001 6.64,54.0");
    for inner in [
        format!("<innerBoundaryIs>{home}</innerBoundaryIs><innerBoundaryIs>{other}</innerBoundaryIs>"),
        format!("<innerBoundaryIs>{home}{other}</innerBoundaryIs>"),
    ] {
        let text = format!(
            "<kml><Placemark><name>p</name><Polygon><outerBoundaryIs>{outer}</outerBoundaryIs>{inner}</Polygon></Placemark></kml>"
        );
        let assembled = import("a.kml", &text, &settings()).unwrap_or_else(|it| panic!("{it}"));
        assert_eq!(mission(&assembled).areas[0].holes.len(), 2, "{}", notes(&assembled));
    }
}

#[test]
fn a_fence_wider_than_a_mission_keeps_it_from_what_is_near() {
    // To the north as far as 55.5 degrees, to the south for 5 km.
    let plan = r#"{"fileType": "Plan", "mission": {"items": []}, "geoFence": {"polygons": [{"inclusion": true,
        "polygon": [[53.95, 6.0], [53.95, 7.2], [55.5, 7.2], [55.5, 6.0]]}]}}"#;
    let areas = mission(&import("q.plan", plan, &settings()).unwrap()).areas;
    let is_closed = |north_m: f64, east_m: f64| areas.iter().any(|it| it.contains(Ned::new(north_m, east_m, 0.0)));
    assert!(!is_closed(0.0, 0.0) && !is_closed(90_000.0, 0.0));
    assert!(is_closed(-6_000.0, 0.0) && is_closed(0.0, 50_000.0) && is_closed(90_000.0, -50_000.0));
}

#[test]
fn a_ring_across_the_antimeridian_is_read_the_short_way() {
    let assembled = read(
        -18.0,
        179.95,
        &[[179.98, -18.01], [-179.98, -18.01], [-179.98, -17.99], [179.98, -17.99], [179.98, -18.01]],
    );
    let area = &mission(&assembled).areas[0];
    // A degree of longitude is 105.9 km there.
    assert!(area.contains(Ned::new(0.0, 5_300.0, 0.0)) && !area.contains(Ned::new(0.0, 3_000.0, 0.0)), "{area:?}");
    assert!(!area.contains(Ned::new(0.0, 7_500.0, 0.0)), "{area:?}");
    assert!(notes(&assembled).contains("crosses the antimeridian"), "{}", notes(&assembled));
    // Cut there, as the RFC asks, it is two areas.
    let ring = |west: f64, east: f64| {
        format!("[[[{west}, -18.01], [{east}, -18.01], [{east}, -17.99], [{west}, -17.99], [{west}, -18.01]]]")
    };
    let text = format!(
        r#"{{"type": "Feature", "properties": {{"kind": "keep-out"}}, "geometry": {{"type": "MultiPolygon", "coordinates": [{}, {}]}}}}"#,
        ring(179.98, 180.0),
        ring(-180.0, -179.98)
    );
    let place = LatLon::new(-18.0, 179.95).unwrap();
    let settings = Settings { origin: Some(Origin { place, altitude_m: None }), ..settings() };
    let assembled = import("a.geojson", &text, &settings).unwrap();
    assert_eq!((assembled.areas, notes(&assembled).as_str()), (2, ""));
}

#[test]
fn a_long_border_along_a_parallel_stays_on_it() {
    let assembled = read(54.0, 6.6, &[[6.0, 54.1], [7.2, 54.1], [7.2, 54.3], [6.0, 54.3], [6.0, 54.1]]);
    let area = &mission(&assembled).areas[0];
    let frame = LocalFrame::at(LatLon::new(54.0, 6.6).unwrap());
    for step in 0..=120 {
        let on_border = frame.local(LatLon::new(54.1, 6.0 + f64::from(step) / 100.0).unwrap());
        let off_m = area.distance_to_border_m(on_border);
        assert!(off_m < 0.6, "{step}: {off_m} m");
    }
    // A straight line between its ends would be off by 130 m in the middle.
    assert!(8 < area.corners.len() && area.corners.len() < 60, "{}", area.corners.len());
}

#[test]
fn a_zone_larger_than_a_mission_is_cut_off() {
    let assembled = read(54.0, 6.6, &[[6.65, 40.0], [40.0, 40.0], [40.0, 65.0], [6.65, 65.0], [6.65, 40.0]]);
    let area = &mission(&assembled).areas[0];
    assert!(area.contains(Ned::new(0.0, 50_000.0, 0.0)) && area.contains(Ned::new(90_000.0, 90_000.0, 0.0)));
    assert!(!area.contains(Ned::new(0.0, 3_000.0, 0.0)));
    assert!(notes(&assembled).contains("it is cut off 140 km"), "{}", notes(&assembled));
}
