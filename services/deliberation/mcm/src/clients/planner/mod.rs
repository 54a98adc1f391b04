//! The planner as the manager sees it: the step that is flown, the plan that is asked for, and the reports that the
//! planner has not acknowledged.

use std::sync::Arc;
use std::time::Duration;

use domain::airspace::Grants;
use domain::area::Area;
use domain::decision::DecisionKind;
use domain::plan::{Denial, Plan, PlanReply, PlannerStatus, Step, StepDone, StepId};
use domain::skill::Goal;
use domain::state::State;
use domain::time::Time;
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use node::CallError;

use crate::config::PlanApproval;
use crate::outbox::{Outbox, Purpose};

mod areas;
mod flight;
#[cfg(test)]
mod model;
mod pauses;
mod plan_request;
mod step_reports;

pub(crate) use areas::KnownAreas;
pub(crate) use flight::Next;
use flight::{Event as FlightEvent, Flight};
use pauses::Pauses;
use plan_request::Event as RequestEvent;
pub(crate) use plan_request::{Basis, Holding, PlanRequest, Question};
use step_reports::{Event as ReportEvent, StepReports};

/// In words: no objective is left, and the mission ends.
pub(crate) const ALL_SETTLED: &str = "every objective is settled";

/// Why a request to the planner has no usable answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum NoAnswer {
    /// There was no reply.
    #[error("{0}")]
    Call(#[from] CallError),
    /// The reply made no sense.
    #[error("gave an invalid answer: {0}")]
    Invalid(#[from] InvalidMessage),
    /// The planner refused the request as invalid.
    #[error("refused the request: {0}")]
    Refused(String),
}

/// Which plans wait for approval, and for how long.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ApprovalPolicy {
    pub(crate) plans: PlanApproval,
    pub(crate) limit: Duration,
}

/// The planner's client.
#[derive(Debug)]
pub(crate) struct Planner {
    /// Makes request ids unique among starts of this process.
    instance: u64,
    last_request: u64,
    flight: Flight,
    request: PlanRequest,
    reports: StepReports,
    pauses: Pauses,
    status: Option<PlannerStatus>,
    areas: KnownAreas,
    /// The epoch of the plan that was adopted last.
    epoch: u64,
    /// The objective of the last plan.
    planned_for: Option<u32>,
}

impl Planner {
    pub(crate) fn new(instance: u64) -> Planner {
        Planner {
            instance,
            last_request: 0,
            flight: Flight::default(),
            request: PlanRequest::default(),
            reports: StepReports::default(),
            pauses: Pauses::default(),
            status: None,
            areas: KnownAreas::default(),
            epoch: 0,
            planned_for: None,
        }
    }

    /// Differs from start to start of this process.
    pub(crate) fn instance(&self) -> u64 {
        self.instance
    }

    /// Whether there is nothing to fly for want of a way, or of an answer.
    pub(crate) fn lacks_a_way(&self) -> bool {
        self.step().is_none() && self.request.lacks_a_way()
    }

    /// The step that is flown, its place in the plan from 1, and the number of steps in the plan.
    pub(crate) fn step(&self) -> Option<(&Arc<Step>, u32, u32)> {
        self.flight.step()
    }

    /// The place in the order of the objective that a plan was adopted for last, and the epoch of that plan.
    pub(crate) fn planned_for(&self) -> (Option<u32>, u64) {
        (self.planned_for, self.epoch)
    }

    /// Continues the same mission after a restart.
    pub(crate) fn restore_planned_for(&mut self, objective: Option<u32>, epoch: u64) {
        (self.planned_for, self.epoch) = (objective, epoch);
    }

    /// What is known about the step after the present one.
    pub(crate) fn next(&self) -> Option<&Next> {
        self.flight.next()
    }

    /// The goal of the step that was given up.
    pub(crate) fn interrupted_goal(&self) -> Option<Goal> {
        self.flight.interrupted_goal()
    }

    /// Why the present step is to be given up, if it is.
    pub(crate) fn withdrawal(&self) -> Option<&str> {
        self.flight.withdrawal()
    }

    /// The state of the request for a plan.
    pub(crate) fn request(&self) -> &PlanRequest {
        &self.request
    }

    /// The planner's newest status.
    pub(crate) fn status(&self) -> Option<&PlannerStatus> {
        self.status.as_ref()
    }

    /// The heights that the mission itself names, of its objectives and sites; none before the planner was heard.
    pub(crate) fn named_heights_m(&self) -> impl Iterator<Item = f64> {
        let objectives = self.status.iter().flat_map(|it| &it.objectives).map(|it| it.objective.position.height_m());
        objectives.chain(self.status.iter().flat_map(|it| &it.sites).map(|it| it.position.height_m()))
    }

    /// Every area of the mission, as far as they are known.
    pub(crate) fn areas(&self) -> &Arc<[Area]> {
        self.areas.all()
    }

    /// What is known of the areas.
    pub(crate) fn known_areas(&self) -> &KnownAreas {
        &self.areas
    }

    /// The same, to be told of what was known before a restart.
    pub(crate) fn known_areas_mut(&mut self) -> &mut KnownAreas {
        &mut self.areas
    }

    /// When a plan may be asked for, after steps that failed.
    pub(crate) fn ask_from(&self) -> Time {
        self.pauses.until()
    }

    /// Asks for a plan, unless a flown step is still to be reported: the planner would plan that step again. A question that was not
    /// answered by its deadline is repeated under its id while nothing has changed and the vehicle is no farther away than
    /// `moved_m`: the planner, which may still be planning, then answers both with the same plan.
    pub(crate) fn ask_for_plan(
        &mut self,
        (state, basis): (State, Basis),
        grants: Grants,
        accepted_loss: u64,
        moved_m: f64,
        timeout: Duration,
        outbox: &mut Outbox,
    ) -> bool {
        if !self.reports.is_empty() {
            return false;
        }
        let (failed, denials) = self.flight.failure();
        let new = Question {
            id: format!("mcm-{:x}-r{}", self.instance, self.last_request + 1),
            state: state.clone(),
            basis,
            failed: failed.cloned(),
            denials: denials.to_vec(),
            accepted_loss,
            epoch: self.newest_epoch(),
            is_repeated: false,
        };
        let repeated = self.request.unanswered().filter(|before| before.is_about_the_same(&new, moved_m));
        let question = match repeated {
            Some(before) => Question { is_repeated: true, ..before.clone() },
            None => {
                self.last_request += 1;
                new
            }
        };
        let request = domain::plan::PlanRequest {
            request_id: question.id.clone(),
            state,
            grants,
            failed: question.failed.clone(),
            denials: question.denials.clone(),
            accepted_loss,
        };
        outbox.call(Purpose::Replan(question.id.clone()), Request::Replan(request.into()), timeout);
        self.request.on(RequestEvent::Sent(question));
        true
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

    /// The present step was flown: the next one, if it is known, becomes the present one; returns whether there is one.
    pub(crate) fn advance(&mut self) -> bool {
        self.flight.on(FlightEvent::Advanced);
        self.flight.step().is_some()
    }

    /// The present step was flown; it is reported to the planner until the planner acknowledges it.
    pub(crate) fn flown(&mut self, now: Time, id: StepId, state: State, first_pause: Duration) {
        self.pauses.end(now, first_pause);
        self.reports.on(ReportEvent::Flown(StepDone { id, state }));
    }

    /// The present step failed by itself.
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

    /// The present step must not begin, or was flown and no next step is known.
    pub(crate) fn drop_step(&mut self) {
        self.flight.on(FlightEvent::Dropped);
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

    /// Flies `plan`.
    pub(crate) fn adopt(&mut self, plan: Plan) {
        self.epoch = plan.epoch;
        self.planned_for = Some(plan.objective);
        self.flight.on(FlightEvent::Adopted(plan));
        self.request.on(RequestEvent::Adopted);
    }

    /// The planner's status does not tell what it has answered: that no objective is left.
    pub(crate) fn discard_finish(&mut self) {
        self.request.on(RequestEvent::Void);
    }

    /// The proposed plan is not flown.
    pub(crate) fn discard_proposal(&mut self) {
        self.request.on(RequestEvent::Void);
    }

    /// The answer to a request for a plan; returns what it means, with its kind. One to a repeated question is for the past, and counts
    /// only if `holds` says that nothing has changed since.
    pub(crate) fn on_plan(
        &mut self,
        now: Time,
        request_id: &str,
        reply: Result<PlanReply, NoAnswer>,
        patience: Duration,
        (basis, holds): (Basis, impl FnOnce(&Question) -> bool),
        approval: ApprovalPolicy,
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
            Ok(_) if is_outdated => {
                self.request.on(RequestEvent::Void);
                let words = "the planner's answer came late, and is for a state that has changed; asking again";
                Some((DecisionKind::PlanLate, words.to_owned()))
            }
            Ok(PlanReply::Refused(reason)) => Some(self.no_plan(now, NoAnswer::Refused(reason), patience)),
            Ok(PlanReply::Plan(plan)) if plan.epoch < self.newest_epoch() => {
                self.request.on(RequestEvent::Void);
                let words = format!("plan {} was made before the mission was changed; asking again", plan.revision);
                Some((DecisionKind::PlanRejected, words))
            }
            Ok(PlanReply::Plan(plan)) => {
                let steps = plan.steps.iter().map(|step| step.text.as_str()).collect::<Vec<_>>().join("; ");
                let words = format!("plan {}: {steps}", plan.revision);
                self.pauses.answered();
                if self.needs_approval(&plan, approval.plans) {
                    self.request.on(RequestEvent::Proposed(Box::new(plan), now + approval.limit));
                    return Some((DecisionKind::PlanProposed, format!("{words}; waits for approval")));
                }
                self.adopt(plan);
                Some((DecisionKind::PlanAdopted, words))
            }
            Ok(PlanReply::Hold { wait, reason, planned }) => {
                let holding = if planned { Holding::ByTheMission } else { Holding::ForAWay };
                self.request.on(RequestEvent::Hold(now + wait, basis, holding));
                self.flight.on(FlightEvent::DenialsHeard);
                Some((DecisionKind::PlanHold, format!("hold for {:.0} s: {reason}", wait.as_secs_f64())))
            }
            Ok(PlanReply::Finished) => {
                self.request.on(RequestEvent::Finished(now + patience));
                self.flight.on(FlightEvent::Finished);
                Some((DecisionKind::PlanFinished, ALL_SETTLED.into()))
            }
        }
    }

    fn no_plan(&mut self, now: Time, no_answer: NoAnswer, patience: Duration) -> (DecisionKind, String) {
        let (kind, wait) = match no_answer {
            NoAnswer::Call(_) => (DecisionKind::PlanLate, patience),
            // The same request gets the same answer: ask with growing pauses.
            NoAnswer::Invalid(_) | NoAnswer::Refused(_) => {
                (DecisionKind::PlanRejected, self.pauses.unusable_answer(patience))
            }
        };
        self.request.on(RequestEvent::Lost(now + wait));
        (kind, format!("planner {no_answer}; asking again"))
    }

    fn needs_approval(&self, plan: &Plan, plans: PlanApproval) -> bool {
        let is_first = self.planned_for != Some(plan.objective);
        plans == PlanApproval::EachPlan || (plans == PlanApproval::EachReplanning && !is_first)
    }

    /// The answer to the question for the step after step `after`.
    pub(crate) fn on_next(
        &mut self,
        now: Time,
        after: StepId,
        reply: Result<Option<Step>, NoAnswer>,
        patience: Duration,
    ) -> Option<NoAnswer> {
        match reply {
            Ok(step) => {
                self.flight.on(FlightEvent::NextKnown(after, step.map(Arc::new)));
                None
            }
            Err(no_answer) => {
                self.flight.on(FlightEvent::NextLost(after, now + patience));
                Some(no_answer)
            }
        }
    }

    /// The answer to the report that step `id` was flown, or its failure.
    pub(crate) fn on_report(&mut self, now: Time, id: StepId, answered: bool, patience: Duration) {
        self.reports.on(if answered { ReportEvent::Answered(id) } else { ReportEvent::Lost(now + patience) });
    }

    /// Takes in the planner's status. One that `has_lost` what it knew may lack areas of the mission that is flown.
    pub(crate) fn on_status(&mut self, status: PlannerStatus, has_lost: bool) {
        self.areas.hear(&status.areas, has_lost);
        let counted = self.status.as_ref().map_or(self.epoch, |it| it.epoch);
        if status.epoch < counted {
            // The planner has lost its memory, so it does not know the plan that waits for approval either.
            self.epoch = self.epoch.min(status.epoch);
            if self.request.proposal().is_some() {
                self.request.on(RequestEvent::Withdrawn);
            }
        }
        if self.newest_epoch() < status.epoch && self.epoch < status.epoch {
            let was_wait = self.withdraw_step_or_wait("the mission was changed".to_owned());
            // The wait belonged to the mission of before, so the next plan counts as a first one.
            self.planned_for = self.planned_for.filter(|_| !was_wait);
        }
        self.status = Some(status);
    }

    /// Takes the areas that the planner told last, since an operator has accepted its loss.
    pub(crate) fn believe_areas(&mut self) {
        if let Some(status) = &self.status {
            self.areas.hear(&status.areas, false);
        }
    }

    /// Whether the planner was heard and has never made a plan.
    pub(crate) fn has_made_no_plan(&self) -> bool {
        self.status.as_ref().is_some_and(|it| it.revision == 0)
    }

    /// Whether by the planner's status every objective has reached its final state.
    pub(crate) fn all_settled(&self) -> bool {
        self.status.as_ref().is_some_and(|it| it.current_objective as usize == it.objectives.len())
    }

    /// Reports the first flown step that the planner has not acknowledged, and fetches the next step before the present
    /// one ends.
    pub(crate) fn tend(&mut self, now: Time, timeout: Duration, outbox: &mut Outbox) {
        if let Some((done, _)) = self.reports.due().filter(|(_, at)| *at <= now) {
            outbox.call(Purpose::StepDone(done.id), Request::StepDone(done.clone().into()), timeout);
            self.reports.on(ReportEvent::Sent);
        }
        if let (Some((step, ..)), Some(Next::Unknown(at))) = (self.flight.step(), self.flight.next())
            && *at <= now
        {
            let request = v1::NextStepRequest { after_step_id: step.id.0 };
            outbox.call(Purpose::NextStep(step.id), Request::NextStep(request), timeout);
            self.flight.on(FlightEvent::NextAsked);
        }
    }

    /// When [`Planner::tend`] has something to do.
    pub(crate) fn deadline(&self, now: Time) -> Option<Time> {
        let report = self.reports.due().map(|(_, at)| at);
        let next = self.flight.next().and_then(|it| if let Next::Unknown(at) = it { Some(*at) } else { None });
        report.into_iter().chain(next).filter(|at| now < *at).min()
    }

    /// The flight is over: nothing of its plan counts for the next one.
    pub(crate) fn forget_flight(&mut self) {
        self.flight = Flight::default();
        self.request = PlanRequest::default();
        self.reports = StepReports::default();
        self.pauses = Pauses::default();
        self.planned_for = None;
    }

    /// Counts the changes of the mission, as the planner has said last; zero before it was heard.
    pub(crate) fn newest_epoch(&self) -> u64 {
        self.status.as_ref().map_or(0, |it| it.epoch)
    }
}
