//! The connected autopilot: its telemetry, the commands sent to it, and who is in control.

use std::time::Duration;

use autopilot::command::NumberedCommand;
use autopilot::gripper::SilentGripper;
use autopilot::target;
use domain::fmu::{Author, Command, CommandId, CommandResult, FlightMode, Gripper, ModeObserver, Seen, Setpoint};
use domain::geodesy::AutopilotFrame;
use domain::geometry::Ned;
use domain::time::{Now, Time};
use node::Effect;

use crate::config::Config;
use crate::epoch::{Break, Epoch};
use crate::grooming::Grooming;
use crate::heard::{Ack, Echo, Heard};
use crate::landing_target::LandingTarget;
use crate::order::Order;
use crate::personality::{Personality, Submode};
use crate::procedure::{Act, Around, Procedure};
use crate::said::{CommandLong, Said, Target, command};
use crate::setpoints::Setpoints;
use crate::status::Reporter;
use crate::streams::Streams;
use crate::telemetry;
use crate::vector::length;
use crate::vehicle::{Vehicle, landed};

/// The autopilot that is flown.
#[derive(Debug)]
pub(crate) struct Flown {
    pub(crate) system: u8,
    pub(crate) heard_first: Time,
    pub(crate) personality: Box<dyn Personality>,
    pub(crate) vehicle: Vehicle,
    pub(crate) order: Order,
    pub(crate) modes: ModeObserver<u32>,
    pub(crate) submode: Submode,
    /// When that began, or the last command ended: what the autopilot says may be old for a moment.
    settles_since: Time,
    pub(crate) epoch: Epoch,
    /// How the frame has moved, since the vehicle was armed.
    pub(crate) moved: String,
    pub(crate) streams: Streams,
    procedure: Option<Procedure>,
    pub(crate) setpoints: Setpoints,
    grooming: Grooming,
    pub(crate) landing_target: LandingTarget,
    gripper: SilentGripper,
    /// It is not known yet whether setpoints were passed on before this process was started.
    pub(crate) adopts: bool,
    /// When all limits were looked at last.
    looked_at: Time,
    pub(crate) reporter: Reporter,
}

/// As long it is not judged who has changed the mode.
const DOUBT: Duration = Duration::from_millis(300);
/// Setpoints that are sent are heard within this time after a start: twenty periods of theirs.
const ADOPTS: Duration = Duration::from_secs(1);
/// The target that the autopilot reports is not judged until this time has passed since a command: four of its messages.
const SETTLES: Duration = Duration::from_secs(1);
/// A vehicle that is slower stands. (ENG: gusts move one that holds by less.)
const STANDS_M_S: f64 = 0.3;

fn ned([north_m, east_m, down_m]: [f64; 3]) -> Ned {
    Ned::new(north_m, east_m, down_m)
}

fn array(it: Ned) -> [f64; 3] {
    [it.north_m, it.east_m, it.down_m]
}

impl Flown {
    /// It was heard for the first time.
    pub(crate) fn new(system: u8, personality: Box<dyn Personality>, config: &Config, now: Time) -> Flown {
        let streams = Streams::new(personality.streams());
        Flown {
            system,
            heard_first: now,
            personality,
            vehicle: Vehicle::default(),
            order: Order::default(),
            modes: ModeObserver::new(DOUBT),
            submode: Submode::Holding,
            settles_since: now,
            epoch: Epoch::new(config.jump_m.get()),
            moved: String::new(),
            streams,
            procedure: None,
            setpoints: Setpoints::default(),
            grooming: Grooming::new(),
            landing_target: LandingTarget::default(),
            gripper: SilentGripper::default(),
            adopts: true,
            looked_at: now,
            reporter: Reporter::default(),
        }
    }

    /// It has said something.
    pub(crate) fn take_in(&mut self, heard: &Heard, now: Now, effects: &mut Vec<Effect>) {
        let heard = &self.in_our_frame(heard);
        match self.epoch.take_in(heard, &self.vehicle, now.time) {
            Ok(None) if self.boots(heard) => {
                self.epoch.restarted();
                self.restart(now.time);
            }
            Ok(None) => {}
            Ok(Some(Break::Restart)) => self.restart(now.time),
            Ok(Some(Break::Moved(how))) => {
                tracing::warn!("{how}");
                self.moved = how;
            }
            Err(crate::epoch::Overtaken) => return,
        }
        let was_armed = self.vehicle.is_armed();
        let was_in_air = self.vehicle.landed.is_some_and(|(_, it)| it == landed::IN_AIR);
        self.vehicle.take_in(heard, now.time);
        match (was_armed, self.vehicle.is_armed()) {
            (true, false) => self.disarmed(was_in_air),
            (false, true) => self.gripper.armed(),
            _ => {}
        }
        effects.extend(telemetry::published(heard, &self.vehicle, now));
        match heard {
            Heard::Ack(ack) => self.acknowledged(*ack, now.time),
            Heard::Landed(state) => {
                self.streams.heard_land_detector(now.time);
                if *state == landed::IN_AIR && self.submode == Submode::Climbing {
                    self.set_submode(Submode::Holding, now.time);
                }
            }
            Heard::Origin(_) => self.streams.heard_origin(),
            Heard::Heartbeat(_) | Heard::CurrentMode { .. } => self.reporter.has_news = true,
            Heard::Target(echo) => self.echoed(*echo, now.time),
            Heard::LocalPosition(it) => self.landing_target.descends(it.velocity[2], now.time),
            Heard::Text { severity, text } => {
                tracing::info!(severity, "the autopilot says: {text}");
                self.vehicle.gripper = self.personality.gripper(text).or(self.vehicle.gripper);
                if let Some(is_seen) = self.personality.landing_target(text) {
                    self.landing_target.told(is_seen, now.time);
                }
                self.reporter.has_news = true;
            }
            _ => {}
        }
    }

    /// Its local frame, once the origin is known.
    fn frame(&self) -> Option<AutopilotFrame> {
        Some(self.personality.local_frame(telemetry::origin(&self.vehicle)?.place))
    }

    /// What it says, with places as they are in our frame.
    fn in_our_frame(&self, heard: &Heard) -> Heard {
        let mut heard = heard.clone();
        let place = match &mut heard {
            Heard::LocalPosition(it) => Some(&mut it.position),
            Heard::Target(it) => it.position.as_mut(),
            _ => None,
        };
        if let (Some(place), Some(frame)) = (place, self.frame()) {
            *place = array(frame.to_ours(ned(*place)));
        }
        heard
    }

    /// A target with its place in the autopilot's frame.
    pub(crate) fn in_its_frame(&self, target: Target) -> Target {
        let frame = self.frame();
        let position = target.position.map(|it| frame.map_or(it, |frame| array(frame.to_its(ned(it)))));
        Target { position, ..target }
    }

    fn acknowledged(&mut self, ack: Ack, now: Time) {
        if ack.is_ours(self.system) {
            self.streams.acknowledged(ack);
            if self.gripper.acknowledged(ack.command, ack.result) {
                self.reporter.has_news = true;
            }
            if let Some(procedure) = &mut self.procedure {
                procedure.acknowledged(ack, now);
            }
        }
    }

    /// Whether its heartbeat goes back to that of an autopilot that starts.
    fn boots(&self, heard: &Heard) -> bool {
        /// MAV_STATE_BOOT, and MAV_STATE_STANDBY.
        const BOOT: u8 = 1;
        const STANDBY: u8 = 3;
        let before = self.vehicle.heartbeat.map(|(_, it)| it.system_status);
        matches!(heard, Heard::Heartbeat(it) if it.system_status == BOOT) && before.is_some_and(|it| STANDBY <= it)
    }

    /// What its gripper does, if that is known, or will be once it is commanded.
    pub(crate) fn gripper(&self) -> Option<Gripper> {
        self.vehicle.gripper.or(self.personality.acknowledges_gripper().then(|| self.gripper.state()))
    }

    /// Whether it sees the target of the present landing, if it `lands`; `None` if that is not on a target, or it does not tell.
    pub(crate) fn landing_target_seen(&self, lands: bool, now: Time) -> Option<bool> {
        match self.personality.target_mode() {
            Some(mode) => {
                let lands = self.vehicle.is_armed() && self.vehicle.custom_mode() == Some(mode);
                (lands && !self.vehicle.is_on_ground()).then(|| target::is_seen(self.vehicle.target_heard, now))
            }
            None => self.landing_target.is_seen(now).filter(|_| lands),
        }
    }

    /// This is sent to it.
    pub(crate) fn told(&mut self, said: &Said) {
        if let Said::Command { command: CommandLong { command, params }, confirmation } = *said {
            let params = params.map(f64::from);
            self.gripper.sent(&NumberedCommand { number: command, params, repeats: confirmation });
        }
    }

    /// The autopilot was started again: nothing earlier holds.
    fn restart(&mut self, now: Time) {
        tracing::warn!("the autopilot was started again");
        let heartbeat = self.vehicle.heartbeat.filter(|(_, it)| !it.armed);
        self.vehicle = Vehicle { heartbeat, ..Vehicle::default() };
        self.modes.restarted();
        self.streams.restart();
        self.setpoints.end();
        self.grooming = Grooming::new();
        self.landing_target = LandingTarget::default();
        self.gripper = SilentGripper::default();
        self.set_submode(Submode::Holding, now);
    }

    fn disarmed(&mut self, was_in_air: bool) {
        self.moved.clear();
        self.setpoints.end();
        self.grooming = Grooming::new();
        let is_ours = self.procedure.as_ref().is_some_and(|it| it.command == Command::Disarm);
        if was_in_air && !is_ours {
            self.modes.taken("the motors were stopped in the air");
        }
    }

    /// A setpoint of somebody else shows in what the autopilot follows.
    fn echoed(&mut self, echo: Echo, now: Time) {
        let is_judged = self.personality.echoes_setpoints()
            && self.vehicle.is_armed()
            && self.vehicle.custom_mode() == Some(self.personality.ground_mode())
            && self.submode != Submode::Climbing
            && self.procedure.is_none()
            && self.modes.author() == Author::Ours
            && SETTLES <= now - self.settles_since;
        if is_judged && self.setpoints.are_of_somebody_else(echo, now) {
            tracing::warn!(?echo, "the autopilot follows a setpoint that is not ours");
            self.setpoints.end();
            self.setpoints.forget();
            self.modes.taken("a setpoint that is not ours is flown");
        }
    }

    /// A command of the layers above begins.
    pub(crate) fn begin(&mut self, id: CommandId, command: Command, now: Time) -> Result<(), String> {
        if self.procedure.as_ref().is_some_and(|it| it.id == id) {
            return Ok(());
        }
        if let Command::Takeoff { height_m } = command
            && !height_m.is_finite()
        {
            return Err("the height of the takeoff is not a number".into());
        }
        let steps = self.personality.steps(command, &self.vehicle)?;
        self.adopts = false;
        self.landing_target.landing_ends();
        if matches!(command, Command::Arm | Command::Takeoff { .. } | Command::Land | Command::LandOnTarget) {
            self.setpoints.forget();
        }
        if matches!(command, Command::Takeoff { .. }) {
            // A setpoint during the climb would end it.
            self.setpoints.end();
        }
        self.procedure = Some(Procedure::new(id, command, steps, now));
        Ok(())
    }

    /// Goes on with the command at hand; its answer once it is over.
    pub(crate) fn advance(
        &mut self,
        setpoint: Option<Setpoint>,
        config: &Config,
        now: Time,
        says: &mut Vec<Said>,
    ) -> Option<(CommandId, CommandResult)> {
        self.looked_at = now;
        let procedure = self.procedure.as_mut()?;
        let (personality, vehicle) = (self.personality.as_ref(), &self.vehicle);
        let (mut acts, has_setpoint) = (Vec::new(), setpoint.is_some());
        let result = procedure.advance(&Around { vehicle, personality, config, has_setpoint, now }, &mut acts);
        let (id, command) = (procedure.id, procedure.command);
        if command == Command::Arm {
            self.modes.arming(now);
        }
        for act in acts {
            match act {
                Act::Say(said) => says.push(said),
                Act::Expect(mode) => {
                    if self.vehicle.custom_mode() != Some(mode) {
                        self.setpoints.stands(self.personality.as_ref(), now);
                    }
                    self.expect(mode, now);
                }
                Act::Become(submode) => {
                    match submode {
                        Submode::Following => self.setpoints.begin(),
                        Submode::Holding | Submode::Climbing => self.setpoints.end(),
                    }
                    self.set_submode(submode, now);
                    // The first one goes out at once: an autopilot that waits for it must not wait for the next one.
                    let first = setpoint.and_then(|it| self.follow(&it, config, now));
                    says.extend(first.map(Said::Setpoint));
                }
                Act::Stop => says.extend(self.setpoints.stop(self.personality.as_ref(), now).map(Said::Setpoint)),
            }
        }
        let result = result?;
        self.procedure = None;
        self.settles_since = now;
        match &result {
            CommandResult::Accepted => {
                tracing::info!("{command}: done");
                if command == Command::LandOnTarget {
                    self.landing_target.landing_begins(now);
                }
                if matches!(command, Command::Loiter | Command::Land | Command::LandOnTarget | Command::Takeoff { .. })
                {
                    self.setpoints.end();
                }
            }
            CommandResult::Rejected { reason } => tracing::warn!("{command}: {reason}"),
        }
        Some((id, result))
    }

    /// Where this process was started in flight: the setpoints that the layers above go on sending are passed on, as they were before. If
    /// none comes for a while, it holds.
    pub(crate) fn adopt(&mut self, has_setpoint: bool, now: Time) {
        let is_guided = self.vehicle.custom_mode() == Some(self.personality.setpoint_mode());
        let is_ours = self.modes.author() == Author::Ours;
        self.adopts &= self.vehicle.is_armed() && is_guided && is_ours && now - self.heard_first < ADOPTS;
        if self.adopts && has_setpoint {
            tracing::info!("started in flight: the setpoints are passed on");
            self.adopts = false;
            self.setpoints.begin();
            self.set_submode(Submode::Following, now);
        }
    }

    /// The target to send for a setpoint of the layers above.
    pub(crate) fn follow(&mut self, setpoint: &Setpoint, config: &Config, now: Time) -> Option<Target> {
        if self.modes.other().is_some() {
            return None;
        }
        self.setpoints.follow(setpoint, self.personality.as_ref(), &self.vehicle, config, now)
    }

    /// Stops a vehicle that follows setpoints when they stop, and stops it again while one that was stopped is neither seen to stand
    /// nor says that it follows the stop: a setpoint is not acknowledged.
    pub(crate) fn stop_without_setpoints(&mut self, has_setpoint: bool, now: Time) -> Option<Target> {
        let is_ours = self.modes.author() == Author::Ours;
        let are_lost = is_ours && self.setpoints.are_followed() && !has_setpoint;
        let is_guided = self.vehicle.custom_mode() == Some(self.personality.ground_mode());
        let stands = || self.vehicle.local_now(now).is_some_and(|it| length(it.velocity) <= STANDS_M_S);
        let holds = is_ours && is_guided && self.vehicle.is_armed() && self.procedure.is_none();
        let moves_on = holds && self.setpoints.may_miss_stop() && !stands();
        self.setpoints.stop_if(are_lost, moves_on, self.personality.as_ref(), now)
    }

    /// When something may be due that nothing has arrived for.
    pub(crate) fn deadline(&self) -> Option<Time> {
        // A procedure and the judgement of setpoints look at ages: often enough for their shortest limit.
        let busy = self.procedure.as_ref().map(|_| self.looked_at + Duration::from_millis(20));
        let watches = self.setpoints.are_followed() || self.setpoints.may_miss_stop();
        let follows = watches.then(|| self.looked_at + Duration::from_millis(100));
        let adopts = self.adopts.then_some(self.heard_first + ADOPTS);
        let deadlines =
            [self.streams.deadline(), busy, follows, adopts, self.modes.deadline(), self.grooming.deadline()];
        deadlines.into_iter().flatten().min()
    }

    /// We set this mode. If it is flown already, it is ours from here on: no autopilot would say that it has taken the command.
    fn expect(&mut self, mode: u32, now: Time) {
        self.modes.sent(mode, now);
        self.modes.accepted(mode);
    }

    /// Judges who has chosen the mode. One that has not started yet says nothing.
    pub(crate) fn observe(&mut self, now: Time) {
        let (Some(flown), Some((_, heartbeat))) = (self.vehicle.custom_mode(), self.vehicle.heartbeat) else { return };
        if !heartbeat.armed && !self.personality.has_started(heartbeat.system_status) {
            return;
        }
        let is_down = !heartbeat.armed || self.vehicle.is_on_ground();
        let (landing, vehicle, personality) = (self.landing(), &self.vehicle, self.personality.as_ref());
        let intended = landing.or(vehicle.intended(now)).unwrap_or(flown);
        let seen = Seen {
            armed: heartbeat.armed,
            intended,
            flown: landing.unwrap_or(flown),
            may_be_ours: personality.mode(intended, Submode::Holding).is_some(),
            failsafe_at: vehicle.critical_since.max(vehicle.texts.newest_of(personality.failsafe_texts())),
        };
        self.modes.saw(seen, |from| personality.changes_by_itself(from, intended, is_down), now);
    }

    /// The landing that is over, until the motors are seen to be off: PX4 tells the mode that follows it up to a second before that.
    pub(crate) fn landing(&self) -> Option<u32> {
        let (vehicle, personality) = (&self.vehicle, self.personality.as_ref());
        let is_landing = |mode: &u32| personality.mode(*mode, Submode::Holding) == Some(FlightMode::Land);
        let is_over = |mode: &u32| {
            let next = vehicle.custom_mode();
            next.is_some_and(|next| next != *mode && personality.changes_by_itself(*mode, next, vehicle.is_on_ground()))
        };
        self.modes.ours().filter(is_landing).filter(is_over).filter(|_| vehicle.is_armed())
    }

    fn set_submode(&mut self, submode: Submode, now: Time) {
        if self.submode != submode {
            (self.submode, self.settles_since) = (submode, now);
            self.reporter.has_news = true;
        }
    }

    /// The mode of a vehicle that stands on the ground with its motors off, and that nobody else has taken.
    fn stands_in(&self) -> Option<u32> {
        let (_, heartbeat) = self.vehicle.heartbeat?;
        let stands = self.vehicle.is_on_ground()
            && !heartbeat.armed
            && self.personality.has_started(heartbeat.system_status)
            && self.modes.other().is_none()
            && self.procedure.is_none();
        self.vehicle.custom_mode().filter(|_| stands)
    }

    /// Selects the mode on the ground in which it can be armed, and says truly whether.
    pub(crate) fn groom(&mut self, now: Time) -> Option<Said> {
        let mode = self.personality.ground_mode();
        if !self.grooming.is_due(self.stands_in(), mode, now) {
            return None;
        }
        self.expect(mode, now);
        let [main, sub] = self.personality.mode_params(mode);
        Some(Said::Command { command: CommandLong::new(command::SET_MODE, [1.0, main, sub]), confirmation: 0 })
    }
}
