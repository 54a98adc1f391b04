//! One skill in the making, running, or on its way out.

use domain::time::Time;
use kittiwake_proto::v1::SkillEvent;

use crate::catalog::Skill;
use crate::commands::Command;
use crate::fsm::{Action, Event, SkillId, State};
use crate::mode_watch::ModeWatch;
use crate::vehicle::View;

/// A request that was taken, with everything known about it.
#[derive(Debug)]
pub struct Instance {
    /// Unique.
    pub id: SkillId,
    /// The caller's name for it.
    pub request_id: String,
    /// Skills that the caller, or the caller of a request displaced by this one, does without from
    /// now on, whatever becomes of this one.
    pub gave_up: Vec<SkillId>,
    /// What is flown.
    pub skill: Box<dyn Skill>,
    /// How far it has come.
    pub state: State,
    /// So many of its commands have been accepted.
    pub accepted: usize,
    /// A command of it was not acknowledged: the vehicle may have obeyed all the same.
    pub unanswered: bool,
    /// It has been the registered skill.
    pub flown: bool,
    /// It has asked for the vehicle's neutral state, which has not been commanded yet.
    pub wants_neutral: bool,
    /// Since when it waits for data.
    pub waits_since: Option<Time>,
    /// Whether the vehicle still flies it.
    pub watch: ModeWatch,
}

impl Instance {
    /// Brings an event about; what is to be done is returned.
    ///
    /// An event that cannot happen leaves everything as it is: in flight that is the best that
    /// can be made of a programming error, in a test it stops the test.
    pub fn take(&mut self, event: Event) -> &'static [Action] {
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

    /// Whether this skill has let the motors turn, as far as one can know, and has not flown with it.
    pub fn has_only_armed(&self) -> bool {
        let arms = self.skill.command(0) == Some(Command::Arm);
        arms && (0 < self.accepted || self.unanswered) && self.skill.command(self.accepted).is_some()
    }

    /// The command that ends it early.
    pub fn neutral(&self) -> Command {
        if self.has_only_armed() { Command::Disarm } else { Command::Loiter }
    }

    /// Its newest event, with where and how the vehicle is if it has ended.
    pub fn event(&self, view: &View) -> SkillEvent {
        let mut event = SkillEvent {
            skill_id: self.id.0,
            request_id: self.request_id.clone(),
            kind: self.skill.kind() as i32,
            state: self.state.wire() as i32,
            ..SkillEvent::default()
        };
        match &self.state {
            State::Execute { trouble: Some(trouble) } => event.reason = trouble.clone(),
            State::Abort { by } => event.reason = format!("overwritten by skill {by}"),
            State::Ended(ending) => {
                event.outcome = ending.outcome as i32;
                event.reason = ending.reason.clone();
                event.position = view.motion.map(|it| it.position.into());
                event.velocity = view.motion.map(|it| it.velocity.into());
                event.position_timestamp_us = view.motion.map_or(0, |it| it.timestamp_us);
                event.landed_timestamp_us = view.landed_timestamp_us;
            }
            _ => {}
        }
        event
    }
}
