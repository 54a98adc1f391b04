//! Whether a skill comes nearer to its goal, by the rule of [`domain::headway`], also where data are missing for a while.

use std::time::Duration;

use domain::headway::{Headway, STRETCH};
use domain::time::{Pace, Time};

use super::deadline::Deadline;
use crate::config::Config;
use crate::vehicle::at_wall_rate;

/// Watches what is left of a skill.
#[derive(Debug)]
pub(super) struct Forward {
    stretch: Duration,
    headway: Option<Headway>,
    /// When it is judged next, or waits for data no longer.
    deadline: Deadline,
}

impl Forward {
    /// Not begun yet.
    pub(super) fn new(config: &Config, pace: Pace) -> Forward {
        let data_wait = at_wall_rate(pace, config.data_wait_s.seconds());
        Forward { stretch: pace.limit(STRETCH), headway: None, deadline: Deadline::new(data_wait) }
    }

    /// It begins.
    pub(super) fn begin(&mut self, now: Time) {
        self.deadline.set(now + self.stretch);
    }

    /// The skill takes `left_s` more, if it is flown as intended; `None`: that is not known. Returns whether it has failed.
    pub(super) fn has_failed(&mut self, now: Time, left_s: Option<f64>) -> bool {
        if self.deadline.at().is_none() {
            return false;
        }
        let Some(left_s) = left_s else { return self.deadline.is_missed(now, false) };
        let headway = match self.headway {
            Some(headway) => headway.seen(now, left_s),
            None => Headway::begins(now, left_s, self.stretch),
        };
        self.headway = Some(headway);
        if self.deadline.at() != Some(headway.judged_at()) {
            self.deadline.move_to(headway.judged_at());
        }
        headway.stands()
    }

    /// When it is judged next.
    pub(super) fn judged_at(&self) -> Option<Time> {
        self.deadline.at()
    }
}
