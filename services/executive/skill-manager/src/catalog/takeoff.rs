//! Takeoff: arm if necessary, then climb straight up, relative to the height at the time of the
//! request. It fails once it climbs no higher.

use std::time::Duration;

use domain::fmu::{Command, FlightMode, LocalPosition};
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::forward::Forward;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::vehicle::View;

/// A climb, with its target height once that is known.
#[derive(Debug)]
pub(crate) struct Takeoff {
    climb_m: f64,
    height_tolerance_m: f64,
    climb_rate_tolerance_m_s: f64,
    climb_m_s: f64,
    settle: Duration,
    /// From the first position after the request: a request that waits must not climb from where the
    /// vehicle is later.
    target_height_m: Option<f64>,
    arms: bool,
    /// When the autopilot ended the climb by itself.
    levelled_off: Option<Time>,
    forward: Forward,
}

impl Takeoff {
    /// A takeoff by `climb_m`.
    pub(crate) fn new(climb_m: f64, config: &Config, pace: Pace) -> Takeoff {
        Takeoff {
            climb_m,
            height_tolerance_m: config.takeoff_tolerance_m.get(),
            climb_rate_tolerance_m_s: config.climb_rate_tolerance_m_s.get(),
            climb_m_s: config.vehicle_takeoff_m_s.get(),
            settle: config.takeoff_settle_s.seconds(),
            target_height_m: None,
            arms: true,
            levelled_off: None,
            forward: Forward::new(config, pace),
        }
    }

    /// When the vehicle must be at its target height, once the autopilot has ended the climb by itself.
    fn settled_at(&self) -> Option<Time> {
        self.levelled_off.map(|it| it + self.settle)
    }

    fn height_left_m(&self, motion: &LocalPosition) -> f64 {
        self.target_height_m.map_or(self.climb_m, |target| (target - motion.position.height_m()).abs())
    }
}

impl Skill for Takeoff {
    fn kind(&self) -> SkillKind {
        SkillKind::Takeoff
    }

    fn ready(&mut self, view: &View) -> Ready {
        if self.target_height_m.is_none() {
            self.target_height_m = view.vertical.map(|it| it.position.height_m() + self.climb_m);
        }
        match (self.target_height_m, view.status) {
            (None, _) => Ready::Require("height"),
            (_, None) => Ready::Require("status"),
            (Some(_), Some(status)) if !status.armed && status.can_arm == Some(false) => {
                Ready::Refuse("the autopilot would not arm".into())
            }
            (Some(_), Some(status)) => {
                self.arms = !status.armed;
                Ready::Command
            }
        }
    }

    fn command(&self, accepted: usize) -> Option<Command> {
        let takeoff = self.target_height_m.map(|height_m| Command::Takeoff { height_m });
        match (self.arms, accepted) {
            (true, 0) => Some(Command::Arm),
            (true, 1) | (false, 0) => takeoff,
            _ => None,
        }
    }

    fn mode(&self) -> FlightMode {
        FlightMode::Takeoff
    }

    fn depends_on_frame(&self) -> bool {
        true
    }

    fn mode_afterwards(&self) -> Option<FlightMode> {
        Some(FlightMode::Loiter)
    }

    fn execute(&mut self, now: Time) {
        self.forward.begin(now);
    }

    fn progress(&mut self, view: &View, now: Time) -> Option<Ending> {
        let is_there = view.vertical.is_some_and(|it| {
            self.height_left_m(&it) < self.height_tolerance_m
                && it.velocity.climb_rate_m_s().abs() < self.climb_rate_tolerance_m_s
        });
        if is_there {
            return Some(Ending::success());
        }
        // Once the autopilot loiters it climbs no further. It counts in the air only: the mode before
        // the climb may have been loiter, too.
        match view.status.map(|it| it.actual) {
            Some(Some(FlightMode::Loiter)) if view.flying == Some(true) => {
                self.levelled_off.get_or_insert(now);
            }
            Some(_) => self.levelled_off = None,
            None => {}
        }
        let target_m = self.target_height_m.unwrap_or(f64::NAN);
        let reached = match view.vertical {
            Some(it) => format!("at {:.1} m", it.position.height_m()),
            None => "at an unknown height".into(),
        };
        if self.settled_at().is_some_and(|it| it <= now) {
            let reason = format!("the climb to {target_m:.1} m ended {reached}");
            return Some(Ending::because(SkillOutcome::Failed, reason));
        }
        let left_s = view.vertical.map(|it| self.height_left_m(&it) / self.climb_m_s);
        self.forward.has_failed(now, left_s).then(|| {
            Ending::because(SkillOutcome::TimedOut, format!("did not climb to {target_m:.1} m: still {reached}"))
        })
    }

    fn deadline(&self) -> Option<Time> {
        self.settled_at().into_iter().chain(self.forward.judged_at()).min()
    }

    fn distance_left_m(&self, motion: &LocalPosition) -> f64 {
        self.height_left_m(motion)
    }
}
