//! The leaves' world: what is known, what is wanted, and what was decided.

use std::collections::BTreeSet;
use std::sync::Arc;

use behavior_tree::{Library, Tree};
use domain::contingency::Contingencies;
use domain::time::{Now, Time};
use kittiwake_proto::v1;

use crate::clients::permissions::Permissions;
use crate::clients::planner::Planner;
use crate::clients::skills::Skills;
use crate::config::{Limits, Start};
use crate::flags::Flags;
use crate::operator::Operator;
use crate::outbox::Outbox;
use crate::timing::Timing;
use crate::vehicle::{Shown, Vehicle};

/// Everything a leaf may look at and ask for. Nothing in here waits or reads a clock.
pub(crate) struct World {
    pub(crate) now: Now,
    pub(crate) limits: Limits,
    pub(crate) table: Arc<Contingencies>,
    pub(crate) library: Arc<Library<World>>,
    /// What came in since the monitor leaf looked.
    pub(crate) inbox: Inbox,
    pub(crate) vehicle: Option<Vehicle>,
    pub(crate) shown: Shown,
    pub(crate) flags: Flags,
    pub(crate) skills: Skills,
    pub(crate) planner: Planner,
    pub(crate) permissions: Permissions,
    pub(crate) mission: Mission,
    pub(crate) operator: Operator,
    /// The flag whose row responds.
    pub(crate) acting: Option<Arc<str>>,
    /// A transition action flies.
    pub(crate) in_transition: bool,
    /// Why the step at hand failed, as its leaves said.
    pub(crate) failure: Failure,
    pub(crate) outbox: Outbox,
    pub(crate) decisions: u64,
    /// Decisions of this wake that are not in words yet.
    pub(crate) unsaid: Vec<(Time, Decision)>,
    pub(crate) timing: Timing,
    /// Subtrees that were given up: taken apart once what matters has been decided.
    pub(crate) discarded: Vec<Tree<World>>,
}

/// Flags that the manager raises itself say so.
pub(crate) const SELF: &str = "mcm";
/// Who the introspection's flags are from.
pub(crate) const MONITOR: &str = "monitor";

/// What came in and waits for the monitor leaf.
#[derive(Debug, Default)]
pub(crate) struct Inbox {
    pub(crate) vehicle: Option<Vehicle>,
    pub(crate) flags: Vec<v1::FlagEvent>,
    /// The flags that the last introspection listed.
    listed: BTreeSet<String>,
}

impl Inbox {
    /// Counts a flag as one that the last introspection listed.
    pub(crate) fn expect(&mut self, name: &str) {
        self.listed.insert(name.to_owned());
    }

    /// Takes in the flags that an introspection lists. What is new or gone in the list counts as an
    /// event: its own may have got lost, or have come while this process or the monitor was away.
    pub(crate) fn list(&mut self, flags: &[v1::RaisedFlag]) {
        let listed: BTreeSet<String> = flags.iter().map(|it| it.name.clone()).collect();
        let event = |name: &String, raised, reason: &str| v1::FlagEvent {
            name: name.clone(),
            raised,
            source: MONITOR.to_owned(),
            reason: reason.to_owned(),
            ..Default::default()
        };
        let risen = flags.iter().filter(|it| !self.listed.contains(&it.name));
        self.flags.extend(risen.map(|it| event(&it.name, true, &it.reason)));
        self.flags.extend(self.listed.difference(&listed).map(|it| event(it, false, "")));
        self.listed = listed;
    }
}

/// What was decided. What belongs to the answer to a flag waits for its words: nothing stands between
/// the flag and the action.
#[derive(Debug)]
pub(crate) enum Decision {
    /// In words already: by topic.
    Said(&'static str, String),
    /// The flag of this row was raised for this reason.
    Raised(usize, String),
    /// This row responds from here on.
    Responding(usize),
}

impl Decision {
    fn in_words(self, flags: &Flags, table: &Contingencies) -> (&'static str, String) {
        const TOPIC: &str = "contingency";
        match self {
            Decision::Said(topic, text) => (topic, text),
            Decision::Raised(row, reason) => (TOPIC, format!("flag `{}` raised: {reason}", flags.name(row))),
            Decision::Responding(row) => {
                (TOPIC, format!("`{}`: {}", flags.name(row), table.rows()[row].actions.join(", else ")))
            }
        }
    }
}

/// The reason a step is about to fail with.
#[derive(Debug, Default)]
pub(crate) struct Failure {
    pub(crate) reason: String,
    pub(crate) denials: Vec<v1::Denial>,
}

/// The mission as a whole.
#[derive(Debug, Default)]
pub(crate) struct Mission {
    /// Latched: nothing starts again after it.
    pub(crate) over: Option<Over>,
    pub(crate) started: Option<Time>,
    pub(crate) report: Option<v1::MissionReport>,
    pub(crate) vehicle_name: String,
}

/// How the mission ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Over {
    pub(crate) outcome: v1::MissionOutcome,
    pub(crate) reason: String,
}

impl World {
    /// Records a decision, in words.
    pub(crate) fn say(&mut self, topic: &'static str, text: impl Into<String>) {
        self.decided(Decision::Said(topic, text.into()));
    }

    /// Records a decision that is put into words once everything is decided.
    pub(crate) fn decided(&mut self, decision: Decision) {
        self.unsaid.push((self.now.time, decision));
    }

    /// Publishes the decisions of this wake, in words.
    pub(crate) fn publish_decisions(&mut self) {
        for (at, decision) in self.unsaid.drain(..) {
            self.decisions += 1;
            let (topic, text) = decision.in_words(&self.flags, &self.table);
            let (at_s, topic, sequence) = (at.as_secs_f64(), topic.to_owned(), self.decisions);
            self.outbox.publish(v1::DecisionRecord { at_s, topic, text, sequence });
        }
    }

    /// Raises a flag that has a row; one without is told and not acted on.
    pub(crate) fn raise(&mut self, name: &str, source: impl Into<String>, reason: impl Into<String>) {
        match self.flags.number(name) {
            None => self.say("contingency", format!("flag `{name}` has no row in the table: not acted on")),
            Some(row) => {
                let reason = reason.into();
                if self.flags.raise(self.now.time, row, source.into(), reason.clone()) {
                    self.decided(Decision::Raised(row, reason));
                }
            }
        }
    }

    /// Latches the end of the mission; the first reason stays.
    pub(crate) fn end_mission(&mut self, outcome: v1::MissionOutcome, reason: impl Into<String>) {
        if self.mission.over.is_none() {
            self.mission.over = Some(Over { outcome, reason: reason.into() });
        }
    }

    /// The state that the planner reasons about; `None` until the vehicle is known.
    pub(crate) fn planning_state(&self) -> Option<v1::PlanningState> {
        let vehicle = self.vehicle?;
        Some(v1::PlanningState {
            position: Some(vehicle.position.into()),
            flying: vehicle.flying,
            mode: vehicle.mode as i32,
            permissions: self.held(),
        })
    }

    /// The areas that may be entered now.
    pub(crate) fn held(&self) -> Vec<String> {
        self.permissions.held(self.now.time, self.limits.permission_margin)
    }

    /// Whether the mission begins only when the operator says so, and the operator has not. What
    /// flies has been started, whatever a restarted manager remembers.
    pub(crate) fn awaits_start(&self) -> bool {
        self.limits.start == Start::Operator
            && !self.operator.has_started
            && self.mission.started.is_none()
            && self.mission.over.is_none()
            && !self.is_flying()
    }

    /// Whether the vehicle is known to fly.
    pub(crate) fn is_flying(&self) -> bool {
        self.vehicle.is_some_and(|it| it.flying)
    }

    /// Whether the vehicle is known to stand on the ground.
    pub(crate) fn is_on_ground(&self) -> bool {
        self.vehicle.is_some_and(|it| !it.flying)
    }
}
