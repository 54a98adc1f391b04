//! The skill manager's client: leaves start and halt skills by handle; one request leaves per wake.
//!
//! A halt and a start of the same wake become one request, "start B, replacing A", so that no
//! loiter command flashes in between; a halt alone becomes a cancellation.

use std::time::Duration;

use domain::skill::{Goal, outcome_name};
use domain::time::Time;
use kittiwake_proto::topics::{Request, Response};
use kittiwake_proto::v1;
use node::CallError;

use crate::outbox::{Outbox, Purpose};

/// Names a skill that a leaf started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Handle(u64);

/// How far a skill has come.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Progress {
    /// Not sent yet: the wake is not over.
    Wanted,
    /// On its way to the skill manager, sent so many times.
    Asked(u32),
    /// Taken; the autopilot has not acknowledged it yet.
    Accepted,
    /// Executing since then.
    Executing(Time),
    /// Over.
    Ended(v1::SkillOutcome, String),
}

#[derive(Debug)]
struct Entry {
    handle: Handle,
    goal: Goal,
    /// Empty while it is only wanted.
    request_id: String,
    skill_id: u64,
    progress: Progress,
    given_up: bool,
    /// The vehicle was seen in its mode since it executes.
    mode_seen: bool,
    /// Its cancellation is on its way.
    cancel_sent: bool,
    heard: Time,
}

/// A request that got no answer is sent so often; its id makes that harmless.
const TRIES: u32 = 3;

#[derive(Debug)]
pub(crate) struct Skills {
    /// Makes request ids unique among starts of this process.
    instance: u64,
    entries: Vec<Entry>,
    last: u64,
    asked_at: Time,
    distance_left_m: f64,
}

impl Skills {
    pub(crate) fn new(instance: u64) -> Skills {
        Skills { instance, entries: Vec::new(), last: 0, asked_at: Time::ZERO, distance_left_m: 0.0 }
    }

    /// Wants `goal` flown.
    pub(crate) fn start(&mut self, now: Time, goal: Goal) -> Handle {
        self.last += 1;
        let handle = Handle(self.last);
        self.entries.push(Entry {
            handle,
            goal,
            request_id: String::new(),
            skill_id: 0,
            progress: Progress::Wanted,
            given_up: false,
            mode_seen: false,
            cancel_sent: false,
            heard: now,
        });
        handle
    }

    /// Gives a skill up.
    pub(crate) fn halt(&mut self, handle: Handle) {
        if let Some(entry) = self.entries.iter_mut().find(|it| it.handle == handle) {
            entry.given_up = true;
        }
    }

    pub(crate) fn progress(&self, handle: Handle) -> Option<&Progress> {
        self.entries.iter().find(|it| it.handle == handle).map(|it| &it.progress)
    }

    /// The skill that flies, or is to fly, for the status.
    pub(crate) fn present(&self) -> Option<(Goal, u64)> {
        let entry = self.entries.iter().rev().find(|it| !it.given_up && !is_over(it))?;
        Some((entry.goal, entry.skill_id))
    }

    /// A status of `at` shows the mode that the skill that executes is to fly.
    pub(crate) fn saw_own_mode(&mut self, at: Time) {
        if let Some((_, entry)) = self.executing().filter(|it| it.0 < at) {
            entry.mode_seen = true;
        }
    }

    /// Whether the vehicle was seen in the mode of the skill that executes. Until then no other is held against
    /// it: an autopilot acknowledges before it changes over, and a status from before may come later.
    pub(crate) fn has_shown_its_mode(&mut self) -> bool {
        self.executing().is_some_and(|(_, entry)| entry.mode_seen)
    }

    /// The newest skill that was not given up, if it executes, and since when.
    fn executing(&mut self) -> Option<(Time, &mut Entry)> {
        let entry = self.entries.iter_mut().rev().find(|it| !it.given_up)?;
        match entry.progress {
            Progress::Executing(since) => Some((since, entry)),
            _ => None,
        }
    }

    pub(crate) fn distance_left_m(&self) -> f64 {
        self.distance_left_m
    }

    /// Sends what this wake wants.
    pub(crate) fn flush(&mut self, timeout: Duration, outbox: &mut Outbox) {
        // Started and given up within one wake: it never was.
        self.entries.retain(|it| !(it.given_up && it.progress == Progress::Wanted));
        match self.entries.iter().position(|it| it.progress == Progress::Wanted) {
            Some(wanted) => {
                // Whatever was given up is replaced by this request; nothing is cancelled besides.
                let given_up = self.entries.iter().rev().find(|it| it.given_up && !is_over(it) && it.skill_id != 0);
                let gave_up_skill_id = given_up.map_or(0, |it| it.skill_id);
                let entry = &mut self.entries[wanted];
                entry.progress = Progress::Asked(1);
                entry.request_id = format!("mcm-{:x}-{}", self.instance, entry.handle.0);
                send(entry, gave_up_skill_id, timeout, outbox);
            }
            None => self.cancel_given_up(timeout, outbox),
        }
    }

    /// The answer to a request to start.
    pub(crate) fn on_reply(
        &mut self,
        now: Time,
        request_id: &str,
        result: Result<Response, CallError>,
        timeout: Duration,
        outbox: &mut Outbox,
    ) {
        let Some(entry) = self.entries.iter_mut().find(|it| it.request_id == request_id) else { return };
        let Progress::Asked(tries) = entry.progress else { return };
        entry.heard = now;
        match result {
            Ok(Response::Skill(reply)) if reply.skill_id != 0 => {
                entry.skill_id = reply.skill_id;
                entry.progress = Progress::Accepted;
            }
            Ok(Response::Skill(reply)) => entry.progress = Progress::Ended(v1::SkillOutcome::Rejected, reply.refusal),
            Err(CallError::Unanswered) if tries < TRIES && !entry.given_up => {
                entry.progress = Progress::Asked(tries + 1);
                send(entry, 0, timeout, outbox);
            }
            Err(error) => {
                entry.progress = Progress::Ended(v1::SkillOutcome::Failed, format!("skill manager {error}"));
            }
            Ok(_) => {}
        }
    }

    /// A cancellation got no answer: it is sent again.
    pub(crate) fn on_cancel_lost(&mut self, skill_id: u64) {
        if let Some(entry) = self.entries.iter_mut().find(|it| it.skill_id == skill_id) {
            entry.cancel_sent = false;
        }
    }

    /// News of a skill.
    pub(crate) fn on_event(&mut self, now: Time, event: &v1::SkillEvent) {
        let Some(entry) = self.entries.iter_mut().find(|it| it.request_id == event.request_id) else { return };
        if is_over(entry) {
            if entry.skill_id != 0 || event.state() == v1::SkillState::Ended {
                return;
            }
            // Its answer was given up on, and it flies all the same: nobody waits for it any more.
            entry.given_up = true;
        }
        entry.heard = now;
        entry.skill_id = event.skill_id;
        match event.state() {
            v1::SkillState::ProcessRequest => entry.progress = Progress::Accepted,
            v1::SkillState::Execute if matches!(entry.progress, Progress::Executing(_)) => {
                // It goes on although a cancellation was sent: that was refused, and is sent again.
                entry.cancel_sent = false;
            }
            v1::SkillState::Execute => entry.progress = Progress::Executing(now),
            v1::SkillState::Ended => entry.progress = Progress::Ended(event.outcome(), event.reason.clone()),
            _ => {}
        }
    }

    pub(crate) fn on_feedback(&mut self, now: Time, feedback: &v1::SkillFeedback) {
        if let Some(entry) = self.entries.iter_mut().find(|it| it.skill_id == feedback.skill_id) {
            entry.heard = now;
            if feedback.distance_left_m.is_finite() {
                self.distance_left_m = feedback.distance_left_m;
            }
        }
    }

    /// What the skill manager knows of its skills: news that was missed, and skills it has lost.
    pub(crate) fn on_table(&mut self, now: Time, table: &v1::SkillTable) {
        for event in &table.skills {
            self.on_event(now, event);
        }
        for entry in &mut self.entries {
            let known = table.skills.iter().any(|it| it.skill_id == entry.skill_id);
            if matches!(entry.progress, Progress::Accepted | Progress::Executing(_)) && !known {
                let reason = "the skill manager no longer knows it".to_owned();
                entry.progress = Progress::Ended(v1::SkillOutcome::Failed, reason);
            }
        }
    }

    /// When [`Skills::tend`] wants to look.
    pub(crate) fn deadline(&self, silence: Duration) -> Option<Time> {
        let live = self.entries.iter().filter(|it| matches!(it.progress, Progress::Accepted | Progress::Executing(_)));
        live.map(|it| it.heard.max(self.asked_at) + silence).min()
    }

    /// Asks about skills that have been silent, and forgets what is over.
    pub(crate) fn tend(&mut self, now: Time, silence: Duration, timeout: Duration, outbox: &mut Outbox) {
        if self.deadline(silence).is_some_and(|it| it <= now) {
            self.asked_at = now;
            outbox.call(Purpose::SkillTable, Request::SkillTable(v1::SkillTableRequest {}), timeout);
        }
        let keep_from = self.entries.len().saturating_sub(8);
        let mut index = 0;
        self.entries.retain(|it| {
            index += 1;
            index > keep_from || !is_over(it)
        });
    }

    /// Cancels what was given up and has no successor that replaces it. One whose id is not known
    /// yet is cancelled at the wake that brings it.
    fn cancel_given_up(&mut self, timeout: Duration, outbox: &mut Outbox) {
        if self.entries.iter().any(|it| !it.given_up && !is_over(it)) {
            return;
        }
        for entry in self.entries.iter_mut().filter(|it| it.given_up && !is_over(it) && it.skill_id != 0) {
            if !std::mem::replace(&mut entry.cancel_sent, true) {
                let request = v1::SkillCancelRequest { skill_id: entry.skill_id };
                outbox.call(Purpose::CancelSkill(entry.skill_id), Request::SkillCancel(request), timeout);
            }
        }
    }
}

fn is_over(entry: &Entry) -> bool {
    matches!(entry.progress, Progress::Ended(..))
}

fn send(entry: &Entry, gave_up_skill_id: u64, timeout: Duration, outbox: &mut Outbox) {
    let request = v1::SkillRequest {
        request_id: entry.request_id.clone(),
        goal: Some(entry.goal.into()),
        when_busy: v1::WhenBusy::Replace as i32,
        gave_up_skill_id,
    };
    outbox.call(Purpose::StartSkill(entry.request_id.clone()), Request::Skill(request), timeout);
}

/// How a skill ended, in words.
pub(crate) fn ending(outcome: v1::SkillOutcome, reason: &str) -> String {
    match reason {
        "" => outcome_name(outcome).to_owned(),
        reason => format!("{}: {reason}", outcome_name(outcome)),
    }
}
