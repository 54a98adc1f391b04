//! The planner's client: the step that is flown, the one after it, and the requests for more.

use std::collections::VecDeque;
use std::time::Duration;

use domain::skill::Goal;
use domain::time::Time;
use kittiwake_proto::topics::{Request, Response};
use kittiwake_proto::v1;
use node::CallError;

use crate::config::PlanApproval;
use crate::outbox::{Outbox, Purpose};

/// The step after the present one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Next {
    /// Not asked for yet, or the answer did not come.
    Unknown,
    /// Asked for.
    Asked,
    /// Fetched; `None`: the plan has no further step.
    Fetched(Option<Box<v1::PlanStep>>),
}

/// Where a request for a plan stands.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Replanning {
    /// Nothing was asked.
    Idle,
    /// Asked under this request id.
    Asked(String),
    /// The planner is late or gone: ask again then.
    Late(Time),
    /// The planner said to hold: ask again then, or when a permission changes.
    Hold {
        /// When to ask again.
        until: Time,
        /// Permissions' revision when it said so.
        revision: u64,
        /// What was held when it said so; a permission that is about to expire is no longer.
        held: Vec<String>,
    },
    /// A plan has come that is flown only once it is approved.
    Proposed(Box<Proposal>),
    /// A new plan was taken over.
    Planned,
    /// Every objective is terminal.
    Finished,
}

/// A plan that waits for approval.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Proposal {
    pub(crate) plan: v1::Plan,
    /// When the default counts.
    pub(crate) until: Time,
}

/// Why the present step cannot be flown on.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Failed {
    pub(crate) step_id: u64,
    pub(crate) reason: String,
    pub(crate) denials: Vec<v1::Denial>,
}

/// Pauses before a plan is asked for after the first, second, .. failure in a row, in units of the first pause.
const PAUSES: [f64; 5] = [0.0, 1.0, 2.0, 4.0, 8.0];

/// The permissions at the moment of an answer.
#[derive(Debug, Clone)]
pub(crate) struct Held {
    /// Counts decisions, so that a change is noticed.
    pub(crate) revision: u64,
    /// The areas that may be entered.
    pub(crate) areas: Vec<String>,
}

#[derive(Debug)]
pub(crate) struct Planner {
    instance: u64,
    last_request: u64,
    pub(crate) step: Option<v1::PlanStep>,
    pub(crate) next: Next,
    /// Number of the present step within its plan, from 1, and how many the plan has.
    pub(crate) step_number: u32,
    pub(crate) step_count: u32,
    pub(crate) failed: Option<Failed>,
    /// What the failed step was to fly; the transition goes that way.
    pub(crate) failed_goal: Option<Goal>,
    pub(crate) replanning: Replanning,
    /// Steps that failed one after the other, and when to ask for a plan again after the last.
    failures: usize,
    pub(crate) ask_from: Time,
    /// Steps that were flown, until the planner has acknowledged them, first flown first.
    flown: VecDeque<v1::StepDone>,
    telling: bool,
    again_at: Time,
    pub(crate) status: Option<v1::PlannerStatus>,
    pub(crate) areas: Vec<domain::area::Area>,
    /// Of the plan that is flown.
    epoch: u64,
    /// The objective that was planned for last.
    planned_for: Option<u32>,
    /// Why the present step is to be given up, until its executor has done so.
    withdrawn: Option<String>,
}

impl Planner {
    pub(crate) fn new(instance: u64) -> Planner {
        Planner {
            instance,
            last_request: 0,
            step: None,
            next: Next::Unknown,
            step_number: 0,
            step_count: 0,
            failed: None,
            failed_goal: None,
            replanning: Replanning::Idle,
            failures: 0,
            ask_from: Time::ZERO,
            flown: VecDeque::new(),
            telling: false,
            again_at: Time::ZERO,
            status: None,
            areas: Vec::new(),
            epoch: 0,
            planned_for: None,
            withdrawn: None,
        }
    }

    /// Whether every flown step has been acknowledged, so that a request for a plan finds them taken in.
    pub(crate) fn is_up_to_date(&self) -> bool {
        self.flown.is_empty()
    }

    /// Asks for a plan.
    pub(crate) fn replan(&mut self, state: v1::PlanningState, timeout: Duration, outbox: &mut Outbox) {
        self.last_request += 1;
        let request_id = format!("mcm-{:x}-r{}", self.instance, self.last_request);
        let failed = self.failed.clone().unwrap_or_default();
        let request = v1::ReplanRequest {
            request_id: request_id.clone(),
            state: Some(state),
            failed_step_id: failed.step_id,
            failure: failed.reason,
            denials: failed.denials,
        };
        self.replanning = Replanning::Asked(request_id);
        outbox.call(Purpose::Replan(request.request_id.clone()), Request::Replan(request), timeout);
    }

    /// Fetches the step after the present one, before that one ends.
    pub(crate) fn prefetch(&mut self, now: Time, timeout: Duration, outbox: &mut Outbox) {
        if let (Some(step), Next::Unknown) = (&self.step, &self.next)
            && self.again_at <= now
        {
            let request = v1::NextStepRequest { after_step_id: step.id };
            outbox.call(Purpose::NextStep(step.id), Request::NextStep(request), timeout);
            self.next = Next::Asked;
        }
    }

    /// The present step was flown: the next one, if it is known, becomes the present one.
    pub(crate) fn advance(&mut self) -> Option<v1::PlanStep> {
        let Next::Fetched(step) = std::mem::replace(&mut self.next, Next::Unknown) else { return None };
        self.step = step.map(|it| *it);
        self.step_number += 1;
        self.step.clone()
    }

    /// The present step was flown; the planner is told until it has acknowledged it.
    pub(crate) fn done(&mut self, step_id: u64, state: v1::PlanningState) {
        self.failures = 0;
        self.flown.push_back(v1::StepDone { step_id, state: Some(state) });
    }

    /// The present step failed by itself. Steps that keep failing are replanned ever more slowly, so
    /// that a moment's trouble does not use up every try, and a contingency gets its say.
    pub(crate) fn fail(&mut self, now: Time, reason: String, denials: Vec<v1::Denial>, first_pause: Duration) {
        if denials.is_empty() {
            self.ask_from = now + first_pause.mul_f64(PAUSES[self.failures.min(PAUSES.len() - 1)]);
            self.failures += 1;
        }
        self.interrupt(reason, denials);
    }

    /// The present step is given up, through no fault of its own or for want of a permission.
    pub(crate) fn interrupt(&mut self, reason: String, denials: Vec<v1::Denial>) {
        if let Some(step) = self.step.take() {
            self.failed = Some(Failed { step_id: step.id, reason, denials });
            self.failed_goal = step.nominal.and_then(|it| it.goal).and_then(|it| it.try_into().ok());
            self.next = Next::Unknown;
        }
    }

    /// The present step is not to be begun, or was flown: what comes next is asked for anew.
    pub(crate) fn drop_step(&mut self) {
        self.step = None;
        self.next = Next::Unknown;
    }

    /// Tells the planner of the first flown step that it does not know of.
    pub(crate) fn tell(&mut self, now: Time, timeout: Duration, outbox: &mut Outbox) {
        if self.telling || now < self.again_at {
            return;
        }
        if let Some(done) = self.flown.front() {
            outbox.call(Purpose::StepDone(done.step_id), Request::StepDone(done.clone()), timeout);
            self.telling = true;
        }
    }

    /// When [`Planner::tell`] or [`Planner::prefetch`] try again.
    pub(crate) fn deadline(&self, now: Time) -> Option<Time> {
        (now < self.again_at).then_some(self.again_at)
    }

    /// The answer to a request for a plan.
    pub(crate) fn on_plan(
        &mut self,
        now: Time,
        request_id: &str,
        result: Result<Response, CallError>,
        patience: Duration,
        Held { revision, areas: held }: Held,
        (approval, limit): (PlanApproval, Duration),
    ) -> Option<String> {
        // An answer to an earlier request was given for a state that no longer is.
        if self.replanning != Replanning::Asked(request_id.to_owned()) {
            return None;
        }
        let reply = match result {
            Ok(Response::Replan(v1::ReplanReply { reply: Some(reply) })) => reply,
            Ok(_) => {
                self.replanning = Replanning::Late(now + patience);
                return Some("planner: an empty answer".into());
            }
            Err(error) => {
                self.replanning = Replanning::Late(now + patience);
                return Some(format!("planner {error}; asking again"));
            }
        };
        match reply {
            v1::replan_reply::Reply::Plan(plan) if plan.steps.is_empty() => {
                self.replanning = Replanning::Late(now + patience);
                Some("planner: a plan without steps; asking again".into())
            }
            v1::replan_reply::Reply::Plan(plan) if plan.epoch < self.newest_epoch() => {
                self.replanning = Replanning::Idle;
                Some(format!("plan {} was made before the mission was changed; asking again", plan.revision))
            }
            v1::replan_reply::Reply::Plan(plan) => {
                let words = plan.steps.iter().map(crate::words::step).collect::<Vec<_>>().join("; ");
                let words = format!("plan {}: {words}", plan.revision);
                let is_first = self.planned_for != Some(plan.objective);
                let waits =
                    approval == PlanApproval::EachPlan || (approval == PlanApproval::EachReplanning && !is_first);
                if waits {
                    self.replanning = Replanning::Proposed(Box::new(Proposal { plan, until: now + limit }));
                    return Some(format!("{words}; waits for approval"));
                }
                self.adopt(plan);
                Some(words)
            }
            v1::replan_reply::Reply::Hold(hold) => {
                let wait = Duration::try_from_secs_f64(hold.wait_s).unwrap_or(patience);
                self.replanning = Replanning::Hold { until: now + wait, revision, held };
                // What was told once need not be told again: the planner has taken it in.
                if let Some(failed) = &mut self.failed {
                    failed.denials.clear();
                }
                Some(format!("hold for {:.0} s: {}", wait.as_secs_f64(), hold.reason))
            }
            v1::replan_reply::Reply::Finished(_) => {
                self.replanning = Replanning::Finished;
                self.failed = None;
                Some("every objective is settled".into())
            }
        }
    }

    /// Flies `plan`.
    pub(crate) fn adopt(&mut self, plan: v1::Plan) {
        self.step_count = plan.steps.len() as u32;
        self.step_number = 1;
        self.epoch = plan.epoch;
        self.planned_for = Some(plan.objective);
        self.step = plan.steps.into_iter().next();
        self.next = Next::Unknown;
        self.failed = None;
        self.withdrawn = None;
        self.replanning = Replanning::Planned;
    }

    /// The plan that waits for approval.
    pub(crate) fn proposal(&self) -> Option<&Proposal> {
        match &self.replanning {
            Replanning::Proposed(it) => Some(it),
            _ => None,
        }
    }

    /// The present step is to be given up, through no fault of its own; its executor does so at its next tick.
    pub(crate) fn withdraw(&mut self, reason: impl Into<String>) {
        match self.replanning {
            // What is being waited for was asked about a mission that is no more.
            Replanning::Hold { .. } | Replanning::Proposed(_) if self.step.is_none() => {
                self.replanning = Replanning::Idle;
                self.planned_for = None;
            }
            _ => self.withdrawn = Some(reason.into()),
        }
    }

    /// Why the present step is to be given up, if it is.
    pub(crate) fn withdrawal(&self) -> Option<&str> {
        self.withdrawn.as_deref()
    }

    /// The present step is given up: the next plan is made for its objective, not for it.
    pub(crate) fn give_up(&mut self) {
        self.interrupt(String::new(), Vec::new());
        (self.failed, self.withdrawn) = (None, None);
        self.ask_from = Time::ZERO;
    }

    fn newest_epoch(&self) -> u64 {
        self.status.as_ref().map_or(0, |it| it.epoch)
    }

    /// The answer to a prefetch.
    pub(crate) fn on_next(&mut self, now: Time, after: u64, result: Result<Response, CallError>, patience: Duration) {
        if self.next != Next::Asked || self.step.as_ref().is_none_or(|it| it.id != after) {
            return;
        }
        match result {
            Ok(Response::NextStep(reply)) => self.next = Next::Fetched(reply.step.map(Box::new)),
            _ => {
                self.next = Next::Unknown;
                self.again_at = now + patience;
            }
        }
    }

    /// The answer to a flown step.
    pub(crate) fn on_done(&mut self, now: Time, step_id: u64, result: Result<Response, CallError>, patience: Duration) {
        self.telling = false;
        match result {
            Ok(_) => {
                // Refused or accepted: the planner knows what it wants to know of it.
                self.flown.retain(|it| it.step_id != step_id);
            }
            Err(_) => self.again_at = now + patience,
        }
    }

    /// Takes in the planner's own account. Areas that make no sense are left out.
    pub(crate) fn on_status(&mut self, status: v1::PlannerStatus) {
        self.areas = status.areas.iter().cloned().filter_map(|it| it.try_into().ok()).collect();
        if self.newest_epoch() < status.epoch && self.epoch < status.epoch {
            self.withdraw("the mission was changed");
        }
        self.status = Some(status);
    }

    /// Whether the planner's account says that every objective is terminal.
    pub(crate) fn all_settled(&self) -> bool {
        self.status.as_ref().is_some_and(|it| it.current_objective as usize == it.objectives.len())
    }
}
