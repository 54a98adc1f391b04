//! What did not get through: always counted, and logged once per sender and period, because a sender of garbage sends a
//! lot. The counts are in every heartbeat, and so among the gateway's metrics.

use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Between two lines about one sender.
const PERIOD: Duration = Duration::from_secs(10);

/// Senders with lines of their own. A flood under ever other names shares one.
const MOST_SENDERS: usize = 64;

/// Stands for the senders beyond [`MOST_SENDERS`].
const OTHERS: &str = "(others)";

/// Counters of what did not get through.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Totals {
    pub(crate) dropped: u64,
    pub(crate) malformed: u64,
    pub(crate) late: u64,
}

/// Why something did not get through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Loss {
    /// There was no room for it.
    Dropped,
    /// It does not decode.
    Malformed,
    /// It was too old to be obeyed.
    Late,
}

/// A line to be logged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Report {
    /// The key of the messages.
    pub(crate) sender: String,
    /// How many since the last line, with this one.
    pub(crate) count: u64,
}

/// All of a process.
#[derive(Debug, Default)]
pub(crate) struct Losses {
    totals: Totals,
    senders: HashMap<(Loss, String), Sender>,
}

#[derive(Debug)]
struct Sender {
    reported: Instant,
    /// Since then.
    count: u64,
}

impl Losses {
    /// Counts one of `sender`; with a report if one is due.
    pub(crate) fn count(&mut self, loss: Loss, sender: &str, now: Instant) -> Option<Report> {
        match loss {
            Loss::Dropped => self.totals.dropped += 1,
            Loss::Malformed => self.totals.malformed += 1,
            Loss::Late => self.totals.late += 1,
        }
        if MOST_SENDERS <= self.senders.len() {
            // What is left in their counts is in the totals.
            self.senders.retain(|_, it| now.saturating_duration_since(it.reported) < PERIOD);
        }
        let known = self.senders.contains_key(&(loss, sender.to_owned())) || self.senders.len() < MOST_SENDERS;
        let name = if known { sender } else { OTHERS };
        let Some(it) = self.senders.get_mut(&(loss, name.to_owned())) else {
            self.senders.insert((loss, name.to_owned()), Sender { reported: now, count: 0 });
            return Some(Report { sender: name.to_owned(), count: 1 });
        };
        it.count += 1;
        if now.saturating_duration_since(it.reported) < PERIOD {
            return None;
        }
        let count = std::mem::take(&mut it.count);
        it.reported = now;
        Some(Report { sender: name.to_owned(), count })
    }

    /// So far.
    pub(crate) fn totals(&self) -> Totals {
        self.totals
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[expect(clippy::disallowed_methods, reason = "any moment to begin with")]
    fn start() -> Instant {
        Instant::now()
    }

    #[test]
    fn a_flood_of_one_sender_is_a_line_in_a_period() {
        let (mut losses, start) = (Losses::default(), start());
        let lines: Vec<_> = (0..25_000u64)
            .filter_map(|ms| losses.count(Loss::Dropped, "kw/uav1/a", start + Duration::from_millis(ms)))
            .map(|it| it.count)
            .collect();
        assert_eq!(lines, [1, 10_000, 10_000]);
        assert_eq!(losses.totals(), Totals { dropped: 25_000, ..Totals::default() });
    }

    #[test]
    fn each_sender_and_each_reason_has_lines_of_its_own() {
        let (mut losses, now) = (Losses::default(), start());
        let line = |sender: &str| Some(Report { sender: sender.into(), count: 1 });
        assert_eq!(losses.count(Loss::Dropped, "a", now), line("a"));
        assert_eq!(losses.count(Loss::Dropped, "b", now), line("b"));
        assert_eq!(losses.count(Loss::Late, "a", now), line("a"));
        assert_eq!(losses.count(Loss::Late, "a", now), None);
        assert_eq!(losses.totals(), Totals { dropped: 2, late: 2, malformed: 0 });
    }

    proptest! {
        /// Whatever names a flood uses, lines and memory have a bound, and all is counted.
        #[test]
        fn no_flood_floods_the_log(senders in prop::collection::vec((0..500u32, 0..30u64), 1..2000)) {
            let (mut losses, mut now, mut lines, mut ms) = (Losses::default(), start(), 0u64, 0);
            for (sender, gap) in &senders {
                (now, ms) = (now + Duration::from_millis(*gap), ms + gap);
                lines += u64::from(losses.count(Loss::Malformed, &format!("kw/{sender}"), now).is_some());
            }
            let periods = 1 + ms / PERIOD.as_millis() as u64;
            prop_assert!(lines <= (1 + periods) * (1 + MOST_SENDERS as u64), "{lines} lines in {periods} periods");
            prop_assert!(losses.senders.len() <= 1 + MOST_SENDERS);
            prop_assert_eq!(losses.totals().malformed, senders.len() as u64);
        }
    }
}
