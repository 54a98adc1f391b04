//! A bridge with an autopilot on a clock of the test, and what it published.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;

use domain::declared_skill::DeclaredSkills;
use domain::geometry::Ned;
use domain::time::{Now, Pace, Time};
use fake_autopilots::bridged::Bridged;
use fake_autopilots::wire::{Faults, Wire};
use fake_autopilots::{FakeAutopilot, Kind};
use kittiwake_proto::topics::{Message, Request};
use kittiwake_proto::v1::{self, vehicle_command::Command};
use mavlink_bridge::config::Config;
use mavlink_bridge::frame::{Found, Frame, Framer};
use mavlink_bridge::link::Link;
use node::{Effect, Event, Node, Token};
use vehicle_sim::VehicleSim;

/// UTC at the beginning.
pub(crate) const UTC_MS: i64 = 1_767_225_600_000;

/// The shipped parameters.
pub(crate) fn config() -> Config {
    section("mavlink_bridge").expect("the shipped section")
}

fn section<T: serde::de::DeserializeOwned>(name: &str) -> Option<T> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/kittiwake.toml");
    let text = std::fs::read_to_string(path).ok()?;
    let table: toml::Table = text.parse().ok()?;
    table.get(name)?.clone().try_into().ok()
}

/// The time of a test.
pub(crate) fn at(time: Duration) -> Now {
    Now { time: Time::after(time), utc_ms: UTC_MS + time.as_millis() as i64 }
}

/// What was published last of each kind, and every acknowledgement.
#[derive(Debug, Default)]
pub(crate) struct Published {
    pub(crate) status: Option<v1::VehicleStatus>,
    pub(crate) statuses: Vec<(Duration, v1::VehicleStatus)>,
    pub(crate) position: Option<v1::VehicleLocalPosition>,
    pub(crate) globe: Option<v1::VehicleGlobalPosition>,
    pub(crate) landed: Option<bool>,
    pub(crate) acks: Vec<v1::VehicleCommandAck>,
    pub(crate) traffic: Option<v1::TransponderReport>,
    pub(crate) task: Option<v1::TaskReport>,
    pub(crate) pictures: Vec<v1::Picture>,
    pub(crate) count: usize,
}

impl Published {
    pub(crate) fn take_in(&mut self, effects: Vec<Effect>, time: Duration) {
        for effect in effects {
            let Effect::Publish { message, .. } = effect else { continue };
            self.count += 1;
            match message {
                Message::VehicleStatus(it) => {
                    self.statuses.push((time, it.clone()));
                    self.status = Some(it);
                }
                Message::VehicleLocalPosition(it) => self.position = Some(it),
                Message::VehicleGlobalPosition(it) => self.globe = Some(it),
                Message::VehicleLandDetected(it) => self.landed = Some(it.landed),
                Message::VehicleCommandAck(it) => self.acks.push(it),
                Message::TransponderReport(it) => self.traffic = Some(it),
                Message::TaskReport(it) => self.task = Some(it),
                Message::Picture(it) => self.pictures.push(it),
                _ => {}
            }
        }
    }
}

/// A ground station at its end of a link.
#[derive(Debug, Default, Clone)]
pub(crate) struct Station {
    said: Rc<RefCell<VecDeque<Vec<u8>>>>,
    heard: Rc<RefCell<Vec<u8>>>,
}

impl Station {
    pub(crate) fn says(&self, frame: &Frame) {
        self.said.borrow_mut().push_back(frame.bytes().to_vec());
    }

    /// The frames since the last call.
    pub(crate) fn heard(&self) -> Vec<Frame> {
        let bytes = self.heard.take();
        let frame = |it| if let Found::Frame(frame) = it { Some(frame) } else { None };
        Framer::datagram(&bytes).into_iter().filter_map(frame).collect()
    }
}

impl Link for Station {
    fn receive(&mut self, _now: Time) -> Option<Vec<u8>> {
        self.said.borrow_mut().pop_front()
    }
    fn send(&mut self, frame: &[u8], _now: Time) {
        self.heard.borrow_mut().extend_from_slice(frame);
    }
    fn is_datagram(&self) -> bool {
        true
    }
}

/// The bridge, the autopilot and the layers above.
pub(crate) struct Rig {
    node: Bridged,
    pub(crate) now: Duration,
    pub(crate) published: Published,
    /// Streamed at 20 Hz, as the skill manager does.
    pub(crate) setpoint: Option<v1::TrajectorySetpoint>,
    next_setpoint: Duration,
    next_id: u64,
}

impl Rig {
    pub(crate) fn new(kind: Kind) -> Rig {
        Rig::over(kind, Faults::default())
    }

    /// With a ground station.
    pub(crate) fn watched(kind: Kind, station: Station) -> Rig {
        let mut rig = Rig::new(kind);
        rig.node = rig.node.seen_from_the_ground(station);
        rig
    }

    /// With declared skills.
    pub(crate) fn skilled(mut self, skills: &DeclaredSkills) -> Rig {
        self.node = self.node.with_skills(skills);
        self
    }

    pub(crate) fn over(kind: Kind, faults: Faults) -> Rig {
        let vehicle: vehicle_sim::config::Config = section("vehicle_sim").expect("the shipped section");
        let wire = Wire::new(faults, 7);
        let vehicle = kind.flies(vehicle);
        let make = move || VehicleSim::new(&vehicle, Pace::REAL_TIME, 1);
        let node = Bridged::new(FakeAutopilot::new(kind, wire.clone(), make), &config(), wire);
        Rig {
            node,
            now: Duration::ZERO,
            published: Published::default(),
            setpoint: None,
            next_setpoint: Duration::ZERO,
            next_id: 1,
        }
    }

    /// Lets time pass until `done`, `limit` at most; whether it was done.
    pub(crate) fn run(&mut self, limit: Duration, mut done: impl FnMut(&Published) -> bool) -> bool {
        let end = self.now + limit;
        while !done(&self.published) {
            let due = self.node.deadline().map_or(end, |it| it.since_start()).max(self.now);
            let due = if self.setpoint.is_some() { due.min(self.next_setpoint.max(self.now)) } else { due };
            if end < due {
                self.now = end;
                return false;
            }
            self.now = due;
            if self.next_setpoint <= self.now
                && let Some(setpoint) = self.setpoint
            {
                self.next_setpoint = self.now + Duration::from_millis(50);
                let control = match setpoint.position {
                    Some(_) => v1::OffboardControl::Position,
                    None => v1::OffboardControl::Velocity,
                };
                self.tell(v1::OffboardControlMode { control: control as i32 });
                self.tell(setpoint);
            }
            let mut effects = Vec::new();
            self.node.act(at(self.now), &mut effects);
            self.published.take_in(effects, self.now);
        }
        true
    }

    pub(crate) fn pass(&mut self, seconds: f64) {
        self.run(Duration::from_secs_f64(seconds), |_| false);
    }

    pub(crate) fn tell(&mut self, message: impl Into<Message>) {
        let mut effects = Vec::new();
        self.node.on(at(self.now), Event::Message { vehicle: "uav1".into(), message: message.into() }, &mut effects);
        self.published.take_in(effects, self.now);
    }

    /// Commands, and waits for the answer.
    #[track_caller]
    pub(crate) fn command(&mut self, command: Command) -> Result<(), String> {
        let id = self.next_id;
        self.next_id += 1;
        self.tell(v1::VehicleCommand { id, command: Some(command) });
        let answered = self.run(Duration::from_secs(2), |it| it.acks.iter().any(|it| it.id == id));
        assert!(answered, "{command:?} is answered");
        let acks = self.published.acks.iter().filter(|it| it.id == id).collect::<Vec<_>>();
        assert_eq!(acks.len(), 1, "{acks:?}");
        match acks[0].result() {
            v1::CommandResult::Accepted => Ok(()),
            _ => Err(acks[0].reason.clone()),
        }
    }

    pub(crate) fn fault(&mut self, name: &str, arguments: impl ToString) {
        let args = arguments.to_string().split_whitespace().map(str::to_owned).collect();
        let request = v1::FaultRequest { name: name.into(), args };
        let event = Event::Request { vehicle: "uav1".into(), token: Token(1), request: Request::Fault(request) };
        let mut effects = Vec::new();
        self.node.on(at(self.now), event, &mut effects);
        let is_accepted = effects.iter().any(|it| matches!(it, Effect::Reply { .. }));
        assert!(is_accepted, "{effects:?}");
        self.published.take_in(effects, self.now);
    }

    pub(crate) fn position(&self) -> Ned {
        let it = self.published.position.and_then(|it| it.position).expect("a position");
        Ned::new(it.north_m, it.east_m, it.down_m)
    }

    pub(crate) fn speed_m_s(&self) -> f64 {
        let it = self.published.position.and_then(|it| it.velocity).expect("a velocity");
        (it.north_m_s.powi(2) + it.east_m_s.powi(2) + it.down_m_s.powi(2)).sqrt()
    }

    pub(crate) fn status(&self) -> &v1::VehicleStatus {
        self.published.status.as_ref().expect("a status")
    }

    pub(crate) fn target(&mut self, target: Ned, speed_limit_m_s: Option<f64>) {
        let position = Some(v1::Ned { north_m: target.north_m, east_m: target.east_m, down_m: target.down_m });
        self.setpoint = Some(v1::TrajectorySetpoint { position, speed_limit_m_s, ..Default::default() });
    }

    /// Ready to be armed.
    #[track_caller]
    pub(crate) fn ready(&mut self) {
        let limit = Duration::from_secs(60);
        assert!(
            self.run(limit, |it| it.status.as_ref().is_some_and(|it| it.can_arm == Some(true))),
            "{:?}",
            self.published.status
        );
    }

    /// Armed and at 10 m.
    #[track_caller]
    pub(crate) fn airborne(&mut self) {
        self.ready();
        assert_eq!(self.command(ARM), Ok(()), "arm: {:?}", self.status());
        assert!(self.status().armed);
        let altitude_m = 10.0 + self.position().height_m();
        let answer = self.command(Command::Takeoff(v1::TakeoffCommand { altitude_m }));
        assert_eq!(answer, Ok(()), "takeoff at {:?}: {:?}", self.now, self.status());
        let up = |it: &Published| {
            let height_m = it.position.and_then(|it| it.position).map_or(0.0, |it| -it.down_m);
            let loiters = it.status.as_ref().is_some_and(|it| it.actual_mode() == v1::FlightMode::Loiter);
            loiters && (height_m - 10.0).abs() < 0.5
        };
        assert!(self.run(Duration::from_secs(30), up), "{:?} {}", self.published.status, self.position());
    }
}

pub(crate) const ARM: Command = Command::Arm(v1::Arm {});
pub(crate) const DISARM: Command = Command::Disarm(v1::Disarm {});
pub(crate) const LAND: Command = Command::Land(v1::LandCommand { on_target: false });
pub(crate) const LOITER: Command = Command::SetMode(v1::SetMode { mode: v1::FlightMode::Loiter as i32 });
pub(crate) const OFFBOARD: Command = Command::SetMode(v1::SetMode { mode: v1::FlightMode::Offboard as i32 });
