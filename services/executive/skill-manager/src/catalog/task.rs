//! Task: hover over a place, or stand, while a process of its own carries out a declared skill. docs/skills.md has the exchange with it.
//!
//! Nothing is commanded: the vehicle hovers or stands when it begins. ([`crate::tracks`] has those along a flight.) The order is repeated until the process reports that it has it. What it
//! reports is believed; the mission manager checks the declared conditions.

use std::sync::Arc;
use std::time::Duration;

use domain::fmu::{Command, FlightMode};
use domain::skill::Goal;
use domain::task::{REPEAT, SILENT, Stance, TaskGoal};
use domain::time::{Pace, Time};
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use super::hover::Hover;
use super::{Ready, Skill};
use crate::config::Config;
use crate::fsm::Ending;
use crate::messages::{TaskOrder, TaskReport, TaskState};
use crate::vehicle::{View, at_wall_rate};

#[derive(Debug)]
pub(crate) struct Task {
    goal: Arc<TaskGoal>,
    request_id: String,
    hover: Hover,
    limit: Duration,
    silent: Duration,
    repeat: Duration,
    exchange: Exchange,
    /// By when it must have ended.
    ends: Option<Time>,
}

/// How far the exchange with the process has come.
#[derive(Debug, Clone, PartialEq)]
enum Exchange {
    /// The skill does not execute yet.
    NotBegun,
    /// The process has not answered yet.
    Ordered {
        since: Time,
        next: Time,
    },
    /// It has.
    Running {
        heard: Time,
    },
    Ended(Ending),
}

impl Task {
    pub(crate) fn new(goal: Arc<TaskGoal>, request_id: &str, config: &Config, pace: Pace) -> Task {
        Task {
            hover: Hover::new(goal.over, config),
            limit: pace.limit(Duration::from_secs_f64(goal.limit_s.min(MOST_S))),
            silent: at_wall_rate(pace, SILENT),
            repeat: pace.wall(REPEAT),
            request_id: request_id.to_owned(),
            exchange: Exchange::NotBegun,
            ends: None,
            goal,
        }
    }

    /// Whether its process has this name for it.
    pub(crate) fn is_ordered_as(&self, request_id: &str) -> bool {
        self.request_id == request_id
    }

    pub(crate) fn is_begun(&self) -> bool {
        self.exchange != Exchange::NotBegun
    }

    fn name(&self) -> &str {
        &self.goal.task.skill
    }

    fn order(&self, cancel: bool) -> TaskOrder {
        TaskOrder { request_id: self.request_id.clone(), task: self.goal.task.clone(), cancel }
    }

    fn ending(&self, report: &TaskReport) -> Ending {
        let (name, outcome, results) = (self.name(), &report.outcome, report.results.clone());
        let because = if report.reason.is_empty() { String::new() } else { format!(": {}", report.reason) };
        if self.goal.succeeds_as.contains(outcome) {
            // To a thousandth, for people; the event has the number.
            let in_words = |(name, value): &(String, f64)| format!(", {name} {}", (value * 1e3).round() / 1e3);
            let found: Vec<String> = results.iter().map(in_words).collect();
            let reason = format!("{outcome}{because}{}", found.concat());
            return Ending { outcome: SkillOutcome::Succeeded, reason, results: results.into() };
        }
        Ending {
            results: results.into(),
            ..Ending::because(SkillOutcome::Failed, format!("{name} ended as `{outcome}`{because}"))
        }
    }
}

/// The longest limit that a time can be made of, in seconds.
const MOST_S: f64 = 1e6;

impl Skill for Task {
    fn kind(&self) -> SkillKind {
        SkillKind::Task
    }

    fn ready(&mut self, view: &View) -> Ready {
        match (self.goal.stance, view.flying) {
            (Stance::Hovers, _) => Hover::status(view).map_or_else(|not_yet| not_yet, |_| self.hover.ready(view)),
            (Stance::Stands, Some(false)) => Ready::Command,
            (Stance::Stands, Some(true)) => Ready::Refuse("the vehicle does not stand on the ground".to_owned()),
            (Stance::Stands, None) => Ready::Require("land detector"),
            (Stance::Flies, _) => Ready::Refuse("a task along a flight is requested with that".to_owned()),
        }
    }

    fn command(&self, _: usize) -> Option<Command> {
        None
    }

    fn mode(&self) -> FlightMode {
        Goal::Task(self.goal.clone()).mode()
    }

    fn depends_on_frame(&self) -> bool {
        !self.stands()
    }

    fn stands(&self) -> bool {
        self.goal.stance == Stance::Stands
    }

    fn execute(&mut self, now: Time) {
        self.exchange = Exchange::Ordered { since: now, next: now };
        self.ends = Some(now + self.limit);
    }

    fn take_order(&mut self, now: Time) -> Option<TaskOrder> {
        let Exchange::Ordered { next, .. } = &mut self.exchange else { return None };
        if now < *next {
            return None;
        }
        *next = now + self.repeat;
        Some(self.order(false))
    }

    fn order_to_end(&self) -> Option<(TaskOrder, Duration)> {
        let is_begun = matches!(self.exchange, Exchange::Ordered { .. } | Exchange::Running { .. });
        is_begun.then(|| (self.order(true), Duration::from_secs_f64(self.goal.interrupt_s.min(MOST_S))))
    }

    fn hear(&mut self, report: &TaskReport, now: Time) {
        if report.skill != self.name() {
            return;
        }
        if report.request_id != self.request_id {
            let is_lost = matches!(self.exchange, Exchange::Running { .. }) && report.state == TaskState::Ready;
            if is_lost {
                let reason = format!("the process of {} was started again, and knows nothing of its task", self.name());
                self.exchange = Exchange::Ended(Ending::because(SkillOutcome::Failed, reason));
            }
            return;
        }
        self.exchange = match (&self.exchange, report.state) {
            (Exchange::Ordered { .. } | Exchange::Running { .. }, TaskState::Ended) => {
                Exchange::Ended(self.ending(report))
            }
            (Exchange::Ordered { .. } | Exchange::Running { .. }, TaskState::Running) => {
                Exchange::Running { heard: now }
            }
            // It has ended once; or the process does something else, and is silent about this one.
            _ => return,
        };
    }

    fn progress(&mut self, _: &View, now: Time) -> Option<Ending> {
        let name = self.name();
        match &self.exchange {
            Exchange::Ended(ending) => Some(ending.clone()),
            Exchange::Ordered { since, .. } if *since + self.silent <= now => {
                let reason = format!("the process of {name} does not answer");
                Some(Ending::because(SkillOutcome::Rejected, reason))
            }
            Exchange::Running { heard } if *heard + self.silent <= now => {
                Some(Ending::because(SkillOutcome::Failed, format!("the process of {name} has fallen silent")))
            }
            _ if self.ends.is_some_and(|it| it <= now) => {
                let reason = format!("{name} has not ended after {} s", self.goal.limit_s);
                Some(Ending::because(SkillOutcome::TimedOut, reason))
            }
            _ => None,
        }
    }

    fn deadline(&self) -> Option<Time> {
        let next = match &self.exchange {
            Exchange::Ordered { next, .. } => Some(*next),
            Exchange::Running { heard } => Some(*heard + self.silent),
            Exchange::NotBegun | Exchange::Ended(_) => None,
        };
        next.into_iter().chain(self.ends).min()
    }
}
