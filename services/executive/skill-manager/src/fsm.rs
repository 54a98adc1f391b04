//! The life of one skill, from its request to its outcome.
//!
//! Pure: a state and an event give the next state and what is to be done about it. Which event
//! happens when is decided elsewhere.

use std::fmt;

use kittiwake_proto::v1::{SkillOutcome, SkillState};

/// Names a skill in every message about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SkillId(pub u64);

impl fmt::Display for SkillId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// How a skill ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ending {
    /// In one word.
    pub outcome: SkillOutcome,
    /// Why; empty for success.
    pub reason: String,
}

impl Ending {
    /// Its postcondition was seen.
    pub fn success() -> Ending {
        Ending { outcome: SkillOutcome::Succeeded, reason: String::new() }
    }

    /// Anything else, with the reason.
    pub fn because(outcome: SkillOutcome, reason: impl Into<String>) -> Ending {
        Ending { outcome, reason: reason.into() }
    }
}

/// Where a skill is in its life.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum State {
    /// PR: wants to be the running one.
    ProcessRequest(Processing),
    /// E: is the registered one; setpoints are refreshed, feedback is sent.
    Execute {
        /// Why the last cancellation came to nothing, if one was tried.
        trouble: Option<String>,
    },
    /// R: its outcome is being sent.
    Report(Ending),
    /// C: loiter was requested; it flies on until that is acknowledged.
    Cancel,
    /// A: a newer skill is registered; the abort message is being sent.
    Abort {
        /// The newer one.
        by: SkillId,
    },
    /// Nothing will happen to it any more.
    Ended(Ending),
}

/// How far the processing of a request has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Processing {
    /// Nothing was commanded yet: it waits for its turn, or for data to be judged by.
    Waiting,
    /// Its commands are on their way.
    Commanding,
    /// So they are, but the caller has cancelled it: the acknowledgement is awaited first.
    CancelRequested,
}

/// Something that happens to a skill.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// Its first command goes out.
    Commanded,
    /// Its postcondition holds before anything was commanded.
    AlreadyTrue,
    /// Its last command was accepted, or the only one that is still wanted.
    Accepted,
    /// It will not run: refused by the autopilot, not acknowledged, or without data.
    Refused(Ending),
    /// It is over: postcondition seen, functional error, pre-empted, deadline passed.
    Done(Ending),
    /// The caller cancels it.
    Cancel,
    /// The autopilot took the loiter that ends it.
    Neutral,
    /// The autopilot did not.
    NeutralRefused(String),
    /// Another skill has taken its place.
    Overwritten {
        /// That one.
        by: SkillId,
    },
    /// The message that a passing state is there for has been sent.
    Sent,
}

/// What a transition demands, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Make it the registered skill; the one that was is overwritten.
    Register,
    /// Command the vehicle into its neutral state as soon as no other command is in flight.
    RequestNeutral,
    /// Tell everybody about the new state.
    Announce,
}

/// An event that cannot happen in that state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{event:?} cannot happen in {state:?}")]
pub struct InvalidTransition {
    /// The state, which stays.
    pub state: State,
    /// The event.
    pub event: Event,
}

impl State {
    /// The state after `event`, and what is to be done about it.
    pub fn on(self, event: Event) -> Result<(State, &'static [Action]), InvalidTransition> {
        use {Action as A, Event as E, Processing as P, State as S};
        const ANNOUNCE: &[Action] = &[A::Announce];
        Ok(match (self, event) {
            (S::ProcessRequest(P::Waiting), E::Commanded) => (S::ProcessRequest(P::Commanding), &[]),
            (S::ProcessRequest(P::Waiting), E::AlreadyTrue) | (S::ProcessRequest(P::Commanding), E::Accepted) => {
                (S::Execute { trouble: None }, &[A::Register, A::Announce])
            }
            // Nothing was commanded, so there is nothing to be undone.
            (S::ProcessRequest(P::Waiting), E::Cancel) => {
                let reason = "cancelled before anything was commanded";
                (S::Ended(Ending::because(SkillOutcome::Cancelled, reason)), ANNOUNCE)
            }
            (S::ProcessRequest(P::Waiting), E::Overwritten { by }) => (S::Abort { by }, ANNOUNCE),
            (S::ProcessRequest(_), E::Refused(ending)) => (S::Ended(ending), ANNOUNCE),
            (S::ProcessRequest(P::Commanding | P::CancelRequested), E::Cancel) => {
                (S::ProcessRequest(P::CancelRequested), &[])
            }
            // The vehicle obeys it already, so the one before it is overwritten all the same.
            (S::ProcessRequest(P::CancelRequested), E::Accepted) => {
                (S::Cancel, &[A::Register, A::RequestNeutral, A::Announce])
            }
            // In C, the postcondition may be seen before the vehicle has seen the cancellation:
            // report what happened.
            (S::Execute { .. } | S::Cancel, E::Done(ending)) => (S::Report(ending), &[]),
            (S::Execute { .. } | S::Cancel, E::Overwritten { by }) => (S::Abort { by }, ANNOUNCE),
            (S::Execute { .. }, E::Cancel) => (S::Cancel, &[A::RequestNeutral, A::Announce]),
            // A retried cancellation changes nothing.
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

    /// Its name on the wire.
    pub fn wire(&self) -> SkillState {
        match self {
            State::ProcessRequest(_) => SkillState::ProcessRequest,
            State::Execute { .. } => SkillState::Execute,
            State::Report(_) => SkillState::Report,
            State::Cancel => SkillState::Cancel,
            State::Abort { .. } => SkillState::Abort,
            State::Ended(_) => SkillState::Ended,
        }
    }
}

#[cfg(test)]
#[path = "fsm_table.rs"]
mod table;
