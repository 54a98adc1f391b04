//! The numbers of decisions.

use domain::time::Now;

/// Gives out numbers that never come twice, also not where everything that was stored is lost: each is the time, in
/// milliseconds since the Unix epoch, or one more than the number before.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Numbers {
    last: u64,
}

impl Numbers {
    /// After `last`, the highest number that was given out before.
    pub(crate) fn after(last: u64) -> Numbers {
        Numbers { last }
    }

    pub(crate) fn last(&self) -> u64 {
        self.last
    }

    pub(crate) fn next(&mut self, now: Now) -> u64 {
        let utc_ms = u64::try_from(now.utc_ms).unwrap_or_default();
        self.last = self.last.saturating_add(1).max(utc_ms);
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_rise_with_the_time_and_also_when_the_clock_is_set_back() {
        let mut numbers = Numbers::default();
        let mut at = |utc_ms| numbers.next(Now { utc_ms, ..Now::default() });
        assert_eq!([at(1000), at(1000), at(5000), at(-1), at(4000)], [1000, 1001, 5000, 5001, 5002]);
    }

    #[test]
    fn numbers_of_a_tower_that_knows_nothing_are_higher_than_those_before() {
        let mut before = Numbers::after(999);
        let last = (0..50).map(|_| before.next(Now { utc_ms: 1000, ..Now::default() })).max().unwrap();
        let first = Numbers::default().next(Now { utc_ms: 2000, ..Now::default() });
        assert!(last < first, "{last}, then {first}");
    }
}
