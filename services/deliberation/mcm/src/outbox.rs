//! The effects of a wake, collected and sent once.

use std::collections::BTreeMap;
use std::time::Duration;

use kittiwake_proto::topics::{Message, Request, Response};
use node::{CallId, Effect, MessageKind, Token};

/// Why a call was made, so that its reply can be assigned.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// The start of a skill, by its request id.
    StartSkill(String),
    /// The cancellation of this skill.
    CancelSkill(u64),
    SkillTable,
    /// A new plan, by its request id.
    Replan(String),
    /// What an operator's request about the mission comes to, by its number.
    Edit(u64),
    /// Permission to enter this area.
    Permission(String),
}

#[derive(Debug, Default)]
pub(crate) struct Outbox {
    effects: Vec<Effect>,
    purposes: BTreeMap<CallId, Purpose>,
    last_call: u64,
}

impl Outbox {
    pub(crate) fn publish(&mut self, message: impl Into<Message>) {
        self.effects.push(Effect::publish(message));
    }

    pub(crate) fn call(&mut self, purpose: Purpose, request: Request, timeout: Duration) {
        self.last_call += 1;
        let call = CallId(self.last_call);
        self.purposes.insert(call, purpose);
        self.effects.push(Effect::Call { call, vehicle: None, trace: None, request, timeout });
    }

    pub(crate) fn reply(&mut self, token: Token, response: Response) {
        self.effects.push(Effect::Reply { token, response });
    }

    /// Reports a message whose content makes no sense.
    pub(crate) fn refuse(&mut self, what: impl Into<MessageKind>, why: impl std::fmt::Display) {
        self.effects.push(Effect::refused(what, why));
    }

    /// Why `call` was made; each call ends once.
    pub(crate) fn purpose(&mut self, call: CallId) -> Option<Purpose> {
        self.purposes.remove(&call)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.effects.is_empty()
    }

    /// Moves all effects out: requests before messages that are only read, since each takes time
    /// to be sent.
    pub(crate) fn drain_into(&mut self, effects: &mut Vec<Effect>) {
        self.effects.sort_by_key(|it| !matches!(it, Effect::Call { .. }));
        effects.append(&mut self.effects);
    }
}
