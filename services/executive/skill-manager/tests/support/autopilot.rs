//! A small autopilot: obeys, refuses or ignores commands, and moves when told.

use std::collections::VecDeque;
use std::time::Duration;

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{self, FlightMode as Mode, vehicle_command::Command};

/// What becomes of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reaction {
    /// Obeyed and acknowledged.
    Obey,
    /// Not obeyed, and said so.
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

/// Something that grows old when it is frozen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    Position,
    Status,
    Landed,
}

pub struct Autopilot {
    pub position: Ned,
    pub velocity: NedVelocity,
    pub armed: bool,
    pub landed: bool,
    pub intended: Mode,
    /// Flown instead of the intended mode.
    pub failsafe: Option<Mode>,
    /// For the next commands; after that, they are obeyed.
    pub reactions: VecDeque<Reaction>,
    pub frozen: Vec<Source>,
    /// Every command that came.
    pub commands: Vec<Command>,
    /// Commands that were not answered, and when.
    unanswered: Option<Time>,
    setpoint: Option<(Time, v1::TrajectorySetpoint)>,
    height_wanted_m: f64,
    said: Option<(Mode, Mode, bool, bool)>,
    steps: u64,
    speed: u32,
}

const STEP: Duration = Duration::from_millis(20);
/// Never less than 250 ms of wall time.
const SETPOINT_LOST: Duration = Duration::from_secs(1);

impl Default for Autopilot {
    fn default() -> Autopilot {
        Autopilot {
            position: Ned::default(),
            velocity: NedVelocity::default(),
            armed: false,
            landed: true,
            intended: Mode::Loiter,
            failsafe: None,
            reactions: VecDeque::new(),
            frozen: Vec::new(),
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
    pub fn flying() -> Autopilot {
        Autopilot { position: Ned::new(0.0, 0.0, -10.0), armed: true, landed: false, ..Autopilot::default() }
    }

    /// The same, with its motors allowed to turn.
    pub fn armed(self) -> Autopilot {
        Autopilot { armed: true, ..self }
    }

    /// The same, but one never hears from this source.
    pub fn silent_about(self, source: Source) -> Autopilot {
        Autopilot { frozen: vec![source], ..self }
    }

    /// The same, with its rates kept to the wall clock.
    pub fn at_speed(self, speed: u32) -> Autopilot {
        Autopilot { speed, ..self }
    }

    pub fn step(&self) -> Duration {
        STEP
    }

    pub fn actual(&self) -> Mode {
        self.failsafe.unwrap_or(self.intended)
    }

    /// Whether setpoints come.
    pub fn is_fed(&self, now: Time) -> bool {
        self.setpoint.is_some_and(|(at, _)| now - at <= SETPOINT_LOST.max(Duration::from_millis(250) * self.speed))
    }

    /// Takes a message in; the acknowledgements it gives.
    pub fn receive(&mut self, message: &Message, now: Time) -> Vec<Message> {
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

    fn command(&mut self, it: &v1::VehicleCommand, now: Time) -> Vec<Message> {
        let patience = Duration::from_millis(999);
        assert!(self.unanswered.is_none_or(|at| patience < now - at), "a command was in flight");
        self.unanswered = None;
        let command = it.command.expect("a command says what");
        self.commands.push(command);
        let reaction = self.reactions.pop_front().unwrap_or(Reaction::Obey);
        let refusal = if reaction == Reaction::Reject { Some("not now") } else { self.refusal(command, now) };
        if reaction != Reaction::Lie && reaction != Reaction::Lose && refusal.is_none() {
            self.obey(command);
        }
        let result = match refusal {
            None => v1::CommandResult::Accepted,
            Some(_) => v1::CommandResult::Rejected,
        };
        let ack = v1::VehicleCommandAck { id: it.id, result: result as i32, reason: refusal.unwrap_or("").into() };
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
            Command::SetMode(it) if it.mode() == Mode::Offboard => (!self.is_fed(now)).then_some("no setpoints"),
            Command::SetMode(_) => None,
        }
    }

    fn obey(&mut self, command: Command) {
        self.failsafe = None;
        match command {
            Command::Arm(_) => self.armed = true,
            Command::Disarm(_) => self.armed = false,
            Command::Takeoff(it) => {
                assert!(it.altitude_m.is_finite());
                self.height_wanted_m = it.altitude_m;
                self.intended = Mode::Takeoff;
            }
            Command::Land(_) => self.intended = Mode::Land,
            Command::SetMode(it) => self.intended = it.mode(),
        }
    }

    /// One step of time; what it says.
    pub fn fly(&mut self, now: Time) -> Vec<Message> {
        let dt = STEP.as_secs_f64();
        let offboard_lost = self.intended == Mode::Offboard && !self.landed && !self.is_fed(now);
        if offboard_lost && self.failsafe.is_none() {
            self.failsafe = Some(Mode::Loiter);
        }
        let wanted = self.wanted_velocity(dt);
        self.velocity = if self.armed { wanted } else { NedVelocity::default() };
        self.position = Ned::new(
            self.position.north_m + self.velocity.north_m_s * dt,
            self.position.east_m + self.velocity.east_m_s * dt,
            (self.position.down_m + self.velocity.down_m_s * dt).min(0.0),
        );
        let there = (self.position.height_m() - self.height_wanted_m).abs() < 0.05;
        if self.intended == Mode::Takeoff && there {
            self.intended = Mode::Loiter;
        }
        let on_ground = self.position.height_m() < 0.01;
        if on_ground && self.actual() == Mode::Land {
            self.armed = false;
            // As a real one does: back to what the user had wanted before.
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
            _ => NedVelocity::default(),
        }
    }

    fn say(&mut self) -> Vec<Message> {
        let mut said = Vec::new();
        let speaks = |it: Source| !self.frozen.contains(&it);
        if speaks(Source::Position) {
            said.push(Message::from(v1::VehicleLocalPosition {
                position: Some(self.position.into()),
                velocity: Some(self.velocity.into()),
                horizontal_valid: true,
                vertical_valid: true,
                ..v1::VehicleLocalPosition::default()
            }));
        }
        let state = (self.intended, self.actual(), self.armed, self.landed);
        let changed = self.said != Some(state);
        if speaks(Source::Status) && (changed || self.steps.is_multiple_of(25 * u64::from(self.speed))) {
            said.push(Message::from(v1::VehicleStatus {
                armed: self.armed,
                intended_mode: self.intended as i32,
                actual_mode: self.actual() as i32,
                failsafe: self.failsafe.is_some(),
                failures: Vec::new(),
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

fn assert_sound(it: &v1::TrajectorySetpoint) {
    let position = it.position.into_iter().flat_map(|it| [it.north_m, it.east_m, it.down_m]);
    let velocity = it.velocity.into_iter().flat_map(|it| [it.north_m_s, it.east_m_s, it.down_m_s]);
    let rest = [it.speed_limit_m_s, it.yaw_rad, it.yaw_rate_rad_s].into_iter().flatten();
    assert!(position.chain(velocity).chain(rest).all(f64::is_finite), "{it:?}");
    assert!(it.position.is_some() != it.velocity.is_some(), "either control: {it:?}");
}
