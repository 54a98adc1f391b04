//! The newest report of each skill, for callers that ask again.

use std::collections::VecDeque;
use std::time::Duration;

use domain::time::Time;

use crate::fsm::{SkillId, SkillState};
use crate::messages::SkillReport;

/// A bound on memory, far above what a mission asks for in the time that is remembered.
const MOST_ENTRIES: usize = 4096;

/// Remembers for a while.
#[derive(Debug)]
pub(crate) struct History {
    memory: Duration,
    skills: VecDeque<(Time, SkillReport)>,
}

impl History {
    /// An empty history that forgets after `memory`.
    pub(crate) fn new(memory: Duration) -> History {
        History { memory, skills: VecDeque::new() }
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
        self.skills.retain(|(at, it)| !matches!(it.state, SkillState::Ended(_)) || now - *at <= memory);
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
            along: String::new(),
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
        history.reported(report(1, EXECUTE), Time::ZERO);
        history.reported(ended(2), Time::ZERO);
        let later = Time::after(Duration::from_secs(301));
        assert_eq!(history.table(later).collect::<Vec<_>>(), [&report(1, EXECUTE)]);
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
