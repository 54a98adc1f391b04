//! A bridge between a vehicle's documents and the requests of ROS.

use kittiwake_proto::v1;
use kittiwake_proto::v1::{MissionOutcome, ObjectiveState};

use crate::cdr::{Reader, Writer};
use crate::{Bridge, Effect, Order, Orders, Service, Stamp, Topic};

const MISSION: &str = include_str!("../../../../config/missions/reference.toml");
const NOW: Stamp = Stamp { sec: 9, nanosec: 0 };

/// A gateway that refuses one order, and remembers all of them by their names.
#[derive(Default)]
struct Gateway {
    orders: Vec<String>,
    refuses: Option<&'static str>,
}

impl Orders for Gateway {
    fn order(&mut self, order: Order<'_>) -> Result<String, String> {
        let name = match order {
            Order::Upload(text) => {
                assert_eq!(text, MISSION);
                "Upload".to_owned()
            }
            other => format!("{other:?}"),
        };
        self.orders.push(name.clone());
        if self.refuses == Some(name.as_str()) {
            Err("the wind is too strong".to_owned())
        } else {
            Ok("done".to_owned())
        }
    }
}

/// A document of a vehicle that is heard and has this mission.
fn document(mission: &str) -> v1::Vehicle {
    let mission = v1::vehicle::MissionState { name: Some(mission.to_owned()), ..Default::default() };
    let contact = v1::Contact { wall_age_s: Some(0.1), lost: false };
    v1::Vehicle { mission: Some(mission), contact: Some(contact), ..Default::default() }
}

fn reported(mission: &str, outcome: MissionOutcome) -> v1::Vehicle {
    let objective = |state: ObjectiveState| v1::ObjectiveReport { state: state.into(), ..Default::default() };
    let objectives = vec![objective(ObjectiveState::Success), objective(ObjectiveState::Failure)];
    let report =
        v1::MissionReport { outcome: outcome.into(), reason: "so".to_owned(), objectives, ..Default::default() };
    v1::Vehicle { report: Some(report), ..document(mission) }
}

/// The bridge with the client of one goal.
struct Flight {
    bridge: Bridge,
    gateway: Gateway,
}

impl Flight {
    fn new(refuses: Option<&'static str>) -> Flight {
        Flight { bridge: Bridge::new("uav1"), gateway: Gateway { refuses, ..Default::default() } }
    }

    fn ask(&mut self, service: Service, number: u64, payload: &[u8]) -> Vec<Effect> {
        self.bridge.on_request(service, number, payload, NOW, &mut self.gateway)
    }

    /// Whether the goal is accepted.
    fn send_goal(&mut self, id: u8, mission: &str) -> bool {
        let effects = self.ask(Service::SendGoal, 1, &Writer::default().bytes(&[id; 16]).string(mission).end());
        reply(&effects, 1)[4] == 1
    }

    fn get_result(&mut self, id: u8, number: u64) -> Vec<Effect> {
        self.ask(Service::GetResult, number, &Writer::default().bytes(&[id; 16]).end())
    }

    fn cancel(&mut self, id: u8) -> u8 {
        let effects = self.ask(Service::CancelGoal, 2, &Writer::default().bytes(&[id; 16]).stamp(NOW).end());
        reply(&effects, 2)[4]
    }

    fn see(&mut self, document: &v1::Vehicle) -> Vec<Effect> {
        self.bridge.on_document(document, &mut self.gateway)
    }
}

#[track_caller]
fn reply(effects: &[Effect], number: u64) -> &[u8] {
    let found = effects.iter().find_map(|it| match it {
        Effect::Reply(of, payload) if *of == number => Some(payload),
        _ => None,
    });
    found.expect("a reply")
}

fn published(effects: &[Effect], topic: Topic) -> Option<&[u8]> {
    effects.iter().find_map(|it| match it {
        Effect::Publish(on, payload) if *on == topic => Some(payload.as_slice()),
        _ => None,
    })
}

/// Status, outcome and reason of a result.
fn result(payload: &[u8]) -> (u8, String, String) {
    let mut reader = Reader::new(payload).unwrap();
    let [status] = reader.array().unwrap();
    (status, reader.string().unwrap().to_owned(), reader.string().unwrap().to_owned())
}

#[test]
fn a_goal_is_uploaded_started_flown_and_told() {
    let mut flight = Flight::new(None);
    // The mission before it, of the same name, ended badly.
    flight.see(&reported("reference", MissionOutcome::Crash));
    assert!(flight.send_goal(1, MISSION));
    assert_eq!(flight.get_result(1, 7), []);
    assert_eq!(published(&flight.see(&reported("reference", MissionOutcome::Crash)), Topic::Feedback), None);
    let mut waits = document("reference");
    waits.operator = Some(v1::vehicle::OperatorState { start_awaited: true, ..Default::default() });
    assert!(published(&flight.see(&waits), Topic::Feedback).is_some());
    assert_eq!(flight.gateway.orders, ["Upload", "Start"]);
    let effects = flight.see(&reported("reference", MissionOutcome::Success));
    assert_eq!(result(reply(&effects, 7)), (4, "success".to_owned(), "so".to_owned()));
    assert_eq!(reply(&effects, 7), reply(&flight.get_result(1, 8), 8), "a late request gets the same answer");
}

#[test]
fn a_goal_ends_as_its_mission_does() {
    #[track_caller]
    fn check(cancels: bool, last: &v1::Vehicle, expected: (u8, &str)) {
        let mut flight = Flight::new(None);
        assert!(flight.send_goal(1, MISSION));
        flight.see(&document("reference"));
        assert!(!cancels || flight.cancel(1) == 0);
        flight.see(last);
        let (status, outcome, _) = result(reply(&flight.get_result(1, 7), 7));
        assert_eq!((status, outcome.as_str()), expected);
    }
    check(false, &reported("reference", MissionOutcome::Failure), (6, "failure"));
    check(true, &reported("reference", MissionOutcome::Failure), (5, "failure"));
    check(true, &reported("reference", MissionOutcome::Success), (4, "success"));
    check(false, &document("another"), (6, ""));
}

#[test]
fn a_goal_is_refused_with_its_reason() {
    #[track_caller]
    fn check(payload: &[u8], refuses: Option<&'static str>, expected: &str) {
        let mut flight = Flight::new(refuses);
        let effects = flight.ask(Service::SendGoal, 1, payload);
        assert_eq!(reply(&effects, 1)[4], 0);
        let log = published(&effects, Topic::Decisions).expect("the reason");
        assert!(String::from_utf8_lossy(log).contains(expected), "{}", String::from_utf8_lossy(log));
    }
    let goal = |mission: &str| Writer::default().bytes(&[1; 16]).string(mission).end();
    check(&goal(MISSION), Some("Upload"), "the wind is too strong");
    check(&goal("name = 3"), None, "the goal's mission");
    check(&goal(MISSION)[..30], None, "the request ends within its mission");
    check(&goal("")[..9], None, "the request ends within its id");
    check(b"", None, "not little-endian CDR");
}

#[test]
fn the_next_goal_replaces_the_one_before() {
    let mut flight = Flight::new(None);
    assert!(flight.send_goal(1, MISSION) && !flight.send_goal(1, MISSION), "an id is accepted once");
    assert_eq!(flight.get_result(1, 7), []);
    assert!(flight.send_goal(2, MISSION));
    assert_eq!(result(reply(&flight.get_result(1, 8), 8)).2, "another mission was uploaded");
    assert_eq!(flight.cancel(1), 3, "it has terminated");
    assert_eq!(flight.cancel(9), 2, "nobody knows it");
    assert_eq!(flight.cancel(0), 0, "zeros mean the present one");
    assert_eq!(result(reply(&flight.get_result(9, 9), 9)).0, 0);
    assert_eq!(flight.gateway.orders, ["Upload", "Upload", "Return"]);
}

#[test]
fn what_the_gateway_refuses_is_said() {
    let mut flight = Flight::new(Some("Return"));
    let effects = flight.ask(Service::Return, 4, &Writer::default().u8(0).end());
    assert_eq!(reply(&effects, 4), Writer::default().bool(false).string("the wind is too strong").end());
    assert!(flight.send_goal(1, MISSION));
    assert_eq!(flight.cancel(1), 1, "rejected");
    let mut flight = Flight::new(Some("Start"));
    assert!(flight.send_goal(1, MISSION));
    let operator = v1::vehicle::OperatorState { start_awaited: true, ..Default::default() };
    flight.see(&v1::Vehicle { operator: Some(operator), ..document("reference") });
    assert_eq!(result(reply(&flight.get_result(1, 7), 7)), (6, String::new(), "the wind is too strong".to_owned()));
}

#[test]
fn a_sample_and_a_decision_are_published_once_and_a_silent_vehicle_not_at_all() {
    let mut flight = Flight::new(None);
    let local = v1::VehicleLocalPosition {
        position: Some(v1::Ned::default()),
        velocity: Some(v1::NedVelocity::default()),
        timestamp_us: 5,
        ..Default::default()
    };
    let attitude = Some(v1::VehicleAttitude { q_w: 1.0, ..Default::default() });
    let aircraft = v1::vehicle::Aircraft { local_position: Some(local), attitude, ..Default::default() };
    let mut seen = v1::Vehicle { aircraft: Some(aircraft), ..document("reference") };
    assert!(published(&flight.see(&seen), Topic::Odometry).is_some());
    assert_eq!(published(&flight.see(&seen), Topic::Odometry), None);
    seen.contact = Some(v1::Contact { wall_age_s: Some(30.0), lost: true });
    let effects = flight.see(&seen);
    assert_eq!(effects.len(), 1);
    assert!(published(&effects, Topic::Diagnostics).is_some());

    let decision = |sequence| v1::DecisionRecord { sequence, ..Default::default() };
    assert_eq!(flight.bridge.on_decisions(&[decision(1), decision(2)]).len(), 2);
    assert_eq!(flight.bridge.on_decisions(&[decision(2), decision(3)]).len(), 1);
    // A manager that has restarted counts from 1.
    for (mission_time_s, expected) in [(80.0, 0), (90.0, 0), (2.0, 1)] {
        flight.see(&v1::Vehicle { mission_time_s: Some(mission_time_s), ..document("reference") });
        assert_eq!(flight.bridge.on_decisions(&[decision(1)]).len(), expected, "{mission_time_s}");
    }
}
