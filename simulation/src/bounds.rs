//! Whether a flight keeps below its greatest height, and does not go on below the energy reserve with nothing that responds.

use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{self, SkillKind};

/// A vehicle that flies over its greatest height by less is at it: what an estimate and a gust leave of a climb that ends there.
const CLEAR_M: f64 = 10.0;
/// A battery that has little left is answered within this time: the hold of its row, and the longest that a process hangs here.
const ANSWERED: Duration = Duration::from_secs(30);

/// Something outside of the bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Excursion {
    /// Too high.
    Height {
        /// When first.
        at: Time,
        /// The height.
        height_m: f64,
        /// What it may be at most.
        most_m: f64,
    },
    /// In the air below the reserve, and neither does anything respond nor does it land.
    Energy {
        /// When it had been so for too long.
        at: Time,
        /// The charge, 0 to 1.
        remaining: f64,
        /// The reserve.
        reserve: f64,
    },
}

/// Watches one flight.
#[derive(Debug)]
pub(crate) struct Bounds {
    most_m: f64,
    reserve: f64,
    remaining: f64,
    low_since: Option<Time>,
    found: Vec<Excursion>,
}

impl Bounds {
    /// For a vehicle that flies no higher than `most_m` on its own, and plans with this reserve, 0 to 1.
    pub(crate) fn of(most_m: f64, reserve: f64) -> Bounds {
        Bounds { most_m, reserve, remaining: 1.0, low_since: None, found: Vec::new() }
    }

    /// A message passes by while the manager says this, and the vehicle flies or does not.
    pub(crate) fn take_in(&mut self, at: Time, message: &Message, manager: &v1::McmStatus, flies: bool) {
        match message {
            // A plan leads as high as its objectives are.
            Message::MissionStatus(it) => {
                let heights = it.objectives.iter().filter_map(|it| it.position).map(|it| -it.down_m);
                self.most_m = heights.fold(self.most_m, f64::max);
            }
            Message::VehicleLocalPosition(it) => {
                let height_m = it.position.map_or(0.0, |it| -it.down_m);
                let is_known = self.found.iter().any(|it| matches!(it, Excursion::Height { .. }));
                if self.most_m + CLEAR_M < height_m && !is_known {
                    self.found.push(Excursion::Height { at, height_m, most_m: self.most_m });
                }
            }
            Message::BatteryStatus(it) => {
                self.remaining = it.remaining;
                let goes_on = flies && manager.acting.is_empty() && manager.skill() != SkillKind::Land;
                self.low_since = (goes_on && self.remaining < self.reserve).then(|| self.low_since.unwrap_or(at));
                let is_known = self.found.iter().any(|it| matches!(it, Excursion::Energy { .. }));
                if self.low_since.is_some_and(|since| ANSWERED < at - since) && !is_known {
                    let (remaining, reserve) = (self.remaining, self.reserve);
                    self.found.push(Excursion::Energy { at, remaining, reserve });
                }
            }
            _ => {}
        }
    }

    /// The first of each kind.
    pub(crate) fn found(&self) -> &[Excursion] {
        &self.found
    }
}

impl Excursion {
    /// When.
    pub fn at(&self) -> Time {
        match self {
            Excursion::Height { at, .. } | Excursion::Energy { at, .. } => *at,
        }
    }

    /// In words.
    pub fn what(&self) -> String {
        match self {
            Excursion::Height { height_m, most_m, .. } => {
                format!("the vehicle flew {height_m:.0} m high, at most {most_m:.0} m are allowed")
            }
            Excursion::Energy { remaining, reserve, .. } => format!(
                "the vehicle flew on with {:.0} % of its battery, {:.0} % are the reserve, and nothing responded",
                remaining * 100.0,
                reserve * 100.0
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64) -> Time {
        Time::after(Duration::from_secs(seconds))
    }

    #[test]
    fn a_vehicle_that_flies_too_high_is_found_once() {
        let mut bounds = Bounds::of(120.0, 0.25);
        let position = |height_m: f64| {
            let position = Some(v1::Ned { down_m: -height_m, ..Default::default() });
            Message::from(v1::VehicleLocalPosition { position, ..Default::default() })
        };
        for (second, height_m) in [(1, 119.0), (2, 129.0), (3, 131.0), (4, 140.0)] {
            bounds.take_in(at(second), &position(height_m), &v1::McmStatus::default(), true);
        }
        assert_eq!(bounds.found(), [Excursion::Height { at: at(3), height_m: 131.0, most_m: 120.0 }]);
        assert_eq!(bounds.found()[0].what(), "the vehicle flew 131 m high, at most 120 m are allowed");
    }

    #[test]
    fn a_low_battery_that_nobody_answers_in_the_air_is_found() {
        let battery = |remaining| Message::from(v1::BatteryStatus { remaining, ..Default::default() });
        #[track_caller]
        fn check(remaining: &Message, acting: &str, skill: SkillKind, flies: bool, expected: usize) {
            let mut bounds = Bounds::of(120.0, 0.25);
            let manager = v1::McmStatus { acting: acting.into(), skill: skill as i32, ..Default::default() };
            (0..=40).for_each(|second| bounds.take_in(at(second), remaining, &manager, flies));
            assert_eq!(bounds.found().len(), expected, "{acting} {skill:?} {flies}");
        }
        check(&battery(0.2), "", SkillKind::Offboard, true, 1);
        check(&battery(0.3), "", SkillKind::Offboard, true, 0);
        check(&battery(0.2), "battery_low", SkillKind::Offboard, true, 0);
        check(&battery(0.2), "", SkillKind::Land, true, 0);
        check(&battery(0.2), "", SkillKind::Offboard, false, 0);
    }
}
