//! Reports to the planner: steps that were flown, each until the planner has acknowledged it.

use std::collections::VecDeque;

use domain::plan::{StepDone, StepId};
use domain::time::Time;

/// The state of the reports.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) enum StepReports {
    /// The planner knows of every step that was flown.
    #[default]
    None,
    /// These are to be reported, the first one next, not before this time.
    Due(VecDeque<StepDone>, Time),
    /// The report of the first of these is under way.
    Sent(VecDeque<StepDone>),
}

/// An event for the reports.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    /// A step was flown.
    Flown(StepDone),
    /// The first report was sent.
    Sent,
    /// The planner has acknowledged or refused this one: it need not be repeated.
    Answered(StepId),
    /// No answer came; report again at this time.
    Lost(Time),
}

impl StepReports {
    /// Takes in an event.
    pub(crate) fn on(&mut self, event: Event) {
        use {Event as E, StepReports as R};
        *self = match (std::mem::take(self), event) {
            (R::None, E::Flown(done)) => R::Due(VecDeque::from([done]), Time::ZERO),
            (R::Due(mut steps, at), E::Flown(done)) => {
                steps.push_back(done);
                R::Due(steps, at)
            }
            (R::Sent(mut steps), E::Flown(done)) => {
                steps.push_back(done);
                R::Sent(steps)
            }
            (R::Due(steps, _), E::Sent) => R::Sent(steps),
            (R::Sent(mut steps), E::Answered(id)) => {
                steps.retain(|step| step.id != id);
                if steps.is_empty() { R::None } else { R::Due(steps, Time::ZERO) }
            }
            (R::Sent(steps), E::Lost(again)) => R::Due(steps, again),
            (reports, E::Sent | E::Answered(_) | E::Lost(_)) => reports,
        };
    }

    /// Whether the planner knows of every step that was flown.
    pub(crate) fn is_empty(&self) -> bool {
        *self == StepReports::None
    }

    /// The report to be sent, and when.
    pub(crate) fn due(&self) -> Option<(&StepDone, Time)> {
        match self {
            StepReports::Due(steps, at) => steps.front().map(|step| (step, *at)),
            StepReports::None | StepReports::Sent(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use domain::geometry::Ned;
    use domain::state::State;

    use super::*;

    fn done(id: u64) -> StepDone {
        StepDone { id: StepId(id), state: State::new(Ned::default(), false) }
    }

    fn name(reports: &StepReports) -> String {
        let ids = |steps: &VecDeque<StepDone>| steps.iter().map(|it| it.id.to_string()).collect::<Vec<_>>().join(" ");
        match reports {
            StepReports::None => "none".into(),
            StepReports::Due(steps, Time::ZERO) => format!("due {}", ids(steps)),
            StepReports::Due(steps, at) => format!("due {} from {}", ids(steps), at.as_secs_f64()),
            StepReports::Sent(steps) => format!("sent {}", ids(steps)),
        }
    }

    #[test]
    fn every_state_answers_every_event_as_the_table_says() {
        let again = Time::after(Duration::from_secs(5));
        let two = || VecDeque::from([done(1), done(2)]);
        let states = [
            StepReports::None,
            StepReports::Due(two(), Time::ZERO),
            StepReports::Due(two(), again),
            StepReports::Sent(two()),
            StepReports::Sent(VecDeque::from([done(1)])),
        ];
        let events = [Event::Flown(done(3)), Event::Sent, Event::Answered(StepId(1)), Event::Lost(again)];
        let table = [
            ("none", ["due 3", "none", "none", "none"]),
            ("due 1 2", ["due 1 2 3", "sent 1 2", "due 1 2", "due 1 2"]),
            ("due 1 2 from 5", ["due 1 2 3 from 5", "sent 1 2", "due 1 2 from 5", "due 1 2 from 5"]),
            ("sent 1 2", ["sent 1 2 3", "sent 1 2", "due 2", "due 1 2 from 5"]),
            ("sent 1", ["sent 1 3", "sent 1", "none", "due 1 from 5"]),
        ];
        for (state, (row, cells)) in states.into_iter().zip(table) {
            assert_eq!(name(&state), row);
            for (event, expected) in events.clone().into_iter().zip(cells) {
                let mut after = state.clone();
                after.on(event.clone());
                assert_eq!(name(&after), expected, "{event:?} in {row}");
            }
        }
    }
}
