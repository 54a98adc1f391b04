//! Which skills are under way, and how the last one ended.

use std::collections::BTreeMap;

use kittiwake_proto::v1;

/// At most three skills are active: one flies, one waits for its acknowledgement, one is being
/// aborted. A vehicle has more only because their last events were lost.
const MAX_ACTIVE: usize = 8;

/// The skills of one vehicle.
#[derive(Debug, Clone, Default)]
pub(crate) struct Skills {
    active: BTreeMap<u64, v1::SkillEvent>,
    /// The newest skill that has ended, but for tasks along a flight.
    pub(crate) last_ended: Option<v1::SkillEvent>,
    feedback: Option<v1::SkillFeedback>,
}

impl Skills {
    /// A skill changed its state.
    pub(crate) fn on_event(&mut self, event: &v1::SkillEvent) {
        if event.state() == v1::SkillState::Ended {
            self.active.remove(&event.skill_id);
            if event.along.is_empty() {
                self.last_ended = Some(event.clone());
            }
            return;
        }
        self.active.insert(event.skill_id, event.clone());
        if MAX_ACTIVE < self.active.len() {
            self.active.pop_first();
        }
    }

    /// A skill reports its progress.
    pub(crate) fn on_feedback(&mut self, feedback: v1::SkillFeedback) {
        self.feedback = Some(feedback);
    }

    /// The skill manager is gone, and its skills with it.
    pub(crate) fn on_manager_gone(&mut self) {
        self.active.clear();
        self.feedback = None;
    }

    /// The skill that flies the vehicle; while none does, the newest that is about to.
    pub(crate) fn running(&self) -> Option<&v1::SkillEvent> {
        let flies = |it: &&v1::SkillEvent| {
            it.along.is_empty() && matches!(it.state(), v1::SkillState::Execute | v1::SkillState::Cancel)
        };
        self.active.values().rev().find(flies).or_else(|| self.active.values().next_back())
    }

    /// Every skill that has not ended, oldest first.
    pub(crate) fn active(&self) -> impl Iterator<Item = &v1::SkillEvent> {
        self.active.values()
    }

    /// The newest feedback of a skill.
    pub(crate) fn feedback_of(&self, skill_id: u64) -> Option<&v1::SkillFeedback> {
        self.feedback.as_ref().filter(|it| it.skill_id == skill_id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use v1::SkillState::{Abort, Cancel, Ended, Execute, ProcessRequest};

    #[track_caller]
    fn check(events: &[(u64, v1::SkillState)], running: Option<u64>) {
        let mut skills = Skills::default();
        for &(skill_id, state) in events {
            skills.on_event(&v1::SkillEvent { skill_id, state: state as i32, ..Default::default() });
        }
        assert_eq!(skills.running().map(|it| it.skill_id), running);
    }

    #[test]
    fn the_running_skill_is_the_one_that_flies_the_vehicle() {
        check(&[], None);
        check(&[(1, ProcessRequest)], Some(1));
        check(&[(1, Execute), (2, ProcessRequest)], Some(1));
        check(&[(1, Cancel), (2, ProcessRequest)], Some(1));
        check(&[(1, Execute), (2, ProcessRequest), (2, Execute), (1, Abort)], Some(2));
        check(&[(1, Execute), (1, Ended)], None);
    }

    #[test]
    fn skills_whose_end_is_never_heard_do_not_accumulate() {
        let endless: Vec<_> = (0..100).map(|id| (id, Execute)).collect();
        check(&endless, Some(99));
        let mut skills = Skills::default();
        endless.iter().for_each(|&(skill_id, _)| skills.on_event(&v1::SkillEvent { skill_id, ..Default::default() }));
        assert_eq!(skills.active().count(), MAX_ACTIVE);
    }
}
