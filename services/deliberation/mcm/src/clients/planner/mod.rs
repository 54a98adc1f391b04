//! The mission that is flown, its plan, and the plan that is asked for. The planner answers questions about it and remembers nothing.

use std::sync::Arc;
use std::time::Duration;

use domain::airspace::Grants;
use domain::area::Area;
use domain::decision::DecisionKind;
use domain::geodesy::Origin;
use domain::mission::MissionAreas;
use domain::plan::{Answered, Course, Denial, FlownStep, MissionStatus, Plan, PlanReply, Step, StepId};
use domain::state::State;
use domain::time::{Now, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::Request;
use node::CallError;

use crate::config::PlanApproval;
use crate::outbox::{Outbox, Purpose};

mod flight;
mod mission;
#[cfg(test)]
mod model;
mod pauses;
mod plan_request;

use flight::{Event as FlightEvent, Flight};
pub(crate) use mission::FlownMission;
use pauses::Pauses;
use plan_request::Event as RequestEvent;
pub(crate) use plan_request::{Basis, Holding, PlanRequest, Question};

/// In words: no objective is left, and the mission ends.
pub(crate) const ALL_SETTLED: &str = "every objective is settled";

/// Why a request to the planner has no usable answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum NoAnswer {
    #[error("{0}")]
    Call(#[from] CallError),
    #[error("gave an invalid answer: {0}")]
    Invalid(#[from] InvalidMessage),
    #[error("answered that {0}")]
    Contradicts(String),
    #[error("refused the request: {0}")]
    Refused(String),
}

/// What tells the mission and its plan from the previous ones.
pub(crate) type News = (u64, usize, Option<StepId>, bool);

/// From where and when something is asked.
#[derive(Debug, Clone)]
pub(crate) struct Viewpoint {
    /// By the mission's clock.
    pub(crate) at: Now,
    pub(crate) state: State,
    /// Of the vehicle's local frame.
    pub(crate) origin: Option<Origin>,
    /// As it is estimated, towards north and east in m/s.
    pub(crate) wind: Option<(f64, f64)>,
}

/// The mission and the planner's client.
#[derive(Debug, Default)]
pub(crate) struct Planner {
    /// Makes request ids unique among starts of this process.
    pub(crate) instance: u64,
    last_request: u64,
    pub(crate) mission: FlownMission,
    pub(crate) flight: Flight,
    pub(crate) request: PlanRequest,
    pub(crate) pauses: Pauses,
    /// Why nothing is flown, as the planner has answered last.
    hold: String,
    /// Where the vehicle's local frame had its origin when a plan was asked for last.
    pub(crate) planned_from: Option<Origin>,
    /// The objective along whose leg a task has failed since a step was flown, and why.
    along_failure: Option<(u32, String)>,
}

impl Planner {
    pub(crate) fn new(instance: u64) -> Planner {
        Planner { instance, ..Planner::default() }
    }

    /// Whether a step after the present one releases the load.
    pub(crate) fn is_release_ahead(&self) -> bool {
        self.flight.rest().iter().skip(1).any(Step::releases)
    }

    /// The heights that the mission itself names, of its objectives and sites.
    pub(crate) fn named_heights_m(&self) -> impl Iterator<Item = f64> {
        let objectives = self.mission.status.objectives.iter().map(|it| it.objective.position.height_m());
        objectives.chain(self.mission.status.sites.iter().map(|it| it.position.height_m()))
    }

    pub(crate) fn areas(&self) -> &Arc<[Area]> {
        self.mission.areas().areas()
    }

    /// As it is published.
    pub(crate) fn told(&self) -> MissionStatus {
        let hold = if matches!(self.request, PlanRequest::Hold(..)) { self.hold.clone() } else { String::new() };
        self.mission.told(self.flight.rest(), hold)
    }

    /// Changes whenever [`Planner::told`] changes.
    pub(crate) fn news(&self) -> News {
        let step = self.flight.step().map(|(step, ..)| step.id);
        (self.mission.version(), self.mission.flown(), step, matches!(self.request, PlanRequest::Hold(..)))
    }

    /// What an answer about the mission depends on, and whether its areas are in it.
    pub(crate) fn basis_from(&mut self, viewpoint: Viewpoint) -> (domain::plan::Basis, bool) {
        self.mission.basis(viewpoint, self.flight.rest())
    }

    /// Asks for a plan. A question that was not answered by its deadline is repeated under its id while nothing has changed and the
    /// vehicle is no farther away than `moved_m`: the planner, which may still be planning, then answers both with the same plan.
    pub(crate) fn ask_for_plan(
        &mut self,
        viewpoint: Viewpoint,
        (basis, grants): (Basis, Grants),
        moved_m: f64,
        timeout: Duration,
        outbox: &mut Outbox,
    ) {
        let (failed, denials) = self.flight.failure();
        let (failed, denials) = (failed.cloned(), denials.to_vec());
        let (state, origin) = (viewpoint.state.clone(), viewpoint.origin);
        let (asked, sends_areas) = self.basis_from(viewpoint);
        let new = Question {
            id: format!("mcm-{:x}-r{}", self.instance, self.last_request + 1),
            state,
            basis,
            failed: failed.clone(),
            denials: denials.clone(),
            version: self.mission.version(),
            flown: self.mission.flown(),
            sends_areas,
            is_repeated: false,
        };
        let repeated = self.request.unanswered().filter(|before| before.is_about_the_same(&new, moved_m));
        let question = match repeated {
            Some(before) => Question { is_repeated: true, sends_areas, ..before.clone() },
            None => {
                self.last_request += 1;
                new
            }
        };
        let request_id = question.id.clone();
        let request = domain::plan::PlanRequest { request_id, basis: asked, grants, failed, denials };
        outbox.call(Purpose::Replan(question.id.clone()), Request::Replan(request.into()), timeout);
        self.planned_from = origin;
        self.request.on(RequestEvent::Sent(question));
    }

    /// No plan is wanted any more. One that was just adopted was made for a state that has changed.
    pub(crate) fn stop_asking_for_plan(&mut self) {
        if self.request == PlanRequest::Planned {
            self.flight.on(FlightEvent::Dropped);
        }
        self.request.on(RequestEvent::Reset);
    }

    /// A plan is wanted from now on.
    pub(crate) fn begin_asking_for_plan(&mut self) {
        self.request.on(RequestEvent::Reset);
    }

    /// The present step was flown: the next one becomes the present one; returns whether there is one.
    pub(crate) fn advance(&mut self) -> bool {
        self.flight.on(FlightEvent::Advanced);
        self.flight.step().is_some()
    }

    /// The present step was flown; the next question tells the planner.
    pub(crate) fn flown(&mut self, now: Time, flown: FlownStep, first_pause: Duration) {
        self.pauses.end(now, first_pause);
        self.mission.flown.push(flown);
    }

    /// A task along the present step has failed.
    pub(crate) fn along_failed(&mut self, reason: String) {
        if let Some((step, ..)) = self.flight.step() {
            self.along_failure.get_or_insert((step.objective, reason));
        }
    }

    /// Why a task along a leg of this objective has failed, if one has, for the planner: once.
    pub(crate) fn take_along_failure(&mut self, objective: u32) -> Option<String> {
        let (failed, reason) = self.along_failure.take()?;
        (failed == objective).then_some(reason)
    }

    pub(crate) fn fail(&mut self, now: Time, reason: String, denials: Vec<Denial>, first_pause: Duration) {
        self.pauses.begin(now, first_pause);
        self.flight.on(FlightEvent::Failed(reason, denials));
    }

    /// The present step is given up because of something else; whether that counts as a failure of the step.
    pub(crate) fn interrupt(&mut self, reason: String, is_failure: bool) {
        self.flight.on(match is_failure {
            true => FlightEvent::Failed(reason, Vec::new()),
            false => FlightEvent::Interrupted(reason),
        });
    }

    /// The present step is given up: the next plan is made for its objective instead.
    pub(crate) fn give_up(&mut self) {
        self.flight.on(FlightEvent::GivenUp);
        self.pauses.skip();
    }

    /// The present step is to be given up because of something else; its executor does so at its next tick.
    pub(crate) fn withdraw(&mut self, reason: impl Into<String>) {
        self.withdraw_step_or_wait(reason.into());
    }

    /// Whether it was a wait: for approval, or for a way.
    fn withdraw_step_or_wait(&mut self, reason: String) -> bool {
        if self.flight.step().is_some() {
            self.flight.on(FlightEvent::Withdrawn(reason));
            return false;
        }
        self.request.on(RequestEvent::Withdrawn)
    }

    pub(crate) fn adopt(&mut self, plan: Plan) {
        self.mission.planned_for = Some(plan.objective);
        self.flight.on(FlightEvent::Adopted(plan));
        self.request.on(RequestEvent::Adopted);
    }

    pub(crate) fn discard_proposal(&mut self) {
        self.request.on(RequestEvent::Void);
    }

    /// The answer to a request for a plan; returns what it means, with its kind. One to a repeated question is for the past, and counts
    /// only if `holds` says that nothing has changed since. `approval`: which plans wait for it, and the limit of that wait.
    pub(crate) fn on_plan(
        &mut self,
        now: Time,
        request_id: &str,
        reply: Result<Answered, NoAnswer>,
        patience: Duration,
        (basis, holds): (Basis, impl FnOnce(&Question) -> bool),
        approval: (PlanApproval, Duration),
    ) -> Option<(DecisionKind, String)> {
        let question = self.request.awaits(request_id)?;
        let is_outdated = question.is_repeated && !holds(question);
        match reply {
            Err(NoAnswer::Call(CallError::Unanswered)) => {
                let is_first = !question.is_repeated;
                self.request.on(RequestEvent::Unanswered(now + patience));
                // Once is enough for as long as it plans.
                let words = "the planner is still planning, or hangs: its answer is awaited";
                is_first.then(|| (DecisionKind::PlanLate, words.to_owned()))
            }
            Err(no_answer) => Some(self.no_plan(now, no_answer, patience)),
            Ok(Answered { reply: PlanReply::Refused(reason), .. }) => {
                Some(self.no_plan(now, NoAnswer::Refused(reason), patience))
            }
            Ok(Answered { course: None, .. }) if question.sends_areas => {
                Some(self.no_plan(now, NoAnswer::Refused("it does not take the areas".into()), patience))
            }
            Ok(Answered { course: None, .. }) => {
                // It was started again.
                self.mission.areas_are_unknown();
                self.request.on(RequestEvent::Void);
                None
            }
            Ok(_) if question.version != self.mission.version() => {
                self.request.on(RequestEvent::Void);
                let words = "the planner's answer was made before the mission was changed; asking again";
                Some((DecisionKind::PlanRejected, words.to_owned()))
            }
            Ok(_) if is_outdated => {
                self.request.on(RequestEvent::Void);
                let words = "the planner's answer came late, and is for a state that has changed; asking again";
                Some((DecisionKind::PlanLate, words.to_owned()))
            }
            Ok(Answered { reply: PlanReply::Finished, course: Some(course) }) if !course.mission.is_settled() => {
                let words = "every objective is settled, by whose state it is not".to_owned();
                Some(self.no_plan(now, NoAnswer::Contradicts(words), patience))
            }
            Ok(Answered { reply, course: Some(course) }) => {
                let flown = question.flown;
                Some(self.go_on(now, reply, course, flown, basis, approval))
            }
        }
    }

    /// The mission goes on as the planner has answered.
    fn go_on(
        &mut self,
        now: Time,
        reply: PlanReply,
        course: Course,
        flown: usize,
        basis: Basis,
        approval: (PlanApproval, Duration),
    ) -> (DecisionKind, String) {
        self.mission.go_on(course, flown);
        self.flight.on(FlightEvent::Heard);
        self.pauses.answered();
        match reply {
            PlanReply::Plan(plan) => {
                let steps = plan.steps.iter().map(|step| step.text.as_str()).collect::<Vec<_>>().join("; ");
                let words = format!("plan {}: {steps}", plan.revision);
                if self.needs_approval(&plan, approval.0) {
                    self.request.on(RequestEvent::Proposed(Box::new(plan), now + approval.1));
                    return (DecisionKind::PlanProposed, format!("{words}; waits for approval"));
                }
                self.adopt(plan);
                (DecisionKind::PlanAdopted, words)
            }
            PlanReply::Hold { wait, reason, planned } => {
                let holding = if planned { Holding::ByTheMission } else { Holding::ForAWay };
                self.request.on(RequestEvent::Hold(now + wait, basis, holding));
                let words = format!("hold for {:.0} s: {reason}", wait.as_secs_f64());
                self.hold = reason;
                (DecisionKind::PlanHold, words)
            }
            PlanReply::Finished | PlanReply::Refused(_) | PlanReply::AreasUnknown => {
                self.request.on(RequestEvent::Finished);
                (DecisionKind::PlanFinished, ALL_SETTLED.into())
            }
        }
    }

    fn no_plan(&mut self, now: Time, no_answer: NoAnswer, patience: Duration) -> (DecisionKind, String) {
        let (kind, wait) = match no_answer {
            NoAnswer::Call(_) => (DecisionKind::PlanLate, patience),
            // The same request gets the same answer: ask with growing pauses.
            NoAnswer::Invalid(_) | NoAnswer::Refused(_) | NoAnswer::Contradicts(_) => {
                (DecisionKind::PlanRejected, self.pauses.unusable_answer(patience))
            }
        };
        self.request.on(RequestEvent::Lost(now + wait));
        (kind, format!("planner {no_answer}; asking again"))
    }

    fn needs_approval(&self, plan: &Plan, plans: PlanApproval) -> bool {
        let is_first = self.mission.planned_for != Some(plan.objective);
        plans == PlanApproval::EachPlan || (plans == PlanApproval::EachReplanning && !is_first)
    }

    /// An operator has changed the mission: it goes on so, which takes in this many of the flown steps, with other areas if there are any.
    /// Whether what the plan is for was changed.
    pub(crate) fn on_change(&mut self, course: Course, areas: Option<MissionAreas>, flown: usize, voids_plan: bool) {
        self.mission.go_on(course, flown);
        areas.into_iter().for_each(|it| self.mission.replace_areas(it));
        if voids_plan {
            self.mission.flown.clear();
            self.flight.on(FlightEvent::Heard);
            let was_wait = self.withdraw_step_or_wait("the mission was changed".to_owned());
            // The wait belonged to the previous mission, so the next plan counts as a first one.
            self.mission.planned_for = self.mission.planned_for.filter(|_| !was_wait);
        }
    }

    /// The flight is over: nothing of its plan counts for the next one.
    pub(crate) fn forget_flight(&mut self) {
        self.flight = Flight::default();
        self.request = PlanRequest::default();
        self.pauses = Pauses::default();
        self.mission.planned_for = None;
        self.mission.flown.clear();
    }
}
