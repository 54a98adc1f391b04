//! Who has the vehicle's motion: the registered skill, the candidate that is being started beside it,
//! and the request that waits behind the candidate.

use domain::fmu::Command;

use crate::fsm::{Processing, SkillId, SkillState};
use crate::skill_run::SkillRun;

/// At most one skill in each slot.
#[derive(Debug, Default)]
pub(crate) struct Slots {
    /// In E or C.
    registered: Option<SkillRun>,
    /// In PR, its turn has come.
    candidate: Option<SkillRun>,
    /// In PR, waits until the candidate's command is acknowledged.
    next: Option<SkillRun>,
}

impl Slots {
    /// Whether no skill flies the vehicle or is being started.
    pub(crate) fn are_idle(&self) -> bool {
        self.registered.is_none() && self.candidate.is_none()
    }

    /// The skill that a request which does not replace is refused for.
    pub(crate) fn running(&self) -> Option<&SkillRun> {
        self.candidate.as_ref().or(self.registered.as_ref())
    }

    pub(crate) fn registered(&self) -> Option<&SkillRun> {
        self.registered.as_ref()
    }

    pub(crate) fn registered_mut(&mut self) -> Option<&mut SkillRun> {
        self.registered.as_mut()
    }

    pub(crate) fn candidate(&self) -> Option<&SkillRun> {
        self.candidate.as_ref()
    }

    pub(crate) fn next(&self) -> Option<&SkillRun> {
        self.next.as_ref()
    }

    pub(crate) fn next_mut(&mut self) -> Option<&mut SkillRun> {
        self.next.as_mut()
    }

    pub(crate) fn take_registered(&mut self) -> Option<SkillRun> {
        self.registered.take()
    }

    /// The registered skill, if it is one of these.
    pub(crate) fn take_registered_if(&mut self, is_one: fn(&SkillRun) -> bool) -> Option<SkillRun> {
        self.registered.take_if(|it| is_one(it))
    }

    pub(crate) fn take_candidate(&mut self) -> Option<SkillRun> {
        self.candidate.take()
    }

    /// The candidate, if it is this skill.
    pub(crate) fn take_candidate_if(&mut self, id: SkillId) -> Option<SkillRun> {
        self.candidate.take_if(|it| it.id() == id)
    }

    /// Whether this skill is the candidate, and neither was it cancelled nor does another request wait for it to get out of the way.
    pub(crate) fn is_being_started(&self, id: SkillId) -> bool {
        let commanding = SkillState::ProcessRequest(Processing::Commanding);
        self.next.is_none() && self.candidate.as_ref().is_some_and(|it| it.id() == id && *it.state() == commanding)
    }

    /// Whether this skill is the registered one and is being cancelled.
    pub(crate) fn is_being_cancelled(&self, id: SkillId) -> bool {
        self.registered.as_ref().is_some_and(|it| it.id() == id && *it.state() == SkillState::Cancel)
    }

    /// The registered skill, if it is this one and is being cancelled.
    pub(crate) fn take_cancelling(&mut self, id: SkillId) -> Option<SkillRun> {
        if self.is_being_cancelled(id) { self.registered.take() } else { None }
    }

    /// This skill, from any slot.
    pub(crate) fn take(&mut self, id: SkillId) -> Option<SkillRun> {
        let slots = [&mut self.registered, &mut self.candidate, &mut self.next];
        slots.into_iter().find_map(|slot| slot.take_if(|it| it.id() == id))
    }

    /// The requests that have commanded nothing yet: they need not be started when a newer one comes.
    pub(crate) fn take_waiting(&mut self) -> impl Iterator<Item = SkillRun> + use<> {
        let waiting = SkillState::ProcessRequest(Processing::Waiting);
        let candidate = self.candidate.take_if(|it| *it.state() == waiting);
        candidate.into_iter().chain(self.next.take())
    }

    /// Every skill that runs or waits and is of this kind, the registered one first.
    pub(crate) fn take_those(&mut self, of_kind: fn(&SkillRun) -> bool) -> Vec<SkillRun> {
        let slots = [&mut self.registered, &mut self.candidate, &mut self.next];
        slots.into_iter().filter_map(|slot| slot.take_if(|it| of_kind(it))).collect()
    }

    /// Whether no skill runs or waits.
    pub(crate) fn are_empty(&self) -> bool {
        self.are_idle() && self.next.is_none()
    }

    /// The command that cancels the registered skill, if it waits to be sent.
    pub(crate) fn take_neutral(&mut self) -> Option<(SkillId, Command)> {
        let running = self.registered.as_mut()?;
        running.take_neutral().map(|neutral| (running.id(), neutral))
    }

    /// A request that waits for its turn.
    pub(crate) fn enqueue(&mut self, run: SkillRun) {
        self.next = Some(run);
    }

    /// The turn of the request that waits; false if there is none.
    pub(crate) fn promote(&mut self) -> bool {
        self.candidate = self.next.take();
        self.candidate.is_some()
    }

    /// Puts a skill that goes on where its state belongs.
    pub(crate) fn put(&mut self, run: SkillRun) {
        match run.state() {
            SkillState::ProcessRequest(_) => self.candidate = Some(run),
            _ => self.registered = Some(run),
        }
    }
}
