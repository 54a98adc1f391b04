//! A small autopilot: obeys, rejects or ignores commands, and moves.

use std::collections::VecDeque;
use std::time::Duration;

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{self, FlightMode as Mode, vehicle_command::Command};

/// What becomes of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reaction {
    /// Obeyed and acknowledged.
    Obey,
    /// Rejected.
    Reject,
    /// Not even received.
    Lose,
    /// Obeyed, but the acknowledgement is lost.
    ObeySilently,
    /// Acknowledged, and then not obeyed.
    Lie,
    /// Obeyed, acknowledged twice.
    AckTwice,
}

/// What a status says: the modes that are intended and flown, armed, landed, the gripper, whether somebody else flies, and the epoch.
type Said = (Mode, Mode, bool, bool, v1::Gripper, (bool, u64));

/// Data that grow old when they are frozen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    Position,
    Status,
    Landed,
}

pub(crate) struct Autopilot {
    pub(crate) position: Ned,
    pub(crate) velocity: NedVelocity,
    /// What the wind adds to the velocity of a loiter.
    pub(crate) wind: NedVelocity,
    pub(crate) armed: bool,
    pub(crate) landed: bool,
    pub(crate) intended: Mode,
    pub(crate) gripper: v1::Gripper,
    /// It takes a release and does not open.
    pub(crate) gripper_stuck: bool,
    /// When the gripper is open, once it was told to be.
    opens: Option<Time>,
    /// The mode that is flown instead of the intended one.
    pub(crate) failsafe: Option<Mode>,
    /// It says that this is for want of setpoints, and nothing else.
    pub(crate) waits_for_setpoints: bool,
    /// Offboard is intended, and no setpoints come.
    misses_setpoints: bool,
    /// The mode was chosen by somebody else since the last command that sets one, or arms.
    pub(crate) other: bool,
    /// Its own words.
    pub(crate) reason: &'static str,
    pub(crate) can_arm: Option<bool>,
    pub(crate) frame_epoch: u64,
    /// What becomes of the next commands; those after them are obeyed.
    pub(crate) reactions: VecDeque<Reaction>,
    pub(crate) frozen: Vec<Source>,
    /// What it says of its motion from now on, whatever it flies.
    pub(crate) repeats: Option<(Ned, NedVelocity)>,
    /// Every command that arrived.
    pub(crate) commands: Vec<Command>,
    /// When a command was last left unanswered.
    unanswered: Option<Time>,
    setpoint: Option<(Time, v1::TrajectorySetpoint)>,
    height_wanted_m: f64,
    said: Option<Said>,
    steps: u64,
    speed: u32,
}

const STEP: Duration = Duration::from_millis(20);
/// From the command until the gripper is open.
const GRIPPER: Duration = Duration::from_secs(1);
/// Never less than one second of wall time.
const SETPOINT_LOST: Duration = Duration::from_secs(1);

impl Default for Autopilot {
    fn default() -> Autopilot {
        Autopilot {
            position: Ned::default(),
            velocity: NedVelocity::default(),
            wind: NedVelocity::default(),
            armed: false,
            landed: true,
            intended: Mode::Loiter,
            gripper: v1::Gripper::Holding,
            gripper_stuck: false,
            opens: None,
            failsafe: None,
            waits_for_setpoints: false,
            misses_setpoints: false,
            other: false,
            reason: "",
            can_arm: None,
            frame_epoch: 0,
            reactions: VecDeque::new(),
            frozen: Vec::new(),
            repeats: None,
            commands: Vec::new(),
            unanswered: None,
            setpoint: None,
            height_wanted_m: 0.0,
            said: None,
            steps: 0,
            speed: 1,
        }
    }
}

impl Autopilot {
    /// In the air, ten metres up, loitering.
    pub(crate) fn flying() -> Autopilot {
        Autopilot { position: Ned::new(0.0, 0.0, -10.0), armed: true, landed: false, ..Autopilot::default() }
    }

    /// The same, but armed.
    pub(crate) fn armed(self) -> Autopilot {
        Autopilot { armed: true, ..self }
    }

    /// The same, but this source never sends.
    pub(crate) fn silent_about(self, source: Source) -> Autopilot {
        Autopilot { frozen: vec![source], ..self }
    }

    /// The same; its rates keep to the wall clock while mission time runs `speed` times as fast.
    pub(crate) fn at_speed(self, speed: u32) -> Autopilot {
        Autopilot { speed, ..self }
    }

    pub(crate) fn step(&self) -> Duration {
        STEP
    }

    pub(crate) fn actual(&self) -> Mode {
        self.failsafe.unwrap_or(self.intended)
    }

    /// Whether setpoints arrive.
    pub(crate) fn is_fed(&self, now: Time) -> bool {
        self.setpoint.is_some_and(|(at, _)| now - at <= SETPOINT_LOST.max(Duration::from_millis(250) * self.speed))
    }

    /// Takes in a message. Returns the acknowledgements.
    pub(crate) fn receive(&mut self, message: &Message, now: Time) -> Vec<Message> {
        match message {
            Message::TrajectorySetpoint(it) => {
                assert_sound(it);
                self.setpoint = Some((now, *it));
                Vec::new()
            }
            Message::VehicleCommand(it) => self.command(it, now),
            _ => Vec::new(),
        }
    }

    fn command(&mut self, message: &v1::VehicleCommand, now: Time) -> Vec<Message> {
        let ack_timeout = Duration::from_millis(999);
        assert!(self.unanswered.is_none_or(|at| ack_timeout < now - at), "a command was in flight");
        self.unanswered = None;
        let command = message.command.expect("a command has content");
        self.commands.push(command);
        let reaction = self.reactions.pop_front().unwrap_or(Reaction::Obey);
        let refusal = if reaction == Reaction::Reject { Some("not now") } else { self.refusal(command, now) };
        if reaction != Reaction::Lie && reaction != Reaction::Lose && refusal.is_none() {
            self.obey(command, now);
        }
        let result = match refusal {
            None => v1::CommandResult::Accepted,
            Some(_) => v1::CommandResult::Rejected,
        };
        let ack = v1::VehicleCommandAck { id: message.id, result: result as i32, reason: refusal.unwrap_or("").into() };
        match reaction {
            Reaction::Lose | Reaction::ObeySilently => {
                self.unanswered = Some(now);
                Vec::new()
            }
            Reaction::AckTwice => vec![ack.clone().into(), ack.into()],
            _ => vec![ack.into()],
        }
    }

    fn refusal(&self, command: Command, now: Time) -> Option<&'static str> {
        match command {
            Command::Arm(_) => None,
            Command::Disarm(_) => (!self.landed).then_some("in the air"),
            Command::Takeoff(_) => (!self.armed).then_some("disarmed"),
            Command::Land(_) => self.landed.then_some("on the ground"),
            Command::Release(_) => None,
            Command::SetMode(it) if it.mode() == Mode::Offboard => (!self.is_fed(now)).then_some("no setpoints"),
            Command::SetMode(_) => None,
        }
    }

    fn obey(&mut self, command: Command, now: Time) {
        self.failsafe = None;
        self.other &= matches!(command, Command::Disarm(_) | Command::Release(_));
        match command {
            Command::Arm(_) => self.armed = true,
            Command::Disarm(_) => self.armed = false,
            Command::Takeoff(it) => {
                assert!(it.altitude_m.is_finite());
                self.height_wanted_m = it.altitude_m;
                self.intended = Mode::Takeoff;
            }
            Command::Land(_) => self.intended = Mode::Land,
            Command::Release(_) => {
                self.opens.get_or_insert(now + GRIPPER);
            }
            Command::SetMode(it) => self.intended = it.mode(),
        }
    }

    /// Flies for one step. Returns the telemetry.
    pub(crate) fn fly(&mut self, now: Time) -> Vec<Message> {
        let dt = STEP.as_secs_f64();
        let offboard_lost = self.intended == Mode::Offboard && !self.landed && !self.is_fed(now);
        if offboard_lost && self.failsafe.is_none() {
            self.failsafe = Some(Mode::Loiter);
        }
        self.misses_setpoints = offboard_lost;
        let wanted = self.wanted_velocity(dt);
        self.velocity = if self.armed { wanted } else { NedVelocity::default() };
        self.position = Ned::new(
            self.position.north_m + self.velocity.north_m_s * dt,
            self.position.east_m + self.velocity.east_m_s * dt,
            (self.position.down_m + self.velocity.down_m_s * dt).min(0.0),
        );
        if !self.gripper_stuck && self.opens.is_some_and(|it| it <= now) {
            self.gripper = v1::Gripper::Released;
        }
        let there = (self.position.height_m() - self.height_wanted_m).abs() < 0.05;
        if self.intended == Mode::Takeoff && there {
            self.intended = Mode::Loiter;
        }
        let on_ground = self.position.height_m() < 0.01;
        if on_ground && self.actual() == Mode::Land {
            self.armed = false;
            // As a real one does: back to the mode before the landing.
            self.intended = Mode::Offboard;
        }
        self.landed = on_ground;
        self.steps += 1;
        self.say()
    }

    fn wanted_velocity(&self, dt: f64) -> NedVelocity {
        match self.actual() {
            Mode::Takeoff => {
                let climb = ((self.height_wanted_m - self.position.height_m()) / dt).clamp(-3.0, 3.0);
                NedVelocity::new(0.0, 0.0, -climb)
            }
            Mode::Land => NedVelocity::new(0.0, 0.0, 1.5),
            Mode::Offboard => match self.setpoint {
                Some((_, v1::TrajectorySetpoint { velocity: Some(it), .. })) => it.try_into().unwrap(),
                Some((_, v1::TrajectorySetpoint { position: Some(it), speed_limit_m_s, .. })) => {
                    let target = Ned::try_from(it).unwrap();
                    let distance_m = self.position.distance_m(target);
                    let speed = speed_limit_m_s.unwrap_or(12.0).min(12.0).min(distance_m / dt);
                    let share = if 0.0 < distance_m { speed / distance_m } else { 0.0 };
                    NedVelocity::new(
                        (target.north_m - self.position.north_m) * share,
                        (target.east_m - self.position.east_m) * share,
                        (target.down_m - self.position.down_m) * share,
                    )
                }
                _ => NedVelocity::default(),
            },
            _ => self.wind,
        }
    }

    fn say(&mut self) -> Vec<Message> {
        let mut said = Vec::new();
        let speaks = |it: Source| !self.frozen.contains(&it);
        if speaks(Source::Position) {
            let (position, velocity) = self.repeats.unwrap_or((self.position, self.velocity));
            said.push(Message::from(v1::VehicleLocalPosition {
                position: Some(position.into()),
                velocity: Some(velocity.into()),
                horizontal_valid: true,
                vertical_valid: true,
                ..v1::VehicleLocalPosition::default()
            }));
        }
        let told = (self.other, self.frame_epoch);
        let state = (self.intended, self.actual(), self.armed, self.landed, self.gripper, told);
        let changed = self.said != Some(state);
        if speaks(Source::Status) && (changed || self.steps.is_multiple_of(25 * u64::from(self.speed))) {
            said.push(Message::from(v1::VehicleStatus {
                armed: self.armed,
                intended_mode: self.intended as i32,
                actual_mode: self.actual() as i32,
                failsafe: self.failsafe.is_some(),
                failures: self
                    .misses_setpoints
                    .then_some(v1::FailureFlag::OffboardSignalLost.into())
                    .into_iter()
                    .collect(),
                origin: None,
                gripper: self.gripper as i32,
                commanded_by_other: self.other,
                reason: self.reason.to_owned(),
                can_arm: self.can_arm,
                frame_epoch: self.frame_epoch,
                failsafe_reason: if self.waits_for_setpoints { v1::FailsafeReason::Setpoints as i32 } else { 0 },
                ..Default::default()
            }));
        }
        if speaks(Source::Landed) && (changed || self.steps.is_multiple_of(50 * u64::from(self.speed))) {
            said.push(
                v1::VehicleLandDetected { landed: self.landed, ground_contact: self.landed, timestamp_us: 0 }.into(),
            );
        }
        self.said = Some(state);
        said
    }
}

fn assert_sound(setpoint: &v1::TrajectorySetpoint) {
    let position = setpoint.position.into_iter().flat_map(|it| [it.north_m, it.east_m, it.down_m]);
    let velocity = setpoint.velocity.into_iter().flat_map(|it| [it.north_m_s, it.east_m_s, it.down_m_s]);
    let rest = [setpoint.speed_limit_m_s, setpoint.yaw_rad, setpoint.yaw_rate_rad_s].into_iter().flatten();
    assert!(position.chain(velocity).chain(rest).all(f64::is_finite), "{setpoint:?}");
    assert!(setpoint.position.is_some() != setpoint.velocity.is_some(), "either control: {setpoint:?}");
}
