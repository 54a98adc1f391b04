//! A pilot for the tests: sends commands, keeps a setpoint alive, lets time pass, writes down what
//! changes.

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
pub fn config() -> Config {
    #[derive(serde::Deserialize)]
    struct File {
        vehicle_sim: Config,
    }
    toml::from_str::<File>(include_str!("../vehicle-sim.toml")).unwrap().vehicle_sim
}

/// A simulator with someone who flies it.
pub struct Flight {
    sim: VehicleSim,
    pace: Pace,
    now: Time,
    setpoint: Option<(v1::OffboardControl, v1::TrajectorySetpoint)>,
    next_setpoint: Time,
    last_id: u64,
    /// How many messages have come on each topic.
    pub counts: BTreeMap<Topic, usize>,
    ack: Option<v1::VehicleCommandAck>,
    pub status: v1::VehicleStatus,
    pub landed: v1::VehicleLandDetected,
    pub position: v1::VehicleLocalPosition,
    pub global: v1::VehicleGlobalPosition,
    pub attitude: v1::VehicleAttitude,
    pub battery: v1::BatteryStatus,
    pub traffic: Vec<v1::TransponderReport>,
    pub wind: v1::WindEstimate,
    /// Changes of status and land detector, with the time.
    pub story: String,
    /// Everything that came out, if asked for.
    pub record: Option<Vec<(Time, Effect)>>,
}

impl Flight {
    pub fn new() -> Flight {
        Flight::at_speed(1.0, 1)
    }

    pub fn at_speed(speed: f64, seed: u64) -> Flight {
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
            record: None,
        };
        flight.act();
        flight
    }

    /// Armed, taken off and loitering at 10 m.
    pub fn airborne() -> Flight {
        let mut flight = Flight::new();
        flight.accepted(arm());
        flight.accepted(takeoff(10.0));
        flight.until("loiter at 10 m", 20.0, |it| it.status.actual_mode() == FlightMode::Loiter);
        flight.pass(2.0);
        flight
    }

    /// In offboard mode, holding the place at 10 m.
    pub fn offboard() -> Flight {
        let mut flight = Flight::airborne();
        flight.stream_position(Ned::new(0.0, 0.0, -10.0), None);
        flight.pass(0.1);
        flight.accepted(offboard());
        flight
    }

    pub fn seconds(&self) -> f64 {
        self.now.as_secs_f64()
    }

    pub fn height_m(&self) -> f64 {
        -self.position.position.unwrap().down_m
    }

    pub fn at(&self) -> Ned {
        self.position.position.unwrap().try_into().unwrap()
    }

    pub fn speed_m_s(&self) -> f64 {
        NedVelocity::try_from(self.position.velocity.unwrap()).unwrap().speed_m_s()
    }

    pub fn fails(&self, flag: v1::FailureFlag) -> bool {
        self.status.failures.contains(&(flag as i32))
    }

    /// Sends a command and returns the answer that came at once, if any.
    pub fn command(&mut self, command: Command) -> Option<v1::VehicleCommandAck> {
        self.last_id += 1;
        let id = self.last_id;
        let ack = self.send(v1::VehicleCommand { id, command: Some(command) });
        assert!(ack.iter().all(|it| it.id == id), "{ack:?} answers another command than {id}");
        ack
    }

    /// Sends a command as it is and returns what answer came at once, if any.
    pub fn send(&mut self, command: v1::VehicleCommand) -> Option<v1::VehicleCommandAck> {
        self.ack = None;
        self.message(command.into());
        self.ack.take()
    }

    /// The id of the newest command.
    pub fn last_id(&self) -> u64 {
        self.last_id
    }

    #[track_caller]
    pub fn accepted(&mut self, command: Command) {
        let ack = self.command(command).expect("an acknowledgement");
        assert_eq!((ack.result(), ack.reason.as_str()), (v1::CommandResult::Accepted, ""), "{command:?}");
    }

    #[track_caller]
    pub fn rejected(&mut self, command: Command, reason: &str) {
        let before = self.status.clone();
        let ack = self.command(command).expect("an acknowledgement");
        assert_eq!((ack.result(), ack.reason.as_str()), (v1::CommandResult::Rejected, reason), "{command:?}");
        assert_eq!(self.status, before, "a rejected command changes nothing");
    }

    #[track_caller]
    pub fn fault(&mut self, line: &str) {
        let mut words = line.split_whitespace().map(String::from);
        let request = v1::FaultRequest { name: words.next().unwrap(), args: words.collect() };
        let reply = self.request(request);
        assert!(reply.accepted, "{}", reply.detail);
    }

    pub fn request(&mut self, request: v1::FaultRequest) -> v1::FaultReply {
        let event = Event::Request { vehicle: "uav1".into(), token: Token(7), request: Request::Fault(request) };
        let replies = self.event(event);
        let [Effect::Reply { token: Token(7), response: Response::Fault(reply) }] = &replies[..] else {
            panic!("one reply expected: {replies:?}")
        };
        reply.clone()
    }

    /// Keeps a position setpoint alive from now on.
    pub fn stream_position(&mut self, target: Ned, speed_limit_m_s: Option<f64>) {
        self.stream(
            v1::OffboardControl::Position,
            v1::TrajectorySetpoint { position: Some(target.into()), speed_limit_m_s, ..Default::default() },
        );
    }

    /// Keeps a velocity setpoint alive from now on.
    pub fn stream_velocity(&mut self, velocity: NedVelocity, yaw_rate_rad_s: Option<f64>) {
        self.stream(
            v1::OffboardControl::Velocity,
            v1::TrajectorySetpoint { velocity: Some(velocity.into()), yaw_rate_rad_s, ..Default::default() },
        );
    }

    pub fn stream(&mut self, control: v1::OffboardControl, setpoint: v1::TrajectorySetpoint) {
        self.setpoint = Some((control, setpoint));
        self.next_setpoint = self.now;
    }

    pub fn stop_streaming(&mut self) {
        self.setpoint = None;
    }

    /// Lets so many mission seconds pass.
    pub fn pass(&mut self, seconds: f64) {
        self.run(seconds, |_| false);
    }

    /// Lets time pass until `holds`; returns how many mission seconds it took.
    #[track_caller]
    pub fn until(&mut self, what: &str, limit_s: f64, holds: impl FnMut(&Flight) -> bool) -> f64 {
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
            let beat = self.sim.deadline().expect("it always has something to publish");
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

    /// Returns what is not published.
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
        let mut others = Vec::new();
        for effect in effects {
            match effect {
                Effect::Publish { vehicle: None, message } => self.hear(message),
                other => others.push(other),
            }
        }
        others
    }

    fn hear(&mut self, message: Message) {
        *self.counts.entry(message.topic()).or_default() += 1;
        match message {
            Message::VehicleCommandAck(it) => self.ack = Some(it),
            Message::VehicleStatus(it) => {
                if it != self.status {
                    self.tell(&describe(&it));
                }
                self.status = it;
            }
            Message::VehicleLandDetected(it) => {
                if (it.ground_contact, it.landed) != (self.landed.ground_contact, self.landed.landed) {
                    self.tell(match (it.ground_contact, it.landed) {
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
            other => panic!("{other:?} is none of the vehicle's topics"),
        }
    }

    /// Writes a line into the story.
    pub fn tell(&mut self, line: &str) {
        self.story += &format!("{:6.1}  {line}\n", self.seconds());
    }

    fn moment(&self) -> Now {
        Now { time: self.now, utc_ms: 0 }
    }
}

fn describe(it: &v1::VehicleStatus) -> String {
    let name = |mode: FlightMode| mode.as_str_name().trim_start_matches("FLIGHT_MODE_");
    let mut line = String::from(if it.armed { "armed " } else { "disarmed " });
    line += name(it.actual_mode());
    if it.intended_mode != it.actual_mode {
        line += &format!(" instead of {}", name(it.intended_mode()));
    }
    if it.failsafe {
        line += ", failsafe";
    }
    for failure in it.failures() {
        line += &format!(", {}", failure.as_str_name().trim_start_matches("FAILURE_FLAG_"));
    }
    line
}

pub fn arm() -> Command {
    Command::Arm(v1::Arm {})
}

pub fn disarm() -> Command {
    Command::Disarm(v1::Disarm {})
}

pub fn takeoff(altitude_m: f64) -> Command {
    Command::Takeoff(v1::TakeoffCommand { altitude_m })
}

pub fn land() -> Command {
    Command::Land(v1::LandCommand {})
}

pub fn loiter() -> Command {
    set_mode(FlightMode::Loiter)
}

pub fn offboard() -> Command {
    set_mode(FlightMode::Offboard)
}

pub fn set_mode(mode: FlightMode) -> Command {
    Command::SetMode(v1::SetMode { mode: mode as i32 })
}
