//! What each flight mode wants of the vehicle at any moment: a velocity and a heading.

use nalgebra::Vector3;

use crate::config::Limits;
use crate::controller::Wanted;
use crate::estimator::Estimate;
use crate::frame::{horizontal, ned, vector, velocity_vector, wrapped};
use crate::guidance::{towards, within_limits};
use crate::offboard::Demand;

/// Slower than this the vehicle has come to rest, and the place is held from then on.
const AT_REST_M_S: f64 = 0.5;
/// A takeoff is over this close to its height, slower than that.
const REACHED_M: f64 = 0.3;
const REACHED_M_S: f64 = 0.5;

/// A flight mode, intended or flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mode {
    /// Come to rest and stay.
    Loiter,
    /// Climb straight up, then loiter there.
    Takeoff {
        /// To this height above the origin.
        altitude_m: f64,
    },
    /// Come to rest over ground, and down.
    Land,
    /// Follow the setpoints.
    Offboard,
    /// Level and down, without any idea of the position: only as a failsafe.
    Descend,
}

/// Where to stay: known once the vehicle has come to rest.
type Hold = Option<Vector3<f64>>;

/// The flown mode with what it remembers.
#[derive(Debug, Clone)]
pub struct Pilot {
    mode: Mode,
    hold: Hold,
    heading_rad: f64,
}

/// What a mode sees besides the estimate.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings {
    /// The last demand that came in.
    pub demand: Option<Demand>,
    /// Nothing can land below this height, if it is blocked.
    pub blocked_below_m: Option<f64>,
}

impl Pilot {
    /// On the ground, in loiter.
    pub fn new() -> Pilot {
        Pilot { mode: Mode::Loiter, hold: None, heading_rad: 0.0 }
    }

    /// The mode that is flown.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Flies `mode` from `estimate` on. Setting the mode that is flown changes nothing.
    pub fn set_mode(&mut self, mode: Mode, estimate: &Estimate) {
        if mode != self.mode {
            self.hold = match mode {
                Mode::Takeoff { .. } => Some(estimate.position),
                Mode::Loiter | Mode::Land | Mode::Offboard | Mode::Descend => None,
            };
            self.mode = mode;
        }
    }

    /// Goes over into loiter at the height of a takeoff once it is reached; whether it did.
    pub fn finish_takeoff(&mut self, estimate: &Estimate) -> bool {
        let Mode::Takeoff { altitude_m } = self.mode else { return false };
        let reached = (altitude_m + estimate.position.z).abs() < REACHED_M && estimate.velocity.z.abs() < REACHED_M_S;
        if reached {
            self.mode = Mode::Loiter;
            self.hold = self.hold.map(|it| Vector3::new(it.x, it.y, -altitude_m));
        }
        reached
    }

    /// Whether it wants to go up: what makes a vehicle on the ground lift off.
    pub fn wants_upwards(&self, estimate: &Estimate, demand: Option<Demand>) -> bool {
        match (self.mode, demand) {
            (Mode::Takeoff { .. }, _) => true,
            (Mode::Offboard, Some(Demand::Position { target, .. })) => target.down_m < estimate.position.z - REACHED_M,
            (Mode::Offboard, Some(Demand::Velocity { velocity, .. })) => velocity.climb_rate_m_s() > 0.0,
            (Mode::Offboard, None) | (Mode::Loiter | Mode::Land | Mode::Descend, _) => false,
        }
    }

    /// What the mode wants now; `dt_s` since it was asked last.
    pub fn wanted(&mut self, estimate: &Estimate, around: &Surroundings, limits: &Limits, dt_s: f64) -> Wanted {
        let velocity = match (self.mode, around.demand) {
            (Mode::Loiter | Mode::Offboard, None) | (Mode::Loiter, Some(_)) => self.stay(estimate, limits),
            (Mode::Takeoff { altitude_m }, _) => {
                let over = self.hold.unwrap_or(estimate.position);
                let target = Vector3::new(over.x, over.y, -altitude_m);
                let wanted = towards(estimate.position, target, limits.cruise_m_s.get(), limits);
                Vector3::new(wanted.x, wanted.y, wanted.z.max(-limits.takeoff_m_s.get()))
            }
            (Mode::Land, _) => {
                horizontal(self.stay(estimate, limits)) + Vector3::z() * sink_m_s(estimate, around, limits)
            }
            (Mode::Descend, _) => Vector3::z() * clear_sink_m_s(estimate, limits),
            (Mode::Offboard, Some(demand)) => self.follow(demand, estimate, limits, dt_s),
        };
        Wanted { velocity, heading_rad: self.heading_rad, level: self.mode == Mode::Descend }
    }

    /// Brakes first and holds the place where it came to rest: holding at once would fly back.
    fn stay(&mut self, estimate: &Estimate, limits: &Limits) -> Vector3<f64> {
        if self.hold.is_none() && estimate.velocity.norm() < AT_REST_M_S {
            self.hold = Some(estimate.position);
        }
        match self.hold {
            Some(place) => towards(estimate.position, place, limits.cruise_m_s.get(), limits),
            None => Vector3::zeros(),
        }
    }

    fn follow(&mut self, demand: Demand, estimate: &Estimate, limits: &Limits, dt_s: f64) -> Vector3<f64> {
        match demand {
            Demand::Position { target, speed_limit_m_s, yaw_rad } => {
                self.heading_rad = yaw_rad.unwrap_or(self.heading_rad);
                towards(estimate.position, vector(target), speed_limit_m_s, limits)
            }
            Demand::Velocity { velocity, yaw_rate_rad_s } => {
                let turn_limit = limits.turn_deg_s.get().to_radians();
                self.heading_rad = wrapped(self.heading_rad + yaw_rate_rad_s.clamp(-turn_limit, turn_limit) * dt_s);
                within_limits(velocity_vector(velocity), limits)
            }
        }
    }
}

/// How fast a landing goes down: slower and slower, and not at all above a blocked site.
fn sink_m_s(estimate: &Estimate, around: &Surroundings, limits: &Limits) -> f64 {
    let clear = clear_sink_m_s(estimate, limits);
    let Some(height_m) = around.blocked_below_m else { return clear };
    let above = Vector3::new(estimate.position.x, estimate.position.y, -height_m);
    towards(estimate.position, above, clear, limits).z
}

/// How fast to go down at this height when nothing is in the way.
fn clear_sink_m_s(estimate: &Estimate, limits: &Limits) -> f64 {
    let (slow, fast) = (limits.land_m_s.get(), limits.descend_m_s.get());
    let (low, high) = (limits.land_slow_below_m.get(), limits.land_slow_from_m.get());
    let height_m = ned(estimate.position).height_m();
    slow + (fast - slow) * ((height_m - low) / (high - low).max(0.1)).clamp(0.0, 1.0)
}
