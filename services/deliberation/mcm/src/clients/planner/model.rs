//! The planner's client against a planner whose answers are late, lost, repeated, out of order, or for a mission that has changed.
//!
//! Whatever happens: what is flown is a step of the plan that was adopted last, and was not flown before; no plan is adopted that was
//! made before the mission was changed; every flown step is reported until the planner has acknowledged it, and no plan is asked for
//! before; every question repeats the denials that no answer has followed yet; an answer that nobody waits for changes nothing.

use std::collections::BTreeSet;

use domain::geometry::Ned;
use domain::plan::{Condition, DenialKind, Parameters};
use proptest::prelude::*;
use proptest_state_machine::{ReferenceStateMachine, StateMachineTest, prop_state_machine};

use super::*;

const SECOND: Duration = Duration::from_secs(1);

/// What the planner says. Indices count back from the newest of its kind.
#[derive(Debug, Clone)]
enum Transition {
    Pass,
    Ask { held: bool },
    Answer { question: usize, answer: Answer, holds: bool },
    Next { after: usize, next: Option<bool> },
    Acknowledge { step: usize, is_heard: bool },
    ChangeMission,
    Fly,
    Fail { is_denied: bool },
    Interrupt { is_failure: bool },
    GiveUp,
    Drop,
    Begin,
    Stop,
    Approve,
    Refuse,
}

#[derive(Debug, Clone)]
enum Answer {
    Plan { steps: u64, is_old: bool },
    Hold,
    Finished,
    Refused,
    Unanswered,
    Gone,
}

/// Anything may happen at any time.
struct Anything;

impl ReferenceStateMachine for Anything {
    type State = ();
    type Transition = Transition;

    fn init_state() -> BoxedStrategy<()> {
        Just(()).boxed()
    }

    fn transitions((): &()) -> BoxedStrategy<Transition> {
        use Transition as T;
        let answer = prop_oneof![
            6 => (1..4_u64, prop::bool::weighted(0.2)).prop_map(|(steps, is_old)| Answer::Plan { steps, is_old }),
            1 => Just(Answer::Hold),
            1 => Just(Answer::Finished),
            1 => Just(Answer::Refused),
            2 => Just(Answer::Unanswered),
            1 => Just(Answer::Gone),
        ];
        prop_oneof![
            3 => Just(T::Pass),
            6 => any::<bool>().prop_map(|held| T::Ask { held }),
            6 => (0..3_usize, answer, prop::bool::weighted(0.8))
                .prop_map(|(question, answer, holds)| T::Answer { question, answer, holds }),
            4 => (0..3_usize, prop::option::of(any::<bool>())).prop_map(|(after, next)| T::Next { after, next }),
            4 => (0..3_usize, prop::bool::weighted(0.7)).prop_map(|(step, is_heard)| T::Acknowledge { step, is_heard }),
            1 => Just(T::ChangeMission),
            4 => Just(T::Fly),
            2 => any::<bool>().prop_map(|is_denied| T::Fail { is_denied }),
            1 => any::<bool>().prop_map(|is_failure| T::Interrupt { is_failure }),
            1 => Just(T::GiveUp),
            1 => Just(T::Drop),
            3 => Just(T::Begin),
            1 => Just(T::Stop),
            2 => Just(T::Approve),
            1 => Just(T::Refuse),
        ]
        .boxed()
    }

    fn apply((): (), _: &Transition) {}
}

/// The client, and what somebody knows who has seen everything.
struct Client {
    planner: Planner,
    outbox: Outbox,
    now: Time,
    approval: PlanApproval,
    questions: Vec<String>,
    /// Every step that the planner has made, in order.
    steps: Vec<StepId>,
    /// Those of the plan that was adopted last.
    adopted: BTreeSet<StepId>,
    flown: BTreeSet<StepId>,
    unacknowledged: Vec<StepId>,
    untold: Vec<Denial>,
    epoch: u64,
    plans: u64,
}

impl Client {
    fn make_step(&mut self) -> Step {
        let id = StepId(self.steps.len() as u64 + 1);
        self.steps.push(id);
        let nominal =
            Parameters { goal: Goal::Land, precondition: Condition::default(), invariant: Condition::default() };
        Step {
            id,
            objective: 0,
            reaches: state(),
            nominal,
            ask: Vec::new(),
            ask_ahead: Vec::new(),
            auxiliary: false,
            text: String::new(),
        }
    }

    fn present(&self) -> Option<StepId> {
        self.planner.step().map(|(step, ..)| step.id)
    }

    fn ask(&mut self, held: bool) {
        let may_ask =
            matches!(self.planner.request(), PlanRequest::Idle | PlanRequest::Retry(..) | PlanRequest::Hold(..));
        if !may_ask || self.present().is_some() {
            return;
        }
        let basis = Basis { revision: 0, held: held.then(|| "A".to_owned()).into_iter().collect() };
        let is_asked = self.planner.ask_for_plan((state(), basis), Grants::new(), 0, 1.5, SECOND, &mut self.outbox);
        assert_eq!(is_asked, self.unacknowledged.is_empty(), "a plan is asked for once every step is reported");
        if let PlanRequest::Asked(question) = self.planner.request() {
            assert_eq!(question.denials, self.untold, "every denial is told");
            self.questions.push(question.id.clone());
        }
    }

    fn answer(&mut self, question: usize, answer: &Answer, holds: bool) {
        let Some(id) = self.questions.iter().rev().nth(question).cloned() else { return };
        let reply = match *answer {
            Answer::Plan { steps, is_old } => {
                self.plans += 1;
                let epoch = if is_old { self.epoch.saturating_sub(1) } else { self.epoch };
                let steps = (0..steps).map(|_| self.make_step()).collect();
                Ok(PlanReply::Plan(Plan { objective: 0, steps, revision: self.plans, epoch }))
            }
            Answer::Hold => Ok(PlanReply::Hold { wait: SECOND, reason: String::new(), planned: false }),
            Answer::Finished => Ok(PlanReply::Finished),
            Answer::Refused => Ok(PlanReply::Refused(String::new())),
            Answer::Unanswered => Err(NoAnswer::Call(CallError::Unanswered)),
            Answer::Gone => Err(NoAnswer::Call(CallError::Unavailable)),
        };
        let is_awaited = self.planner.request().awaits(&id).is_some();
        let before = format!("{:?}", self.planner);
        let basis = Basis { revision: 0, held: Vec::new() };
        let policy = ApprovalPolicy { plans: self.approval, limit: SECOND };
        let said = self.planner.on_plan(self.now, &id, reply, SECOND, (basis, |_: &Question| holds), policy);
        if !is_awaited {
            assert!(
                said.is_none() && before == format!("{:?}", self.planner),
                "an answer that nobody awaits changes nothing"
            );
        }
        if matches!(self.planner.request(), PlanRequest::Hold(..) | PlanRequest::Finished(_)) && is_awaited {
            self.untold.clear();
        }
        self.note_adopted();
    }

    /// A plan that is flown from now on is the newest one of the mission.
    fn note_adopted(&mut self) {
        let Some((step, 1, count)) = self.planner.step().map(|(step, number, count)| (step.id, number, count)) else {
            return;
        };
        if !self.adopted.contains(&step) {
            assert!(self.planner.newest_epoch() <= self.planner.epoch, "a plan for the mission of before is flown");
            self.adopted = (step.0..step.0 + u64::from(count)).map(StepId).collect();
            self.untold.clear();
        }
    }

    fn next(&mut self, after: usize, next: Option<bool>) {
        let Some(after) = self.steps.iter().rev().nth(after).copied() else { return };
        let is_asked = self.present() == Some(after) && self.planner.next() == Some(&Next::Asked);
        let reply = match next {
            None => Err(NoAnswer::Call(CallError::Unanswered)),
            Some(false) => Ok(None),
            Some(true) => Ok(Some(self.make_step())),
        };
        if let (true, Ok(Some(step))) = (is_asked, &reply) {
            self.adopted.insert(step.id);
        }
        self.planner.on_next(self.now, after, reply, SECOND);
    }

    fn fly(&mut self) {
        let Some(id) = self.present() else { return };
        self.planner.flown(self.now, id, state(), SECOND);
        self.unacknowledged.push(id);
        self.flown.insert(id);
        match self.planner.next() {
            Some(Next::Known(_)) => {
                self.planner.advance();
            }
            _ => self.planner.drop_step(),
        }
    }

    fn fail(&mut self, is_denied: bool) {
        if self.present().is_none() {
            return;
        }
        let denial = Denial { area: "A".into(), kind: DenialKind::Refused, reason: String::new() };
        self.untold = is_denied.then_some(denial).into_iter().collect();
        self.planner.fail(self.now, "why".into(), self.untold.clone(), SECOND);
    }

    /// What a proposal says is not flown before somebody approves it.
    fn decide(&mut self, is_approved: bool) {
        let Some((plan, _)) = self.planner.request().proposal() else { return };
        match is_approved {
            true => self.planner.adopt(plan.clone()),
            false => self.planner.discard_proposal(),
        }
        self.note_adopted();
    }
}

fn state() -> State {
    State::new(Ned::default(), true)
}

impl StateMachineTest for Client {
    type SystemUnderTest = Client;
    type Reference = Anything;

    fn init_test((): &()) -> Client {
        Client {
            planner: Planner::new(1),
            outbox: Outbox::default(),
            now: Time::ZERO,
            approval: PlanApproval::None,
            questions: Vec::new(),
            steps: Vec::new(),
            adopted: BTreeSet::new(),
            flown: BTreeSet::new(),
            unacknowledged: Vec::new(),
            untold: Vec::new(),
            epoch: 1,
            plans: 0,
        }
    }

    fn apply(mut client: Client, (): &(), transition: Transition) -> Client {
        use Transition as T;
        match transition {
            T::Pass => client.now = client.now + SECOND,
            T::Ask { held } => client.ask(held),
            T::Answer { question, answer, holds } => client.answer(question, &answer, holds),
            T::Next { after, next } => client.next(after, next),
            T::Acknowledge { step, is_heard } => {
                let Some(id) = client.steps.iter().rev().nth(step).copied() else { return client };
                // Only a report that is under way is answered.
                if matches!(client.planner.reports, StepReports::Sent(_)) && is_heard {
                    client.unacknowledged.retain(|it| *it != id);
                }
                client.planner.on_report(client.now, id, is_heard, SECOND);
            }
            T::ChangeMission => {
                client.epoch += 1;
                client.planner.on_status(status(client.epoch), false);
                // From now on every second plan waits for somebody.
                client.approval =
                    if client.epoch.is_multiple_of(2) { PlanApproval::EachPlan } else { PlanApproval::None };
            }
            T::Fly => client.fly(),
            T::Fail { is_denied } => client.fail(is_denied),
            T::Interrupt { is_failure } => {
                if client.present().is_some() {
                    client.untold.clear();
                }
                client.planner.interrupt("why".into(), is_failure);
            }
            T::GiveUp => {
                if client.present().is_some() {
                    client.untold.clear();
                }
                client.planner.give_up();
            }
            T::Drop => client.planner.drop_step(),
            T::Begin => {
                if client.present().is_none() {
                    client.planner.begin_asking_for_plan();
                }
            }
            T::Stop => client.planner.stop_asking_for_plan(),
            T::Approve => client.decide(true),
            T::Refuse => client.decide(false),
        }
        client.planner.tend(client.now, SECOND, &mut client.outbox);
        client
    }

    fn check_invariants(client: &Client, (): &()) {
        if let Some(step) = client.present() {
            assert!(client.adopted.contains(&step), "{step} is none of {:?}", client.adopted);
            assert!(!client.flown.contains(&step), "{step} is flown a second time");
            assert!(!matches!(client.planner.request(), PlanRequest::Asked(_)), "it asks for a plan and flies one");
        }
        let reports = match &client.planner.reports {
            StepReports::None => Vec::new(),
            StepReports::Due(steps, _) | StepReports::Sent(steps) => steps.iter().map(|it| it.id).collect(),
        };
        assert_eq!(reports, client.unacknowledged, "every flown step is reported, in order, until it is acknowledged");
        let (_, denials) = client.planner.flight.failure();
        assert_eq!(denials, client.untold);
    }
}

fn status(epoch: u64) -> PlannerStatus {
    PlannerStatus::try_from(v1::PlannerStatus { epoch, ..Default::default() }).expect("an empty status is one")
}

prop_state_machine! {
    #![proptest_config(ProptestConfig { cases: 2_000, ..ProptestConfig::default() })]

    #[test]
    fn whatever_the_planner_answers_what_is_flown_is_right(sequential 1..60 => Client);
}
