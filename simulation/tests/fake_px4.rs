//! The bridge and a PX4, without the rest of the system: what the status says while somebody commands, loses, takes over, restarts.

use std::time::Duration;

use domain::declared_skill::DeclaredSkills;
use domain::fmu::{Command, CommandId, FlightMode, Gripper, OffboardControl, Setpoint, Status, VehicleCommand};
use domain::geometry::Ned;
use domain::time::{Now, Time};
use fake_px4::{FakeLink, FakePx4, Trouble};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::{Effect, Event, Node};
use px4_bridge::Px4Bridge;
use px4_bridge::modes::NavState;
use serde::Deserialize;

/// Of the shipped configuration.
#[derive(Deserialize)]
struct Sections {
    vehicle_sim: vehicle_sim::config::Config,
    px4_bridge: px4_bridge::config::Config,
}

/// The steps of time.
const STEP: Duration = Duration::from_millis(4);
/// Setpoints come this often.
const STREAM: Duration = Duration::from_millis(50);

struct Flight {
    bridge: Px4Bridge<FakeLink>,
    link: FakeLink,
    now: Time,
    next_id: u64,
    status: Option<(Time, Status)>,
    position: v1::VehicleLocalPosition,
    acks: Vec<v1::VehicleCommandAck>,
    stream: Option<Setpoint>,
    next_setpoint: Time,
    tasks: Vec<v1::TaskReport>,
}

impl Flight {
    fn new() -> Flight {
        let text = include_str!("../../config/kittiwake.toml");
        let sections: Sections = toml::from_str(text).expect("the shipped configuration");
        let link = FakeLink::to(FakePx4::new(&sections.vehicle_sim, 1));
        let skills =
            DeclaredSkills::read(&crate::stories::support::shipped().join("skills")).expect("the shipped skills");
        Flight {
            bridge: Px4Bridge::new(&sections.px4_bridge, link.clone()).with_skills(&skills),
            link,
            now: Time::ZERO,
            next_id: 1,
            status: None,
            position: v1::VehicleLocalPosition::default(),
            acks: Vec::new(),
            stream: None,
            next_setpoint: Time::ZERO,
            tasks: Vec::new(),
        }
    }

    /// In the air at 10 m, flown by us, in Hold.
    fn in_the_air() -> Flight {
        let mut flight = Flight::new();
        flight.until("it can arm", |it| it.status().can_arm == Some(true));
        flight.commands(Command::Arm);
        flight.until("it is armed", |it| it.status().armed);
        flight.commands(Command::Takeoff { height_m: 10.0 });
        flight.until("the takeoff flies", |it| it.status().actual == Some(FlightMode::Takeoff));
        flight.until("the takeoff ends", |it| it.status().actual == Some(FlightMode::Loiter));
        assert!(flight.height_m() > 8.0, "{}", flight.height_m());
        flight
    }

    /// The same, offboard to a far place.
    fn offboard() -> Flight {
        let mut flight = Flight::in_the_air();
        let target = Ned::new(0.0, 200.0, -10.0);
        flight.stream = Some(Setpoint::Position { target, speed_limit_m_s: None, yaw_rad: None });
        flight.pass(0.2);
        flight.commands(Command::Offboard);
        flight.until("it flies offboard", |it| it.status().actual == Some(FlightMode::Offboard));
        assert!(!flight.status().commanded_by_other);
        flight
    }

    fn status(&self) -> Status {
        self.status.clone().expect("a status").1
    }

    fn height_m(&self) -> f64 {
        self.position.position.map_or(0.0, |it| -it.down_m)
    }

    /// Sends a command, and expects PX4 to take it.
    #[track_caller]
    fn commands(&mut self, command: Command) {
        let ack = self.answer_to(command);
        assert_eq!(ack.result(), v1::CommandResult::Accepted, "{command}: {}", ack.reason);
    }

    #[track_caller]
    fn answer_to(&mut self, command: Command) -> v1::VehicleCommandAck {
        let id = CommandId(self.next_id);
        self.next_id += 1;
        self.tell(v1::VehicleCommand::from(VehicleCommand { id, command }));
        self.until("an answer", |it| it.acks.iter().any(|it| it.id == id.0));
        self.acks.pop().expect("the answer")
    }

    fn tell(&mut self, message: impl Into<Message>) {
        let (mut effects, message) = (Vec::new(), message.into());
        self.bridge.on(self.now(), Event::Message { vehicle: "uav1".into(), message }, &mut effects);
        self.take(effects);
    }

    fn now(&self) -> Now {
        Now { time: self.now, utc_ms: 0 }
    }

    fn step(&mut self) {
        self.now = self.now + STEP;
        if let Some(setpoint) = self.stream.filter(|_| self.next_setpoint <= self.now) {
            self.next_setpoint = self.now + STREAM;
            self.tell(v1::OffboardControlMode::from(OffboardControl::Position));
            self.tell(v1::TrajectorySetpoint::from(setpoint));
        }
        let mut effects = Vec::new();
        self.bridge.act(self.now(), &mut effects);
        self.take(effects);
    }

    fn take(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Publish { message: Message::VehicleStatus(it), .. } => {
                    self.status = Some((self.now, it.into()))
                }
                Effect::Publish { message: Message::VehicleLocalPosition(it), .. } => self.position = it,
                Effect::Publish { message: Message::VehicleCommandAck(it), .. } => self.acks.push(it),
                Effect::Publish { message: Message::TaskReport(it), .. } if it.request_id == "r" => self.tasks.push(it),
                Effect::Refused { why, .. } => panic!("refused: {why}"),
                Effect::Publish { .. } | Effect::Call { .. } | Effect::Reply { .. } => {}
            }
        }
    }

    fn pass(&mut self, seconds: f64) {
        let until = self.now + Duration::from_secs_f64(seconds);
        while self.now < until {
            self.step();
        }
    }

    #[track_caller]
    fn until(&mut self, what: &str, holds: impl Fn(&Flight) -> bool) {
        let limit = self.now + Duration::from_secs(120);
        while self.status.is_none() || !holds(self) {
            assert!(self.now < limit, "not within 120 s: {what}; {:?}", self.status);
            self.step();
        }
    }

    fn trouble(&mut self, trouble: Trouble) {
        self.link.0.borrow_mut().trouble(trouble);
    }
}

#[test]
fn it_can_arm_only_when_px4_knows_where_it_is() {
    let mut flight = Flight::new();
    flight.until("a word of PX4", |_| true);
    assert_eq!(flight.status().can_arm, Some(false));
    assert!(!flight.status().reason.is_empty());
    assert_eq!(flight.answer_to(Command::Arm).result(), v1::CommandResult::Rejected);
    assert_eq!(flight.link.0.borrow().commands(), []);
    flight.until("it can arm", |it| it.status().can_arm == Some(true));
    assert_eq!(flight.status().reason, "");
    assert!(flight.status().origin.is_some_and(|it| it.altitude_m.is_some()));
}

#[test]
fn a_flight_and_after_its_landing_another() {
    let mut flight = Flight::offboard();
    flight.until("it is there", |it| it.position.position.is_some_and(|it| 199.0 < it.east_m));
    flight.stream = None;
    flight.commands(Command::Land);
    flight.until("it is disarmed", |it| !it.status().armed);
    // PX4 has gone back to offboard, in which it would not arm: the bridge sets Hold.
    flight.until("it can arm again", |it| it.status().can_arm == Some(true));
    assert_eq!(flight.status().intended, Some(FlightMode::Loiter));
    assert!(!flight.status().commanded_by_other);
    flight.commands(Command::Arm);
    flight.until("it is armed", |it| it.status().armed);
    assert!(!flight.status().commanded_by_other);
}

#[test]
fn without_setpoints_px4_returns_and_with_them_it_resumes() {
    let mut flight = Flight::offboard();
    let stream = flight.stream.take();
    let stopped = flight.now;
    flight.until("it returns", |it| it.status().actual == Some(FlightMode::Return));
    let after_ms = (flight.now - stopped).as_millis();
    assert!((950..1250).contains(&after_ms), "{after_ms} ms");
    let status = flight.status();
    assert_eq!((status.intended, status.failsafe), (Some(FlightMode::Offboard), true));
    assert_eq!(status.reason, "Return instead of Offboard: there are no fresh offboard setpoints");
    assert!(!status.commanded_by_other, "PX4 pre-empts; nobody has taken over");
    let sent = flight.link.0.borrow().setpoints();
    flight.pass(3.0);
    assert_eq!(flight.link.0.borrow().setpoints(), sent, "the bridge repeats none");
    flight.stream = stream;
    flight.until("it resumes", |it| it.status().actual == Some(FlightMode::Offboard));
}

#[test]
fn whoever_takes_over_is_seen_until_we_command_again() {
    for mode in [NavState::LOITER, NavState(2), NavState::RETURN, NavState::LAND] {
        let mut flight = Flight::offboard();
        flight.trouble(Trouble::Selects(mode));
        flight.until("it is seen", |it| it.status().commanded_by_other);
        assert_eq!(flight.status().actual, mode.mode());
        // Back in offboard, but not by us.
        flight.trouble(Trouble::Selects(NavState::OFFBOARD));
        flight.until("offboard", |it| it.status().actual == Some(FlightMode::Offboard));
        flight.pass(1.0);
        assert!(flight.status().commanded_by_other, "{}", mode.name());
        flight.commands(Command::Loiter);
        flight.until("it is ours", |it| !it.status().commanded_by_other);
    }
}

#[test]
fn who_lands_it_for_us_keeps_it_on_the_ground() {
    let mut flight = Flight::in_the_air();
    flight.trouble(Trouble::Selects(NavState::LAND));
    flight.until("it is disarmed", |it| !it.status().armed);
    flight.pass(5.0);
    assert!(flight.status().commanded_by_other, "until we command something");
    assert!(
        flight.link.0.borrow().commands().iter().all(|(_, number, ..)| *number != 176),
        "and nothing is set for it"
    );
    flight.commands(Command::Arm);
    flight.until("it is armed", |it| it.status().armed);
    assert!(!flight.status().commanded_by_other, "arming is a command of ours, and sets Hold first");
}

#[test]
fn px4s_own_failsafes_are_pre_emptions_with_their_reasons() {
    #[track_caller]
    fn check(trouble: Trouble, actual: FlightMode, reason: &str) {
        let mut flight = Flight::offboard();
        flight.trouble(trouble);
        flight.until("it pre-empts", |it| it.status().actual == Some(actual));
        let status = flight.status();
        assert!(status.failsafe && !status.commanded_by_other && status.reason.contains(reason), "{status:?}");
    }
    check(Trouble::Fence(Some(30.0)), FlightMode::Loiter, "Hold instead of Offboard: the geofence is breached");
    check(Trouble::BatteryWarning(2), FlightMode::Return, "Return instead of Offboard: the battery is critical");
    check(Trouble::BatteryWarning(3), FlightMode::Land, "Land instead of Offboard: the battery is nearly empty");
}

#[test]
fn a_px4_that_is_started_again_has_another_frame_and_nothing_old_is_said_of_it() {
    let mut flight = Flight::offboard();
    let before = flight.status().frame_epoch;
    assert_ne!(before, 0);
    flight.trouble(Trouble::Silent(true));
    flight.pass(2.0);
    let (at, _) = flight.status.clone().expect("a status");
    flight.pass(3.0);
    assert_eq!(flight.status.as_ref().map(|it| it.0), Some(at), "nothing is repeated");
    assert_eq!(flight.answer_to(Command::Land).result(), v1::CommandResult::Rejected);
    flight.trouble(Trouble::Silent(false));
    flight.trouble(Trouble::Restarts);
    flight.until("its first word", |it| it.status.as_ref().is_some_and(|it| at < it.0));
    assert_eq!(flight.status().frame_epoch, 0, "it does not know where it is");
    flight.until("it knows where it is", |it| it.status().frame_epoch != 0);
    assert_ne!(flight.status().frame_epoch, before);
}

#[test]
fn a_topic_that_stops_forbids_to_arm() {
    let mut flight = Flight::new();
    flight.until("it can arm", |it| it.status().can_arm == Some(true));
    flight.trouble(Trouble::Mute("vehicle_land_detected"));
    flight.until("it cannot", |it| it.status().can_arm == Some(false));
    assert!(flight.status().reason.contains("vehicle_land_detected"), "{}", flight.status().reason);
}

#[test]
fn a_speed_limit_is_kept() {
    let mut flight = Flight::in_the_air();
    let target = Ned::new(60.0, 0.0, -10.0);
    flight.stream = Some(Setpoint::Position { target, speed_limit_m_s: Some(3.0), yaw_rad: None });
    flight.pass(0.2);
    flight.commands(Command::Offboard);
    let mut fastest_m_s = 0.0_f64;
    let until = flight.now + Duration::from_secs(40);
    while flight.now < until {
        flight.step();
        let velocity = flight.position.velocity.unwrap_or_default();
        fastest_m_s = fastest_m_s.max(velocity.north_m_s.hypot(velocity.east_m_s));
    }
    assert!((2.5..4.0).contains(&fastest_m_s), "{fastest_m_s}");
    let north_m = flight.position.position.map_or(0.0, |it| it.north_m);
    assert!((north_m - 60.0).abs() < 1.0, "{north_m}");
}

#[test]
fn a_load_counts_as_released_once_px4_acknowledges_it() {
    let mut flight = Flight::in_the_air();
    assert_eq!(flight.status().gripper, Some(Gripper::Silent));
    flight.commands(Command::Release);
    let commanded = flight.now;
    assert_eq!(flight.status().gripper, Some(Gripper::Silent), "it moves");
    flight.until("the gripper is open", |it| it.status().gripper == Some(Gripper::Released));
    assert!(Duration::from_millis(900) < flight.now - commanded);
    let mut flight = Flight::in_the_air();
    flight.trouble(Trouble::HasNoGripper);
    let answer = flight.answer_to(Command::Release);
    assert_eq!(answer.result(), v1::CommandResult::Rejected);
    assert!(answer.reason.contains("PX4 refused release, failed"), "{}", answer.reason);
    flight.pass(3.0);
    assert_eq!(flight.status().gripper, Some(Gripper::Silent));
}

#[test]
fn a_declared_skill_is_a_command_to_px4() {
    #[track_caller]
    fn check(trouble: Option<Trouble>, expected: (&str, &str)) {
        let mut flight = Flight::in_the_air();
        trouble.into_iter().for_each(|it| flight.trouble(it));
        flight.tell(v1::TaskOrder { request_id: "r".into(), skill: "gripper_release".into(), ..Default::default() });
        flight.until("its end", |it| it.tasks.last().is_some_and(|it| it.state() == v1::TaskState::Ended));
        let report = flight.tasks.pop().expect("the last report");
        assert_eq!((report.outcome.as_str(), report.reason.as_str()), expected);
    }
    check(None, ("released", ""));
    let refused = "the command is refused by the autopilot: failed";
    check(Some(Trouble::HasNoGripper), ("refused", refused));
}

#[test]
fn a_landing_on_a_target_says_whether_it_is_seen_where_px4_tells() {
    let mut flight = Flight::in_the_air();
    flight.commands(Command::LandOnTarget);
    flight.until("it lands", |it| it.status().actual == Some(FlightMode::Land));
    flight.pass(2.0);
    assert_eq!(flight.status().landing_target_seen, None, "the topic is not sent");
    for seen in [true, false, true] {
        flight.trouble(Trouble::Target { seen });
        flight.until("it says so", |it| it.status().landing_target_seen == Some(seen));
    }
    flight.until("it is disarmed", |it| !it.status().armed);
    flight.until("it can arm again", |it| it.status().can_arm == Some(true));
    assert_eq!(flight.status().landing_target_seen, None);
    assert!(!flight.status().commanded_by_other);
}
