//! The numbers of decisions about one vehicle.

use domain::time::Now;

/// The end of the year 9999 in milliseconds since the Unix epoch: no clock gives a higher number. Above it there are more numbers left than can
/// be given out, and a tower that was led there goes on; but nobody leads it further.
const HIGHEST_NAMED: u64 = 253_402_300_799_999;

/// Gives out numbers that rise: each is the time, in milliseconds since the Unix epoch, or one more than the number before.
///
/// Where what was stored is lost they still rise, unless the clock was set back as well; then the vehicle names its highest
/// number with its next request, and they go on above that. Each vehicle has numbers of its own, so that none moves those of
/// another one.
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

    /// The vehicle knows a decision of this number; the next one is higher, unless the number is one that no tower gives out.
    pub(crate) fn go_on_above(&mut self, named: u64) {
        if named <= HIGHEST_NAMED {
            self.last = self.last.max(named);
        }
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

    #[test]
    fn numbers_go_on_above_what_the_vehicle_names_and_it_cannot_use_them_up() {
        #[track_caller]
        fn check(named: u64, next: u64) {
            let mut numbers = Numbers::after(50);
            numbers.go_on_above(named);
            assert_eq!(numbers.next(Now { utc_ms: 100, ..Now::default() }), next);
        }
        check(0, 100);
        check(70, 100);
        check(7000, 7001);
        check(HIGHEST_NAMED, HIGHEST_NAMED + 1);
        check(HIGHEST_NAMED + 1, 100);
        check(u64::MAX, 100);
    }
}
