//! A pilot for the tests: sends commands, streams a setpoint, lets time pass, and records what changes.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::geometry::{Ned, NedVelocity};
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Message, Request, Response, Topic};
use kittiwake_proto::v1::vehicle_command::Command;
use kittiwake_proto::v1::{self, FlightMode};
use node::{Effect, Event, Node, Token};
use vehicle_sim::VehicleSim;
use vehicle_sim::config::Config;

/// Wall time between two setpoints: 20 Hz.
const SETPOINT_PERIOD: Duration = Duration::from_millis(50);

/// The shipped configuration.
pub(crate) fn config() -> Config {
    #[derive(serde::Deserialize)]
    struct File {
        vehicle_sim: Config,
    }
    toml::from_str::<File>(include_str!("../vehicle-sim.toml")).unwrap().vehicle_sim
}

/// A simulator and its pilot.
pub(crate) struct Flight {
    sim: VehicleSim,
    pace: Pace,
    now: Time,
    setpoint: Option<(v1::OffboardControl, v1::TrajectorySetpoint)>,
    next_setpoint: Time,
    last_id: u64,
    /// How many messages have come on each topic.
    pub(crate) counts: BTreeMap<Topic, usize>,
    ack: Option<v1::VehicleCommandAck>,
    pub(crate) status: v1::VehicleStatus,
    pub(crate) landed: v1::VehicleLandDetected,
    pub(crate) position: v1::VehicleLocalPosition,
    pub(crate) global: v1::VehicleGlobalPosition,
    pub(crate) attitude: v1::VehicleAttitude,
    pub(crate) battery: v1::BatteryStatus,
    pub(crate) traffic: Vec<v1::TransponderReport>,
    pub(crate) wind: v1::WindEstimate,
    /// Changes of status and land detector, with the time.
    pub(crate) story: String,
    /// Messages that were refused, and why.
    pub(crate) refused: Vec<String>,
    /// Everything that came out, if recorded.
    pub(crate) record: Option<Vec<(Time, Effect)>>,
}

impl Flight {
    pub(crate) fn new() -> Flight {
        Flight::at_speed(1.0, 1)
    }

    pub(crate) fn at_speed(speed: f64, seed: u64) -> Flight {
        let pace = Pace::new(speed).unwrap();
        let mut flight = Flight {
            sim: VehicleSim::new(&config(), pace, seed),
            pace,
            now: Time::ZERO,
            setpoint: None,
            next_setpoint: Time::ZERO,
            last_id: 0,
            counts: BTreeMap::new(),
            ack: None,
            status: Default::default(),
            landed: Default::default(),
            position: Default::default(),
            global: Default::default(),
            attitude: Default::default(),
            battery: Default::default(),
            traffic: Vec::new(),
            wind: v1::WindEstimate::default(),
            story: String::new(),
            refused: Vec::new(),
            record: None,
        };
        flight.act();
        flight
    }

    /// Armed, and loitering at 10 m after a takeoff.
    pub(crate) fn airborne() -> Flight {
        let mut flight = Flight::new();
        flight.accepted(arm());
        flight.accepted(takeoff(10.0));
        flight.until("loiter at 10 m", 20.0, |it| it.status.actual_mode() == FlightMode::Loiter);
        flight.pass(2.0);
        flight
    }

    /// In offboard mode, holding the position at 10 m.
    pub(crate) fn offboard() -> Flight {
        let mut flight = Flight::airborne();
        flight.stream_position(Ned::new(0.0, 0.0, -10.0), None);
        flight.pass(0.1);
        flight.accepted(offboard());
        flight
    }

    pub(crate) fn seconds(&self) -> f64 {
        self.now.as_secs_f64()
    }

    pub(crate) fn height_m(&self) -> f64 {
        -self.position.position.unwrap().down_m
    }

    pub(crate) fn at(&self) -> Ned {
        self.position.position.unwrap().try_into().unwrap()
    }

    pub(crate) fn speed_m_s(&self) -> f64 {
        NedVelocity::try_from(self.position.velocity.unwrap()).unwrap().speed_m_s()
    }

    pub(crate) fn fails(&self, flag: v1::FailureFlag) -> bool {
        self.status.failures.contains(&(flag as i32))
    }

    /// Sends a command and returns the answer that came at once, if any.
    pub(crate) fn command(&mut self, command: Command) -> Option<v1::VehicleCommandAck> {
        self.last_id += 1;
        let id = self.last_id;
        let ack = self.send(v1::VehicleCommand { id, command: Some(command) });
        assert!(ack.iter().all(|it| it.id == id), "{ack:?} answers another command than {id}");
        ack
    }

    /// Sends a command as it is and returns what answer came at once, if any.
    pub(crate) fn send(&mut self, command: v1::VehicleCommand) -> Option<v1::VehicleCommandAck> {
        self.ack = None;
        self.message(command.into());
        self.ack.take()
    }

    /// The id of the newest command.
    pub(crate) fn last_id(&self) -> u64 {
        self.last_id
    }

    #[track_caller]
    pub(crate) fn accepted(&mut self, command: Command) {
        let ack = self.command(command).expect("an acknowledgement");
        assert_eq!((ack.result(), ack.reason.as_str()), (v1::CommandResult::Accepted, ""), "{command:?}");
    }

    #[track_caller]
    pub(crate) fn rejected(&mut self, command: Command, reason: &str) {
        let before = self.status.clone();
        let ack = self.command(command).expect("an acknowledgement");
        assert_eq!((ack.result(), ack.reason.as_str()), (v1::CommandResult::Rejected, reason), "{command:?}");
        assert_eq!(self.status, before, "a rejected command changes nothing");
    }

    #[track_caller]
    pub(crate) fn fault(&mut self, line: &str) {
        let mut words = line.split_whitespace().map(String::from);
        let request = v1::FaultRequest { name: words.next().unwrap(), args: words.collect() };
        let reply = self.request(request);
        assert!(reply.accepted, "{}", reply.detail);
    }

    pub(crate) fn request(&mut self, request: v1::FaultRequest) -> v1::FaultReply {
        let event = Event::Request { vehicle: "uav1".into(), token: Token(7), request: Request::Fault(request) };
        let replies = self.event(event);
        let [Effect::Reply { token: Token(7), response: Response::Fault(reply) }] = &replies[..] else {
            panic!("one reply expected: {replies:?}")
        };
        reply.clone()
    }

    /// Streams a position setpoint from now on.
    pub(crate) fn stream_position(&mut self, target: Ned, speed_limit_m_s: Option<f64>) {
        self.stream(
            v1::OffboardControl::Position,
            v1::TrajectorySetpoint { position: Some(target.into()), speed_limit_m_s, ..Default::default() },
        );
    }

    /// Streams a velocity setpoint from now on.
    pub(crate) fn stream_velocity(&mut self, velocity: NedVelocity, yaw_rate_rad_s: Option<f64>) {
        self.stream(
            v1::OffboardControl::Velocity,
            v1::TrajectorySetpoint { velocity: Some(velocity.into()), yaw_rate_rad_s, ..Default::default() },
        );
    }

    pub(crate) fn stream(&mut self, control: v1::OffboardControl, setpoint: v1::TrajectorySetpoint) {
        self.setpoint = Some((control, setpoint));
        self.next_setpoint = self.now;
    }

    pub(crate) fn stop_streaming(&mut self) {
        self.setpoint = None;
    }

    /// Lets mission time pass.
    pub(crate) fn pass(&mut self, seconds: f64) {
        self.run(seconds, |_| false);
    }

    /// Lets time pass until `holds`; returns how many mission seconds it took.
    #[track_caller]
    pub(crate) fn until(&mut self, what: &str, limit_s: f64, holds: impl FnMut(&Flight) -> bool) -> f64 {
        let start = self.seconds();
        assert!(self.run(limit_s, holds), "{what} not seen within {limit_s} s\n{}", self.story);
        self.seconds() - start
    }

    fn run(&mut self, seconds: f64, mut holds: impl FnMut(&Flight) -> bool) -> bool {
        let end = self.now + Duration::from_secs_f64(seconds);
        loop {
            if holds(self) {
                return true;
            }
            let beat = self.sim.deadline().expect("a deadline");
            let next = if self.setpoint.is_some() { beat.min(self.next_setpoint) } else { beat };
            if next > end {
                self.now = end;
                return false;
            }
            self.now = self.now.max(next);
            match self.setpoint {
                Some((control, setpoint)) if self.next_setpoint <= self.now => {
                    self.next_setpoint = self.next_setpoint + self.pace.wall(SETPOINT_PERIOD);
                    self.message(v1::OffboardControlMode { control: control as i32 }.into());
                    self.message(setpoint.into());
                }
                _ => self.act(),
            }
        }
    }

    fn message(&mut self, message: Message) {
        let replies = self.event(Event::Message { vehicle: "uav1".into(), message });
        assert_eq!(replies, []);
    }

    /// Returns the replies.
    fn event(&mut self, event: Event) -> Vec<Effect> {
        let mut effects = Vec::new();
        let now = self.moment();
        self.sim.on(now, event, &mut effects);
        self.sim.act(now, &mut effects);
        self.take_in(effects)
    }

    fn act(&mut self) {
        let mut effects = Vec::new();
        let now = self.moment();
        self.sim.act(now, &mut effects);
        let replies = self.take_in(effects);
        assert_eq!(replies, []);
    }

    fn take_in(&mut self, effects: Vec<Effect>) -> Vec<Effect> {
        if let Some(record) = &mut self.record {
            record.extend(effects.iter().map(|it| (self.now, it.clone())));
        }
        let mut replies = Vec::new();
        for effect in effects {
            match effect {
                Effect::Publish { vehicle: None, message } => self.hear(message),
                Effect::Refused { what, why } => self.refused.push(format!("{}: {why}", what.key())),
                reply => replies.push(reply),
            }
        }
        replies
    }

    fn hear(&mut self, message: Message) {
        *self.counts.entry(message.topic()).or_default() += 1;
        match message {
            Message::VehicleCommandAck(it) => self.ack = Some(it),
            Message::VehicleStatus(it) => {
                // Its time alone is not news.
                if it != (v1::VehicleStatus { timestamp_us: it.timestamp_us, ..self.status.clone() }) {
                    self.note(&describe(&it));
                }
                self.status = it;
            }
            Message::VehicleLandDetected(it) => {
                if (it.ground_contact, it.landed) != (self.landed.ground_contact, self.landed.landed) {
                    self.note(match (it.ground_contact, it.landed) {
                        (false, _) => "in the air",
                        (true, false) => "ground contact",
                        (true, true) => "landed",
                    });
                }
                self.landed = it;
            }
            Message::VehicleAttitude(it) => self.attitude = it,
            Message::VehicleLocalPosition(it) => self.position = it,
            Message::VehicleGlobalPosition(it) => self.global = it,
            Message::BatteryStatus(it) => self.battery = it,
            Message::TransponderReport(it) => self.traffic.push(it),
            Message::WindEstimate(it) => self.wind = it,
            other => panic!("{other:?} is not one of the vehicle's topics"),
        }
    }

    /// Writes a line into the story.
    pub(crate) fn note(&mut self, line: &str) {
        self.story += &format!("{:6.1}  {line}\n", self.seconds());
    }

    fn moment(&self) -> Now {
        Now { time: self.now, utc_ms: 0 }
    }
}

fn describe(status: &v1::VehicleStatus) -> String {
    let name = |mode: FlightMode| mode.as_str_name().trim_start_matches("FLIGHT_MODE_");
    let mut line = String::from(if status.armed { "armed " } else { "disarmed " });
    line += name(status.actual_mode());
    if status.intended_mode != status.actual_mode {
        line += &format!(" instead of {}", name(status.intended_mode()));
    }
    if status.failsafe {
        line += ", failsafe";
    }
    for failure in status.failures() {
        line += &format!(", {}", failure.as_str_name().trim_start_matches("FAILURE_FLAG_"));
    }
    line
}

pub(crate) fn arm() -> Command {
    Command::Arm(v1::Arm {})
}

pub(crate) fn disarm() -> Command {
    Command::Disarm(v1::Disarm {})
}

pub(crate) fn takeoff(altitude_m: f64) -> Command {
    Command::Takeoff(v1::TakeoffCommand { altitude_m })
}

pub(crate) fn land() -> Command {
    Command::Land(v1::LandCommand::default())
}

pub(crate) fn release() -> Command {
    Command::Release(v1::ReleaseCommand {})
}

pub(crate) fn loiter() -> Command {
    set_mode(FlightMode::Loiter)
}

pub(crate) fn offboard() -> Command {
    set_mode(FlightMode::Offboard)
}

pub(crate) fn set_mode(mode: FlightMode) -> Command {
    Command::SetMode(v1::SetMode { mode: mode as i32 })
}
