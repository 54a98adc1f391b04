//! A mission with an origin, and a vehicle whose local frame begins there, elsewhere, or nobody knows where.

use super::*;
use domain::geodesy::{LatLon, LocalFrame};
use v1::mission_request::Request as Ask;

/// Where the mission takes off.
const HERE: Option<(f64, f64)> = Some((54.0, 6.6));
/// 1.1 km north of [`HERE`].
const ELSEWHERE: Option<(f64, f64)> = Some((54.01, 6.6));

const UNKNOWN: &str = "the mission has an origin, and the vehicle has not said where its own is";
const TOO_FAR: &str = "the mission's origin is 1.1 km from the vehicle's: 54.000000, 6.600000 and 54.010000, 6.600000, \
                       expected at most 5 m";
const PLAN: &str = "1 takeoff 10 m
                    2 position 0 500 10
                    3 land";

fn with_origin() -> String {
    format!("{}[origin]\nlatitude_deg = 54.0\nlongitude_deg = 6.6\n", across(""))
}

fn upload() -> Ask {
    Ask::Upload(v1::MissionText { text: with_origin(), wind: None })
}

impl Story {
    /// The vehicle's local frame has its origin there, if that is known.
    fn hear(&mut self, origin: Option<(f64, f64)>) {
        let place = origin.map(|(latitude_deg, longitude_deg)| LatLon::new(latitude_deg, longitude_deg).unwrap());
        self.origin = place.map(|place| Origin { place, altitude_m: Some(7.0) });
    }
}

#[test]
fn on_the_ground_it_waits_until_the_vehicle_knows_its_place() {
    let mut story = Story::of(&with_origin());
    let waits = format!("waiting for the vehicle's place: {UNKNOWN}");
    check(&story.plan(), &format!("hold 1 s: {waits}"));
    let status = story.status();
    assert_eq!((status.hold, status.origin.map(|it| (it.latitude_deg, it.longitude_deg))), (waits.clone(), HERE));
    story.hear(None);
    check(&story.plan(), &format!("hold 1 s: {waits}"));
    assert_eq!(story.status().hold, waits);
    story.hear(HERE);
    assert_eq!(story.status().hold, "", "it is published at once");
    check(&story.plan(), PLAN);
}

#[test]
fn a_mission_for_another_place_never_takes_off() {
    let mut story = Story::of(&with_origin());
    story.hear(ELSEWHERE);
    check(&story.plan(), "finished");
    assert_eq!(story.status().objectives[0].reason, TOO_FAR);
}

#[test]
fn a_mission_without_an_origin_is_flown_from_wherever_the_vehicle_stands() {
    for origin in [None, HERE, ELSEWHERE] {
        let mut story = Story::of(&across(""));
        story.hear(origin);
        check(&story.plan(), PLAN);
    }
}

#[test]
fn in_flight_a_mission_is_taken_only_if_its_origin_is_the_vehicles() {
    #[track_caller]
    fn check(origin: Option<(f64, f64)>, refused: &str) {
        let mut story = Story::under_way(REFERENCE);
        story.hear(origin);
        let before = story.status();
        for ask in [Ask::Validate(v1::MissionText { text: with_origin(), wind: None }), upload()] {
            let reply = story.ask(ask);
            assert_eq!(reply.accepted, refused.is_empty(), "{}", reply.text);
            assert!(refused.is_empty() || reply.text == refused, "{}", reply.text);
        }
        assert_eq!(story.status() == before, !refused.is_empty());
    }
    check(None, UNKNOWN);
    check(ELSEWHERE, TOO_FAR);
    check(HERE, "");
}

#[test]
fn on_the_ground_a_mission_is_taken_before_the_vehicle_knows_its_place() {
    let mut story = Story::of(REFERENCE);
    assert!(story.ask(upload()).accepted);
    check(&story.plan(), &format!("hold 1 s: waiting for the vehicle's place: {UNKNOWN}"));
    story.hear(ELSEWHERE);
    assert_eq!(story.ask(upload()).text, TOO_FAR);
}

#[test]
fn what_the_tower_has_closed_stays_where_it_lies_if_the_next_mission_begins_elsewhere() {
    let hole = "holes_m = [[[-20, 180], [20, 180], [20, 220]]]";
    let mut story = Story::of(&format!("{}{}", with_origin(), area("A", "permission", [110.0, 290.0], hole)));
    story.hear(ELSEWHERE);
    story.closed = vec![v1::ClosedArea { area: "A".into(), decision: UTC_START_MS as u64 }];
    let corners = |story: &Story, latitude_deg: f64| -> Vec<LatLon> {
        let frame = LocalFrame::at(LatLon::new(latitude_deg, 6.6).unwrap());
        story.areas.areas()[0].rings().flatten().map(|it| frame.lat_lon(*it)).collect()
    };
    let before = corners(&story, 54.0);
    let text = with_origin().replace("latitude_deg = 54.0", "latitude_deg = 54.01");
    let reply = story.ask(Ask::Upload(v1::MissionText { text, wind: None }));
    assert!(reply.accepted && reply.text.contains("not listed, and stays: A"), "{}", reply.text);
    let after = corners(&story, 54.01);
    assert_eq!((before.len(), after.len()), (7, 7), "four of the outline and three of the hole");
    let moved_m = std::iter::zip(&before, &after).map(|(before, after)| before.distance_m(*after)).fold(0.0, f64::max);
    assert!(moved_m < 0.01, "{moved_m} m");
}

#[test]
fn a_frame_that_moves_in_flight_ends_the_mission() {
    let mut story = Story::of(&with_origin());
    story.hear(HERE);
    story.plan();
    story.fly(1);
    // 2 m are within the tolerance.
    story.hear(Some((54.00002, 6.6)));
    assert!(story.plan().contains("position 0 500 10"));
    story.hear(ELSEWHERE);
    check(&story.plan(), "finished");
    assert_eq!(story.status().objectives[0].reason, TOO_FAR);
}

#[test]
fn on_the_ground_a_vehicle_can_forget_its_place() {
    let mut story = Story::of(&with_origin());
    story.hear(ELSEWHERE);
    story.hear(None);
    check(&story.plan(), &format!("hold 1 s: waiting for the vehicle's place: {UNKNOWN}"));
}
