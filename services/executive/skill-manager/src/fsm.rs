//! The life of one skill, from its request to its outcome.
//!
//! A state and an event give the next state and what is to be done. Which event happens when is
//! decided elsewhere.

use std::fmt;

use kittiwake_proto::v1::SkillOutcome;

/// Names a skill in every message about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct SkillId(pub(crate) u64);

impl fmt::Display for SkillId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// How a skill ended.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ending {
    /// The kind of ending.
    pub(crate) outcome: SkillOutcome,
    /// Why; empty for success, but of a task.
    pub(crate) reason: String,
    /// What the process of a task has found out.
    pub(crate) results: Box<[(String, f64)]>,
}

impl Ending {
    /// Its postcondition was seen.
    pub(crate) fn success() -> Ending {
        Ending { outcome: SkillOutcome::Succeeded, reason: String::new(), results: Box::default() }
    }

    /// It ended in any other way.
    pub(crate) fn because(outcome: SkillOutcome, reason: impl Into<String>) -> Ending {
        Ending { outcome, reason: reason.into(), results: Box::default() }
    }
}

/// Where a skill is in its life.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum SkillState {
    /// PR: it is to become the registered skill.
    ProcessRequest(Processing),
    /// E: it is the registered skill; setpoints are refreshed, feedback is sent.
    Execute {
        /// Why the last cancellation failed, if one was tried.
        trouble: Option<String>,
    },
    /// R: its outcome is being sent.
    Report(Ending),
    /// C: loiter was requested; it flies until that is acknowledged.
    Cancel,
    /// A: a newer skill is registered; the abort message is being sent.
    Abort {
        /// The newer skill.
        by: SkillId,
    },
    /// Nothing happens to it any longer.
    Ended(Ending),
}

/// How far the processing of a request has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Processing {
    /// Nothing was commanded yet, or nothing that the autopilot took: it waits for its turn, or for data.
    Waiting,
    /// Its commands are being sent.
    Commanding,
    /// The caller has cancelled it while a command was in flight: the acknowledgement is awaited first.
    CancelRequested,
}

/// Something that happens to a skill.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Event {
    /// Its first command is sent.
    Commanded,
    /// Its postcondition holds before anything was commanded.
    AlreadyTrue,
    /// The autopilot did not take its first command yet: it is to be sent once more.
    TooEarly,
    /// Its last command was accepted; if it is cancelled, the command that was in flight then.
    Accepted,
    /// It will not run: rejected by the autopilot, not acknowledged, or without data.
    Refused(Ending),
    /// It is over: postcondition seen, functional error, pre-empted, deadline passed.
    Done(Ending),
    /// The caller cancels it.
    Cancel,
    /// The autopilot accepted the command that cancels it.
    Neutral,
    /// The autopilot did not accept that command.
    NeutralRefused(String),
    /// Another skill has taken its place, or waits to take it.
    Overwritten {
        /// The other skill.
        by: SkillId,
    },
    /// The message of a passing state was sent.
    Sent,
}

/// What a transition demands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Action {
    /// Make it the registered skill; the former one is overwritten.
    Register,
    /// Command the vehicle into its neutral state as soon as no other command is in flight.
    RequestNeutral,
    /// Publish the new state.
    Announce,
}

/// An event that cannot happen in that state.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{event:?} cannot happen in {state:?}")]
pub(crate) struct InvalidTransition {
    /// The state, which does not change.
    pub(crate) state: SkillState,
    /// The event.
    pub(crate) event: Event,
}

impl SkillState {
    /// The state after `event`, and what is to be done, in this order.
    pub(crate) fn on(self, event: Event) -> Result<(SkillState, &'static [Action]), InvalidTransition> {
        use {Action as A, Event as E, Processing as P, SkillState as S};
        const ANNOUNCE: &[Action] = &[A::Announce];
        Ok(match (self, event) {
            (S::ProcessRequest(P::Waiting), E::Commanded) => (S::ProcessRequest(P::Commanding), &[]),
            (S::ProcessRequest(P::Waiting), E::AlreadyTrue) | (S::ProcessRequest(P::Commanding), E::Accepted) => {
                (S::Execute { trouble: None }, &[A::Register, A::Announce])
            }
            (S::ProcessRequest(P::Commanding), E::TooEarly) => (S::ProcessRequest(P::Waiting), &[]),
            // The autopilot obeys no command of this skill yet, so nothing is to be undone.
            (S::ProcessRequest(P::Waiting), E::Cancel) => {
                let reason = "cancelled before anything was commanded";
                (S::Ended(Ending::because(SkillOutcome::Cancelled, reason)), ANNOUNCE)
            }
            // The skill's driver undoes what it has commanded so far.
            (S::ProcessRequest(P::Waiting | P::Commanding), E::Overwritten { by }) => (S::Abort { by }, ANNOUNCE),
            (S::ProcessRequest(_), E::Refused(ending)) => (S::Ended(ending), ANNOUNCE),
            (S::ProcessRequest(P::Commanding | P::CancelRequested), E::Cancel) => {
                (S::ProcessRequest(P::CancelRequested), &[])
            }
            // The vehicle obeys it already, so the former skill is overwritten nevertheless.
            (S::ProcessRequest(P::CancelRequested), E::Accepted) => {
                (S::Cancel, &[A::Register, A::RequestNeutral, A::Announce])
            }
            // In C, the postcondition may be seen before the cancellation takes effect: report what
            // happened.
            (S::Execute { .. } | S::Cancel, E::Done(ending)) => (S::Report(ending), &[]),
            (S::Execute { .. } | S::Cancel, E::Overwritten { by }) => (S::Abort { by }, ANNOUNCE),
            (S::Execute { .. }, E::Cancel) => (S::Cancel, &[A::RequestNeutral, A::Announce]),
            // A repeated cancellation changes nothing.
            (S::Cancel, E::Cancel) => (S::Cancel, &[]),
            (S::Cancel, E::Neutral) => {
                (S::Ended(Ending::because(SkillOutcome::Cancelled, "cancelled by the caller")), ANNOUNCE)
            }
            (S::Cancel, E::NeutralRefused(why)) => (S::Execute { trouble: Some(why) }, ANNOUNCE),
            (S::Report(ending), E::Sent) => (S::Ended(ending), ANNOUNCE),
            (S::Abort { by }, E::Sent) => {
                (S::Ended(Ending::because(SkillOutcome::Aborted, format!("overwritten by skill {by}"))), ANNOUNCE)
            }
            (state, event) => return Err(InvalidTransition { state, event }),
        })
    }
}

#[cfg(test)]
#[path = "fsm_table.rs"]
mod table;
