//! The last decisions of a vehicle's mission manager, for clients that ask for them later than they were made.

use std::collections::VecDeque;
use std::sync::Arc;

use kittiwake_proto::v1;
use prost::Message as _;

/// The most that are kept: those of several minutes in which much goes wrong.
const MOST: usize = 500;
/// The most bytes that are kept: anybody on the bus can send long ones.
const MAX_BYTES: usize = 1024 * 1024;

/// Decisions, oldest first. Cheap to clone: snapshots share them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Decisions {
    records: Arc<VecDeque<Arc<v1::DecisionRecord>>>,
    bytes: usize,
}

impl Decisions {
    /// Keeps a decision, and as many before it as there is room for.
    pub(crate) fn add(&mut self, record: v1::DecisionRecord) {
        let records = Arc::make_mut(&mut self.records);
        self.bytes += record.encoded_len();
        records.push_back(Arc::new(record));
        while MOST < records.len() || MAX_BYTES < self.bytes {
            let Some(oldest) = records.pop_front() else { break };
            self.bytes -= oldest.encoded_len();
        }
    }

    /// Puts those from before in front of them.
    pub(crate) fn go_on_from(&mut self, before: Decisions) {
        let since = std::mem::replace(self, before);
        since.records.iter().for_each(|it| self.add(v1::DecisionRecord::clone(it)));
    }

    /// The last `last` of those with a number above `after`, oldest first; without `after` also those of a manager of an earlier
    /// version, which have none.
    pub(crate) fn newest(&self, last: usize, after: Option<u64>) -> Vec<v1::DecisionRecord> {
        let is_later = |it: &v1::DecisionRecord| after.is_none_or(|after| after < it.sequence);
        let later: Vec<_> = self.records.iter().filter(|it| is_later(it)).collect();
        later[later.len().saturating_sub(last)..].iter().map(|it| v1::DecisionRecord::clone(it)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(decisions: &Decisions, last: usize, after: u64) -> Vec<u64> {
        decisions.newest(last, Some(after)).iter().map(|it| it.sequence).collect()
    }

    fn decision(sequence: u64, bytes: usize) -> v1::DecisionRecord {
        v1::DecisionRecord { sequence, text: "x".repeat(bytes), ..Default::default() }
    }

    #[test]
    fn the_last_ones_are_kept() {
        let mut decisions = Decisions::default();
        assert_eq!(numbers(&decisions, 9, 0), [0_u64; 0]);
        (1..=600).for_each(|number| decisions.add(decision(number, 10)));
        assert_eq!(numbers(&decisions, usize::MAX, 0), (101..=600).collect::<Vec<_>>());
        assert_eq!(numbers(&decisions, 2, 0), [599, 600]);
        assert_eq!(numbers(&decisions, 2, 597), [599, 600]);
        assert_eq!(numbers(&decisions, 9, 598), [599, 600]);
        assert_eq!(numbers(&decisions, 9, 600), [0_u64; 0]);
        assert_eq!(numbers(&decisions, 0, 0), [0_u64; 0]);
    }

    #[test]
    fn those_from_before_a_restart_come_first() {
        let (mut before, mut since) = (Decisions::default(), Decisions::default());
        (1..=3).for_each(|number| before.add(decision(number, 1)));
        (4..=5).for_each(|number| since.add(decision(number, 1)));
        since.go_on_from(before);
        assert_eq!(numbers(&since, 9, 0), [1, 2, 3, 4, 5]);
    }

    #[test]
    fn those_without_a_number_are_shown_unless_a_number_is_asked_for() {
        let mut decisions = Decisions::default();
        (0..3).for_each(|_| decisions.add(decision(0, 1)));
        assert_eq!(decisions.newest(2, None).len(), 2);
        assert_eq!(numbers(&decisions, 2, 0), [0_u64; 0]);
    }

    #[test]
    fn long_ones_take_the_place_of_more_of_the_others() {
        let mut decisions = Decisions::default();
        (1..=9).for_each(|number| decisions.add(decision(number, MAX_BYTES / 4)));
        assert_eq!(numbers(&decisions, 9, 0), [7, 8, 9]);
        decisions.add(decision(10, 2 * MAX_BYTES));
        assert_eq!(numbers(&decisions, 9, 0), [0_u64; 0], "one that is too long for all is not kept");
        decisions.add(decision(11, 1));
        assert_eq!(numbers(&decisions, 9, 0), [11]);
    }

    #[test]
    fn a_snapshot_keeps_what_it_has() {
        let mut decisions = Decisions::default();
        decisions.add(decision(1, 1));
        let snapshot = decisions.clone();
        decisions.add(decision(2, 1));
        assert_eq!((numbers(&snapshot, 9, 0), numbers(&decisions, 9, 0)), (vec![1], vec![1, 2]));
    }
}
