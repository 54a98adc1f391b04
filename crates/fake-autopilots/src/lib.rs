//! Autopilots for tests: they speak MAVLink as two real ones were measured to, over the simulated vehicle.
//!
//! One vehicle ([`vehicle_sim`]) with two personalities, PX4 and ArduPilot: what each accepts, refuses and says, when, and to whom. A
//! [`wire::Wire`] carries their frames. They do not model either autopilot's control: the simulated vehicle flies.

use std::time::Duration;

use domain::geodesy::AutopilotFrame;
use domain::geometry::Ned;
use domain::quantity::Positive;
use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Request, Response, Service};
use kittiwake_proto::v1;
use mavlink_bridge::frame::{Found, Frame, Framer};
use mavlink_bridge::signing::{Key, Signing};
use node::{Effect, Event, Node, VehicleId};
use vehicle_sim::VehicleSim;
use vehicle_sim::config::{Config, Limits};

mod ardupilot;
pub mod bridged;
mod camera;
mod px4;
mod received;
mod spoken;
pub mod wire;

use camera::Camera;
use received::Received;
use spoken::{Stream, Streams};
use wire::Wire;

/// Which autopilot is imitated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// PX4.
    Px4,
    /// ArduPilot Copter.
    ArduPilot,
}

impl Kind {
    /// A vehicle as this autopilot flies it by default.
    pub fn flies(self, vehicle: Config) -> Config {
        let acceleration_m_s2 = match self {
            Kind::Px4 => vehicle.limits.acceleration_m_s2,
            Kind::ArduPilot => Positive::try_from(ardupilot::BRAKING_M_S2).expect("a positive number"),
        };
        Config { limits: Limits { acceleration_m_s2, ..vehicle.limits }, ..vehicle }
    }
}

/// An autopilot with its vehicle.
#[derive(Debug)]
pub struct FakeAutopilot {
    kind: Kind,
    system: u8,
    sim: VehicleSim,
    vehicle: Telemetry,
    wire: Wire,
    streams: Streams,
    /// When it was switched on; its clock begins there.
    booted: Time,
    sequence: u8,
    signing: Option<Signing>,
    pilot: Pilot,
    camera: Camera,
    restarts: Restart,
    make: Make,
    glitches_until: Time,
}

/// Makes a vehicle that stands disarmed.
type Factory = Box<dyn Fn() -> VehicleSim + Send>;

struct Make(Factory);

impl std::fmt::Debug for Make {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Make")
    }
}

/// What only one of the two has.
#[derive(Debug)]
enum Pilot {
    Px4(px4::Px4),
    ArduPilot(ardupilot::ArduPilot),
}

/// Whether it was killed and is to come back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Restart {
    Runs,
    DeadUntil(Time),
}

/// What the vehicle said last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Telemetry {
    status: v1::VehicleStatus,
    local: v1::VehicleLocalPosition,
    global: v1::VehicleGlobalPosition,
    attitude: v1::VehicleAttitude,
    battery: v1::BatteryStatus,
    landed: v1::VehicleLandDetected,
    wind: v1::WindEstimate,
    traffic: Vec<v1::TransponderReport>,
    glitches: bool,
}

/// What somebody else does to the vehicle, as a request for a fault that the simulator does not have.
pub const OTHER_SETS_MODE: &str = "other_sets_mode";
/// Somebody else starts the motors.
pub const OTHER_ARMS: &str = "other_arms";
/// Somebody else sends a setpoint: a place, north, east and down in metres. Only ArduPilot takes one that comes alone.
pub const OTHER_SETS_TARGET: &str = "other_sets_target";
/// ArduPilot's battery failsafe, by thresholds of its own: it lands, and reports it until it is started again.
pub const BATTERY_FAILSAFE: &str = "battery_failsafe";
/// ArduPilot's fence: setpoints farther from home than this many metres are dropped without a word; 0 takes it away.
pub const FENCE: &str = "fence";
/// ArduPilot has a sensor for precision landing, which sees the simulator's target.
pub const PRECISION_LANDING: &str = "precision_landing";
/// For this many seconds the estimator does not believe its satellite receiver, which has a fix.
pub const GNSS_GLITCH: &str = "gnss_glitch";
/// Kills the autopilot and starts it again, with its vehicle where it stands: the argument is how many seconds later.
pub const RESTART: &str = "restart";
/// Cuts the link for this many seconds.
pub const LINK_GAP: &str = "link_gap";

impl FakeAutopilot {
    /// An autopilot of `kind` and system 1 whose frames go over `wire`; `make` makes its vehicle.
    pub fn new(kind: Kind, wire: Wire, make: impl Fn() -> VehicleSim + Send + 'static) -> FakeAutopilot {
        FakeAutopilot {
            kind,
            system: 1,
            sim: make(),
            vehicle: Telemetry::default(),
            wire,
            streams: Streams::new(kind),
            booted: Time::ZERO,
            sequence: 0,
            signing: None,
            pilot: pilot(kind),
            camera: Camera::default(),
            restarts: Restart::Runs,
            make: Make(Box::new(make)),
            glitches_until: Time::ZERO,
        }
    }

    /// The same, which signs what it says and obeys nothing that is not signed.
    pub fn signing_with(self, key: Key) -> FakeAutopilot {
        FakeAutopilot { signing: Some(Signing::new(key, 0)), ..self }
    }

    fn boot_ms(&self, now: Time) -> u32 {
        (now - self.booted).as_millis() as u32
    }

    /// Gives the vehicle a message of the layers above, as the simulator knows them.
    fn tell(&mut self, message: impl Into<Message>, now: Now) -> Option<v1::VehicleCommandAck> {
        let vehicle: VehicleId = "fake".into();
        let mut effects = Vec::new();
        self.sim.on(now, Event::Message { vehicle, message: message.into() }, &mut effects);
        self.hear(effects)
    }

    /// Takes in what the vehicle says; its answer to a command if there is one.
    fn hear(&mut self, effects: Vec<Effect>) -> Option<v1::VehicleCommandAck> {
        let mut answer = None;
        for effect in effects {
            let Effect::Publish { message, .. } = effect else { continue };
            match message {
                Message::VehicleStatus(it) => self.vehicle.status = it,
                Message::VehicleLocalPosition(it) => {
                    let position = it.position.map(|it| match self.frame() {
                        Some(frame) => frame.to_its(Ned::new(it.north_m, it.east_m, it.down_m)).into(),
                        None => it,
                    });
                    self.vehicle.local = v1::VehicleLocalPosition { position, ..it };
                }
                Message::VehicleGlobalPosition(it) => self.vehicle.global = it,
                Message::VehicleAttitude(it) => self.vehicle.attitude = it,
                Message::BatteryStatus(it) => self.vehicle.battery = it,
                Message::VehicleLandDetected(it) => self.vehicle.landed = it,
                Message::WindEstimate(it) => self.vehicle.wind = it,
                Message::TransponderReport(it) => self.vehicle.traffic.push(it),
                Message::VehicleCommandAck(it) => answer = Some(it),
                _ => {}
            }
        }
        answer
    }

    /// Its own local frame, once the origin is known.
    fn frame(&self) -> Option<AutopilotFrame> {
        spoken::origin(&self.vehicle).map(match self.kind {
            Kind::Px4 => AutopilotFrame::of_px4,
            Kind::ArduPilot => AutopilotFrame::of_ardupilot,
        })
    }

    /// Commands the vehicle; whether it obeys.
    fn command(&mut self, command: v1::vehicle_command::Command, now: Now) -> bool {
        let answer = self.tell(v1::VehicleCommand { id: 1, command: Some(command) }, now);
        // It says at once what it does from here on.
        self.advance(now);
        answer.is_some_and(|it| it.result() == v1::CommandResult::Accepted)
    }

    fn loiter(&mut self, now: Now) -> bool {
        let mode = v1::FlightMode::Loiter as i32;
        self.command(v1::vehicle_command::Command::SetMode(v1::SetMode { mode }), now)
    }

    fn offboard(&mut self, now: Now) -> bool {
        let mode = v1::FlightMode::Offboard as i32;
        self.command(v1::vehicle_command::Command::SetMode(v1::SetMode { mode }), now)
    }

    /// Gives the vehicle a setpoint, with its proof of life.
    fn fly(&mut self, position: Option<[f64; 3]>, velocity: [f64; 3], now: Now) {
        let control = match position {
            Some(_) => v1::OffboardControl::Position,
            None => v1::OffboardControl::Velocity,
        };
        self.tell(v1::OffboardControlMode { control: control as i32 }, now);
        let [north_m_s, east_m_s, down_m_s] = velocity;
        let velocity = position.is_none().then_some(v1::NedVelocity { north_m_s, east_m_s, down_m_s });
        let frame = self.frame();
        let position = position.map(|[north_m, east_m, down_m]| Ned::new(north_m, east_m, down_m));
        let position = position.map(|it| frame.map_or(it, |frame| frame.to_ours(it)).into());
        self.tell(v1::TrajectorySetpoint { position, velocity, ..Default::default() }, now);
    }

    fn say(&mut self, id: u32, payload: &[u8], now: Time) {
        self.sequence = self.sequence.wrapping_add(1);
        let mut frame = Frame::new(self.sequence, self.system, 1, id, payload);
        if let Some(signing) = &mut self.signing {
            frame = signing.sign(frame, 0);
        }
        self.wire.send_to_bridge(frame.bytes(), now);
    }

    fn acknowledge(&mut self, command: u16, result: u8, from: (u8, u8), now: Time) {
        let mut payload = command.to_le_bytes().to_vec();
        payload.extend([result, 0, 0, 0, 0, 0, from.0, from.1]);
        self.say(77, &payload, now);
    }

    fn text(&mut self, severity: u8, text: &str, now: Time) {
        let mut payload = vec![severity];
        payload.extend(text.bytes().take(50));
        payload.resize(54, 0);
        self.say(253, &payload, now);
    }

    fn is_armed(&self) -> bool {
        self.vehicle.status.armed
    }

    fn is_landed(&self) -> bool {
        self.vehicle.landed.landed
    }

    fn position(&self) -> [f64; 3] {
        let it = self.vehicle.local.position.unwrap_or_default();
        [it.north_m, it.east_m, it.down_m]
    }

    fn actual(&self) -> v1::FlightMode {
        self.vehicle.status.actual_mode()
    }

    /// Advances the vehicle to `now`.
    fn advance(&mut self, now: Now) {
        let mut effects = Vec::new();
        self.sim.act(now, &mut effects);
        self.hear(effects);
    }

    fn take_frames(&mut self, now: Now) {
        while let Some(bytes) = self.wire.receive_at_autopilot(now.time) {
            for found in Framer::datagram(&bytes) {
                if let Found::Frame(frame) = found
                    && self.signing.as_mut().is_none_or(|it| it.check(&frame, 0).is_ok())
                    && let Some(received) = received::received(&frame)
                    && received.is_for(self.system)
                    && frame.component() != 1
                {
                    let from = (frame.system(), frame.component());
                    self.take_in(&received, from, now);
                }
            }
        }
    }

    fn take_in(&mut self, received: &Received, from: (u8, u8), now: Now) {
        /// MAV_CMD_SET_MESSAGE_INTERVAL, MAV_CMD_REQUEST_MESSAGE.
        const SET_INTERVAL: u16 = 511;
        const REQUEST_MESSAGE: u16 = 512;
        match received {
            Received::Command { command: SET_INTERVAL, params, .. } => {
                let result = self.streams.ask(self.kind, params[0] as u32, params[1], now.time);
                self.acknowledge(SET_INTERVAL, result, from, now.time);
            }
            Received::Command { command: camera::SET_DISTANCE, params, .. } => {
                self.camera.set(params);
                self.acknowledge(camera::SET_DISTANCE, 0, from, now.time);
            }
            Received::Command { command: REQUEST_MESSAGE, params, .. } => {
                self.acknowledge(REQUEST_MESSAGE, 0, from, now.time);
                self.stream(params[0] as u32, now);
            }
            _ => match self.kind {
                Kind::Px4 => px4::take_in(self, received, from, now),
                Kind::ArduPilot => ardupilot::take_in(self, received, from, now),
            },
        }
    }

    fn stream(&mut self, id: u32, now: Now) {
        let boot_ms = self.boot_ms(now.time);
        let mode = match self.kind {
            Kind::Px4 => px4::modes(self),
            Kind::ArduPilot => ardupilot::modes(self, now.time),
        };
        let frame = self.frame();
        for (id, payload) in spoken::messages(Stream(id), &mut self.vehicle, frame, &mode, boot_ms) {
            self.say(id, &payload, now.time);
        }
    }

    /// Something that a fault of this name does to the autopilot, if it is one of ours.
    fn trouble(&mut self, request: &v1::FaultRequest, now: Now) -> Option<String> {
        let numbers: Vec<f64> = request.args.iter().filter_map(|it| it.parse().ok()).collect();
        let number = || numbers.first().copied().unwrap_or_default();
        match request.name.as_str() {
            OTHER_SETS_MODE => {
                match self.kind {
                    Kind::Px4 => px4::set_mode(self, number() as u32, now),
                    Kind::ArduPilot => ardupilot::set_mode(self, number() as u32, now),
                };
                Some("somebody else sets a mode".into())
            }
            OTHER_ARMS => {
                self.command(v1::vehicle_command::Command::Arm(v1::Arm {}), now);
                Some("somebody else arms".into())
            }
            OTHER_SETS_TARGET => {
                let position = numbers.try_into().expect("north, east and down");
                let position = Received::Setpoint { target: (1, 1), mask: 0xDF8, position, velocity: [0.0; 3] };
                ardupilot::take_in(self, &position, (255, 190), now);
                Some("somebody else sends a setpoint".into())
            }
            BATTERY_FAILSAFE => {
                ardupilot::battery_fails(self, now);
                Some("the autopilot finds its battery low".into())
            }
            FENCE => {
                ardupilot::fence(self, number());
                Some("the autopilot has a fence".into())
            }
            PRECISION_LANDING => {
                ardupilot::lands_precisely(self);
                Some("the autopilot has precision landing".into())
            }
            GNSS_GLITCH => {
                self.glitches_until = now.time + Duration::from_secs_f64(number());
                Some("the receiver glitches".into())
            }
            RESTART => {
                self.restarts = Restart::DeadUntil(now.time + Duration::from_secs_f64(number()));
                Some("the autopilot is killed".into())
            }
            LINK_GAP => {
                self.wire.cut_until(now.time + Duration::from_secs_f64(number()));
                Some("the link is cut".into())
            }
            _ => None,
        }
    }

    fn boot(&mut self, now: Now) {
        // The vehicle has fallen meanwhile: it stands where it began, as a new simulation does.
        self.sim = (self.make.0)();
        let mut effects = Vec::new();
        self.sim.act(now, &mut effects);
        self.vehicle = Telemetry::default();
        self.hear(effects);
        self.pilot = pilot(self.kind);
        self.camera = Camera::default();
        if let Pilot::ArduPilot(it) = &mut self.pilot {
            it.boot(now.time);
        }
        self.streams = Streams::new(self.kind);
        self.booted = now.time;
        self.sequence = 0;
        self.restarts = Restart::Runs;
    }
}

fn pilot(kind: Kind) -> Pilot {
    match kind {
        Kind::Px4 => Pilot::Px4(px4::Px4::new()),
        Kind::ArduPilot => Pilot::ArduPilot(ardupilot::ArduPilot::new()),
    }
}

impl Node for FakeAutopilot {
    fn name(&self) -> &'static str {
        "fake-autopilot"
    }

    fn subscriptions(&self) -> &'static [kittiwake_proto::topics::Topic] {
        &[]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Fault]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Request { token, request: Request::Fault(request), vehicle } = event else { return };
        if let Some(detail) = self.trouble(&request, now) {
            let reply = v1::FaultReply { accepted: true, detail, known: Vec::new() };
            effects.push(Effect::Reply { token, response: Response::Fault(reply) });
            return;
        }
        let mut said = Vec::new();
        self.sim.on(now, Event::Request { token, request: Request::Fault(request), vehicle }, &mut said);
        let (replies, others) = said.into_iter().partition(|it| matches!(it, Effect::Reply { .. }));
        effects.extend::<Vec<_>>(replies);
        self.hear(others);
    }

    fn act(&mut self, now: Now, _effects: &mut Vec<Effect>) {
        if let Restart::DeadUntil(until) = self.restarts {
            while self.wire.receive_at_autopilot(now.time).is_some() {}
            if now.time < until {
                return;
            }
            self.boot(now);
        }
        self.vehicle.glitches = now.time < self.glitches_until;
        self.advance(now);
        self.take_frames(now);
        match self.kind {
            Kind::Px4 => px4::fly(self, now),
            Kind::ArduPilot => ardupilot::fly(self, now),
        }
        if let Some(number) = self.camera.moved(self.position()) {
            let boot_us = u64::from(self.boot_ms(now.time)) * 1000;
            for (id, payload) in spoken::picture(self.kind, number, &self.vehicle, boot_us, now.utc_ms) {
                self.say(id, &payload, now.time);
            }
        }
        for id in self.streams.due(now.time) {
            self.stream(id, now);
        }
    }

    fn deadline(&self) -> Option<Time> {
        let alive = match self.restarts {
            Restart::DeadUntil(until) => Some(until),
            Restart::Runs => [self.sim.deadline(), self.streams.deadline()].into_iter().flatten().min(),
        };
        alive.into_iter().chain(self.wire.arrival_at_autopilot()).min()
    }
}
