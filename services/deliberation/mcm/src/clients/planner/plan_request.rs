//! The plan that is asked for.

use domain::plan::Plan;
use domain::time::Time;

/// The state of the request for a plan.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) enum PlanRequest {
    /// No plan is asked for.
    #[default]
    Idle,
    /// Asked under this request id.
    Asked(String),
    /// The planner did not answer, or its answer made no sense: ask again at this time.
    Retry(Time),
    /// The planner said to hold: ask again at this time, or when what it knew has changed.
    Hold(Time, Basis),
    /// A plan waits for approval; from this time on the default counts.
    Proposed(Box<Plan>, Time),
    /// A plan was adopted.
    Planned,
    /// Every objective has reached its final state.
    Finished,
}

/// What the planner knew when it said to hold.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Basis {
    /// Counts the tower's decisions.
    pub(crate) revision: u64,
    /// The areas that could be entered, without those whose permission is about to expire.
    pub(crate) held: Vec<String>,
}

/// An event for the request. Answers name the request they answer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    /// A request was sent.
    Sent(String),
    /// No usable answer came; ask again at this time.
    Lost(Time),
    /// Nothing can be flown before this time.
    Hold(Time, Basis),
    /// A plan came that waits for approval until this time.
    Proposed(Box<Plan>, Time),
    /// A plan came, or was approved.
    Adopted,
    /// A plan came that is void, or was refused.
    Void,
    /// Nothing is left to plan.
    Finished,
    /// The mission was changed, or another plan is wanted: an earlier answer no longer counts.
    Withdrawn,
    /// No plan is wanted any more, or one is wanted from now on.
    Reset,
}

impl PlanRequest {
    /// Takes in an event; returns whether it changed anything.
    pub(crate) fn on(&mut self, event: Event) -> bool {
        use {Event as E, PlanRequest as R};
        let after = match (&*self, event) {
            (R::Idle | R::Retry(_) | R::Hold(..), E::Sent(request_id)) => R::Asked(request_id),
            (R::Asked(_), E::Lost(again)) => R::Retry(again),
            (R::Asked(_), E::Hold(until, basis)) => R::Hold(until, basis),
            (R::Asked(_), E::Proposed(plan, until)) => R::Proposed(plan, until),
            (R::Asked(_) | R::Proposed(..), E::Adopted) => R::Planned,
            (R::Asked(_) | R::Proposed(..), E::Void) => R::Idle,
            (R::Asked(_), E::Finished) => R::Finished,
            (R::Hold(..) | R::Proposed(..), E::Withdrawn) => R::Idle,
            (_, E::Reset) => R::Idle,
            _ => return false,
        };
        *self = after;
        true
    }

    /// Whether this request waits for its answer: an answer to an earlier one was given for a state that has changed.
    pub(crate) fn awaits(&self, request_id: &str) -> bool {
        matches!(self, PlanRequest::Asked(id) if id == request_id)
    }

    /// The plan that waits for approval, and until when.
    pub(crate) fn proposal(&self) -> Option<(&Plan, Time)> {
        match self {
            PlanRequest::Proposed(plan, until) => Some((plan, *until)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn plan() -> Box<Plan> {
        Box::new(Plan { objective: 0, steps: Vec::new(), revision: 3, epoch: 0 })
    }

    fn basis() -> Basis {
        Basis { revision: 1, held: Vec::new() }
    }

    fn name(request: &PlanRequest) -> &'static str {
        match request {
            PlanRequest::Idle => "idle",
            PlanRequest::Asked(_) => "asked",
            PlanRequest::Retry(_) => "retry",
            PlanRequest::Hold(..) => "hold",
            PlanRequest::Proposed(..) => "proposed",
            PlanRequest::Planned => "planned",
            PlanRequest::Finished => "finished",
        }
    }

    #[test]
    fn every_state_answers_every_event_as_the_table_says() {
        let at = Time::after(Duration::from_secs(5));
        let states = [
            PlanRequest::Idle,
            PlanRequest::Asked("r1".into()),
            PlanRequest::Retry(at),
            PlanRequest::Hold(at, basis()),
            PlanRequest::Proposed(plan(), at),
            PlanRequest::Planned,
            PlanRequest::Finished,
        ];
        let events = [
            Event::Sent("r2".into()),
            Event::Lost(at),
            Event::Hold(at, basis()),
            Event::Proposed(plan(), at),
            Event::Adopted,
            Event::Void,
            Event::Finished,
            Event::Withdrawn,
            Event::Reset,
        ];
        // One row per state, one column per event; `-` where the event changes nothing.
        let table = [
            ("idle", ["asked", "-", "-", "-", "-", "-", "-", "-", "idle"]),
            ("asked", ["-", "retry", "hold", "proposed", "planned", "idle", "finished", "-", "idle"]),
            ("retry", ["asked", "-", "-", "-", "-", "-", "-", "-", "idle"]),
            ("hold", ["asked", "-", "-", "-", "-", "-", "-", "idle", "idle"]),
            ("proposed", ["-", "-", "-", "-", "planned", "idle", "-", "idle", "idle"]),
            ("planned", ["-", "-", "-", "-", "-", "-", "-", "-", "idle"]),
            ("finished", ["-", "-", "-", "-", "-", "-", "-", "-", "idle"]),
        ];
        for (state, (row, cells)) in states.into_iter().zip(table) {
            assert_eq!(name(&state), row);
            for (event, expected) in events.clone().into_iter().zip(cells) {
                let mut after = state.clone();
                let meant = after.on(event.clone());
                assert_eq!(if meant { name(&after) } else { "-" }, expected, "{event:?} in {row}");
                assert!(meant || after == state, "{event:?} in {row}");
            }
        }
    }
}
