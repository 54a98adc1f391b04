//! The launcher's own time: it stands still while the launcher is held up, as one that was stopped, or gets no turn on a busy machine. Meanwhile it
//! hears nobody, so no limit that a child has may run out.
//!
//! What the aircraft is known to do is no such limit: it is as old as the clock on the wall says.

use std::time::Duration;

/// A turn lasts no longer than this. What is longer is a pause, in which nothing was heard.
const LONGEST_TURN: Duration = Duration::from_secs(1);

/// Time since the launcher's start, without its pauses. A pause counts as the longest turn, so that time goes on however slow the machine is.
#[derive(Debug, Default)]
pub struct OwnTime {
    /// When this turn began: since the start, and without the pauses.
    began: Duration,
    counted: Duration,
}

impl OwnTime {
    /// The next turn begins; returns whether the one before was held up. `elapsed` is the wall time since the start.
    pub fn begin_turn(&mut self, elapsed: Duration) -> bool {
        let was_held_up = LONGEST_TURN <= elapsed.saturating_sub(self.began);
        self.counted = self.at(elapsed);
        self.began = elapsed;
        was_held_up
    }

    /// The time `elapsed` since the start, without the pauses.
    pub fn at(&self, elapsed: Duration) -> Duration {
        self.counted + elapsed.saturating_sub(self.began).min(LONGEST_TURN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// Turns begin at `turns_ms`; which of them ended a pause, and what time it is at last.
    #[track_caller]
    fn check(turns_ms: &[u64], pauses: &[u64], last_ms: u64) {
        let mut time = OwnTime::default();
        let ended: Vec<u64> = turns_ms.iter().copied().filter(|it| time.begin_turn(ms(*it))).collect();
        assert_eq!((ended.as_slice(), time.at(ms(*turns_ms.last().unwrap()))), (pauses, ms(last_ms)), "{turns_ms:?}");
    }

    #[test]
    fn a_pause_counts_as_one_turn_and_says_so() {
        check(&[200, 400, 999], &[], 999);
        check(&[200, 60_200, 60_300], &[60_200], 1_300);
        // However slow the machine is, time goes on.
        check(&[2_000, 4_000, 6_000], &[2_000, 4_000, 6_000], 3_000);
    }

    #[test]
    fn within_a_turn_time_goes_on_and_never_back() {
        let mut time = OwnTime::default();
        time.begin_turn(ms(100));
        let within: Vec<_> = [100, 600, 1_100, 5_100].into_iter().map(|it| time.at(ms(it))).collect();
        assert_eq!(within, [ms(100), ms(600), ms(1_100), ms(1_100)]);
        time.begin_turn(ms(5_100));
        assert_eq!(time.at(ms(5_100)), ms(1_100));
    }
}
