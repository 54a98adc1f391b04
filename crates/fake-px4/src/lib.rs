//! A PX4 for tests: its keys, its CDR, and its commander as far as it was measured, over the physics of the simulator.
//!
//! It behaves as the real one did: one answer to each command; offboard is lost one second after the last setpoint, then it returns
//! at once, and it resumes by itself when setpoints come back; a takeoff that is at its height becomes Hold; two seconds after a
//! landing it disarms, and the mode from before comes back, in which it would not arm; it counts time from its own start, and needs
//! some seconds until it knows where it is. It is for tests only, and imitates nothing else of PX4.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use domain::fmu::{Command, CommandId, OffboardControl, Setpoint, VehicleCommand};
use domain::geodesy::{AutopilotFrame, LatLon};
use domain::geometry::{Ned, NedVelocity};
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::{Effect, Event, Node};
use px4_bridge::cdr::{Definitions, Record};
use px4_bridge::keys;
use px4_bridge::modes::NavState;
use px4_bridge::port::{Arrival, Port};
use vehicle_sim::VehicleSim;

mod commander;
mod gripper;
mod report;

use commander::Commander;
use gripper::Gripper;

/// Its health checks run ten times a second.
const CHECK: Duration = Duration::from_millis(100);
/// After its start it knows its position in this time. (Measured: 3.7 s.)
const ESTIMATOR_STARTS: Duration = Duration::from_millis(3700);
/// Its status arrives this much later than the answer to the command that changed it. (Measured: 12 to 40 ms.)
const STATUS_IS_LATE: Duration = Duration::from_millis(20);
/// The messages that it sends twice a second and on every change.
const STATUS: Duration = Duration::from_millis(450);
/// The topics that it listens to, of those that matter here.
const INPUTS: [&str; 3] = ["vehicle_command", "offboard_control_mode", "trajectory_setpoint"];

/// Where the target of a landing is.
const TARGET: &str = "landing_target_pose";

/// What somebody does to it who is not Kittiwake.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trouble {
    /// Another ground station, or a pilot, selects a mode.
    Selects(NavState),
    /// The companion's link and PX4 itself restart: its clock and its frame begin again, where it is.
    Restarts,
    /// Silence, as if the link were cut.
    Silent(bool),
    /// The battery is reported at this level (`battery_warning`): 2 critical, 3 emergency.
    BatteryWarning(u8),
    /// A circle round home that it must not leave, in metres (`GF_MAX_HOR_DIST`, `GF_ACTION` = 2); `None`: no fence.
    Fence(Option<f64>),
    /// This topic is not sent any more.
    Mute(&'static str),
    /// All topics are sent again.
    Unmute,
    /// It sends where the target of a landing is, and sees it or does not. By default it does not send that.
    Target {
        /// Whether it sees it.
        seen: bool,
    },
    /// Its gripper is not enabled (`PD_GRIPPER_TYPE` -1).
    HasNoGripper,
    /// Without setpoints it flies this (`COM_OBL_RC_ACT`): by default it returns.
    WithoutSetpoints(NavState),
}

/// The fake autopilot.
#[derive(Debug)]
pub struct FakePx4 {
    definitions: Definitions,
    body: VehicleSim,
    commander: Commander,
    newest: Newest,
    /// When it was started, and for how long its motors were on since then.
    boot: Time,
    armed_for: Duration,
    now: Time,
    silent: bool,
    muted: Vec<&'static str>,
    /// What it sends that was not fetched yet, and when it arrives.
    outgoing: Vec<(Time, Arrival)>,
    next_check: Time,
    next_status: BTreeMap<&'static str, Time>,
    last_status: BTreeMap<&'static str, Vec<u8>>,
    /// Every command that came: its number and its first two parameters.
    commands: Vec<(Time, u64, f64, f64)>,
    setpoints: u64,
    gripper: Gripper,
    sees_target: bool,
}

/// The newest of the body's telemetry.
#[derive(Debug, Default)]
struct Newest {
    status: v1::VehicleStatus,
    position: v1::VehicleLocalPosition,
    landed: v1::VehicleLandDetected,
}

impl FakePx4 {
    /// On the ground, started at time zero, with the simulator's vehicle.
    pub fn new(config: &vehicle_sim::config::Config, seed: u64) -> FakePx4 {
        let mut px4 = FakePx4 {
            definitions: Definitions::known(),
            body: VehicleSim::new(config, Pace::REAL_TIME, seed),
            commander: Commander::default(),
            newest: Newest::default(),
            boot: Time::ZERO,
            armed_for: Duration::ZERO,
            now: Time::ZERO,
            silent: false,
            muted: Vec::new(),
            outgoing: Vec::new(),
            next_check: Time::ZERO,
            next_status: BTreeMap::new(),
            last_status: BTreeMap::new(),
            commands: Vec::new(),
            setpoints: 0,
            gripper: Gripper::Grabbed,
            sees_target: false,
        };
        px4.declare(true);
        px4
    }

    /// Everything that it sends up to `now`.
    pub fn advance(&mut self, now: Time) -> Vec<Arrival> {
        self.now = now;
        let mut effects = Vec::new();
        self.body.act(Now { time: now, utc_ms: 0 }, &mut effects);
        for effect in effects {
            if let Effect::Publish { message, .. } = effect {
                self.report(message);
            }
        }
        if self.next_check <= now {
            self.next_check = now + CHECK;
            self.move_gripper();
            if self.sees_target && self.is_armed() {
                self.send(TARGET, |sample| sample.set_flag("abs_pos_valid", true));
            }
            self.armed_for += if self.is_armed() { CHECK } else { Duration::ZERO };
            self.review();
        }
        let (due, later) = std::mem::take(&mut self.outgoing).into_iter().partition(|(at, _)| *at <= now);
        self.outgoing = later;
        let due: Vec<_> = due;
        if self.silent { Vec::new() } else { due.into_iter().map(|(_, it)| it).collect() }
    }

    /// When [`FakePx4::advance`] has something again.
    pub fn deadline(&self) -> Option<Time> {
        let late = self.outgoing.iter().map(|(at, _)| *at).min();
        self.body.deadline().map(|it| it.min(self.next_check).min(late.unwrap_or(it)))
    }

    /// The tokens that it declares at its start.
    pub fn tokens(&self) -> Vec<String> {
        INPUTS.iter().filter_map(|topic| self.token("in", topic)).collect()
    }

    fn token(&self, way: &str, topic: &str) -> Option<String> {
        let it = self.definitions.newest(topic)?;
        Some(format!(
            "@ros2_lv/0/00/0/11/MS/%/%/px4_00/%fmu%{way}%{topic}/px4_msgs::msg::dds_::{}_/RIHS01_{}/::,7:,:,:,,",
            it.type_name, it.hash
        ))
    }

    /// A sample has arrived.
    ///
    /// # Panics
    /// If it does not know the message: the test is about one that it knows.
    pub fn take_in(&mut self, key: &str, payload: &[u8], now: Time) {
        self.now = now;
        if self.silent {
            return;
        }
        let key = keys::read(key, 0).filter(|it| !it.is_output).expect("a key of an input");
        let definition = self.definitions.of(key.topic, key.hash).expect("a known version").clone();
        let sample = Record::decode(&definition, payload).expect("a whole message");
        let number = |field| sample.number(field).expect("the field");
        match key.topic {
            "vehicle_command" => {
                let (command, p1, p2) =
                    (sample.unsigned("command").expect("the number"), number("param1"), number("param2"));
                self.commands.push((now, command, p1, p2));
                let (p3, p7) = (number("param3"), number("param7"));
                let from = (number("source_system"), number("source_component"));
                match command {
                    gripper::COMMAND => self.command_gripper(p2, from),
                    _ => {
                        let result = self.command(command, [p1, p2, p3, p7]);
                        self.acknowledge(command, result, from);
                    }
                }
                self.review();
            }
            "offboard_control_mode" => self.commander.alive_at = Some(now),
            "trajectory_setpoint" => {
                self.setpoints += 1;
                let at = |field, index| sample.number_at(field, index).expect("the array");
                let (p, v) = ([0, 1, 2].map(|it| at("position", it)), [0, 1, 2].map(|it| at("velocity", it)));
                self.commander.setpoint = if p.iter().all(|it| it.is_finite()) {
                    let yaw_rad = Some(number("yaw")).filter(|it| it.is_finite());
                    let target = self.in_body(Ned::new(p[0], p[1], p[2]));
                    Some((now, Setpoint::Position { target, speed_limit_m_s: None, yaw_rad }))
                } else if v.iter().all(|it| it.is_finite()) {
                    let velocity = NedVelocity { north_m_s: v[0], east_m_s: v[1], down_m_s: v[2] };
                    Some((now, Setpoint::Velocity { velocity, yaw_rate_rad_s: None }))
                } else {
                    None
                };
            }
            _ => {}
        }
    }

    /// Somebody does something to it.
    pub fn trouble(&mut self, trouble: Trouble) {
        match trouble {
            Trouble::Selects(mode) => self.commander.select(mode),
            Trouble::Silent(silent) => {
                self.silent = silent;
                self.outgoing.clear();
            }
            Trouble::BatteryWarning(level) => self.commander.battery_warning = level,
            Trouble::Fence(radius_m) => self.commander.fence_m = radius_m,
            Trouble::Mute(topic) => self.muted.push(topic),
            Trouble::Unmute => self.muted.clear(),
            Trouble::Target { seen } => {
                let key = self.token("out", TARGET).expect("a topic of the table");
                self.outgoing.push((self.now, Arrival::Token { key, alive: true }));
                self.sees_target = seen;
            }
            Trouble::HasNoGripper => self.gripper = Gripper::Missing,
            Trouble::WithoutSetpoints(mode) => self.commander.without_setpoints = mode,
            Trouble::Restarts => {
                self.declare(false);
                (self.boot, self.armed_for) = (self.now, Duration::ZERO);
                let at = self.newest.position.position.unwrap_or_default();
                let Commander { without_setpoints, .. } = self.commander;
                let offset = Ned::new(at.north_m, at.east_m, 0.0);
                self.commander = Commander { offset, without_setpoints, ..Commander::default() };
                self.last_status.clear();
                self.declare(true);
            }
        }
        self.review();
    }

    /// The commands that came, with their times: number, first and second parameter.
    pub fn commands(&self) -> &[(Time, u64, f64, f64)] {
        &self.commands
    }

    /// How many setpoints came.
    pub fn setpoints(&self) -> u64 {
        self.setpoints
    }

    /// The mode that it flies.
    pub fn actual(&self) -> NavState {
        self.commander.actual
    }

    /// Whether its motors may turn.
    pub fn is_armed(&self) -> bool {
        self.newest.status.armed
    }

    fn acknowledge(&mut self, command: u64, result: u8, from: (f64, f64)) {
        self.send("vehicle_command_ack", |ack| {
            ack.set_number("command", command as f64)?;
            ack.set_number("result", f64::from(result))?;
            ack.set_number("target_system", from.0)?;
            ack.set_number("target_component", from.1)
        });
    }

    fn declare(&mut self, alive: bool) {
        let now = self.now;
        let tokens = self.tokens().into_iter().map(|key| (now, Arrival::Token { key, alive }));
        self.outgoing.extend(tokens);
    }

    /// Whether it knows where it is.
    fn knows_position(&self) -> bool {
        ESTIMATOR_STARTS <= self.now - self.boot
    }

    /// A position of its frame in the body's.
    fn in_body(&self, at: Ned) -> Ned {
        let offset = self.commander.offset;
        let at = Ned::new(at.north_m + offset.north_m, at.east_m + offset.east_m, at.down_m);
        self.frame().map_or(at, |it| it.to_ours(at))
    }

    /// Converts a place from the vehicle's frame, which is true to the Earth, to PX4's.
    fn in_its_frame(&self, at: Ned) -> Ned {
        self.frame().map_or(at, |it| it.to_its(at))
    }

    fn frame(&self) -> Option<AutopilotFrame> {
        let origin = self.newest.status.origin?;
        LatLon::new(origin.latitude_deg, origin.longitude_deg).ok().map(AutopilotFrame::of_px4)
    }

    fn is_fresh(&self) -> bool {
        let fresh = |at: Option<Time>| at.is_some_and(|it| self.now - it <= commander::OFFBOARD_LOSS);
        fresh(self.commander.alive_at) && fresh(self.commander.setpoint.map(|it| it.0))
    }

    fn order(&mut self, command: Command) {
        let order = VehicleCommand { id: CommandId(0), command };
        self.tell(v1::VehicleCommand::from(order));
    }

    fn fly_to(&mut self, setpoint: Setpoint) {
        let control: OffboardControl = setpoint.control();
        self.tell(v1::OffboardControlMode::from(control));
        self.tell(v1::TrajectorySetpoint::from(setpoint));
    }

    fn tell(&mut self, message: impl Into<Message>) {
        let event = Event::Message { vehicle: "uav1".into(), message: message.into() };
        let mut effects = Vec::new();
        self.body.on(Now { time: self.now, utc_ms: 0 }, event, &mut effects);
    }
}

/// The fake as a [`Port`]: a bridge and a test have it in common.
#[derive(Debug, Clone)]
pub struct FakeLink(pub Rc<RefCell<FakePx4>>);

impl FakeLink {
    /// A link to `px4`.
    pub fn to(px4: FakePx4) -> FakeLink {
        FakeLink(Rc::new(RefCell::new(px4)))
    }
}

impl Port for FakeLink {
    fn take(&mut self, now: Time) -> Vec<Arrival> {
        self.0.borrow_mut().advance(now)
    }

    fn put(&mut self, now: Time, key: &str, payload: Vec<u8>) {
        self.0.borrow_mut().take_in(key, &payload, now);
    }

    fn deadline(&self) -> Option<Time> {
        self.0.borrow().deadline()
    }
}
