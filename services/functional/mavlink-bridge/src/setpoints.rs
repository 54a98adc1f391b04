//! The setpoints of the layers above, as they are passed on to the autopilot.

use std::time::Duration;

use domain::fmu::Setpoint;
use domain::time::Time;

use crate::carrot::{Aim, Carrot};
use crate::config::Config;
use crate::heard::Echo;
use crate::personality::{Following, Personality};
use crate::said::Target;
use crate::sent::Sent;
use crate::vehicle::Vehicle;

/// Whether they are passed on, and what was sent of them.
#[derive(Debug, Default)]
pub(crate) struct Setpoints {
    follows: bool,
    carrot: Option<Carrot>,
    sent: Sent,
    /// It was stopped by a setpoint, and nothing else was sent since.
    is_stopped: bool,
    next_stop: Option<Time>,
}

/// A stop for want of setpoints is sent this often.
const STOP_PERIOD: Duration = Duration::from_millis(500);

impl Setpoints {
    /// From here on they are passed on. Where they are already, the target goes on from where it is.
    pub(crate) fn begin(&mut self) {
        (self.follows, self.is_stopped) = (true, false);
    }

    /// From here on they are not.
    pub(crate) fn end(&mut self) {
        (self.follows, self.carrot) = (false, None);
    }

    /// Whether they are passed on.
    pub(crate) fn are_followed(&self) -> bool {
        self.follows
    }

    /// Whether the vehicle has not flown them for `limit`.
    pub(crate) fn are_unflown(&self, limit: Duration, now: Time) -> bool {
        self.carrot.as_ref().is_some_and(|it| it.is_unflown(limit, now))
    }

    /// Whether the vehicle was stopped by a setpoint that may not have arrived, and nothing else was sent since.
    pub(crate) fn may_miss_stop(&self) -> bool {
        self.is_stopped && self.sent.may_be_lost()
    }

    /// What was sent is followed no more.
    pub(crate) fn forget(&mut self) {
        self.is_stopped = false;
        self.sent.forget();
    }

    /// A mode begins in which the vehicle stands until a setpoint comes, where setpoints stop it.
    pub(crate) fn stands(&mut self, personality: &dyn Personality, now: Time) {
        if let Some(target) = personality.stop() {
            self.sent.note(target, now);
        }
    }

    /// The target to send for a setpoint of the layers above.
    pub(crate) fn follow(
        &mut self,
        setpoint: &Setpoint,
        personality: &dyn Personality,
        vehicle: &Vehicle,
        config: &Config,
        now: Time,
    ) -> Option<Target> {
        if !self.follows {
            return None;
        }
        let following = personality.following(setpoint);
        if following == Following::Direct || matches!(setpoint, Setpoint::Velocity { .. }) {
            self.carrot = None;
        }
        let target = match (setpoint, following) {
            (Setpoint::Position { target, yaw_rad, .. }, Following::Direct) => Target {
                position: Some([target.north_m, target.east_m, target.down_m]),
                velocity: None,
                yaw_rad: *yaw_rad,
                yaw_rate_rad_s: None,
            },
            (
                Setpoint::Position { target, speed_limit_m_s, yaw_rad },
                Following::Carrot { with_velocity, lag, turning_m_s2 },
            ) => {
                let vehicle = vehicle.local_now(now);
                if self.carrot.is_none() {
                    // Without a position there is nowhere to begin.
                    self.carrot = Some(Carrot::new(&vehicle?, now));
                }
                let aim = Aim {
                    end: [target.north_m, target.east_m, target.down_m],
                    speed_m_s: speed_limit_m_s.unwrap_or(f64::INFINITY).min(config.cruise_m_s.get()),
                    climb_m_s: config.climb_m_s.get(),
                    descent_m_s: config.descent_m_s.get(),
                    acceleration_m_s2: config.acceleration_m_s2.get(),
                    vertical_acceleration_m_s2: config.vertical_acceleration_m_s2.get(),
                    turning_m_s2,
                    lag,
                };
                let (position, velocity) = self.carrot.as_mut()?.advance(&aim, vehicle.as_ref(), now);
                let velocity = with_velocity.then_some(velocity);
                Target { position: Some(position), velocity, yaw_rad: *yaw_rad, yaw_rate_rad_s: None }
            }
            (Setpoint::Velocity { velocity, yaw_rate_rad_s }, _) => Target {
                position: None,
                velocity: Some([velocity.north_m_s, velocity.east_m_s, velocity.down_m_s]),
                yaw_rad: None,
                yaw_rate_rad_s: *yaw_rate_rad_s,
            },
        };
        if !target.is_finite() {
            return None;
        }
        self.sent.note(target, now);
        self.is_stopped = false;
        Some(target)
    }

    /// The target that stops the vehicle, where it has no mode for that.
    pub(crate) fn stop(&mut self, personality: &dyn Personality, now: Time) -> Option<Target> {
        let target = personality.stop()?;
        self.sent.note(target, now);
        (self.is_stopped, self.next_stop) = (true, Some(now + STOP_PERIOD));
        Some(target)
    }

    /// Where the autopilot has no failsafe for it: stops a vehicle that follows setpoints once they are lost, and one that was stopped
    /// and `moves_on`, as often as it takes.
    pub(crate) fn stop_if(
        &mut self,
        are_lost: bool,
        moves_on: bool,
        personality: &dyn Personality,
        now: Time,
    ) -> Option<Target> {
        if are_lost {
            self.carrot = None;
        }
        let is_first = are_lost && !self.is_stopped;
        if is_first {
            tracing::warn!("the setpoints have stopped: the vehicle is stopped");
        }
        let is_due = is_first || ((are_lost || moves_on) && self.next_stop.is_none_or(|it| it <= now));
        is_due.then(|| self.stop(personality, now)).flatten()
    }

    /// Whether what the autopilot follows is not ours, again and again.
    pub(crate) fn are_of_somebody_else(&mut self, echo: Echo, now: Time) -> bool {
        self.sent.is_of_somebody_else(echo, now)
    }
}
