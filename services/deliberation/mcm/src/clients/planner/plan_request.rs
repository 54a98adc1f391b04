//! The plan that is asked for.

use domain::plan::{Denial, Failure, Plan};
use domain::state::State;
use domain::time::Time;

#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) enum PlanRequest {
    /// No plan is asked for.
    #[default]
    Idle,
    Asked(Question),
    /// The planner did not answer, or its answer made no sense: ask again at this time. With the same question, if it may still
    /// be planning for that one.
    Retry(Time, Option<Question>),
    /// The planner said to hold, by the mission or for want of a way: ask again at this time, or when what it knew has changed.
    Hold(Time, Basis, Holding),
    /// A plan waits for approval; from this time on the default counts.
    Proposed(Box<Plan>, Time),
    /// A plan was adopted.
    Planned,
    /// Every objective has reached its final state.
    Finished,
}

/// Why the vehicle is to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Holding {
    /// There is nothing to fly yet: the way is closed, or something is not known.
    ForAWay,
    /// The mission asks for a stay.
    ByTheMission,
}

/// What a plan is asked for with. The answer counts, however late it comes, as long as that is how things are.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Question {
    /// Of the request, and of those that repeat it.
    pub(crate) id: String,
    /// The vehicle's, when it was asked first.
    pub(crate) state: State,
    pub(crate) basis: Basis,
    pub(crate) failed: Option<Failure>,
    pub(crate) denials: Vec<Denial>,
    /// Of the mission, and how many steps were flown since.
    pub(crate) version: u64,
    pub(crate) flown: usize,
    /// The areas were sent with it.
    pub(crate) sends_areas: bool,
    /// It was asked before, and not answered by the deadline.
    pub(crate) is_repeated: bool,
}

impl Question {
    /// Whether this is asked about the same as `other`, with the vehicle no farther away than `moved_m`.
    pub(crate) fn is_about_the_same(&self, other: &Question, moved_m: f64) -> bool {
        let about = |it: &Question| (it.failed.clone(), it.denials.clone(), it.version, it.flown);
        about(self) == about(other) && self.holds(&other.state, &other.basis, moved_m)
    }

    /// Whether things are as they were when it was asked.
    pub(crate) fn holds(&self, state: &State, basis: &Basis, moved_m: f64) -> bool {
        self.basis == *basis
            && self.state.flying == state.flying
            && self.state.gripper == state.gripper
            && self.state.position.distance_m(state.position) <= moved_m
    }
}

/// What the planner knew of permissions and areas when it was asked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Basis {
    /// Counts the tower's decisions.
    pub(crate) revision: u64,
    /// The areas that could be entered, without those whose permission is about to expire.
    pub(crate) held: Vec<String>,
    /// Tells the areas from others.
    pub(crate) areas_id: String,
}

/// An event for the request. Answers name the request they answer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    Sent(Question),
    /// No answer came by the deadline; repeat the question at this time.
    Unanswered(Time),
    /// No usable answer came; ask again at this time.
    Lost(Time),
    /// Nothing is flown before this time.
    Hold(Time, Basis, Holding),
    /// A plan came that waits for approval until this time.
    Proposed(Box<Plan>, Time),
    /// A plan came, or was approved.
    Adopted,
    /// An answer came that is void, or a plan was refused.
    Void,
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
            (R::Idle | R::Retry(..) | R::Hold(..), E::Sent(question)) => R::Asked(question),
            (R::Asked(question), E::Unanswered(again)) => R::Retry(again, Some(question.clone())),
            (R::Asked(_), E::Lost(again)) => R::Retry(again, None),
            (R::Asked(_), E::Hold(until, basis, holding)) => R::Hold(until, basis, holding),
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

    /// The question, if it waits for this answer: an answer to another one was given for a state that has changed.
    pub(crate) fn awaits(&self, request_id: &str) -> Option<&Question> {
        match self {
            PlanRequest::Asked(question) if question.id == request_id => Some(question),
            _ => None,
        }
    }

    /// The question that was not answered by its deadline and is to be repeated.
    pub(crate) fn unanswered(&self) -> Option<&Question> {
        let PlanRequest::Retry(_, question) = self else { return None };
        question.as_ref()
    }

    /// Whether the planner said to hold when it knew anything else than `basis`.
    pub(crate) fn holds_by_other(&self, basis: &Basis) -> bool {
        matches!(self, PlanRequest::Hold(_, before, _) if before != basis)
    }

    /// The plan that waits for approval, and until when.
    pub(crate) fn proposal(&self) -> Option<(&Plan, Time)> {
        let PlanRequest::Proposed(plan, until) = self else { return None };
        Some((plan, *until))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::geometry::Ned;
    use std::time::Duration;

    fn plan() -> Box<Plan> {
        Box::new(Plan { objective: 0, steps: Vec::new(), revision: 3 })
    }

    fn question(id: &str) -> Question {
        Question {
            id: id.into(),
            state: State::new(Ned::default(), true),
            basis: basis(),
            failed: None,
            denials: Vec::new(),
            version: 0,
            flown: 0,
            sends_areas: false,
            is_repeated: false,
        }
    }

    #[test]
    fn a_question_is_the_same_as_long_as_nothing_it_is_about_has_changed() {
        #[track_caller]
        fn check(now: Question, expected: bool) {
            assert_eq!(question("r1").is_about_the_same(&now, 1.5), expected, "{now:?}");
        }
        let at = |east_m: f64, flying: bool| State::new(Ned::new(0.0, east_m, 0.0), flying);
        check(question("r2"), true);
        check(Question { state: at(1.4, true), ..question("r2") }, true);
        check(Question { state: at(1.6, true), ..question("r2") }, false);
        check(Question { state: at(0.0, false), ..question("r2") }, false);
        check(Question { basis: Basis { revision: 2, ..basis() }, ..question("r2") }, false);
        check(Question { basis: Basis { held: vec!["A".into()], ..basis() }, ..question("r2") }, false);
        check(Question { basis: Basis { areas_id: "other".into(), ..basis() }, ..question("r2") }, false);
        let failed = Failure { reason: "why".into(), interrupted: false };
        check(Question { failed: Some(failed), ..question("r2") }, false);
        check(Question { version: 1, ..question("r2") }, false);
        check(Question { flown: 1, ..question("r2") }, false);
    }

    fn basis() -> Basis {
        Basis { revision: 1, held: Vec::new(), areas_id: "some".into() }
    }

    fn name(request: &PlanRequest) -> &'static str {
        match request {
            PlanRequest::Idle => "idle",
            PlanRequest::Asked(_) => "asked",
            PlanRequest::Retry(_, None) => "retry",
            PlanRequest::Retry(_, Some(_)) => "repeat",
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
            PlanRequest::Asked(question("r1")),
            PlanRequest::Retry(at, None),
            PlanRequest::Retry(at, Some(question("r1"))),
            PlanRequest::Hold(at, basis(), Holding::ForAWay),
            PlanRequest::Proposed(plan(), at),
            PlanRequest::Planned,
            PlanRequest::Finished,
        ];
        let events = [
            Event::Sent(question("r2")),
            Event::Unanswered(at),
            Event::Lost(at),
            Event::Hold(at, basis(), Holding::ForAWay),
            Event::Proposed(plan(), at),
            Event::Adopted,
            Event::Void,
            Event::Finished,
            Event::Withdrawn,
            Event::Reset,
        ];
        // One row per state, one column per event; `-` where the event changes nothing.
        let table = [
            ("idle", ["asked", "-", "-", "-", "-", "-", "-", "-", "-", "idle"]),
            ("asked", ["-", "repeat", "retry", "hold", "proposed", "planned", "idle", "finished", "-", "idle"]),
            ("retry", ["asked", "-", "-", "-", "-", "-", "-", "-", "-", "idle"]),
            ("repeat", ["asked", "-", "-", "-", "-", "-", "-", "-", "-", "idle"]),
            ("hold", ["asked", "-", "-", "-", "-", "-", "-", "-", "idle", "idle"]),
            ("proposed", ["-", "-", "-", "-", "-", "planned", "idle", "-", "idle", "idle"]),
            ("planned", ["-", "-", "-", "-", "-", "-", "-", "-", "-", "idle"]),
            ("finished", ["-", "-", "-", "-", "-", "-", "-", "-", "-", "idle"]),
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
