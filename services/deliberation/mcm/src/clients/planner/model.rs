//! The planner's client against a planner whose answers are late, lost, repeated, out of order, or for a mission that has changed.
//!
//! Whatever happens: what is flown is a step of the plan that was adopted last, and was not flown before; no answer counts that was
//! made before the mission was changed; every flown step is reported until an answer has taken it in; every question repeats the denials that
//! no answer has followed yet; an answer that nobody waits for changes nothing.

use std::collections::BTreeSet;

use domain::geometry::Ned;
use domain::mission::{Objective, ObjectiveStatus, Progress};
use domain::plan::{Condition, DenialKind, Parameters};
use domain::skill::Goal;
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
    ChangeMission { voids_plan: bool },
    Fly,
    Fail { is_denied: bool },
    Interrupt { is_failure: bool },
    GiveUp,
    Begin,
    Stop,
    Approve,
    Refuse,
}

#[derive(Debug, Clone)]
enum Answer {
    Plan { steps: u64 },
    Hold,
    Finished,
    Refused,
    AreasUnknown,
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
            6 => (1..4_u64).prop_map(|steps| Answer::Plan { steps }),
            1 => Just(Answer::AreasUnknown),
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
            1 => any::<bool>().prop_map(|voids_plan| T::ChangeMission { voids_plan }),
            4 => Just(T::Fly),
            2 => any::<bool>().prop_map(|is_denied| T::Fail { is_denied }),
            1 => any::<bool>().prop_map(|is_failure| T::Interrupt { is_failure }),
            1 => Just(T::GiveUp),
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
    /// Each with the version of the mission that it was asked about.
    questions: Vec<(String, u64)>,
    /// Every step that the planner has made, in order.
    steps: Vec<StepId>,
    /// Those of the plan that was adopted last.
    adopted: BTreeSet<StepId>,
    flown: BTreeSet<StepId>,
    /// Those that no answer has taken in.
    untold_steps: usize,
    untold: Vec<Denial>,
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
            from: Ned::default(),
            passed: 0,
            reaches: state(),
            nominal,
            ask: Vec::new(),
            ask_ahead: Vec::new(),
            auxiliary: false,
            along: Vec::new(),
            text: String::new(),
        }
    }

    fn present(&self) -> Option<StepId> {
        self.planner.flight.step().map(|(step, ..)| step.id)
    }

    fn ask(&mut self, held: bool) {
        let may_ask =
            matches!(self.planner.request, PlanRequest::Idle | PlanRequest::Retry(..) | PlanRequest::Hold(..));
        if !may_ask || self.present().is_some() {
            return;
        }
        let basis =
            Basis { revision: 0, held: held.then(|| "A".to_owned()).into_iter().collect(), areas_id: String::new() };
        let viewpoint = Viewpoint { at: Now { time: self.now, utc_ms: 0 }, state: state(), origin: None, wind: None };
        self.planner.ask_for_plan(viewpoint, (basis, Grants::new()), 1.5, SECOND, &mut self.outbox);
        if let PlanRequest::Asked(question) = &self.planner.request {
            assert_eq!(question.denials, self.untold, "every denial is reported");
            assert_eq!(question.flown, self.untold_steps, "every flown step is reported");
            self.questions.push((question.id.clone(), question.version));
        }
    }

    fn answer(&mut self, question: usize, answer: &Answer, holds: bool) {
        let Some((id, asked_about)) = self.questions.iter().rev().nth(question).cloned() else { return };
        let reply = match *answer {
            Answer::Plan { steps } => {
                self.plans += 1;
                let steps = (0..steps).map(|_| self.make_step()).collect();
                Ok(PlanReply::Plan(Plan { objective: 0, steps, revision: self.plans }))
            }
            Answer::Hold => Ok(PlanReply::Hold { wait: SECOND, reason: String::new(), planned: false }),
            Answer::Finished => Ok(PlanReply::Finished),
            Answer::Refused => Ok(PlanReply::Refused(String::new())),
            Answer::AreasUnknown => Ok(PlanReply::AreasUnknown),
            Answer::Unanswered => Err(NoAnswer::Call(CallError::Unanswered)),
            Answer::Gone => Err(NoAnswer::Call(CallError::Unavailable)),
        };
        let has_course = !matches!(answer, Answer::Refused | Answer::AreasUnknown);
        let is_settled = matches!(answer, Answer::Finished);
        let reply = reply.map(|reply| Answered { reply, course: has_course.then(|| course(is_settled)) });
        let is_awaited = self.planner.request.awaits(&id).is_some();
        let version = self.planner.mission.version();
        let before = format!("{:?}", self.planner);
        let basis = Basis { revision: 0, held: Vec::new(), areas_id: String::new() };
        let policy = (self.approval, SECOND);
        let said = self.planner.on_plan(self.now, &id, reply, SECOND, (basis, |_: &Question| holds), policy);
        if !is_awaited {
            assert!(
                said.is_none() && before == format!("{:?}", self.planner),
                "an answer that nobody awaits changes nothing"
            );
        }
        if self.planner.mission.version() != version {
            assert_eq!(asked_about, version, "an answer about the previous mission counts");
            self.untold.clear();
            self.untold_steps = 0;
        }
        self.note_adopted();
    }

    /// A plan that is flown from now on is the newest one of the mission.
    fn note_adopted(&mut self) {
        let Some((step, 1, count)) = self.planner.flight.step().map(|(step, number, count)| (step.id, number, count))
        else {
            return;
        };
        if !self.adopted.contains(&step) {
            self.adopted = (step.0..step.0 + u64::from(count)).map(StepId).collect();
            self.untold.clear();
        }
    }

    fn fly(&mut self) {
        let Some((step, ..)) = self.planner.flight.step() else { return };
        let step = (**step).clone();
        self.flown.insert(step.id);
        let flown = FlownStep { step, state: state(), at: Now { time: self.now, utc_ms: 0 }, along_failure: None };
        self.planner.flown(self.now, flown, SECOND);
        self.untold_steps += 1;
        self.planner.advance();
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
        let Some((plan, _)) = self.planner.request.proposal() else { return };
        match is_approved {
            true => self.planner.adopt(plan.clone()),
            false => self.planner.discard_proposal(),
        }
        self.note_adopted();
    }
}

/// The mission as an answer has it.
fn course(is_settled: bool) -> Course {
    let objective = Objective::new("there".into(), Ned::default(), false).expect("it is one");
    let progress = if is_settled { Progress::Success } else { Progress::Waiting };
    let objectives = vec![ObjectiveStatus { progress, ..ObjectiveStatus::waiting(&objective) }];
    Course { mission: MissionStatus { objectives, ..MissionStatus::default() }, notes: Default::default() }
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
            untold_steps: 0,
            untold: Vec::new(),
            plans: 0,
        }
    }

    fn apply(mut client: Client, (): &(), transition: Transition) -> Client {
        use Transition as T;
        match transition {
            T::Pass => client.now = client.now + SECOND,
            T::Ask { held } => client.ask(held),
            T::Answer { question, answer, holds } => client.answer(question, &answer, holds),
            T::ChangeMission { voids_plan } => {
                let flown = client.planner.mission.flown();
                client.planner.on_change(course(false), None, flown, voids_plan);
                client.untold_steps = 0;
                if voids_plan {
                    client.untold.clear();
                    // From now on every second plan waits for somebody.
                    client.approval = match client.approval {
                        PlanApproval::None => PlanApproval::EachPlan,
                        _ => PlanApproval::None,
                    };
                }
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
            T::Begin => {
                if client.present().is_none() {
                    client.planner.begin_asking_for_plan();
                }
            }
            T::Stop => client.planner.stop_asking_for_plan(),
            T::Approve => client.decide(true),
            T::Refuse => client.decide(false),
        }
        client
    }

    fn check_invariants(client: &Client, (): &()) {
        if let Some(step) = client.present() {
            assert!(client.adopted.contains(&step), "{step} is not one of {:?}", client.adopted);
            assert!(!client.flown.contains(&step), "{step} is flown a second time");
            assert!(!matches!(client.planner.request, PlanRequest::Asked(_)), "it asks for a plan and flies one");
        }
        assert_eq!(client.planner.mission.flown(), client.untold_steps);
        let (_, denials) = client.planner.flight.failure();
        assert_eq!(denials, client.untold);
    }
}

prop_state_machine! {
    #![proptest_config(ProptestConfig { cases: 2_000, ..ProptestConfig::default() })]

    #[test]
    fn whatever_the_planner_answers_what_is_flown_is_right(sequential 1..60 => Client);
}
