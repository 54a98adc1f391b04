//! What was answered and what became of it, for callers that ask again.

use std::collections::VecDeque;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::v1::{SkillEvent, SkillReply, SkillState};

/// A bound on memory, far above what a mission asks for in the time that is remembered.
const MOST_ENTRIES: usize = 4096;

/// Answers to requests and the newest event of each skill, for a while.
#[derive(Debug)]
pub struct Ledger {
    memory: Duration,
    answers: VecDeque<(Time, String, SkillReply)>,
    skills: VecDeque<(Time, SkillEvent)>,
}

impl Ledger {
    /// An empty ledger that forgets after `memory`.
    pub fn new(memory: Duration) -> Ledger {
        Ledger { memory, answers: VecDeque::new(), skills: VecDeque::new() }
    }

    /// The answer that this request was given before.
    pub fn answer(&self, request_id: &str) -> Option<SkillReply> {
        self.answers.iter().find(|(_, id, _)| id == request_id).map(|(_, _, reply)| reply.clone())
    }

    /// Remembers an answer.
    pub fn answered(&mut self, request_id: &str, reply: &SkillReply, now: Time) {
        self.forget(now);
        self.answers.push_back((now, request_id.into(), reply.clone()));
    }

    /// Remembers an event in place of the skill's former one.
    pub fn happened(&mut self, event: &SkillEvent, now: Time) {
        match self.skills.iter_mut().find(|(_, it)| it.skill_id == event.skill_id) {
            Some(entry) => *entry = (now, event.clone()),
            None => self.skills.push_back((now, event.clone())),
        }
    }

    /// The newest event of each skill, oldest skill first.
    pub fn table(&mut self, now: Time) -> Vec<SkillEvent> {
        self.forget(now);
        self.skills.iter().map(|(_, it)| it.clone()).collect()
    }

    /// The newest event of one skill.
    pub fn skill(&self, skill_id: u64) -> Option<&SkillEvent> {
        self.skills.iter().map(|(_, it)| it).find(|it| it.skill_id == skill_id)
    }

    fn forget(&mut self, now: Time) {
        let memory = self.memory;
        self.answers.retain(|(at, _, _)| now - *at <= memory);
        self.skills.retain(|(at, it)| it.state() != SkillState::Ended || now - *at <= memory);
        while MOST_ENTRIES <= self.answers.len() {
            self.answers.pop_front();
        }
        // Those that still run are among the newest.
        while MOST_ENTRIES <= self.skills.len() {
            self.skills.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(skill_id: u64, state: SkillState) -> SkillEvent {
        SkillEvent { skill_id, state: state as i32, ..SkillEvent::default() }
    }

    #[test]
    fn what_ended_is_forgotten_and_what_runs_is_not() {
        let mut ledger = Ledger::new(Duration::from_secs(300));
        let reply = SkillReply { skill_id: 1, refusal: String::new() };
        ledger.answered("a", &reply, Time::ZERO);
        ledger.happened(&event(1, SkillState::Execute), Time::ZERO);
        ledger.happened(&event(2, SkillState::Ended), Time::ZERO);
        assert_eq!(ledger.answer("a"), Some(reply));
        let later = Time::after(Duration::from_secs(301));
        assert_eq!(ledger.table(later), [event(1, SkillState::Execute)]);
        assert_eq!(ledger.answer("a"), None);
    }

    #[test]
    fn the_table_holds_one_event_per_skill() {
        let mut ledger = Ledger::new(Duration::from_secs(300));
        ledger.happened(&event(1, SkillState::Execute), Time::ZERO);
        ledger.happened(&event(2, SkillState::ProcessRequest), Time::ZERO);
        ledger.happened(&event(1, SkillState::Ended), Time::ZERO);
        assert_eq!(ledger.table(Time::ZERO), [event(1, SkillState::Ended), event(2, SkillState::ProcessRequest)]);
    }
}
