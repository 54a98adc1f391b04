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
    /// Since when the vehicle is too far from it without having moved towards it, and where it was then.
    behind: Option<(Time, [f64; 3])>,
}

/// Where to and how fast.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Aim {
    /// The end.
    pub(crate) end: [f64; 3],
    /// No faster than this, nor up and down than these: ArduPilot dives at 5 m/s after a target that does.
    pub(crate) speed_m_s: f64,
    pub(crate) climb_m_s: f64,
    pub(crate) descent_m_s: f64,
    /// How fast the speed changes on the way to the end; up and down it changes more slowly.
    pub(crate) acceleration_m_s2: f64,
    pub(crate) vertical_acceleration_m_s2: f64,
    /// How fast the vehicle can lose the speed that it has in another direction.
    pub(crate) turning_m_s2: f64,
    /// How far the vehicle may be behind: seconds of the target's speed, and of its own: one that moves cannot turn at once.
    pub(crate) lag: Duration,
}

impl Aim {
    fn speed_along_m_s(&self, direction: [f64; 3]) -> f64 {
        let vertical_m_s = if direction[2] < 0.0 { self.climb_m_s } else { self.descent_m_s };
        self.speed_m_s.min(vertical_m_s / direction[2].abs())
    }

    fn acceleration_along_m_s2(&self, direction: [f64; 3]) -> f64 {
        self.acceleration_m_s2.min(self.vertical_acceleration_m_s2 / direction[2].abs())
    }
}

/// Farther behind than the lag allows by this, the vehicle is not following. (ENG: gusts and overshoot.)
const MARGIN_M: f64 = 3.0;
/// One that has come nearer by this follows. (ENG: gusts move one that holds by less.)
const NEARER_M: f64 = 1.5;
/// A longer pause of the setpoints does not count as motion.
const LONGEST_STEP_S: f64 = 0.5;

impl Carrot {
    /// It begins where the vehicle is, and moves as it does: a target that begins at rest would be overtaken.
    pub(crate) fn new(vehicle: &LocalPosition, now: Time) -> Carrot {
        Carrot { position: vehicle.position, velocity: vehicle.velocity, at: now, behind: None }
    }

    /// Moves on towards `aim`; `vehicle` is where the vehicle is, if that is known. Returns position and velocity.
    ///
    /// It turns as a vehicle must: its velocity goes straight over into the wanted one, by `turning_m_s2` at most. So it never moves in a direction
    /// that neither of them has, such as down on the way to a climb.
    pub(crate) fn advance(&mut self, aim: &Aim, vehicle: Option<&LocalPosition>, now: Time) -> ([f64; 3], [f64; 3]) {
        let dt_s = (now - self.at).as_secs_f64().min(LONGEST_STEP_S);
        self.at = now;
        let way = difference(aim.end, self.position);
        let left_m = length(way);
        let direction = if left_m <= 1e-6 { [0.0; 3] } else { way.map(|it| it / left_m) };
        self.watch(aim, direction, vehicle, now);
        let along_m_s = dot(self.velocity, direction);
        let beside_m_s = length(difference(self.velocity, direction.map(|it| it * along_m_s)));
        let acceleration_m_s2 = aim.acceleration_along_m_s2(direction);
        let braking_m_s = (2.0 * acceleration_m_s2 * left_m).sqrt();
        let wanted_m_s = if self.behind.is_some() { 0.0 } else { aim.speed_along_m_s(direction).min(braking_m_s) };
        let is_on_its_way = 0.0 <= along_m_s && beside_m_s <= aim.turning_m_s2 * dt_s;
        let most_m_s2 = match is_on_its_way {
            false => aim.turning_m_s2,
            true if along_m_s < wanted_m_s => acceleration_m_s2,
            true => 2.0 * acceleration_m_s2,
        };
        let most_m_s = most_m_s2 * dt_s;
        let arrives = left_m <= along_m_s * dt_s && along_m_s <= braking_m_s + most_m_s;
        if is_on_its_way && (arrives || left_m <= 1e-6) {
            (self.position, self.velocity) = (aim.end, [0.0; 3]);
            return (self.position, self.velocity);
        }
        let change = difference(direction.map(|it| it * wanted_m_s), self.velocity);
        let part = (most_m_s / length(change)).min(1.0);
        self.velocity = std::array::from_fn(|i| self.velocity[i] + change[i] * part);
        self.position = std::array::from_fn(|i| self.position[i] + self.velocity[i] * dt_s);
        (self.position, self.velocity)
    }

    /// Looks whether the vehicle follows. One that is ahead on the way does; one that moves may need its way to brake. Where the vehicle is not
    /// known, nothing new is known of that.
    fn watch(&mut self, aim: &Aim, direction: [f64; 3], vehicle: Option<&LocalPosition>, now: Time) {
        let Some(vehicle) = vehicle else { return };
        let apart = difference(self.position, vehicle.position);
        let ahead_m = dot(apart, direction).min(0.0);
        let behind_m = length(std::array::from_fn(|i| apart[i] - direction[i] * ahead_m));
        let speed_m_s = length(vehicle.velocity);
        let lag_m = (length(self.velocity) + speed_m_s) * aim.lag.as_secs_f64();
        let braking_m = speed_m_s * speed_m_s / (2.0 * aim.acceleration_m_s2);
        let is_behind = lag_m + braking_m + MARGIN_M < behind_m;
        // By its own motion: a target that still brakes moves away from a vehicle that follows slowly.
        let towards_m = |from: [f64; 3]| dot(difference(vehicle.position, from), apart) / length(apart).max(1e-6);
        let before = self.behind.filter(|(_, from)| towards_m(*from) < NEARER_M);
        self.behind = is_behind.then(|| before.unwrap_or((now, vehicle.position)));
    }

    /// Whether the vehicle has not followed for `limit`.
    pub(crate) fn is_unflown(&self, limit: Duration, now: Time) -> bool {
        self.behind.is_some_and(|(since, _)| limit <= now - since)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const AIM: Aim = Aim {
        end: [0.0, 30.0, -10.0],
        speed_m_s: 2.0,
        climb_m_s: 3.0,
        descent_m_s: 1.5,
        acceleration_m_s2: 2.0,
        vertical_acceleration_m_s2: 1.0,
        turning_m_s2: 2.0,
        lag: Duration::from_millis(2_500),
    };

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
    fn one_that_wind_slows_follows_and_one_that_it_holds_or_carries_away_does_not() {
        for (speed_m_s, follows) in [(2.5, true), (1.0, true), (0.0, false), (-2.0, false)] {
            let mut vehicle = resting(0.0, 0.0);
            let mut carrot = Carrot::new(&vehicle, at(0));
            let aim = Aim { end: [0.0, 3000.0, -10.0], ..AIM_FAST };
            let unflown = (1..1200).any(|step| {
                vehicle.velocity[1] = speed_m_s;
                vehicle.position[1] += speed_m_s * 0.05;
                carrot.advance(&aim, Some(&vehicle), at(step * 50));
                carrot.is_unflown(Duration::from_secs(3), at(step * 50))
            });
            assert_eq!(unflown, !follows, "{speed_m_s} m/s: {carrot:?}");
        }
    }

    #[test]
    fn it_takes_over_the_motion_of_a_vehicle_that_is_on_its_way() {
        let moving = LocalPosition { velocity: [0.0, 2.0, 0.0], ..resting(0.0, 0.0) };
        let mut carrot = Carrot::new(&moving, at(0));
        let (position, velocity) = carrot.advance(&AIM, Some(&moving), at(50));
        assert_eq!((position, velocity), ([0.0, 0.1, -10.0], [0.0, 2.0, 0.0]));
        // Where it is to turn round it brakes first.
        let back = Aim { end: [0.0, -30.0, -10.0], ..AIM };
        let (_, velocity) = Carrot::new(&moving, at(0)).advance(&back, Some(&moving), at(50));
        assert!((velocity[1] - 1.9).abs() < 1e-9, "{velocity:?}");
    }

    /// A vehicle that flies the target which it heard `delay` ago, and changes its velocity by no more than `acceleration_m_s2`.
    #[derive(Debug)]
    struct Follower {
        at: LocalPosition,
        acceleration_m_s2: f64,
        delay: usize,
        heard: std::collections::VecDeque<([f64; 3], [f64; 3])>,
    }

    impl Follower {
        fn fly(&mut self, target: ([f64; 3], [f64; 3]), dt_s: f64) {
            self.heard.push_back(target);
            if self.heard.len() <= self.delay {
                return;
            }
            let Some((position, velocity)) = self.heard.pop_front() else { return };
            let apart = difference(position, self.at.position);
            let wanted: [f64; 3] = std::array::from_fn(|i| velocity[i] + apart[i]);
            let wanted = wanted.map(|it| it * (AIM_FAST.speed_m_s / length(wanted)).min(1.0));
            let change = difference(wanted, self.at.velocity);
            let part = (self.acceleration_m_s2 * dt_s / length(change)).min(1.0);
            self.at.velocity = std::array::from_fn(|i| self.at.velocity[i] + change[i] * part);
            self.at.position = std::array::from_fn(|i| self.at.position[i] + self.at.velocity[i] * dt_s);
        }
    }

    const AIM_FAST: Aim = Aim { speed_m_s: 10.0, ..AIM };

    proptest! {
        /// Whatever ends it is given on its way, however it brakes and however late it hears of them.
        #[test]
        fn a_vehicle_that_flies_its_target_within_its_limits_follows(
            ends in prop::collection::vec((prop::array::uniform2(-300.0..300.0), 1..40_u64), 1..8),
            turning_m_s2 in 2.0..5.0,
            better_m_s2 in 0.0..3.0,
            delay in 0..12_usize,
        ) {
            let rest = resting(0.0, 0.0);
            let acceleration_m_s2 = turning_m_s2 + better_m_s2;
            let mut vehicle = Follower { at: rest, acceleration_m_s2, delay, heard: Default::default() };
            let mut carrot = Carrot::new(&rest, at(0));
            let (mut ms, mut before) = (0, [0.0; 3]);
            for ([north_m, east_m], seconds) in &ends {
                let aim = Aim { end: [*north_m, *east_m, -10.0], turning_m_s2, ..AIM_FAST };
                for _ in 0..seconds * 20 {
                    ms += 50;
                    let target = carrot.advance(&aim, Some(&vehicle.at), at(ms));
                    let change = length(difference(target.1, before)) / 0.05;
                    let rests = target.1 == [0.0; 3];
                    prop_assert!(rests || change <= 2.0 * aim.acceleration_m_s2 + turning_m_s2, "{change} m/s2 at {ms} ms");
                    before = target.1;
                    vehicle.fly(target, 0.05);
                    prop_assert!(!carrot.is_unflown(Duration::from_secs(3), at(ms)), "{ms} ms: {carrot:?} {vehicle:?}");
                }
            }
            // It comes to its last end, and rests there.
            let aim = Aim { end: [ends[ends.len() - 1].0[0], ends[ends.len() - 1].0[1], -10.0], ..AIM_FAST };
            for _ in 0..2_400 {
                ms += 50;
                let target = carrot.advance(&aim, Some(&vehicle.at), at(ms));
                vehicle.fly(target, 0.05);
            }
            prop_assert_eq!((carrot.position, carrot.velocity), (aim.end, [0.0; 3]));
        }
    }

    /// It climbs to where it is while it flies on: it must brake, and has no reason to sink.
    #[test]
    fn a_turn_into_a_climb_never_sinks() {
        let moving = LocalPosition { velocity: [0.0, 10.0, 0.0], ..resting(0.0, 0.0) };
        for turning_m_s2 in [2.0, 5.0] {
            let aim = Aim { end: [0.0, -10.0, -15.0], turning_m_s2, ..AIM_FAST };
            let mut carrot = Carrot::new(&moving, at(0));
            for step in 1..400 {
                let before_m = carrot.position[2];
                let vehicle = LocalPosition { boot_ms: 0, position: carrot.position, velocity: carrot.velocity };
                let (position, _) = carrot.advance(&aim, Some(&vehicle), at(step * 50));
                assert!(position[2] <= before_m, "{position:?}");
            }
            assert_eq!(carrot.position, aim.end);
        }
    }

    #[test]
    fn it_climbs_and_sinks_no_faster_than_the_vehicle_may() {
        let mut carrot = Carrot::new(&resting(0.0, 0.0), at(0));
        let mut ms = 0;
        for (end, most_m_s) in [([0.0, 0.0, -40.0], 3.0), ([0.0, 0.0, -3.0], 1.5), ([0.0, 30.0, -33.0], 3.0)] {
            let mut fastest_m_s: f64 = 0.0;
            for _ in 0..800 {
                ms += 50;
                let vehicle = LocalPosition { boot_ms: 0, position: carrot.position, velocity: carrot.velocity };
                let (_, velocity) = carrot.advance(&Aim { end, ..AIM_FAST }, Some(&vehicle), at(ms));
                fastest_m_s = fastest_m_s.max(velocity[2].abs());
            }
            assert!((fastest_m_s - most_m_s).abs() < 0.01, "{fastest_m_s} m/s to {end:?}");
            assert_eq!(carrot.position, end);
        }
    }

    #[test]
    fn one_that_is_ahead_on_the_way_follows() {
        let mut carrot = Carrot::new(&resting(0.0, 0.0), at(0));
        carrot.advance(&AIM, Some(&resting(0.0, 20.0)), at(50));
        assert!(carrot.behind.is_none(), "{carrot:?}");
    }

    #[test]
    fn a_pause_is_no_leap() {
        let moving = LocalPosition { velocity: [0.0, 2.0, 0.0], ..resting(0.0, 0.0) };
        let (position, _) = Carrot::new(&moving, at(0)).advance(&AIM, None, at(10_000));
        assert!(position[1] <= 1.01, "{position:?}");
    }
}
