//! What is decided at a tick, by the one rule ([`crate::decide`]), and what is asked of the decision.

use domain::contingency::narrowing::{Narrowing, Narrows};
use domain::contingency::{Action, Moment, Raised, Severity};
use domain::decision::DecisionKind;

use super::World;
use super::responses::ActiveResponse;
use crate::decide::{Decision, decide};
use crate::journal::{CONTINGENCY, Cause, Entry, Said};

impl World {
    /// Decides by what is believed now, and records what is new. Every leaf of this tick acts by it.
    pub(super) fn take_decision(&mut self) {
        let now = self.decision_now();
        let before = std::mem::replace(&mut self.answer.decision, now);
        self.answer.permits.take();
        self.say_narrowing(before.narrowing);
        for (row, waits) in &self.answer.decision.waits {
            if before.waits.get(row) != Some(waits) {
                self.out.journal.decided(self.now, Entry::Waits(*row, *waits));
            }
        }
    }

    /// What would be decided now, as between two ticks.
    fn decision_now(&self) -> Decision {
        let raised: Vec<Raised> = self.raised().collect();
        decide(self.setup.table.rows(), &raised, Moment { situation: self.situation(), phase: self.flight_phase() })
    }

    /// The row that responds at this tick; `None`: the nominal flight continues.
    pub(crate) fn responder(&self) -> Option<usize> {
        self.answer.decision.responder
    }

    /// The row that would respond now: after an order, and before the tick decides.
    pub(crate) fn next_responder(&self) -> Option<usize> {
        if self.flags.any_is_up() { self.decision_now().responder } else { None }
    }

    /// The rows whose flags are up, most urgent first.
    pub(super) fn raised(&self) -> impl Iterator<Item = Raised> + Clone {
        self.flags.rows_up().map(move |row| Raised {
            row,
            overrides: self.flags.overrides(row),
            is_overridden: self.flags.is_overridden(row),
            under_way: self.answer.response.as_ref().filter(|it| it.row == row).map(|it| self.severity(it)),
        })
    }

    /// Whether the response of `row` has begun and not ended.
    pub(crate) fn is_under_way(&self, row: usize) -> bool {
        self.answer.response.as_ref().is_some_and(|it| it.row == row)
    }

    /// The row whose response is under way.
    pub(super) fn response_row(&self) -> Option<usize> {
        self.answer.response.as_ref().map(|it| it.row)
    }

    /// The action that is flown, or tried next, and those after it; none without a response.
    pub(super) fn actions_left(&self) -> &[Action] {
        let left =
            self.answer.response.as_ref().and_then(|it| self.setup.table.rows()[it.row].actions.get(it.action..));
        left.unwrap_or_default()
    }

    /// The row whose response is under way, as long as its flag is up.
    pub(super) fn responding(&self) -> Option<usize> {
        self.answer.response.as_ref().map(|it| it.row).filter(|row| self.flags.row_is_up(*row))
    }

    pub(super) fn severity(&self, response: &ActiveResponse) -> Severity {
        self.setup.table.rows()[response.row].actions.get(response.action).map_or(Severity::Hold, |it| it.severity)
    }

    /// Whether a response is under way that brings the vehicle down.
    pub(super) fn comes_down(&self) -> bool {
        self.actions_left().first().is_some_and(|it| Severity::Return <= it.severity)
    }

    /// Records what is forbidden from now on, and what no longer is.
    fn say_narrowing(&mut self, before: Narrowing) {
        let now = self.answer.decision.narrowing;
        if before == now {
            return;
        }
        let here = self.seen.vehicle.map(|it| it.position);
        self.landings.no_landing_at = now.no_landing_here.and(self.landings.no_landing_at.or(here));
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
            Narrows::Slow => format!("no faster than {:.1} m/s", self.setup.limits.slow_speed_m_s),
        };
        let text = format!("`{}`: {}, {meaning}", self.flags.name(row), what.name());
        let said = Said::new(CONTINGENCY, DecisionKind::Note, text).about(row).led_to_by(Cause::Raised(row));
        self.record(said.taking(what.name(), meaning));
    }
}
