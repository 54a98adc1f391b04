//! What each flight mode demands of the vehicle at any moment: a velocity and a heading.

use domain::fmu::Setpoint;
use nalgebra::Vector3;

use crate::config::Limits;
use crate::controller::VelocityDemand;
use crate::estimator::Estimate;
use crate::frame::{horizontal, ned, vector, velocity_vector, wrapped};
use crate::guidance::{towards, within_limits};

/// Slower than this the vehicle has come to rest, and the mode holds that position.
const AT_REST_M_S: f64 = 0.5;
/// A takeoff is over when it is this close to its height, and slower than that.
const REACHED_M: f64 = 0.3;
const REACHED_M_S: f64 = 0.5;
/// This near over the origin a return begins its descent.
const OVER_HOME_M: f64 = 2.0;
/// How fast a pilot flies.
const MANUAL_M_S: f64 = 1.0;

/// A flight mode, intended or actual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Mode {
    /// Come to rest and stay.
    Loiter,
    /// Climb straight up, then loiter there.
    Takeoff {
        /// Height above the origin at which the climb ends.
        height_m: f64,
    },
    /// Come to rest over ground, and descend.
    Land,
    /// Follow the setpoints.
    Offboard,
    /// Fly over the origin at the present height, and land there: only as a failsafe, or by somebody else.
    Return,
    /// A mode that has no name in `fmu/`, in which a pilot flies slowly north.
    Manual,
    /// Stay level and descend without a position: only as a failsafe.
    Descend,
}

/// The actual mode with its memory.
#[derive(Debug, Clone)]
pub(crate) struct Pilot {
    mode: Mode,
    /// The position to hold: known once the vehicle has come to rest.
    hold: Option<Vector3<f64>>,
    heading_rad: f64,
}

/// What a mode depends on besides the estimate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PilotInput {
    /// The offboard setpoint to follow.
    pub(crate) setpoint: Option<Setpoint>,
    /// A landing cannot get below this height while the site is blocked.
    pub(crate) blocked_below_m: Option<f64>,
    /// How far from a position setpoint it steers for.
    pub(crate) steering_error: Vector3<f64>,
}

impl Pilot {
    /// On the ground, in loiter.
    pub(crate) fn new() -> Pilot {
        Pilot { mode: Mode::Loiter, hold: None, heading_rad: 0.0 }
    }

    /// The actual mode.
    pub(crate) fn mode(&self) -> Mode {
        self.mode
    }

    /// Flies `mode` from `estimate` on. Setting the actual mode again changes nothing.
    pub(crate) fn set_mode(&mut self, mode: Mode, estimate: &Estimate) {
        if mode != self.mode {
            self.hold = match mode {
                Mode::Takeoff { .. } => Some(estimate.position),
                Mode::Return => Some(Vector3::new(0.0, 0.0, estimate.position.z)),
                Mode::Loiter | Mode::Land | Mode::Offboard | Mode::Manual | Mode::Descend => None,
            };
            self.mode = mode;
        }
    }

    /// Changes from takeoff to loiter once the height is reached; returns whether it did.
    pub(crate) fn finish_takeoff(&mut self, estimate: &Estimate) -> bool {
        let Mode::Takeoff { height_m } = self.mode else { return false };
        let reached = (height_m + estimate.position.z).abs() < REACHED_M && estimate.velocity.z.abs() < REACHED_M_S;
        if reached {
            self.mode = Mode::Loiter;
            self.hold = self.hold.map(|it| Vector3::new(it.x, it.y, -height_m));
        }
        reached
    }

    /// Whether the mode demands a climb, which makes a vehicle on the ground lift off.
    pub(crate) fn demands_climb(&self, estimate: &Estimate, setpoint: Option<Setpoint>) -> bool {
        match (self.mode, setpoint) {
            (Mode::Takeoff { .. }, _) => true,
            (Mode::Offboard, Some(Setpoint::Position { target, .. })) => {
                target.down_m < estimate.position.z - REACHED_M
            }
            (Mode::Offboard, Some(Setpoint::Velocity { velocity, .. })) => velocity.climb_rate_m_s() > 0.0,
            (Mode::Offboard, None) | (Mode::Loiter | Mode::Land | Mode::Return | Mode::Manual | Mode::Descend, _) => {
                false
            }
        }
    }

    /// What the mode demands now, `dt_s` after the last call.
    pub(crate) fn demand(
        &mut self,
        estimate: &Estimate,
        input: &PilotInput,
        limits: &Limits,
        dt_s: f64,
    ) -> VelocityDemand {
        let velocity = match (self.mode, input.setpoint) {
            (Mode::Loiter | Mode::Offboard, None) | (Mode::Loiter, Some(_)) => self.stay(estimate, limits),
            (Mode::Takeoff { height_m }, _) => {
                let over = self.hold.unwrap_or(estimate.position);
                let target = Vector3::new(over.x, over.y, -height_m);
                let velocity = towards(estimate.position, target, limits.cruise_m_s.get(), limits);
                Vector3::new(velocity.x, velocity.y, velocity.z.max(-limits.takeoff_m_s.get()))
            }
            (Mode::Land, _) => {
                horizontal(self.stay(estimate, limits)) + Vector3::z() * sink_m_s(estimate, input, limits)
            }
            (Mode::Return, _) => {
                let over = self.hold.unwrap_or(estimate.position);
                let way = towards(estimate.position, over, limits.cruise_m_s.get(), limits);
                let is_over = horizontal(over - estimate.position).norm() < OVER_HOME_M;
                let sink_m_s = if is_over { sink_m_s(estimate, input, limits) } else { 0.0 };
                horizontal(way) + Vector3::z() * sink_m_s
            }
            (Mode::Manual, _) => Vector3::x() * MANUAL_M_S,
            (Mode::Descend, _) => Vector3::z() * clear_sink_m_s(estimate, limits),
            (Mode::Offboard, Some(setpoint)) => {
                let beside = Estimate { position: estimate.position - input.steering_error, ..*estimate };
                self.follow(setpoint, &beside, limits, dt_s)
            }
        };
        VelocityDemand { velocity, heading_rad: self.heading_rad, level: self.mode == Mode::Descend }
    }

    /// Brakes first, then holds the position where the vehicle came to rest: holding at once would
    /// fly back.
    fn stay(&mut self, estimate: &Estimate, limits: &Limits) -> Vector3<f64> {
        if self.hold.is_none() && estimate.velocity.norm() < AT_REST_M_S {
            self.hold = Some(estimate.position);
        }
        match self.hold {
            Some(position) => towards(estimate.position, position, limits.cruise_m_s.get(), limits),
            None => Vector3::zeros(),
        }
    }

    fn follow(&mut self, setpoint: Setpoint, estimate: &Estimate, limits: &Limits, dt_s: f64) -> Vector3<f64> {
        match setpoint {
            Setpoint::Position { target, speed_limit_m_s, yaw_rad } => {
                self.heading_rad = yaw_rad.unwrap_or(self.heading_rad);
                let speed_limit_m_s = speed_limit_m_s.unwrap_or(f64::INFINITY);
                towards(estimate.position, vector(target), speed_limit_m_s, limits)
            }
            Setpoint::Velocity { velocity, yaw_rate_rad_s } => {
                let turn_limit = limits.turn_deg_s.get().to_radians();
                let turn_rate = yaw_rate_rad_s.unwrap_or(0.0).clamp(-turn_limit, turn_limit);
                self.heading_rad = wrapped(self.heading_rad + turn_rate * dt_s);
                within_limits(velocity_vector(velocity), limits)
            }
        }
    }
}

/// How fast a landing descends: slower and slower, and not at all above a blocked site.
fn sink_m_s(estimate: &Estimate, input: &PilotInput, limits: &Limits) -> f64 {
    let clear = clear_sink_m_s(estimate, limits);
    let Some(height_m) = input.blocked_below_m else { return clear };
    let above = Vector3::new(estimate.position.x, estimate.position.y, -height_m);
    towards(estimate.position, above, clear, limits).z
}

/// How fast to descend at this height when nothing is in the way.
fn clear_sink_m_s(estimate: &Estimate, limits: &Limits) -> f64 {
    let (slow, fast) = (limits.land_m_s.get(), limits.descend_m_s.get());
    let (low, high) = (limits.land_slow_below_m.get(), limits.land_slow_from_m.get());
    let height_m = ned(estimate.position).height_m();
    slow + (fast - slow) * ((height_m - low) / (high - low).max(0.1)).clamp(0.0, 1.0)
}
