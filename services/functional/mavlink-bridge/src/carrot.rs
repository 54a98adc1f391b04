//! A target that moves along the line to its end at a wanted speed, since neither autopilot has a speed limit that holds for setpoints.
//!
//! It gains and loses speed gradually, does not run away from a vehicle that stays behind, and says if the vehicle does not follow at
//! all: an autopilot swallows setpoints beyond its fence without a word.

use std::time::Duration;

use domain::time::Time;

use crate::heard::LocalPosition;
use crate::vector::{difference, dot, length};

/// A moving target.
#[derive(Debug, Clone)]
pub(crate) struct Carrot {
    position: [f64; 3],
    velocity: [f64; 3],
    at: Time,
    behind: Option<Behind>,
}

/// The vehicle is too far from the target, and does not come nearer.
#[derive(Debug, Clone, Copy)]
struct Behind {
    since: Time,
    nearest_m: f64,
}

/// Where to and how fast.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Aim {
    /// The end.
    pub(crate) end: [f64; 3],
    /// No faster than this.
    pub(crate) speed_m_s: f64,
    /// How fast the speed changes.
    pub(crate) acceleration_m_s2: f64,
    /// How far the vehicle may be behind: seconds of the target's speed, and of its own: one that moves cannot turn at once.
    pub(crate) lag: Duration,
}

/// Farther behind than the lag allows by this, the vehicle is not following. (ENG: gusts and overshoot.)
const MARGIN_M: f64 = 3.0;
/// One that has come nearer by this follows. (ENG: more than a position that is held varies.)
const NEARER_M: f64 = 0.5;
/// A pause of the setpoints that is longer is no motion.
const LONGEST_STEP_S: f64 = 0.5;

impl Carrot {
    /// It begins where the vehicle is, and moves as it does: a target that begins at rest would be overtaken.
    pub(crate) fn new(vehicle: &LocalPosition, now: Time) -> Carrot {
        Carrot { position: vehicle.position, velocity: vehicle.velocity, at: now, behind: None }
    }

    /// Moves on towards `aim`; `vehicle` is where the vehicle is, if that is known. Returns position and velocity.
    pub(crate) fn advance(&mut self, aim: &Aim, vehicle: Option<&LocalPosition>, now: Time) -> ([f64; 3], [f64; 3]) {
        let dt_s = (now - self.at).as_secs_f64().min(LONGEST_STEP_S);
        self.at = now;
        let way = difference(aim.end, self.position);
        let left_m = length(way);
        let direction = if left_m <= 1e-6 { [0.0; 3] } else { way.map(|it| it / left_m) };
        // What it moves by beside the way to the end is lost in the turn.
        let speed_m_s = dot(self.velocity, direction).max(0.0);
        self.watch(aim, direction, vehicle, now);
        if left_m <= 1e-6 {
            (self.position, self.velocity) = (aim.end, [0.0; 3]);
            return (self.position, self.velocity);
        }
        let braking_m_s = (2.0 * aim.acceleration_m_s2 * left_m).sqrt();
        let wanted_m_s = if self.behind.is_some() { 0.0 } else { aim.speed_m_s.min(braking_m_s) };
        let change = aim.acceleration_m_s2 * dt_s;
        let speed_m_s = (speed_m_s + (wanted_m_s - speed_m_s).clamp(-2.0 * change, change)).min(braking_m_s);
        let step_m = (speed_m_s * dt_s).min(left_m);
        self.position = std::array::from_fn(|i| self.position[i] + direction[i] * step_m);
        self.velocity = direction.map(|it| it * speed_m_s);
        (self.position, self.velocity)
    }

    /// Looks whether the vehicle follows. One that is ahead on the way does.
    fn watch(&mut self, aim: &Aim, direction: [f64; 3], vehicle: Option<&LocalPosition>, now: Time) {
        let Some(vehicle) = vehicle else {
            self.behind = None;
            return;
        };
        let apart = difference(self.position, vehicle.position);
        let ahead_m = dot(apart, direction).min(0.0);
        let behind_m = length(std::array::from_fn(|i| apart[i] - direction[i] * ahead_m));
        let allowed_m = (length(self.velocity) + length(vehicle.velocity)) * aim.lag.as_secs_f64() + MARGIN_M;
        self.behind = (allowed_m < behind_m).then_some(match self.behind {
            Some(it) if it.nearest_m - NEARER_M < behind_m => it,
            _ => Behind { since: now, nearest_m: behind_m },
        });
    }

    /// Whether the vehicle has not followed for `limit`.
    pub(crate) fn is_unflown(&self, limit: Duration, now: Time) -> bool {
        self.behind.is_some_and(|it| limit <= now - it.since)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AIM: Aim =
        Aim { end: [0.0, 30.0, -10.0], speed_m_s: 2.0, acceleration_m_s2: 2.0, lag: Duration::from_millis(2_500) };

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    fn resting(north_m: f64, east_m: f64) -> LocalPosition {
        LocalPosition { boot_ms: 0, position: [north_m, east_m, -10.0], velocity: [0.0; 3] }
    }

    #[test]
    fn it_moves_at_the_wanted_speed_and_ends_at_its_end() {
        let mut carrot = Carrot::new(&resting(0.0, 0.0), at(0));
        let mut fastest: f64 = 0.0;
        for step in 1..400 {
            let vehicle = LocalPosition { boot_ms: 0, position: carrot.position, velocity: carrot.velocity };
            let (position, velocity) = carrot.advance(&AIM, Some(&vehicle), at(step * 50));
            fastest = fastest.max(length(velocity));
            assert!(position[0] == 0.0 && position[1] <= 30.0 && (position[2] + 10.0).abs() < 1e-9);
        }
        assert!((fastest - 2.0).abs() < 1e-9, "{fastest}");
        assert_eq!(carrot.advance(&AIM, None, at(20_050)), (AIM.end, [0.0; 3]));
    }

    #[test]
    fn it_waits_for_a_vehicle_that_does_not_follow_and_says_so() {
        let mut carrot = Carrot::new(&resting(0.0, 0.0), at(0));
        for step in 1..400 {
            carrot.advance(&AIM, Some(&resting(0.0, 0.0)), at(step * 50));
        }
        assert!(carrot.position[1] < 10.0, "{carrot:?}");
        assert!(carrot.is_unflown(Duration::from_secs(3), at(20_000)));
    }

    #[test]
    fn it_takes_over_the_motion_of_a_vehicle_that_is_on_its_way() {
        let moving = LocalPosition { velocity: [0.0, 2.0, 0.0], ..resting(0.0, 0.0) };
        let mut carrot = Carrot::new(&moving, at(0));
        let (position, velocity) = carrot.advance(&AIM, Some(&moving), at(50));
        assert_eq!((position, velocity), ([0.0, 0.1, -10.0], [0.0, 2.0, 0.0]));
        // Where it is to turn round it begins at rest.
        let back = Aim { end: [0.0, -30.0, -10.0], ..AIM };
        let (_, velocity) = Carrot::new(&moving, at(0)).advance(&back, Some(&moving), at(50));
        assert!((velocity[1] + 0.1).abs() < 1e-9, "{velocity:?}");
    }

    #[test]
    fn a_vehicle_that_overshoots_and_comes_back_follows() {
        let mut carrot = Carrot::new(&resting(0.0, 0.0), at(0));
        let limit = Duration::from_secs(3);
        for step in 1..160 {
            // It brakes from 10 m/s, turns 12.5 m away, and comes back.
            let s = step as f64 * 0.05;
            let overshoot_m = (10.0 * s - 2.0 * s * s).max(0.0);
            let velocity = [10.0 - 4.0 * s, 0.0, 0.0];
            let beside = LocalPosition { velocity, ..resting(overshoot_m, 0.0) };
            carrot.advance(&AIM, Some(&beside), at(step * 50));
            assert!(!carrot.is_unflown(limit, at(step * 50)), "{s} s");
        }
        let ahead = resting(0.0, carrot.position[1] + 20.0);
        carrot.advance(&AIM, Some(&ahead), at(8_050));
        assert!(carrot.behind.is_none(), "{carrot:?}");
    }

    #[test]
    fn a_pause_is_no_leap() {
        let moving = LocalPosition { velocity: [0.0, 2.0, 0.0], ..resting(0.0, 0.0) };
        let (position, _) = Carrot::new(&moving, at(0)).advance(&AIM, None, at(10_000));
        assert!(position[1] <= 1.01, "{position:?}");
    }
}
