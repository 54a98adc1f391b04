//! What is decided at a tick, by the one rule ([`crate::decide`]), and what is asked of the decision.

use std::borrow::Cow;

use domain::contingency::narrowing::{Narrowing, Narrows};
use domain::contingency::{Action, Moment, OPERATOR_ABORT, Raised, Severity};
use domain::decision::DecisionKind;

use super::responses::ActiveResponse;
use super::{Mission, World};
use crate::clients::planner::{Holding, PlanRequest};
use crate::decide::{Awaited, Decision, Inputs, PlanStage, Progress, Stage, Wait, decide};
use crate::journal::{CONTINGENCY, Cause, Entry, Said};
use crate::vehicle::Vehicle;

/// A decision with all that it follows from, so that it is made again when that is another, and then only.
#[derive(Debug, Default)]
pub(super) struct Decided {
    inputs: Inputs,
    decision: Decision,
}

impl World {
    /// Decides by what is believed now, and records what is new. Every leaf of this tick acts by it.
    pub(super) fn take_decision(&mut self) {
        self.answer.permits.take();
        let Some(now) = self.decided_anew() else { return };
        let Decided { decision: before, .. } = std::mem::replace(&mut self.answer.decided, now);
        self.answer.has_rested |= self.responder().is_none();
        self.say_narrowing(before.narrowing);
        for waits in &self.answer.decided.decision.waits {
            if !before.waits.contains(waits) {
                self.out.journal.decided(self.now, Entry::Waits(waits.0, waits.1));
            }
        }
    }

    /// What is decided now, if it follows from anything else than the decision of this tick. All that it follows from is compared, so
    /// that an old one is never kept; the table is that of the start.
    fn decided_anew(&self) -> Option<Decided> {
        let moment = Moment { situation: self.situation(), phase: self.flight_phase() };
        let (progress, before) = (self.mission_progress(), &self.answer.decided.inputs);
        let is_same =
            progress == before.progress && moment == before.moment && self.raised().eq(before.raised.iter().copied());
        let inputs = || Inputs { raised: self.raised().collect(), moment, progress };
        (!is_same).then(inputs).map(|inputs| Decided { decision: decide(&inputs, self.setup.table.rows()), inputs })
    }

    pub(crate) fn decision(&self) -> &Decision {
        &self.answer.decided.decision
    }

    /// What is decided now: after an order and before the tick, or by what has come of the tick.
    pub(crate) fn decision_now(&self) -> Cow<'_, Decision> {
        self.decided_anew().map_or(Cow::Borrowed(self.decision()), |it| Cow::Owned(it.decision))
    }

    /// What is narrowed since the flags were taken in last.
    pub(crate) fn narrowing(&self) -> Narrowing {
        self.decision().narrowing
    }

    /// [`World::decision_now`], and the same from nothing.
    #[cfg(test)]
    pub(crate) fn decided(&self) -> (Decision, Decision) {
        let moment = Moment { situation: self.situation(), phase: self.flight_phase() };
        let inputs = Inputs { raised: self.raised().collect(), moment, progress: self.mission_progress() };
        (self.decision_now().into_owned(), decide(&inputs, self.setup.table.rows()))
    }

    /// The row that responds at this tick; `None`: the nominal flight continues.
    pub(crate) fn responder(&self) -> Option<usize> {
        self.decision().responder()
    }

    /// The row that would respond now: after an order, and before the tick decides.
    pub(crate) fn next_responder(&self) -> Option<usize> {
        self.decision_now().responder()
    }

    fn mission_progress(&self) -> Progress {
        let Mission { over, started_s, .. } = &self.mission;
        let stage = match (over, started_s) {
            (Some(over), _) if over.report.is_some() => Stage::Reported,
            (Some(_), _) => Stage::Ending,
            (None, Some(_)) => Stage::Begun,
            (None, None) => Stage::Before,
        };
        Progress { stage, plan: self.plan_stage(), order: self.awaited_order() }
    }

    /// The vehicle that plans are made for, once its state suffices: nothing takes off without a battery that is known.
    pub(super) fn plans_from(&self) -> Option<Vehicle> {
        self.seen.vehicle.filter(|it| it.flying || it.charge.is_some())
    }

    fn plan_stage(&self) -> PlanStage {
        let wait = |what, until| PlanStage::Awaited(Wait { what, until });
        match &self.planner.request {
            _ if self.planner.flight.step().is_some() => PlanStage::Flown,
            PlanRequest::Planned => PlanStage::Flown,
            PlanRequest::Finished => PlanStage::Settled,
            PlanRequest::Asked(_) => wait(Awaited::Answer, None),
            PlanRequest::Proposed(_, until) => wait(Awaited::Approval, Some(*until)),
            _ if self.plans_from().is_none() => wait(Awaited::Vehicle, None),
            PlanRequest::Idle => wait(Awaited::Retry, Some(self.planner.pauses.until())),
            PlanRequest::Retry(at, _) => wait(Awaited::Retry, Some(*at)),
            PlanRequest::Hold(until, _, Holding::ForAWay) => wait(Awaited::Retry, Some(*until)),
            PlanRequest::Hold(until, _, Holding::ByTheMission) => wait(Awaited::Stay, Some(*until)),
        }
    }

    /// The rows whose flags are up, most urgent first.
    fn raised(&self) -> impl Iterator<Item = Raised> {
        self.flags.up().map(move |(row, flag)| Raised {
            row,
            overrides: flag.overrides,
            is_overridden: flag.overridden,
            under_way: self.answer.response.as_ref().filter(|it| it.row == row).map(|it| self.severity(it)),
        })
    }

    pub(crate) fn is_under_way(&self, row: usize) -> bool {
        self.answer.response.as_ref().is_some_and(|it| it.row == row)
    }

    pub(super) fn response_row(&self) -> Option<usize> {
        self.answer.response.as_ref().map(|it| it.row)
    }

    /// Whether the response was ordered with override.
    pub(super) fn is_ordered_with_override(&self) -> bool {
        self.response_row().is_some_and(|row| self.flags.overrides(row))
    }

    /// Whether a pilot has ordered to land here, whatever is below.
    pub(super) fn is_ordered_here(&self) -> bool {
        self.is_ordered_with_override()
            && self.response_row().is_some_and(|row| **self.flags.name(row) == *OPERATOR_ABORT)
    }

    /// The action that is flown, or tried next, and those after it; none without a response.
    pub(super) fn actions_left(&self) -> &[Action] {
        let left =
            self.answer.response.as_ref().and_then(|it| self.setup.table.rows()[it.row].actions.get(it.action..));
        left.unwrap_or_default()
    }

    pub(super) fn severity(&self, response: &ActiveResponse) -> Severity {
        self.setup.table.rows()[response.row].actions.get(response.action).map_or(Severity::Hold, |it| it.severity)
    }

    /// Whether a response is under way that brings the vehicle down.
    pub(super) fn comes_down(&self) -> bool {
        self.actions_left().first().is_some_and(|it| it.severity.comes_down())
    }

    /// Records what is forbidden from now on, and what no longer is.
    fn say_narrowing(&mut self, before: Narrowing) {
        let now = self.narrowing();
        // Of a flag from before a restart: where the vehicle is seen first.
        let here = self.seen.vehicle.map(|it| it.position);
        self.landings.no_landing_at = now.no_landing_here.and(self.landings.no_landing_at.or(here));
        if before == now {
            return;
        }
        for what in Narrows::ALL {
            match (before.by(what), now.by(what)) {
                (None, Some(row)) => self.say_narrowed(what, row),
                (Some(_), None) => {
                    let text = format!("`{}` is over: no flag asks for it any more", what.name());
                    self.record(Said::new(CONTINGENCY, DecisionKind::Note, text).led_to_by(Cause::Nothing));
                }
                (None, None) | (Some(_), Some(_)) => {}
            }
        }
    }

    fn say_narrowed(&mut self, what: Narrows, row: usize) {
        let meaning = match what {
            Narrows::NoNewArea => "no area is entered in which the vehicle is not already".to_owned(),
            Narrows::NoLandingHere => "no landing where the vehicle is".to_owned(),
            Narrows::Slow => format!("no faster than {:.1} m/s", self.setup.limits.config.slow_speed_m_s.get()),
        };
        let text = format!("`{}`: {}, {meaning}", self.flags.name(row), what.name());
        let said = Said::new(CONTINGENCY, DecisionKind::Note, text).about(row).led_to_by(Cause::Raised(row));
        self.record(said.taking(what.name(), meaning));
    }
}
