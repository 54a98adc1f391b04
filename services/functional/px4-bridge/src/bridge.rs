//! The bridge between PX4's topics and those of the vocabulary: samples, commands, setpoints and time in, messages and samples out.

use std::time::Duration;

use autopilot::command::NumberedCommand;
use autopilot::gripper::SilentGripper;
use autopilot::target;
use autopilot::tasks::Tasks;
use domain::declared_skill::DeclaredSkills;
use domain::fmu::{
    Command, CommandAck, CommandId, CommandResult, LocalPosition, ModeObserver, OffboardControl, Seen, Setpoint,
    Status, VehicleCommand,
};
use domain::time::{Now, Time};
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1;
use node::{Effect, MessageKind};

use crate::carrot::Carrot;
use crate::cdr::{CdrError, Definitions, Record};
use crate::commands::{self, Ack, Answer, Pending, Step};
use crate::config::Config;
use crate::frame::{Frame, is_restart};
use crate::health::Health;
use crate::keys;
use crate::modes::NavState;
use crate::port::Arrival;
use crate::telemetry::{self, Rates};
use crate::watch::Watch;

/// A command is given up after this time: its sender has repeated it once by then, and given up too.
const COMMAND_LIMIT: Duration = Duration::from_secs(3);
/// How often Hold is set after a landing, until it is seen.
const HOLD_PERIOD: Duration = Duration::from_secs(1);
/// A position that is older is not flown by.
const POSITION_LIMIT: Duration = Duration::from_millis(500);
/// What PX4 counts as a vehicle of one system: the numbers of a vehicle that has not said its own yet.
const TARGET: (u8, u8) = (1, 1);

/// What goes out.
#[derive(Debug, Default)]
pub(crate) struct Out {
    /// To the bus.
    pub(crate) effects: Vec<Effect>,
    /// To PX4: key and bytes.
    pub(crate) samples: Vec<(String, Vec<u8>)>,
}

/// The newest status of PX4.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Flies {
    armed: bool,
    intended: NavState,
    actual: NavState,
    failsafe: bool,
    checks_pass: bool,
    target: (u8, u8),
}

/// The bridge's state.
#[derive(Debug)]
pub(crate) struct Bridge {
    config: Config,
    watch: Watch,
    rates: Rates,
    frame: Frame,
    health: Health,
    modes: ModeObserver<NavState>,
    /// How high the newest takeoff of ours is to end.
    takeoff_m: Option<f64>,
    carrot: Carrot,
    flies: Option<Flies>,
    position: Option<(Time, LocalPosition)>,
    pending: Option<Pending>,
    /// PX4's clock in the newest status and position.
    clocks: (u64, u64),
    hold_sent: Option<Time>,
    /// A flight of ours has ended, and PX4 is not in Hold since then.
    hold_wanted: bool,
    /// Why PX4 flies another mode, for as long as it does: its flags clear a moment before its mode.
    pre_emption: String,
    /// Why PX4 refused the newest command, until one is taken.
    refusal: String,
    gripper: SilentGripper,
    /// When PX4 told where the target of a landing is.
    target_heard: Option<Time>,
    tasks: Tasks,
}

impl Bridge {
    pub(crate) fn new(config: &Config, definitions: Definitions) -> Bridge {
        Bridge {
            watch: Watch::new(definitions, config.domain, config.silent_after_s.seconds()),
            frame: Frame::new(config.frame_jump_m.get()),
            // PX4 says which mode is intended, and no failsafe changes that.
            modes: ModeObserver::new(Duration::ZERO),
            takeoff_m: None,
            config: config.clone(),
            rates: Rates::default(),
            health: Health::default(),
            carrot: Carrot::default(),
            flies: None,
            position: None,
            pending: None,
            clocks: (0, 0),
            hold_sent: None,
            hold_wanted: false,
            pre_emption: String::new(),
            refusal: String::new(),
            gripper: SilentGripper::default(),
            target_heard: None,
            tasks: Tasks::default(),
        }
    }

    /// PX4 carries out those of these skills that have a command.
    pub(crate) fn carries_out(&mut self, skills: &DeclaredSkills) {
        self.tasks = Tasks::of(skills);
    }

    /// A task is ordered.
    pub(crate) fn task(&mut self, order: v1::TaskOrder, now: Time, out: &mut Out) {
        let ends = self.tasks.order(order, now);
        ends.into_iter().for_each(|it| self.send_of_task(it, out));
        self.tend(now, out);
    }

    fn send_of_task(&mut self, command: NumberedCommand, out: &mut Out) {
        if let Err(reason) = self.send(command, out) {
            out.effects.push(Effect::refused(Topic::TaskOrder, reason));
        }
    }

    /// Takes in what PX4 sent.
    pub(crate) fn arrived(&mut self, arrival: &Arrival, now: Now, out: &mut Out) {
        match arrival {
            Arrival::Token { key, alive } => {
                let why = keys::read_token(key, self.config.domain).and_then(|it| self.watch.token(&it, *alive));
                out.effects.extend(why.map(|it| Effect::refused(Topic::VehicleCommand, it)));
            }
            Arrival::Sample { key, payload } => {
                let Some(key) = keys::read(key, self.config.domain).filter(|it| it.is_output) else { return };
                let definition = match self.watch.definition(&key) {
                    Ok(it) => it,
                    Err(why) => {
                        out.effects.extend(why.map(|it| Effect::refused(what(key.topic), it)));
                        return;
                    }
                };
                let taken = Record::decode(&definition, payload).and_then(|it| self.take(key.topic, &it, now, out));
                match taken {
                    Ok(true) => self.watch.heard(key.topic, now.time),
                    // The same statement once more is not a sign of life.
                    Ok(false) => {}
                    Err(cause) => {
                        out.effects.push(Effect::refused(what(key.topic), format!("`{}` of PX4: {cause}", key.topic)))
                    }
                }
            }
        }
    }

    /// Takes in a sample; false if it repeats the one before.
    fn take(&mut self, topic: &str, sample: &Record<'_>, at: Now, out: &mut Out) -> Result<bool, CdrError> {
        let now = at.time;
        match topic {
            "vehicle_status" => return self.take_status(sample, now, out),
            "vehicle_local_position" => {
                let clock = sample.unsigned("timestamp")?;
                self.look_for_restart(self.clocks.1, clock);
                self.clocks.1 = clock;
                self.frame.read(sample)?;
                let position = telemetry::local_position(sample)?;
                let position = position.map(|it| LocalPosition { position: self.frame.to_ours(it.position), ..it });
                self.position = position.map(|it| (now, it));
                out.effects.extend(position.map(|it| Effect::publish(v1::VehicleLocalPosition::from(it))));
            }
            "vehicle_attitude" => {
                let attitude = self.rates.attitude(sample)?;
                out.effects.extend(attitude.map(|it| Effect::publish(v1::VehicleAttitude::from(it))));
            }
            "vehicle_global_position" => {
                let position = telemetry::global_position(sample)?;
                out.effects.extend(position.map(|it| Effect::publish(v1::VehicleGlobalPosition::from(it))));
            }
            "vehicle_land_detected" => {
                let landed = telemetry::land_detected(sample)?;
                out.effects.push(Effect::publish(v1::VehicleLandDetected::from(landed)));
            }
            "battery_status" => {
                let battery = telemetry::battery(sample)?;
                out.effects.extend(battery.map(|it| Effect::publish(v1::BatteryStatus::from(it))));
            }
            "failsafe_flags" => {
                let before = self.health.clone();
                self.health.read(sample)?;
                // Otherwise the next status tells it: it comes twice a second.
                if self.health != before && self.watch.is_there(now) {
                    self.publish_status(now, out);
                }
            }
            "vehicle_command_ack" => {
                if let Some(ack) = Ack::read(sample)? {
                    self.acknowledged(ack, now, out);
                }
            }
            "landing_target_pose" => {
                let is_news = !target::is_seen(self.target_heard, now);
                self.target_heard = Some(now);
                if is_news {
                    self.publish_status(now, out);
                }
            }
            "camera_capture" => {
                if let Some(picture) = telemetry::picture(sample, at.utc_ms)? {
                    self.tasks.picture_reported();
                    out.effects.push(Effect::publish(picture));
                }
            }
            _ => {}
        }
        Ok(true)
    }

    fn take_status(&mut self, sample: &Record<'_>, now: Time, out: &mut Out) -> Result<bool, CdrError> {
        /// `VehicleStatus.ARMING_STATE_ARMED`.
        const ARMED: u64 = 2;
        let clock = sample.unsigned("timestamp")?;
        let number = |field| sample.unsigned(field).map(|it| it as u8);
        let flies = Flies {
            armed: sample.unsigned("arming_state")? == ARMED,
            intended: NavState(number("nav_state_user_intention")?),
            actual: NavState(number("nav_state")?),
            failsafe: sample.flag("failsafe")?,
            checks_pass: sample.flag("pre_flight_checks_pass")?,
            target: (number("system_id")?, number("component_id")?),
        };
        if clock != 0 && clock == self.clocks.0 && self.flies.is_some() {
            return Ok(false);
        }
        self.look_for_restart(self.clocks.0, clock);
        self.clocks.0 = clock;
        let before = self.flies.replace(flies);
        self.watch.heard("vehicle_status", now);
        if flies.armed && before.is_some_and(|it| !it.armed) {
            self.gripper.armed();
        }
        self.observe(flies, now);
        let ended = before.is_some_and(|it| it.armed) && !flies.armed && self.modes.other().is_none();
        self.hold_wanted = (self.hold_wanted || ended) && !flies.armed && flies.intended != NavState::LOITER;
        self.publish_status(now, out);
        self.arm_once_in_hold(now, out);
        self.hold_after_landing(now, out);
        Ok(true)
    }

    /// Judges who has chosen the mode. By itself PX4 ends a takeoff that is at its height; the change back after a landing comes with the
    /// disarming.
    fn observe(&mut self, Flies { armed, intended, .. }: Flies, now: Time) {
        let height_m = self.fresh_position(now).map(|it| it.position.height_m());
        let short_m = self.config.takeoff_short_m.get();
        let is_short = self.takeoff_m.zip(height_m).is_some_and(|(wanted, is)| is < wanted - short_m);
        let may_be_ours = intended.is_commandable();
        // It says itself that it flies something else.
        let seen = Seen { armed, intended, flown: intended, may_be_ours, failsafe_at: None };
        let ends_takeoff = |from| (from, intended) == (NavState::TAKEOFF, NavState::LOITER) && !is_short;
        self.modes.saw(seen, ends_takeoff, now);
    }

    fn look_for_restart(&mut self, before_us: u64, now_us: u64) {
        if is_restart(before_us, now_us) {
            tracing::warn!(before_us, now_us, "PX4 was started again: its clock went back");
            self.watch.restarted();
            self.frame.restarted();
            self.modes.restarted();
            self.carrot.end();
            self.health = Health::default();
            self.rates = Rates::default();
            self.clocks = (0, 0);
            self.gripper = SilentGripper::default();
            (self.flies, self.position, self.pending, self.hold_sent) = (None, None, None, None);
            self.hold_wanted = false;
            self.refusal.clear();
        }
    }

    fn fresh_position(&self, now: Time) -> Option<LocalPosition> {
        self.position.filter(|(at, _)| now - *at <= POSITION_LIMIT).map(|(_, it)| it)
    }

    fn publish_status(&mut self, now: Time, out: &mut Out) {
        let Some(flies) = self.flies else { return };
        let lack = self.watch.lack(now);
        let has_position = self.fresh_position(now).is_some_and(|it| it.horizontal_valid && it.vertical_valid);
        // The checks are those for the mode of the moment; before arming the bridge sets Hold.
        let can_arm = match (&lack, flies.armed, flies.intended) {
            (Some(_), ..) => Some(false),
            // Before there is a position the frame that it counts in may still change.
            (None, false, NavState::LOITER) => Some(flies.checks_pass && has_position),
            (None, ..) => None,
        };
        let pre_empted = flies.failsafe || flies.intended != flies.actual;
        let words = self.health.reasons(flies.intended);
        if !pre_empted || !words.is_empty() {
            self.pre_emption.clone_from(&words);
        }
        let reason = if let Some(lack) = lack {
            lack
        } else if pre_empted || can_arm == Some(false) {
            let words = if pre_empted { self.pre_emption.clone() } else { words };
            let words =
                if words.is_empty() { "PX4 does not say why on this path; its events do".into() } else { words };
            if flies.armed {
                format!("{} instead of {}: {words}", flies.actual.name(), flies.intended.name())
            } else {
                words
            }
        } else {
            self.refusal.clone()
        };
        let status = Status {
            armed: flies.armed,
            intended: flies.intended.mode(),
            actual: flies.actual.mode(),
            failsafe: flies.failsafe,
            failures: self.health.failures(flies.intended, flies.failsafe),
            origin: self.frame.origin(),
            gripper: Some(self.gripper.state()),
            landing_target_seen: self.landing_target_seen(flies, now),
            commanded_by_other: self.modes.other().is_some(),
            reason,
            can_arm,
            frame_epoch: self.frame.epoch(),
            vibration_m_s2: None,
            failsafe_reason: None,
            timestamp_us: self.clocks.0,
        };
        out.effects.push(Effect::publish(v1::VehicleStatus::from(status)));
    }

    /// Whether the target of the present landing is seen; `None` if there is no such landing, or PX4 does not send the topic.
    fn landing_target_seen(&self, flies: Flies, now: Time) -> Option<bool> {
        let lands = flies.armed && flies.actual == NavState::PRECISION_LAND;
        (lands && self.watch.sends_target).then(|| target::is_seen(self.target_heard, now))
    }

    /// A command has come. It is answered once PX4 has answered, or at once where PX4 cannot be asked.
    pub(crate) fn commanded(&mut self, VehicleCommand { id, command }: VehicleCommand, now: Time, out: &mut Out) {
        if let Some(pending) = self.pending.as_mut().filter(|it| it.id == id) {
            pending.repeats = pending.repeats.saturating_add(1);
            pending.since = now;
        } else {
            if let Err(reason) = self.may(command, now) {
                refuse(id, reason, out);
                return;
            }
            let in_hold = self.flies.is_some_and(|it| (it.intended, it.actual) == (NavState::LOITER, NavState::LOITER));
            // It is set even where it is the mode already, if somebody else has chosen it: from the arming on it is ours.
            let sets_hold = command == Command::Arm && (!in_hold || self.modes.other().is_some());
            let step = if sets_hold { Step::SetsHold } else { Step::Sent };
            self.pending = Some(Pending { id, command, step, since: now, repeats: 0 });
        }
        self.send_pending(now, out);
    }

    /// Why PX4 is not even asked.
    fn may(&self, command: Command, now: Time) -> Result<(), String> {
        if !self.watch.is_there(now) {
            return Err(format!("no PX4 is heard at {}", self.config.endpoint));
        }
        let position = self.fresh_position(now).filter(|it| it.horizontal_valid && it.vertical_valid);
        let altitude = self.frame.origin().and_then(|it| it.altitude_m);
        match command {
            Command::Arm | Command::Takeoff { .. } => match self.watch.lack(now) {
                Some(lack) => Err(lack),
                None if position.is_none() => Err("PX4's position estimate is not valid yet".into()),
                None if altitude.is_none() => Err("PX4 does not know where its origin is yet".into()),
                None => Ok(()),
            },
            Command::Disarm
            | Command::Land
            | Command::LandOnTarget
            | Command::Loiter
            | Command::Offboard
            | Command::Release => Ok(()),
        }
    }

    fn send_pending(&mut self, now: Time, out: &mut Out) {
        let Some(pending) = self.pending else { return };
        let altitude = self.frame.origin().and_then(|it| it.altitude_m);
        let Some((px4, mode)) = pending.px4(altitude) else {
            self.pending = None;
            refuse(pending.id, "PX4 does not know where its origin is yet".into(), out);
            return;
        };
        if let Err(reason) = self.send(px4, out) {
            self.pending = None;
            refuse(pending.id, reason, out);
            return;
        }
        if let Some(mode) = mode {
            if let Command::Takeoff { height_m } = pending.command {
                self.takeoff_m = Some(height_m);
            }
            self.modes.sent(mode, now);
        }
        if (pending.command, pending.step) == (Command::Arm, Step::Sent) {
            self.modes.arming(now);
        }
    }

    fn send(&mut self, command: NumberedCommand, out: &mut Out) -> Result<(), String> {
        let target = self.flies.map_or(TARGET, |it| it.target);
        let (key, definition) = self.watch.input("vehicle_command")?;
        let payload = commands::encode(&command, definition, target).map_err(|it| it.to_string())?;
        out.samples.push((key, payload));
        self.gripper.sent(&command);
        Ok(())
    }

    fn acknowledged(&mut self, ack: Ack, now: Time, out: &mut Out) {
        if self.gripper.acknowledged(ack.number, ack.result) {
            self.publish_status(now, out);
        }
        self.tasks.acknowledged(ack.number, ack.result, now);
        self.answered(ack.number, Answer::of(ack.result), now, out);
        self.tend(now, out);
    }

    fn answered(&mut self, number: u16, answer: Answer, now: Time, out: &mut Out) {
        let altitude = self.frame.origin().and_then(|it| it.altitude_m);
        let Some(mut pending) = self.pending else { return };
        let Some((_, mode)) = pending.px4(altitude).filter(|(px4, _)| px4.number == number) else { return };
        match (answer, pending.step) {
            // The gripper moves; that it has moved is said by another acknowledgement, and then by the status.
            (Answer::InProgress, Step::Sent) if pending.command == Command::Release => {
                self.pending = None;
                acknowledge(pending.id, CommandResult::Accepted, out);
            }
            (Answer::InProgress, _) => {}
            (Answer::Accepted, Step::SetsHold | Step::AwaitsHold) => {
                self.modes.accepted(NavState::LOITER);
                pending.step = Step::AwaitsHold;
                self.pending = Some(pending);
                self.arm_once_in_hold(now, out);
            }
            (Answer::Accepted, Step::Sent) => {
                if let Some(mode) = mode {
                    self.modes.accepted(mode);
                }
                self.refusal.clear();
                self.pending = None;
                acknowledge(pending.id, CommandResult::Accepted, out);
            }
            (Answer::Refused(words), step) => {
                if let Some(mode) = mode {
                    self.modes.refused(mode);
                }
                let intended = self.flies.map_or(NavState::LOITER, |it| it.intended);
                let why = self.health.reasons(mode.unwrap_or(intended));
                let what =
                    if step != Step::Sent { "Hold before arming".to_owned() } else { pending.command.to_string() };
                let why = if why.is_empty() { String::new() } else { format!(": {why}") };
                self.refusal = format!("PX4 refused {what}, {words}{why}");
                self.pending = None;
                refuse(pending.id, self.refusal.clone(), out);
            }
        }
    }

    /// The mode is the one that the motors may be armed in: arms them.
    fn arm_once_in_hold(&mut self, now: Time, out: &mut Out) {
        let in_hold = self.flies.is_some_and(|it| it.intended == NavState::LOITER && it.actual == NavState::LOITER);
        if let Some(pending) = self.pending.as_mut().filter(|it| it.step == Step::AwaitsHold && in_hold) {
            pending.step = Step::Sent;
            self.send_pending(now, out);
        }
    }

    /// After a landing PX4 goes back to the mode from before, in which it would not arm, and would not say whether it would in Hold.
    /// Where we have landed it, Hold is set. What somebody else has flown, or has selected on the ground, is left as it is.
    fn hold_after_landing(&mut self, now: Time, out: &mut Out) {
        if !self.hold_wanted || self.pending.is_some() {
            return;
        }
        if self.hold_sent.is_some_and(|at| now - at < HOLD_PERIOD) {
            return;
        }
        self.hold_sent = Some(now);
        if self.send(commands::hold(), out).is_ok() {
            self.modes.sent(NavState::LOITER, now);
        }
    }

    /// The proof of life goes to PX4 as it comes.
    pub(crate) fn control(&mut self, control: OffboardControl, out: &mut Out) {
        let Ok((key, definition)) = self.watch.input("offboard_control_mode") else { return };
        let mut record = Record::zero(definition);
        let set = match control {
            OffboardControl::Position => record.set_flag("position", true),
            OffboardControl::Velocity => record.set_flag("velocity", true),
        };
        match set {
            Ok(()) => out.samples.push((key, record.encode())),
            Err(cause) => out.effects.push(Effect::refused(Topic::OffboardControlMode, cause)),
        }
    }

    /// A setpoint goes to PX4 as it comes, and never twice. One with a speed limit becomes a moving target.
    pub(crate) fn setpoint(&mut self, setpoint: Setpoint, now: Time, out: &mut Out) {
        let nowhere = [f64::NAN; 3];
        let (position, velocity, yaw, yaw_rate) = match setpoint {
            Setpoint::Position { target, speed_limit_m_s, yaw_rad } => {
                let limit_m_s = speed_limit_m_s.filter(|it| *it < self.config.own_speed_m_s.get());
                let target = match (limit_m_s, self.fresh_position(now)) {
                    (None, _) => {
                        self.carrot.end();
                        target
                    }
                    (Some(limit_m_s), Some(vehicle)) => {
                        let lead_s = self.config.lead_s.get();
                        self.carrot.next(target, limit_m_s, lead_s, vehicle.position, now)
                    }
                    // Nothing says where the moving target should begin: PX4 misses its setpoints, and does what it does then.
                    (Some(_), None) => return,
                };
                let target = self.frame.to_its(target);
                ([target.north_m, target.east_m, target.down_m], nowhere, yaw_rad, None)
            }
            Setpoint::Velocity { velocity, yaw_rate_rad_s } => {
                self.carrot.end();
                (nowhere, [velocity.north_m_s, velocity.east_m_s, velocity.down_m_s], None, yaw_rate_rad_s)
            }
        };
        let Ok((key, definition)) = self.watch.input("trajectory_setpoint") else { return };
        let encode = || {
            let mut record = Record::zero(definition);
            let arrays = [("position", position), ("velocity", velocity), ("acceleration", nowhere), ("jerk", nowhere)];
            for (field, values) in arrays {
                for (index, value) in values.into_iter().enumerate() {
                    record.set_number_at(field, index, value)?;
                }
            }
            record.set_number("yaw", yaw.unwrap_or(f64::NAN))?;
            record.set_number("yawspeed", yaw_rate.unwrap_or(f64::NAN))?;
            Ok::<_, CdrError>(record.encode())
        };
        match encode() {
            Ok(payload) => out.samples.push((key, payload)),
            Err(cause) => out.effects.push(Effect::refused(Topic::TrajectorySetpoint, cause)),
        }
    }

    /// Gives up what PX4 does not answer: its sender has, too. Does what is due of the tasks.
    pub(crate) fn tend(&mut self, now: Time, out: &mut Out) {
        self.pending.take_if(|it| COMMAND_LIMIT <= now - it.since);
        let (is_heard, mut sends) = (self.watch.is_there(now), Vec::new());
        self.tasks.act(is_heard, now, &mut sends, &mut out.effects);
        sends.into_iter().for_each(|it| self.send_of_task(it, out));
    }

    /// When something of the tasks is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.tasks.deadline()
    }
}

fn acknowledge(id: CommandId, result: CommandResult, out: &mut Out) {
    out.effects.push(Effect::publish(v1::VehicleCommandAck::from(CommandAck { id, result })));
}

fn refuse(id: CommandId, reason: String, out: &mut Out) {
    acknowledge(id, CommandResult::Rejected { reason }, out);
}

/// The topic of the vocabulary that a topic of PX4 feeds, for what is reported as refused.
fn what(topic: &str) -> MessageKind {
    MessageKind::Topic(match topic {
        "vehicle_local_position" => Topic::VehicleLocalPosition,
        "vehicle_attitude" => Topic::VehicleAttitude,
        "vehicle_global_position" => Topic::VehicleGlobalPosition,
        "vehicle_land_detected" => Topic::VehicleLandDetected,
        "battery_status" => Topic::BatteryStatus,
        "vehicle_command_ack" => Topic::VehicleCommandAck,
        "camera_capture" => Topic::Picture,
        _ => Topic::VehicleStatus,
    })
}
