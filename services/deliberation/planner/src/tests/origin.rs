//! A mission with an origin, and a vehicle whose local frame begins there, elsewhere, or nobody knows where.

use super::*;
use v1::mission_request::Request as Ask;

/// Where the mission takes off.
const HERE: Option<(f64, f64)> = Some((54.0, 6.6));
/// 1.1 km north of it.
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
    /// The vehicle says where its local frame has its origin, if it knows; what the planner makes of that.
    fn hear(&mut self, origin: Option<(f64, f64)>, armed: bool) -> Vec<Effect> {
        let origin = origin.map(|(latitude_deg, longitude_deg)| v1::Origin {
            latitude_deg,
            longitude_deg,
            altitude_amsl_m: Some(7.0),
        });
        let message = v1::VehicleStatus { armed, origin, ..Default::default() }.into();
        let mut effects = Vec::new();
        self.planner.on(self.now, Event::Message { vehicle: "uav1".into(), message }, &mut effects);
        effects
    }
}

#[test]
fn on_the_ground_it_waits_until_the_vehicle_knows_its_place() {
    let mut story = Story::of(&with_origin());
    let waits = format!("waiting for the vehicle's place: {UNKNOWN}");
    check(&story.plan(), &format!("hold 1 s: {waits}"));
    let status = story.status();
    assert_eq!((status.hold, status.origin.map(|it| (it.latitude_deg, it.longitude_deg))), (waits.clone(), HERE));
    story.hear(None, false);
    check(&story.plan(), &format!("hold 1 s: {waits}"));
    assert_eq!(story.status().hold, waits);
    story.hear(HERE, false);
    assert_eq!(story.status().hold, "", "it is told at once");
    check(&story.plan(), PLAN);
}

#[test]
fn a_mission_for_another_place_never_takes_off() {
    let mut story = Story::of(&with_origin());
    story.hear(ELSEWHERE, false);
    check(&story.plan(), "finished");
    assert_eq!(story.status().objectives[0].reason, TOO_FAR);
}

#[test]
fn a_mission_without_an_origin_is_flown_from_wherever_the_vehicle_stands() {
    for origin in [None, HERE, ELSEWHERE] {
        let mut story = Story::of(&across(""));
        story.hear(origin, false);
        check(&story.plan(), PLAN);
    }
}

#[test]
fn in_flight_a_mission_is_taken_only_if_its_origin_is_the_vehicles() {
    #[track_caller]
    fn check(origin: Option<(f64, f64)>, refused: &str) {
        let mut story = Story::under_way(REFERENCE);
        story.hear(origin, true);
        let before = story.planner.core.status();
        for ask in [Ask::Validate(v1::MissionText { text: with_origin(), wind: None }), upload()] {
            let reply = story.ask(ask);
            assert_eq!(reply.accepted, refused.is_empty(), "{}", reply.text);
            assert!(refused.is_empty() || reply.text == refused, "{}", reply.text);
        }
        assert_eq!(story.planner.core.status() == before, !refused.is_empty());
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
    story.hear(ELSEWHERE, false);
    assert_eq!(story.ask(upload()).text, TOO_FAR);
}

#[test]
fn a_frame_that_moves_in_flight_ends_the_mission() {
    let mut story = Story::of(&with_origin());
    story.hear(HERE, false);
    story.plan();
    story.fly(1);
    // It has kept its origin in flight, and 2 m are within the tolerance.
    story.hear(None, true);
    story.hear(Some((54.00002, 6.6)), true);
    assert_eq!(story.status().epoch, 0);
    story.hear(ELSEWHERE, true);
    let status = story.status();
    assert_eq!((status.epoch, status.plan.unwrap().steps.len()), (1, 0), "what was planned counts no more");
    check(&story.plan(), "finished");
    assert_eq!(story.status().objectives[0].reason, TOO_FAR);
}

#[test]
fn on_the_ground_a_vehicle_can_forget_its_place() {
    let mut story = Story::of(&with_origin());
    story.hear(ELSEWHERE, false);
    story.hear(None, false);
    check(&story.plan(), &format!("hold 1 s: waiting for the vehicle's place: {UNKNOWN}"));
}

#[test]
fn a_place_that_does_not_exist_is_refused_and_changes_nothing() {
    let mut story = Story::of(&with_origin());
    story.hear(HERE, false);
    let effects = story.hear(Some((91.0, 6.6)), false);
    let [Effect::Refused { why, .. }] = &effects[..] else { panic!("{effects:?}") };
    assert!(why.starts_with("`origin` is (91.0, 6.6)"), "{why}");
    check(&story.plan(), PLAN);
}

#[test]
fn the_origin_of_an_uploaded_mission_outlives_the_process() {
    let mut story = Story::under_way(REFERENCE);
    story.hear(HERE, true);
    assert!(story.ask(upload()).accepted);
    story.restart(REFERENCE).unwrap();
    assert_eq!(story.status().origin.map(|it| (it.latitude_deg, it.longitude_deg)), HERE);
    // The new process has not heard the vehicle yet.
    assert!(story.plan().starts_with("hold 1 s: waiting for the vehicle's place"));
    story.hear(HERE, true);
    assert!(story.plan().contains("position 0 500 10"));
    // A version that knew no origins has kept none.
    let mut memory = story.planner.memory();
    memory.status.as_mut().unwrap().origin = None;
    story.planner.resume(memory).unwrap();
    assert_eq!(story.planner.core.mission().origin, None);
}
