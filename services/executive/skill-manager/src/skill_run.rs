//! One run of a skill, from its request to its outcome.

use std::time::Duration;

use domain::fmu::{Command, CommandResult, FlightMode, Setpoint};
use domain::time::Time;
use kittiwake_proto::v1::{SkillKind, SkillOutcome};

use crate::catalog::{Ready, Skill};
use crate::commands::Acknowledgement;
use crate::fsm::{Action, Ending, Event, Processing, SkillId, SkillState};
use crate::messages::{Feedback, SkillReport, TaskOrder, TaskReport};
use crate::mode_watch::{ModeWatch, left_to_autopilot};
use crate::tracks::Track;
use crate::vehicle::{FlightStatus, View};

/// A request that was accepted, with everything known about it.
#[derive(Debug)]
pub(crate) struct SkillRun {
    id: SkillId,
    request_id: String,
    skill: Box<dyn Skill>,
    /// The tasks that are to go on while it is flown.
    along: Vec<Track>,
    state: SkillState,
    /// Skills that the caller has given up, whatever becomes of this one. Includes those of the
    /// requests that this one displaced.
    gave_up: Vec<SkillId>,
    /// How many of its commands were accepted.
    accepted: usize,
    /// One of its commands was not acknowledged: the vehicle may have obeyed nevertheless.
    unacknowledged: bool,
    /// It has been the registered skill.
    flown: bool,
    /// It is to be cancelled, and the command for that was not sent yet.
    wants_neutral: bool,
    /// Since when it waits for data.
    waits_since: Option<Time>,
    /// Until when it must not be commanded, if that is known.
    not_before: Option<Time>,
    /// When it sends its first command once more, or did.
    second_try: Option<Time>,
    /// An operator has ordered it, so it may override a failsafe of the autopilot.
    takes_control: bool,
    /// Whether the vehicle still flies it.
    watch: ModeWatch,
    feedback_due: Time,
}

/// What becomes of a request whose turn has come.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Start {
    /// Data are missing: it waits for them.
    Wait,
    /// It ends, or begins, without a command.
    Without(Event),
    /// Its next command is to be sent.
    Command(Command),
}

/// What the end of a run means for the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Aftermath {
    /// A newer skill flies the vehicle.
    Replaced,
    /// The autopilot flies it, or it loiters.
    Released,
    /// Nothing flies it.
    Idle,
    /// This run never flew it.
    NeverFlew,
}

impl SkillRun {
    /// A request that waits for its turn.
    pub(crate) fn new(
        id: SkillId,
        request_id: String,
        gave_up: Option<SkillId>,
        mut skill: Box<dyn Skill>,
        view: &View,
        now: Time,
    ) -> SkillRun {
        // A goal is relative to where the vehicle is now, however long the request waits.
        skill.ready(view);
        SkillRun {
            id,
            request_id,
            skill,
            along: Vec::new(),
            state: SkillState::ProcessRequest(Processing::Waiting),
            gave_up: gave_up.into_iter().collect(),
            accepted: 0,
            unacknowledged: false,
            flown: false,
            wants_neutral: false,
            waits_since: None,
            not_before: None,
            second_try: None,
            takes_control: false,
            watch: ModeWatch::new(now),
            feedback_due: now,
        }
    }

    /// These tasks are to go on while it is flown.
    pub(crate) fn along(&mut self, along: Vec<Track>) {
        self.along = along;
    }

    /// It is flown from now on, and those tasks with it.
    pub(crate) fn take_along(&mut self) -> Vec<Track> {
        std::mem::take(&mut self.along)
    }

    /// From now on it may override a failsafe of the autopilot.
    pub(crate) fn take_control(&mut self) {
        self.takes_control = true;
    }

    pub(crate) fn id(&self) -> SkillId {
        self.id
    }

    pub(crate) fn kind(&self) -> SkillKind {
        self.skill.kind()
    }

    pub(crate) fn state(&self) -> &SkillState {
        &self.state
    }

    /// What is to be streamed while it executes.
    pub(crate) fn setpoint(&self) -> Option<Setpoint> {
        self.skill.setpoint()
    }

    /// Whether one of its commands was accepted.
    pub(crate) fn has_commanded(&self) -> bool {
        0 < self.accepted
    }

    /// Whether one of its commands was not acknowledged, so that the vehicle may have obeyed nevertheless.
    pub(crate) fn is_unacknowledged(&self) -> bool {
        self.unacknowledged
    }

    /// The skills that its callers have given up.
    pub(crate) fn gave_up(&self) -> &[SkillId] {
        &self.gave_up
    }

    /// Takes over what the callers of a displaced request have given up.
    pub(crate) fn inherit(&mut self, displaced: &SkillRun) {
        self.gave_up.extend(&displaced.gave_up);
    }

    /// Takes an event; returns what is to be done.
    ///
    /// An event that cannot happen leaves everything as it is: in flight that is the best answer to
    /// a programming error, in a test it stops the test.
    pub(crate) fn take(&mut self, event: Event) -> &'static [Action] {
        match self.state.clone().on(event) {
            Ok((state, actions)) => {
                self.state = state;
                actions
            }
            Err(invalid) => {
                debug_assert!(false, "skill {}: {invalid}", self.id);
                &[]
            }
        }
    }

    /// Its turn has come. `data_wait` is how long it may wait for data; `why` are the autopilot's own words about what it flies.
    pub(crate) fn start(&mut self, view: &View, why: &str, now: Time, data_wait: Duration) -> Start {
        if self.state == SkillState::ProcessRequest(Processing::Waiting) {
            if self.second_try.is_some_and(|at| now < at) {
                return Start::Wait;
            }
            let waited = self.waits_since.is_some_and(|since| since + data_wait <= now);
            self.not_before = None;
            let ready = match view.is_heard || self.may_override_failsafe() {
                true => self.skill.ready(view),
                false => Ready::Await("vehicle status"),
            };
            match ready {
                Ready::AlreadyTrue => return Start::Without(Event::AlreadyTrue),
                Ready::NotBefore(at) => {
                    // Data that are missing later are waited for from then on.
                    (self.waits_since, self.not_before) = (None, Some(at));
                    return Start::Wait;
                }
                Ready::Refuse(reason) if waited => {
                    return Start::Without(Event::Refused(Ending::because(SkillOutcome::Failed, reason)));
                }
                Ready::Require(data) if waited => {
                    let reason = format!("no recent {data} from the vehicle");
                    return Start::Without(Event::Refused(Ending::because(SkillOutcome::Failed, reason)));
                }
                Ready::Await(_) | Ready::Require(_) | Ready::Refuse(_) if !waited => {
                    self.waits_since.get_or_insert(now);
                    return Start::Wait;
                }
                Ready::Command | Ready::Await(_) | Ready::Require(_) | Ready::Refuse(_) => {
                    self.waits_since = None;
                    self.take(Event::Commanded);
                }
            }
        }
        match (self.skill.command(self.accepted), self.left_to_autopilot(view, why)) {
            (Some(_), Some(ending)) => Start::Without(Event::Refused(ending)),
            (Some(command), None) => Start::Command(command),
            (None, _) => Start::Without(Event::Accepted),
        }
    }

    /// How it ends instead of being commanded, if the autopilot flies a failsafe of its own that it may not override.
    fn left_to_autopilot(&self, view: &View, why: &str) -> Option<Ending> {
        let status = view.failsafe.filter(|_| !self.may_override_failsafe())?;
        Some(left_to_autopilot(status, why))
    }

    /// When it gives up waiting for data, may be commanded, or sends its first command once more.
    pub(crate) fn wait_deadline(&self, data_wait: Duration) -> Option<Time> {
        self.waits_since.map(|since| since + data_wait).or(self.not_before).or(self.second_try)
    }

    /// Whether its first command, which the autopilot has refused, is to be sent once more at `at`.
    pub(crate) fn tries_again(&mut self, ack: &Acknowledgement, at: Time) -> bool {
        let refused = matches!(ack, Acknowledgement::Answered(CommandResult::Rejected { .. }));
        let first = self.accepted == 0 && self.state == SkillState::ProcessRequest(Processing::Commanding);
        let again = refused && first && self.second_try.is_none();
        if again {
            self.second_try = Some(at);
        }
        again
    }

    /// A command that starts it was acknowledged or not; `None`: it has another one to send.
    pub(crate) fn start_acknowledged(&mut self, command: Command, ack: &Acknowledgement) -> Option<Event> {
        if !ack.is_accepted() {
            self.unacknowledged = *ack == Acknowledgement::Missing;
            let reason = format!("start: {}", ack.describe(command));
            return Some(Event::Refused(Ending::because(SkillOutcome::Rejected, reason)));
        }
        self.accepted += 1;
        let goes_on = self.state == SkillState::ProcessRequest(Processing::Commanding)
            && self.skill.command(self.accepted).is_some();
        (!goes_on).then_some(Event::Accepted)
    }

    /// Whether it goes on to its own end although the command that cancels it was accepted: what it has commanded happens.
    pub(crate) fn goes_on_when_cancelled(&self) -> bool {
        self.skill.is_irrevocable() && self.has_commanded()
    }

    /// It is the registered skill from now on. Its first feedback is due at once.
    pub(crate) fn register(&mut self, now: Time) {
        self.flown = true;
        self.watch = ModeWatch::new(now);
        self.feedback_due = now;
        self.skill.execute(now);
    }

    /// How it ends, if its postcondition is seen or can no longer be reached.
    pub(crate) fn progress(&mut self, view: &View, now: Time) -> Option<Ending> {
        if !self.has_only_armed() {
            self.skill.progress(view, now)
        } else if self.state == SkillState::Cancel {
            None
        } else {
            let reason = "the vehicle was armed, and neither took off nor was disarmed";
            Some(Ending::because(SkillOutcome::Failed, reason))
        }
    }

    /// How it ends, if a status shows that the vehicle flies something else; `why`: the autopilot's own words.
    pub(crate) fn judge_mode(&mut self, status: FlightStatus, why: &str, now: Time, limit: Duration) -> Option<Ending> {
        // In C the mode is expected to change.
        if self.executes() && !self.stands() {
            self.watch.judge(self.skill.as_ref(), status, why, now, limit)
        } else {
            None
        }
    }

    /// Whether its goal is a place or a height in the local frame.
    pub(crate) fn depends_on_frame(&self) -> bool {
        self.skill.depends_on_frame()
    }

    /// Whether it is used by a vehicle that stands, so that its end needs no command.
    pub(crate) fn stands(&self) -> bool {
        self.skill.stands()
    }

    /// Whether it waits for its turn, or for the acknowledgement of a command.
    pub(crate) fn is_starting(&self) -> bool {
        matches!(self.state, SkillState::ProcessRequest(_))
    }

    /// Whether it is in E.
    fn executes(&self) -> bool {
        matches!(self.state, SkillState::Execute { .. })
    }

    /// When it ends, or must look again, even if no data come.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.skill.deadline()
    }

    /// When its next feedback is due.
    pub(crate) fn feedback_deadline(&self) -> Option<Time> {
        Some(self.feedback_due).filter(|_| self.executes())
    }

    /// Its feedback if that is due; there is none while the position is not known.
    pub(crate) fn feedback(&mut self, view: &View, now: Time, period: Duration) -> Option<Feedback> {
        self.feedback_deadline().filter(|due| *due <= now)?;
        self.feedback_due = now + period;
        let motion = view.motion?;
        let (id, kind, distance_left_m) = (self.id, self.skill.kind(), self.skill.distance_left_m(&motion));
        Some(Feedback { id, kind, motion, distance_left_m })
    }

    /// What its own process is to be told now.
    pub(crate) fn take_order(&mut self, now: Time) -> Option<TaskOrder> {
        self.skill.take_order(now)
    }

    /// What ends it in its own process, if it goes on there, and how long that may take.
    pub(crate) fn order_to_end(&self) -> Option<(TaskOrder, Duration)> {
        self.skill.order_to_end()
    }

    /// Whether this is the task of that name.
    pub(crate) fn is_requested_as(&self, request_id: &str) -> bool {
        self.request_id == request_id
    }

    /// A process has reported about a declared skill.
    pub(crate) fn hear(&mut self, report: &TaskReport, now: Time) {
        self.skill.hear(report, now);
    }

    /// It is to be cancelled as soon as no other command is in flight.
    pub(crate) fn request_neutral(&mut self) {
        self.wants_neutral = true;
    }

    /// The command that cancels it, if it waits to be sent.
    pub(crate) fn take_neutral(&mut self) -> Option<Command> {
        let neutral = if self.has_only_armed() { Command::Disarm } else { Command::Loiter };
        std::mem::take(&mut self.wants_neutral).then_some(neutral)
    }

    /// Whether it may start while the autopilot flies a failsafe of its own: what an operator orders may, and what says so itself.
    pub(crate) fn may_override_failsafe(&self) -> bool {
        self.takes_control || self.skill.may_start_during_failsafe()
    }

    /// Whether it is a takeoff.
    pub(crate) fn takes_off(&self) -> bool {
        self.skill.kind() == SkillKind::Takeoff
    }

    /// Whether it has armed the vehicle, as far as is known, and has not taken off.
    pub(crate) fn has_only_armed(&self) -> bool {
        let arms = self.skill.command(0) == Some(Command::Arm);
        arms && (0 < self.accepted || self.unacknowledged) && self.skill.command(self.accepted).is_some()
    }

    /// What its end with `outcome` means for the vehicle.
    pub(crate) fn aftermath(&self, outcome: SkillOutcome) -> Aftermath {
        match outcome {
            SkillOutcome::Aborted if self.flown || !self.has_commanded() => Aftermath::Replaced,
            // Setpoints would silently take back what the autopilot has taken over.
            SkillOutcome::Preempted if self.flown => Aftermath::Released,
            SkillOutcome::Cancelled if self.flown => Aftermath::Released,
            // It has left the vehicle in loiter.
            SkillOutcome::Succeeded if self.skill.mode() == FlightMode::Loiter => Aftermath::Released,
            _ if self.flown => Aftermath::Idle,
            _ => Aftermath::NeverFlew,
        }
    }

    /// Its newest state, with the data by which an outcome is judged.
    pub(crate) fn report(&self, view: &View) -> SkillReport {
        SkillReport {
            id: self.id,
            request_id: self.request_id.clone(),
            kind: self.skill.kind(),
            state: self.state.clone(),
            motion: view.motion,
            landed_timestamp_us: view.landed_timestamp_us,
            flown_by_other: false,
            along: String::new(),
        }
    }
}
