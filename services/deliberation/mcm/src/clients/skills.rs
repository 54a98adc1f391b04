//! The skill manager as the manager sees it: leaves start and halt skills by handle; one request leaves per wake.
//!
//! A halt and a start of the same wake become one request, "start B, replacing A", so that the vehicle does not loiter
//! in between; a halt alone becomes a cancellation.

use std::sync::Arc;
use std::time::Duration;

use domain::fmu::FlightMode;
use domain::skill::{Goal, SkillEvent, SkillOutcome, SkillPhase};
use domain::task::TaskGoal;
use domain::time::Time;
use domain::wire::task::along_to_wire;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use node::CallError;

use crate::outbox::{Outbox, Purpose};

/// A cancellation that was refused or lost is sent again after this time. (ENG: at once would be as often as the bus carries it, to an
/// autopilot that has just refused it; the vehicle's next status may show why.)
const CANCEL_PAUSE: Duration = Duration::from_millis(500);

/// Names a skill that a leaf started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Handle(u64);

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Sending {
    /// Somebody else flies: nothing is asked for.
    pub(crate) quietly: bool,
    /// An operator has ordered to take control back.
    pub(crate) takes_control: bool,
}

/// The progress of a skill.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Progress {
    /// Not sent yet: the wake is not over.
    Wanted,
    /// On its way to the skill manager, sent this many times.
    Asked(u32),
    /// Accepted; the autopilot has not acknowledged it yet.
    Accepted,
    /// Flown.
    Executing {
        /// Since when.
        since: Time,
        /// The vehicle was seen in its mode.
        mode_seen: bool,
    },
    /// Ended, with the reason for every outcome but success.
    Ended(SkillOutcome, String),
}

/// Whether a leaf still wants a skill.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Claim {
    /// Wanted.
    Held,
    /// Halted.
    GivenUp,
    /// Halted, and its cancellation is on its way.
    Cancelling,
    /// Halted, and its cancellation was refused or lost: it is sent again.
    CancelAgain {
        /// Then.
        at: Time,
    },
}

#[derive(Debug)]
struct Entry {
    handle: Handle,
    goal: Goal,
    /// The tasks along it that go on, as far as is known.
    along: Vec<Arc<TaskGoal>>,
    /// Its request id; empty before it is sent.
    request_id: String,
    /// 0 until the skill manager has given it an id.
    skill_id: u64,
    progress: Progress,
    claim: Claim,
    /// When it was given up.
    given_up: Option<Time>,
    heard: Time,
}

impl Entry {
    fn is_over(&self) -> bool {
        matches!(self.progress, Progress::Ended(..))
    }

    fn is_held(&self) -> bool {
        self.claim == Claim::Held
    }
}

/// How often a request without an answer is sent; its id makes repetitions harmless.
const TRIES: u32 = 3;

#[derive(Debug, Default)]
pub(crate) struct Skills {
    /// Makes request ids unique among starts of this process.
    instance: u64,
    entries: Vec<Entry>,
    last: u64,
    asked_at: Time,
    distance_left_m: f64,
    /// Why tasks along a flight have failed, until somebody takes it.
    along_failures: Vec<String>,
    /// As of the last wake.
    sending: Sending,
}

impl Skills {
    pub(crate) fn new(instance: u64) -> Skills {
        Skills { instance, ..Skills::default() }
    }

    pub(crate) fn start(&mut self, now: Time, goal: Goal, along: Vec<Arc<TaskGoal>>) -> Handle {
        self.last += 1;
        let handle = Handle(self.last);
        self.entries.push(Entry {
            handle,
            goal,
            along,
            request_id: String::new(),
            skill_id: 0,
            progress: Progress::Wanted,
            claim: Claim::Held,
            given_up: None,
            heard: now,
        });
        handle
    }

    pub(crate) fn halt(&mut self, now: Time, handle: Handle) {
        if let Some(entry) = self.entries.iter_mut().find(|it| it.handle == handle && it.is_held()) {
            (entry.claim, entry.given_up) = (Claim::GivenUp, Some(now));
        }
    }

    /// The progress of a skill; `None` once it is forgotten.
    pub(crate) fn progress(&self, handle: Handle) -> Option<&Progress> {
        self.entries.iter().find(|it| it.handle == handle).map(|it| &it.progress)
    }

    /// The tasks along a flight that go on; without a handle those of the newest one.
    pub(crate) fn along(&self, handle: Option<Handle>) -> &[Arc<TaskGoal>] {
        let is_it = |it: &&Entry| handle.map_or(it.is_held(), |handle| it.handle == handle);
        self.entries.iter().rev().find(is_it).map_or(&[], |it| &it.along)
    }

    /// Why tasks along a flight have failed since the last call.
    pub(crate) fn take_along_failures(&mut self) -> Vec<String> {
        std::mem::take(&mut self.along_failures)
    }

    /// The skill that is flown, or about to be, for the status.
    pub(crate) fn present(&self) -> Option<(&Goal, u64)> {
        let entry = self.entries.iter().rev().find(|it| it.is_held() && !it.is_over())?;
        Some((&entry.goal, entry.skill_id))
    }

    /// What the skill that has ended last said about it; empty for most that have succeeded.
    pub(crate) fn last_words(&self) -> &str {
        match self.entries.iter().rev().find(|it| it.is_held()).map(|it| &it.progress) {
            Some(Progress::Ended(_, reason)) => reason,
            _ => "",
        }
    }

    /// A status sent at `at` shows that the vehicle flies in `mode`.
    pub(crate) fn on_mode(&mut self, mode: FlightMode, at: Time) {
        let newest = self.entries.iter_mut().rev().find(|it| it.is_held());
        if let Some(Entry { goal, progress: Progress::Executing { since, mode_seen }, .. }) = newest
            && *since < at
            && goal.mode() == mode
        {
            *mode_seen = true;
        }
    }

    /// Whether the vehicle was seen in the mode of the skill that executes. Until then another mode does not count as
    /// pre-emption: an autopilot acknowledges before it changes over, and an older status may come later.
    pub(crate) fn has_shown_its_mode(&self) -> bool {
        let newest = self.entries.iter().rev().find(|it| it.is_held());
        newest.is_some_and(|it| matches!(it.progress, Progress::Executing { mode_seen: true, .. }))
    }

    /// Since when a skill that was given up does not end, the longest first; `None` if all have.
    pub(crate) fn cancelling_since(&self) -> Option<Time> {
        let flown = self.entries.iter().filter(|it| !it.is_held() && !it.is_over() && it.skill_id != 0);
        flown.filter_map(|it| it.given_up).min()
    }

    pub(crate) fn distance_left_m(&self) -> f64 {
        self.distance_left_m
    }

    pub(crate) fn flush(&mut self, now: Time, sending: Sending, timeout: Duration, outbox: &mut Outbox) {
        // Started and given up within one wake: it is never sent.
        self.entries.retain(|it| it.is_held() || it.progress != Progress::Wanted);
        self.sending = sending;
        match self.entries.iter().position(|it| it.progress == Progress::Wanted && !sending.quietly) {
            Some(wanted) => {
                // This request replaces the skill that was given up; no cancellation is needed.
                let given_up = self.entries.iter().rev().find(|it| !it.is_held() && !it.is_over() && it.skill_id != 0);
                let gave_up_skill_id = given_up.map_or(0, |it| it.skill_id);
                let entry = &mut self.entries[wanted];
                entry.progress = Progress::Asked(1);
                entry.request_id = format!("mcm-{:x}-{}", self.instance, entry.handle.0);
                send(entry, gave_up_skill_id, sending, timeout, outbox);
            }
            None => self.cancel_given_up(now, timeout, outbox),
        }
    }

    /// The answer to a request to start: the id that the skill runs under, or why it was refused.
    pub(crate) fn on_reply(
        &mut self,
        now: Time,
        request_id: &str,
        result: Result<Result<u64, String>, CallError>,
        timeout: Duration,
        outbox: &mut Outbox,
    ) {
        let Some(entry) = self.entries.iter_mut().find(|it| it.request_id == request_id) else { return };
        let Progress::Asked(tries) = entry.progress else { return };
        entry.heard = now;
        match result {
            Ok(Ok(skill_id)) => {
                entry.skill_id = skill_id;
                entry.progress = Progress::Accepted;
            }
            Ok(Err(reason)) => entry.progress = Progress::Ended(SkillOutcome::Rejected, reason),
            Err(CallError::Unanswered) if tries < TRIES && entry.is_held() => {
                entry.progress = Progress::Asked(tries + 1);
                send(entry, 0, self.sending, timeout, outbox);
            }
            Err(error) => entry.progress = Progress::Ended(SkillOutcome::Failed, format!("skill manager {error}")),
        }
    }

    /// A task along a flight is not among those that go on once it has ended.
    fn on_event_along(&mut self, event: &SkillEvent, outcome: SkillOutcome) {
        let Some(entry) = self.entries.iter_mut().find(|it| it.request_id == event.request_id) else { return };
        let before = entry.along.len();
        entry.along.retain(|it| it.task.skill != event.along);
        let has_failed = !matches!(outcome, SkillOutcome::Succeeded | SkillOutcome::Cancelled);
        if has_failed && entry.is_held() && entry.along.len() < before {
            self.along_failures.push(event.reason.clone());
        }
    }

    pub(crate) fn on_event(&mut self, now: Time, event: &SkillEvent) {
        match &event.phase {
            _ if event.along.is_empty() => {}
            SkillPhase::Ended(outcome) => return self.on_event_along(event, *outcome),
            _ => return,
        }
        let Some(entry) = self.entries.iter_mut().find(|it| it.request_id == event.request_id) else { return };
        if entry.is_over() {
            if entry.skill_id != 0 || matches!(event.phase, SkillPhase::Ended(_)) {
                return;
            }
            // The request was given up without an answer, and the skill is flown nevertheless: no leaf waits for it.
            entry.claim = Claim::GivenUp;
        }
        entry.heard = now;
        entry.skill_id = event.skill_id;
        match (&event.phase, &entry.progress) {
            (SkillPhase::ProcessRequest, _) => entry.progress = Progress::Accepted,
            // It is flown although a cancellation was sent: that was refused, and is sent again.
            (SkillPhase::Execute, Progress::Executing { .. }) => self.cancel_again(now, event.skill_id),
            (SkillPhase::Execute, _) => entry.progress = Progress::Executing { since: now, mode_seen: false },
            (SkillPhase::Ended(outcome), _) => entry.progress = Progress::Ended(*outcome, event.reason.clone()),
            (SkillPhase::Cancel | SkillPhase::Closing, _) => {}
        }
    }

    pub(crate) fn on_feedback(&mut self, now: Time, skill_id: u64, distance_left_m: f64) {
        if let Some(entry) = self.entries.iter_mut().find(|it| it.skill_id == skill_id) {
            entry.heard = now;
            self.distance_left_m = distance_left_m;
        }
    }

    /// The skill manager's table: events that were missed, and skills that it does not know.
    pub(crate) fn on_table(&mut self, now: Time, table: &[SkillEvent]) {
        for event in table {
            self.on_event(now, event);
        }
        for entry in &mut self.entries {
            let known = table.iter().any(|it| it.skill_id == entry.skill_id);
            if matches!(entry.progress, Progress::Accepted | Progress::Executing { .. }) && !known {
                let reason = "the skill manager no longer knows it".to_owned();
                entry.progress = Progress::Ended(SkillOutcome::Failed, reason);
            }
        }
    }

    /// When [`Skills::tend`] has something to do.
    pub(crate) fn deadline(&self, silence: Duration) -> Option<Time> {
        let is_replaced = self.entries.iter().any(|it| it.is_held() && !it.is_over());
        let cancel_again = self.entries.iter().filter(|it| !is_replaced && !it.is_over() && it.skill_id != 0);
        let cancel_again =
            cancel_again.filter_map(|it| if let Claim::CancelAgain { at } = it.claim { Some(at) } else { None });
        cancel_again.chain(self.silent_at(silence)).min()
    }

    /// When one of them has been silent for this long.
    fn silent_at(&self, silence: Duration) -> Option<Time> {
        let live =
            self.entries.iter().filter(|it| matches!(it.progress, Progress::Accepted | Progress::Executing { .. }));
        live.map(|it| it.heard.max(self.asked_at) + silence).min()
    }

    /// Asks about skills that were not heard of for a while, and forgets those that have ended.
    pub(crate) fn tend(&mut self, now: Time, silence: Duration, timeout: Duration, outbox: &mut Outbox) {
        if self.silent_at(silence).is_some_and(|it| it <= now) {
            self.asked_at = now;
            outbox.call(Purpose::SkillTable, Request::SkillTable(v1::SkillTableRequest {}), timeout);
        }
        let keep_from = self.entries.len().saturating_sub(8);
        let mut index = 0;
        self.entries.retain(|it| {
            index += 1;
            index > keep_from || !it.is_over()
        });
    }

    /// Cancels skills that were given up and are not replaced. One whose id is not known
    /// yet is cancelled in the wake that brings the id.
    fn cancel_given_up(&mut self, now: Time, timeout: Duration, outbox: &mut Outbox) {
        if self.entries.iter().any(|it| it.is_held() && !it.is_over()) {
            return;
        }
        let is_due = |claim: Claim| match claim {
            Claim::GivenUp => true,
            Claim::CancelAgain { at } => at <= now,
            Claim::Held | Claim::Cancelling => false,
        };
        for entry in self.entries.iter_mut().filter(|it| is_due(it.claim) && !it.is_over() && it.skill_id != 0) {
            entry.claim = Claim::Cancelling;
            let request = v1::SkillCancelRequest { skill_id: entry.skill_id };
            outbox.call(Purpose::CancelSkill(entry.skill_id), Request::SkillCancel(request), timeout);
        }
    }

    /// A cancellation was refused, or got no answer: it is sent again.
    pub(crate) fn cancel_again(&mut self, now: Time, skill_id: u64) {
        let mut cancelled = self.entries.iter_mut().filter(|it| it.claim == Claim::Cancelling);
        if let Some(entry) = cancelled.find(|it| it.skill_id == skill_id) {
            entry.claim = Claim::CancelAgain { at: now + CANCEL_PAUSE };
        }
    }
}

fn send(entry: &Entry, gave_up_skill_id: u64, sending: Sending, timeout: Duration, outbox: &mut Outbox) {
    let request = v1::SkillRequest {
        request_id: entry.request_id.clone(),
        goal: Some(entry.goal.clone().into()),
        when_busy: v1::WhenBusy::Replace as i32,
        gave_up_skill_id,
        takes_control: sending.takes_control,
        along: along_to_wire(&entry.along),
    };
    outbox.call(Purpose::StartSkill(entry.request_id.clone()), Request::Skill(request), timeout);
}

pub(crate) fn ending(outcome: SkillOutcome, reason: &str) -> String {
    match reason {
        "" => outcome.to_string(),
        reason => format!("{outcome}: {reason}"),
    }
}
