//! A task that has ended for the skill manager and goes on in its process. The process gets the order to end it, and the next skill waits until
//! it is safe to fly on.

use std::time::Duration;

use domain::time::Time;

use crate::messages::{TaskOrder, TaskReport, TaskState};

/// How often that order is sent, if there is no answer.
const TRIES: u32 = 5;

#[derive(Debug)]
pub(crate) struct Farewell {
    order: TaskOrder,
    next: Time,
    tries_left: u32,
    repeat: Duration,
    /// From then on another skill may begin, whatever the process does.
    over: Time,
}

impl Farewell {
    /// `order` ends the task; the process may take as long as `takes` to make that safe.
    pub(crate) fn begin(order: TaskOrder, takes: Duration, repeat: Duration, now: Time) -> Farewell {
        Farewell { order, next: now, tries_left: TRIES, repeat, over: now + takes }
    }

    /// Whether another skill has to wait.
    pub(crate) fn blocks(&self, now: Time) -> bool {
        now < self.over
    }

    /// Whether nothing is left to be said or waited for.
    pub(crate) fn is_over(&self, now: Time) -> bool {
        self.tries_left == 0 && !self.blocks(now)
    }

    /// Whether the process is done with the task.
    pub(crate) fn is_ended_by(&self, report: &TaskReport) -> bool {
        let is_of_it = report.request_id == self.order.request_id;
        report.skill == self.order.task.skill && is_of_it && report.state == TaskState::Ended
    }

    /// The order, if it is due.
    pub(crate) fn take_order(&mut self, now: Time) -> Option<TaskOrder> {
        if now < self.next || self.tries_left == 0 {
            return None;
        }
        (self.next, self.tries_left) = (now + self.repeat, self.tries_left - 1);
        Some(self.order.clone())
    }

    /// When it has something to do next.
    pub(crate) fn deadline(&self) -> Option<Time> {
        Some(if 0 < self.tries_left { self.next } else { self.over })
    }
}
