//! Answers to requests and the newest report of each skill, for callers that ask again.

use std::collections::VecDeque;
use std::time::Duration;

use domain::time::Time;

use crate::fsm::{SkillId, SkillState};
use crate::messages::SkillReport;

/// A bound on memory, far above what a mission asks for in the time that is remembered.
const MOST_ENTRIES: usize = 4096;

/// The answer to a request: the skill, or why there is none.
pub(crate) type Answer = Result<SkillId, String>;

/// Remembers for a while.
#[derive(Debug)]
pub(crate) struct History {
    memory: Duration,
    answers: VecDeque<(Time, String, Answer)>,
    skills: VecDeque<(Time, SkillReport)>,
}

impl History {
    /// An empty history that forgets after `memory`.
    pub(crate) fn new(memory: Duration) -> History {
        History { memory, answers: VecDeque::new(), skills: VecDeque::new() }
    }

    /// The answer that this request was given before.
    pub(crate) fn answer(&self, request_id: &str) -> Option<&Answer> {
        self.answers.iter().find(|(_, id, _)| id == request_id).map(|(_, _, answer)| answer)
    }

    /// Remembers an answer.
    pub(crate) fn answered(&mut self, request_id: String, answer: Answer, now: Time) {
        self.forget(now);
        self.answers.push_back((now, request_id, answer));
    }

    /// Remembers a report in place of the former one of the same skill.
    pub(crate) fn reported(&mut self, report: SkillReport, now: Time) {
        match self.skills.iter_mut().find(|(_, it)| it.id == report.id) {
            Some(entry) => *entry = (now, report),
            None => self.skills.push_back((now, report)),
        }
    }

    /// The newest report of each skill, oldest skill first.
    pub(crate) fn table(&mut self, now: Time) -> impl Iterator<Item = &SkillReport> {
        self.forget(now);
        self.skills.iter().map(|(_, report)| report)
    }

    /// The newest report of one skill.
    pub(crate) fn skill(&self, id: SkillId) -> Option<&SkillReport> {
        self.skills.iter().map(|(_, report)| report).find(|it| it.id == id)
    }

    fn forget(&mut self, now: Time) {
        let memory = self.memory;
        self.answers.retain(|(at, _, _)| now - *at <= memory);
        self.skills.retain(|(at, it)| !matches!(it.state, SkillState::Ended(_)) || now - *at <= memory);
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
    use kittiwake_proto::v1::SkillKind;

    use super::*;
    use crate::fsm::{Ending, Processing};

    const EXECUTE: SkillState = SkillState::Execute { trouble: None };

    fn report(id: u64, state: SkillState) -> SkillReport {
        let (request_id, kind) = (format!("r{id}"), SkillKind::Land);
        SkillReport {
            id: SkillId(id),
            request_id,
            kind,
            state,
            motion: None,
            landed_timestamp_us: 0,
            flown_by_other: false,
        }
    }

    fn ended(id: u64) -> SkillReport {
        report(id, SkillState::Ended(Ending::success()))
    }

    #[test]
    fn a_skill_that_ended_is_forgotten_and_one_that_runs_is_not() {
        let mut history = History::new(Duration::from_secs(300));
        history.answered("a".into(), Ok(SkillId(1)), Time::ZERO);
        history.reported(report(1, EXECUTE), Time::ZERO);
        history.reported(ended(2), Time::ZERO);
        assert_eq!(history.answer("a"), Some(&Ok(SkillId(1))));
        let later = Time::after(Duration::from_secs(301));
        assert_eq!(history.table(later).collect::<Vec<_>>(), [&report(1, EXECUTE)]);
        assert_eq!(history.answer("a"), None);
    }

    #[test]
    fn the_table_holds_one_report_per_skill() {
        let mut history = History::new(Duration::from_secs(300));
        let waiting = SkillState::ProcessRequest(Processing::Waiting);
        history.reported(report(1, EXECUTE), Time::ZERO);
        history.reported(report(2, waiting.clone()), Time::ZERO);
        history.reported(ended(1), Time::ZERO);
        assert_eq!(history.table(Time::ZERO).collect::<Vec<_>>(), [&ended(1), &report(2, waiting)]);
    }
}
