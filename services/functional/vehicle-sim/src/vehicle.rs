//! The vehicle as a whole: body, autopilot and battery, stepped together through mission time.
//!
//! It takes commands, setpoints and faults. It sends nothing: see [`crate::telemetry`] and
//! [`crate::publisher`].

use std::time::Duration;

use domain::fmu::{Command, FailsafeReason, Failure};
use domain::time::{Pace, Time};
use nalgebra::Vector3;

use crate::arming::Arming;
use crate::battery::Battery;
use crate::boot::Boot;
use crate::commander::{Phase, Refusal, Situation, judge};
use crate::config::Config;
use crate::controller::Controller;
use crate::estimator::{Estimate, Estimator};
use crate::failsafe::{FailsafeCause, pre_empt};
use crate::frame::horizontal;
use crate::gripper::Gripper;
use crate::land_detector::LandDetector;
use crate::liftoff::{Liftoff, Signals};
use crate::multirotor::{Controls, GRAVITY_M_S2, Motors, Multirotor};
use crate::noise::{Noise, NoiseStream};
use crate::offboard::Offboard;
use crate::others::Others;
use crate::pilot::{Mode, Pilot, PilotInput};
use crate::wind::Wind;

/// The step of the physics: PX4's position controller runs at the same 250 Hz.
const STEP: Duration = Duration::from_millis(4);
/// At rest on the ground, with nothing to fly, longer steps are enough.
const REST_STEP: Duration = Duration::from_millis(100);
/// Meeting the ground faster than this breaks the vehicle.
const CRASH_M_S: f64 = 4.0;

/// Body, autopilot and battery.
#[derive(Debug)]
pub(crate) struct Vehicle {
    config: Config,
    clock: Time,
    /// The true state.
    pub(crate) body: Multirotor,
    /// Drives the motors and the avionics.
    pub(crate) battery: Battery,
    /// The autopilot's estimate of the state.
    pub(crate) estimator: Estimator,
    /// The air around it.
    pub(crate) wind: Wind,
    /// The setpoint streams.
    pub(crate) offboard: Offboard,
    /// The present start of the autopilot, and its local frame.
    pub(crate) boot: Boot,
    /// Who and what else has a say.
    pub(crate) others: Others,
    /// What it carries its load with.
    pub(crate) gripper: Gripper,
    /// How many motors have failed.
    pub(crate) motors_lost: u8,
    /// Whether a landing is blocked above the ground.
    pub(crate) site_blocked: bool,
    /// At this height above the ground and below, the target of a landing is not seen.
    pub(crate) target_hidden_below_m: f64,
    lands_on_target: bool,
    /// What the land detector reports, whatever is true.
    pub(crate) detector_stuck: Option<bool>,
    /// How much the frame shakes, m/s2.
    pub(crate) vibration_m_s2: f64,
    /// By how much the heading of the position estimate is off.
    pub(crate) heading_error_rad: f64,
    /// How far from the position that it is sent the autopilot steers for.
    pub(crate) steering_error: Vector3<f64>,
    /// It flies no faster over ground, whatever it is asked for.
    pub(crate) slow_m_s: Option<f64>,
    /// Until when the ground station is not heard.
    pub(crate) link_lost_until: Time,
    gusts: Noise,
    crashed: bool,
    arming: Arming,
    intended: Mode,
    failsafe: bool,
    pilot: Pilot,
    controller: Controller,
    liftoff: Liftoff,
    land_detector: LandDetector,
}

impl Vehicle {
    /// Disarmed at the origin, with a full battery.
    pub(crate) fn new(config: Config, pace: Pace, seed: u64) -> Vehicle {
        Vehicle {
            clock: Time::ZERO,
            body: Multirotor::new(config.airframe.clone()),
            battery: Battery::new(config.battery.clone()),
            estimator: Estimator::new(config.estimator.clone(), seed),
            wind: Wind::default(),
            offboard: Offboard::new(pace.limit(config.offboard_loss_s.seconds())),
            boot: Boot::new(),
            others: Others::default(),
            gripper: Gripper::new(config.gripper.holds_load, config.gripper.opens_in_s.seconds()),
            motors_lost: 0,
            site_blocked: false,
            target_hidden_below_m: 0.0,
            lands_on_target: false,
            detector_stuck: None,
            vibration_m_s2: 0.0,
            heading_error_rad: 0.0,
            steering_error: Vector3::zeros(),
            slow_m_s: None,
            link_lost_until: Time::ZERO,
            gusts: Noise::new(seed, NoiseStream::Wind),
            crashed: false,
            arming: Arming::new(pace.limit(config.preflight_disarm_s.seconds()), config.landed_disarm_s.seconds()),
            intended: Mode::Loiter,
            failsafe: false,
            pilot: Pilot::new(),
            controller: Controller::default(),
            liftoff: Liftoff::Off,
            land_detector: LandDetector::Landed,
            config,
        }
    }

    /// Advances the physics to `now`.
    pub(crate) fn advance(&mut self, now: Time) {
        while self.clock < now {
            if self.is_parked() {
                self.rest((now - self.clock).min(REST_STEP));
            } else if self.clock + STEP <= now {
                self.step();
            } else {
                break;
            }
        }
    }

    /// Accepts a command, or returns why not.
    pub(crate) fn command(&mut self, command: Command, now: Time) -> Result<(), Refusal> {
        let command = self.boot.command(command);
        let arms = command == Command::Arm && !self.arming.is_armed();
        if let (true, Some(why)) = (arms, &self.others.not_ready) {
            return Err(Refusal::NotReady(why.clone()));
        }
        judge(command, &self.situation(now))?;
        if arms && self.others.has_chosen() {
            // As the bridges to real autopilots do: armed in a pilot's mode it would be the pilot's.
            self.intended = Mode::Loiter;
        }
        if command.mode().is_some() || arms {
            self.others.commanded();
            self.lands_on_target = command == Command::LandOnTarget;
        }
        match command {
            Command::Arm => self.arming.arm(now),
            Command::Disarm => self.disarm(),
            Command::Takeoff { height_m } => self.intended = Mode::Takeoff { height_m },
            Command::Land | Command::LandOnTarget => self.intended = Mode::Land,
            Command::Loiter => self.intended = Mode::Loiter,
            Command::Offboard => self.intended = Mode::Offboard,
            Command::Release => self.gripper.release(now),
        }
        self.review(now);
        Ok(())
    }

    /// Decides which mode flies: the intended one, unless a failsafe demands another.
    ///
    /// Called once everything that arrived together was taken in, so that setpoints that waited in
    /// a queue count before they are missed.
    pub(crate) fn review(&mut self, now: Time) {
        // Setpoints that are missed end no other failsafe: PX4 takes the most severe action.
        let misses = || pre_empt(self.intended, self.offboard_lost(now));
        let other = self.failsafe_of_its_own().or_else(misses).filter(|_| self.arming.is_armed());
        self.failsafe = other.is_some();
        self.pilot.set_mode(other.unwrap_or(self.intended), &self.estimate());
    }

    /// Somebody else sets the mode, on a vehicle in any state.
    pub(crate) fn taken_over(&mut self, mode: Mode, now: Time) {
        self.others.choose();
        self.intended = mode;
        self.review(now);
    }

    /// The autopilot starts again: it forgets what it was asked for, takes where it is for its origin, and says nothing for a while. An
    /// armed one that `holds` loiters then; otherwise its motors are off.
    pub(crate) fn restart(&mut self, holds: bool, now: Time) {
        self.boot.again(self.estimate().position, now);
        self.others.commanded();
        self.offboard.forget();
        self.intended = Mode::Loiter;
        if !holds {
            self.disarm();
        }
        self.review(now);
    }

    /// Why it flies something else than was asked for, or would not arm; empty if neither is so.
    pub(crate) fn reason(&self, now: Time) -> String {
        let unfit = || self.situation(now).unfit.map(|it| it.to_string());
        let in_words = |cause: Option<FailsafeCause>| cause.map(|it| it.to_string());
        let other = || self.others.why().map(str::to_owned);
        let missed = || in_words(self.offboard_lost(now));
        let flies = || in_words(self.worst_cause()).or_else(other).or_else(missed).filter(|_| self.failsafe);
        let waits = || self.others.not_ready.clone().or_else(unfit);
        if self.arming.is_armed() { flies() } else { waits() }.unwrap_or_default()
    }

    /// Whether its sensor sees the target below, while it lands on one: it sees one wherever that is, unless it is hidden.
    pub(crate) fn landing_target_seen(&self) -> Option<bool> {
        let height_m = self.body.ground.down_m(self.body.position) - self.body.position.z;
        let lands = self.lands_on_target && self.actual() == Mode::Land && !self.land_detector.landed();
        lands.then_some(self.target_hidden_below_m < height_m)
    }

    /// Why a failsafe flies, if one does.
    pub(crate) fn failsafe_reason(&self) -> Option<FailsafeReason> {
        let is_other = self.failsafe_of_its_own().is_some();
        self.failsafe.then_some(if is_other { FailsafeReason::Other } else { FailsafeReason::Setpoints })
    }

    /// The mode that it flies in place of the intended one, whether or not setpoints are missed.
    fn failsafe_of_its_own(&self) -> Option<Mode> {
        pre_empt(self.intended, self.worst_cause()).or(self.others.failsafe())
    }

    /// Whether it would arm now.
    pub(crate) fn can_arm(&self, now: Time) -> bool {
        self.arming.is_armed() || (self.others.not_ready.is_none() && self.situation(now).unfit.is_none())
    }

    /// Repairs motors and body.
    pub(crate) fn repair(&mut self) {
        self.motors_lost = 0;
        self.crashed = false;
    }

    /// The autopilot's estimate of the state.
    pub(crate) fn estimate(&self) -> Estimate {
        self.estimator.estimate(&self.body)
    }

    /// The state of the land detector.
    pub(crate) fn land_detector(&self) -> LandDetector {
        self.land_detector
    }

    /// Whether the motors may turn.
    pub(crate) fn is_armed(&self) -> bool {
        self.arming.is_armed()
    }

    /// The intended mode.
    pub(crate) fn intended(&self) -> Mode {
        self.intended
    }

    /// The actual mode.
    pub(crate) fn actual(&self) -> Mode {
        self.pilot.mode()
    }

    /// Whether a failsafe flies in place of the intended mode.
    pub(crate) fn failsafe(&self) -> bool {
        self.failsafe
    }

    /// The failures that it reports.
    pub(crate) fn failures(&self, now: Time) -> Vec<Failure> {
        let estimate = self.estimate();
        let failures = [
            (self.arming.is_armed() && self.offboard_lost(now).is_some(), Failure::OffboardSignalLost),
            (self.estimator.faults.gnss_lost, Failure::GnssLost),
            (!estimate.horizontal_valid || !estimate.vertical_valid, Failure::Estimator),
            (self.motors_lost > 0 || self.crashed, Failure::Motor),
            (self.battery.is_critical(), Failure::Battery),
            (now < self.link_lost_until, Failure::GroundLinkLost),
        ];
        failures.into_iter().filter_map(|(holds, failure)| holds.then_some(failure)).collect()
    }

    fn situation(&self, now: Time) -> Situation {
        let phase = match (self.arming.is_armed(), self.land_detector.landed()) {
            (false, _) => Phase::Disarmed,
            (true, true) => Phase::OnGround,
            (true, false) => Phase::InAir,
        };
        // Dead reckoning may end a flight for a few seconds, but no flight starts on it.
        let blind = phase != Phase::InAir && self.estimator.faults.gnss_lost;
        Situation {
            phase,
            height_m: -self.estimate().position.z,
            setpoints: self.offboard.is_alive(now),
            unfit: self.worst_cause().max(blind.then_some(FailsafeCause::PositionLost)),
        }
    }

    fn worst_cause(&self) -> Option<FailsafeCause> {
        let causes = [
            (self.battery.is_emergency(), FailsafeCause::BatteryEmergency),
            (self.motors_lost > 0, FailsafeCause::MotorFailed),
            (!self.estimate().horizontal_valid, FailsafeCause::PositionLost),
            (self.crashed, FailsafeCause::Crashed),
        ];
        causes.into_iter().filter_map(|(holds, cause)| holds.then_some(cause)).max()
    }

    fn offboard_lost(&self, now: Time) -> Option<FailsafeCause> {
        (self.intended == Mode::Offboard && !self.offboard.is_alive(now)).then_some(FailsafeCause::OffboardLost)
    }

    /// Whether nothing on it moves.
    fn is_parked(&self) -> bool {
        !self.arming.is_armed() && self.body.standing && self.land_detector.landed()
    }

    fn rest(&mut self, time: Duration) {
        self.clock = self.clock + time;
        self.gripper.step(self.clock);
        self.wind.rest(time.as_secs_f64());
        self.estimator.step(time.as_secs_f64());
        self.battery.step(self.battery.idle_power_w(), time.as_secs_f64());
    }

    fn step(&mut self) {
        let dt_s = STEP.as_secs_f64();
        self.clock = self.clock + STEP;
        self.gripper.step(self.clock);
        let wind = self.wind.step(&mut self.gusts, dt_s);
        self.estimator.step(dt_s);
        let controls = self.controls(dt_s);
        let impact_m_s = self.body.step(&controls, self.motors(), wind, dt_s);
        self.land_detector = self.land_detector.on(self.body.standing, self.body.thrust_m_s2, self.clock);
        self.drain(dt_s, (wind - self.body.velocity).norm());
        if impact_m_s.is_some_and(|it| it > CRASH_M_S) {
            self.crashed = true;
            self.land_detector = LandDetector::Landed;
            self.disarm();
        }
        let ramping = matches!(self.liftoff, Liftoff::Ramp { .. });
        // An autopilot whose detector has not noticed the landing does not disarm by itself.
        let seems_landed = self.land_detector.landed() && self.detector_stuck != Some(false);
        if self.arming.on(seems_landed, ramping, self.clock) {
            self.disarm();
        }
    }

    fn controls(&mut self, dt_s: f64) -> Controls {
        let estimate = self.estimate();
        let limits = &self.config.limits;
        if self.pilot.finish_takeoff(&estimate) {
            self.intended = Mode::Loiter;
        }
        let setpoint = self.offboard.followed();
        let signals = Signals {
            armed: self.arming.is_armed(),
            climb: self.pilot.demands_climb(&estimate, setpoint),
            landed: self.land_detector.landed(),
        };
        self.liftoff = self.liftoff.on(signals, self.clock, limits);
        if !self.liftoff.lifts() {
            self.controller.reset();
            return Controls::IDLE;
        }
        let blocked_height_m = || self.config.blocked_site_height_m.get() - self.body.ground.down_m(self.body.position);
        let blocked_below_m = self.site_blocked.then(blocked_height_m);
        let input = PilotInput { setpoint, blocked_below_m, steering_error: self.steering_error };
        let mut demand = self.pilot.demand(&estimate, &input, limits, dt_s);
        demand.velocity.z = demand.velocity.z.max(-self.liftoff.climb_limit_m_s(self.clock, limits));
        let speed_m_s = horizontal(demand.velocity).norm();
        if let Some(slow_m_s) = self.slow_m_s.filter(|slow_m_s| *slow_m_s < speed_m_s) {
            demand.velocity.x *= slow_m_s / speed_m_s;
            demand.velocity.y *= slow_m_s / speed_m_s;
        }
        self.controller.controls(&demand, estimate.velocity, self.body.heading_rad(), limits, dt_s)
    }

    fn drain(&mut self, dt_s: f64, airspeed_m_s: f64) {
        let drag_w = self.config.airframe.mass_kg.get() * self.body.drag_m_s2.norm() * airspeed_m_s;
        let power_w = self.battery.flight_power_w(self.body.thrust_m_s2 / GRAVITY_M_S2, drag_w);
        self.battery.step(power_w, dt_s);
    }

    fn motors(&self) -> Motors {
        match self.motors_lost {
            _ if self.battery.is_empty() || self.crashed => Motors::NoThrust,
            0 => Motors::Working,
            1 => Motors::OneLost,
            2.. => Motors::NoThrust,
        }
    }

    /// Stops the motors, wherever it is.
    ///
    /// PX4 returns to the mode before the landing, which after an offboard flight is offboard, and
    /// then refuses to arm until another mode is set. Here it is always loiter.
    pub(crate) fn disarm(&mut self) {
        self.arming.disarm();
        self.intended = Mode::Loiter;
        self.failsafe = false;
        self.pilot.set_mode(Mode::Loiter, &self.estimate());
        self.liftoff = Liftoff::Off;
        self.body.thrust_m_s2 = 0.0;
    }
}
