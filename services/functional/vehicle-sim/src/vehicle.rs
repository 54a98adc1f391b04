//! The vehicle as a whole: body, autopilot and battery, stepped together through mission time.
//!
//! It is told commands, setpoints and troubles, and can be looked at. It sends nothing: see
//! [`crate::telemetry`] and [`crate::publisher`].

use std::time::Duration;

use domain::time::{Pace, Time};
use kittiwake_proto::v1;

use crate::arming::Arming;
use crate::battery::Battery;
use crate::commander::{Command, Phase, Refusal, Situation, judge};
use crate::config::Config;
use crate::controller::Controller;
use crate::estimator::{Estimate, Estimator};
use crate::failsafe::{Condition, pre_empt};
use crate::land_detector::LandDetector;
use crate::liftoff::{Liftoff, Signals};
use crate::multirotor::{Controls, GRAVITY_M_S2, Motors, Multirotor};
use crate::noise::{Noise, Use};
use crate::offboard::Offboard;
use crate::pilot::{Mode, Pilot, Surroundings};
use crate::wind::Wind;

/// The step of the physics: PX4's position controller runs at the same 250 Hz.
const STEP: Duration = Duration::from_millis(4);
/// At rest on the ground, with nothing to fly, longer steps do.
const REST_STEP: Duration = Duration::from_millis(100);
/// Meeting the ground faster than this breaks the vehicle.
const CRASH_M_S: f64 = 4.0;

/// Body, autopilot and battery.
#[derive(Debug)]
pub struct Vehicle {
    config: Config,
    clock: Time,
    /// The true state.
    pub body: Multirotor,
    /// What it flies on.
    pub battery: Battery,
    /// Where it believes to be.
    pub estimator: Estimator,
    /// The air about it.
    pub wind: Wind,
    /// What comes from whoever flies it.
    pub offboard: Offboard,
    /// Motors that have failed.
    pub motors_lost: u8,
    /// Whether the ground below is blocked.
    pub site_blocked: bool,
    /// Until when the ground station is not heard.
    pub link_lost_until: Time,
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
    pub fn new(config: Config, pace: Pace, seed: u64) -> Vehicle {
        Vehicle {
            clock: Time::ZERO,
            body: Multirotor::new(config.airframe.clone()),
            battery: Battery::new(config.battery.clone()),
            estimator: Estimator::new(config.estimator.clone(), seed),
            wind: Wind::default(),
            offboard: Offboard::new(pace.limit(config.offboard_loss_s.seconds())),
            motors_lost: 0,
            site_blocked: false,
            link_lost_until: Time::ZERO,
            gusts: Noise::new(seed, Use::Wind),
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

    /// Brings the physics up to `now`.
    pub fn advance(&mut self, now: Time) {
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

    /// Takes a command, or says why not.
    pub fn command(&mut self, command: Command, now: Time) -> Result<(), Refusal> {
        judge(command, &self.situation(now))?;
        match command {
            Command::Arm => self.arming.arm(now),
            Command::Disarm => self.disarm(),
            Command::Takeoff { altitude_m } => self.intended = Mode::Takeoff { altitude_m },
            Command::Land => self.intended = Mode::Land,
            Command::Loiter => self.intended = Mode::Loiter,
            Command::Offboard => self.intended = Mode::Offboard,
        }
        self.review(now);
        Ok(())
    }

    /// Decides which mode flies: the intended one, unless a failsafe demands another.
    ///
    /// Called once all that arrived together has been taken in, so that setpoints that waited in
    /// a queue count before they are missed.
    pub fn review(&mut self, now: Time) {
        let condition = self.worst_failure().max(self.offboard_lost(now));
        let other = if self.arming.is_armed() { pre_empt(self.intended, condition) } else { None };
        self.failsafe = other.is_some();
        self.pilot.set_mode(other.unwrap_or(self.intended), &self.estimate());
    }

    /// Makes the body whole again.
    pub fn repair(&mut self) {
        self.motors_lost = 0;
        self.crashed = false;
    }

    /// What the autopilot believes.
    pub fn estimate(&self) -> Estimate {
        self.estimator.estimate(&self.body)
    }

    /// What the land detector says.
    pub fn land_detector(&self) -> LandDetector {
        self.land_detector
    }

    /// Whether the motors may turn.
    pub fn is_armed(&self) -> bool {
        self.arming.is_armed()
    }

    /// The mode that was asked for.
    pub fn intended(&self) -> Mode {
        self.intended
    }

    /// The mode that is flown.
    pub fn actual(&self) -> Mode {
        self.pilot.mode()
    }

    /// Whether a failsafe flies in place of the intended mode.
    pub fn failsafe(&self) -> bool {
        self.failsafe
    }

    /// The failure flags that are up.
    pub fn failures(&self, now: Time) -> Vec<v1::FailureFlag> {
        use v1::FailureFlag as F;
        let estimate = self.estimate();
        let flags = [
            (self.arming.is_armed() && self.offboard_lost(now).is_some(), F::OffboardSignalLost),
            (self.estimator.trouble.gnss_lost, F::GnssLost),
            (!estimate.horizontal_valid || !estimate.vertical_valid, F::Estimator),
            (self.motors_lost > 0 || self.crashed, F::Motor),
            (self.battery.is_critical(), F::Battery),
            (now < self.link_lost_until, F::GroundLinkLost),
        ];
        flags.into_iter().filter_map(|(up, flag)| up.then_some(flag)).collect()
    }

    fn situation(&self, now: Time) -> Situation {
        let phase = match (self.arming.is_armed(), self.land_detector.landed()) {
            (false, _) => Phase::Disarmed,
            (true, true) => Phase::OnGround,
            (true, false) => Phase::InAir,
        };
        // Dead reckoning may finish a flight for a few seconds, but it is nothing to start one with.
        let blind = phase != Phase::InAir && self.estimator.trouble.gnss_lost;
        Situation {
            phase,
            height_m: -self.estimate().position.z,
            setpoints: self.offboard.is_alive(now),
            unfit: self.worst_failure().max(blind.then_some(Condition::PositionLost)),
        }
    }

    fn worst_failure(&self) -> Option<Condition> {
        let conditions = [
            (self.battery.is_emergency(), Condition::BatteryEmergency),
            (self.motors_lost > 0, Condition::MotorFailed),
            (!self.estimate().horizontal_valid, Condition::PositionLost),
            (self.crashed, Condition::Crashed),
        ];
        conditions.into_iter().filter_map(|(holds, condition)| holds.then_some(condition)).max()
    }

    fn offboard_lost(&self, now: Time) -> Option<Condition> {
        (self.intended == Mode::Offboard && !self.offboard.is_alive(now)).then_some(Condition::OffboardLost)
    }

    /// Nothing about it moves.
    fn is_parked(&self) -> bool {
        !self.arming.is_armed() && self.body.standing && self.land_detector.landed()
    }

    fn rest(&mut self, time: Duration) {
        self.clock = self.clock + time;
        self.estimator.step(time.as_secs_f64());
        self.battery.step(self.battery.idle_power_w(), time.as_secs_f64());
    }

    fn step(&mut self) {
        let dt_s = STEP.as_secs_f64();
        self.clock = self.clock + STEP;
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
        if self.arming.on(self.land_detector.landed(), ramping, self.clock) {
            self.disarm();
        }
    }

    fn controls(&mut self, dt_s: f64) -> Controls {
        let estimate = self.estimate();
        let limits = &self.config.limits;
        if self.pilot.finish_takeoff(&estimate) {
            self.intended = Mode::Loiter;
        }
        let demand = self.offboard.demand();
        let signals = Signals {
            armed: self.arming.is_armed(),
            upwards: self.pilot.wants_upwards(&estimate, demand),
            landed: self.land_detector.landed(),
        };
        self.liftoff = self.liftoff.on(signals, self.clock, limits);
        if !self.liftoff.lifts() {
            self.controller.reset();
            return Controls::IDLE;
        }
        let blocked_below_m = self.site_blocked.then(|| self.config.blocked_site_height_m.get());
        let mut wanted = self.pilot.wanted(&estimate, &Surroundings { demand, blocked_below_m }, limits, dt_s);
        wanted.velocity.z = wanted.velocity.z.max(-self.liftoff.climb_limit_m_s(self.clock, limits));
        self.controller.controls(&wanted, estimate.velocity, self.body.heading_rad(), limits, dt_s)
    }

    fn drain(&mut self, dt_s: f64, airspeed_m_s: f64) {
        let drag_w = self.config.airframe.mass_kg.get() * self.body.drag_m_s2.norm() * airspeed_m_s;
        let power_w = self.battery.flight_power_w(self.body.thrust_m_s2 / GRAVITY_M_S2, drag_w);
        self.battery.step(power_w, dt_s);
    }

    fn motors(&self) -> Motors {
        match self.motors_lost {
            _ if self.battery.is_empty() || self.crashed => Motors::Dead,
            0 => Motors::Sound,
            1 => Motors::OneLost,
            2.. => Motors::Dead,
        }
    }

    /// PX4 goes back to the mode before the landing, which after an offboard flight is OFFBOARD,
    /// and then refuses to arm until another mode is set. Here it is always LOITER.
    fn disarm(&mut self) {
        self.arming.disarm();
        self.intended = Mode::Loiter;
        self.failsafe = false;
        self.pilot.set_mode(Mode::Loiter, &self.estimate());
        self.liftoff = Liftoff::Off;
        self.body.thrust_m_s2 = 0.0;
    }
}
