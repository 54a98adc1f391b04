//! Whether a landing on a target sees it. ArduPilot says so in texts alone, and also of a target that it only flies over.

use std::time::Duration;

use domain::time::Time;

/// A target that nothing was heard of since the landing began counts as not seen after this time. (ENG: from 10 m ArduPilot comes down to
/// 6 m meanwhile, where its sensor should see it: PLND_ALT_MAX is 8 m. Where no range finder says how high it is, it never says so itself.)
const LOOKS_FOR: Duration = Duration::from_secs(8);

/// What was heard of the target.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LandingTarget {
    /// When the landing on it began.
    landing_since: Option<Time>,
    /// Whether it was seen, by the newest text, and when that came.
    told: Option<(Time, bool)>,
}

impl LandingTarget {
    /// The autopilot says whether it sees the target.
    pub(crate) fn told(&mut self, is_seen: bool, now: Time) {
        self.told = Some((now, is_seen));
    }

    /// A landing on it begins.
    pub(crate) fn landing_begins(&mut self, now: Time) {
        self.landing_since = Some(now);
    }

    /// Something else is commanded.
    pub(crate) fn landing_ends(&mut self) {
        self.landing_since = None;
    }

    /// Whether the landing sees it; `None`: that is not known, or no landing on it is flown. One that was lost before the landing may only
    /// have been flown over.
    pub(crate) fn is_seen(&self, now: Time) -> Option<bool> {
        let since = self.landing_since?;
        match self.told {
            Some((_, true)) => Some(true),
            Some((at, false)) if since <= at => Some(false),
            _ => (LOOKS_FOR <= now - since).then_some(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The landing begins at 10 s; what was told at which second, and what is known at another one.
    #[track_caller]
    fn check(told: &[(u64, bool)], at_s: u64, expected: Option<bool>) {
        let (mut target, time) = (LandingTarget::default(), |seconds| Time::after(Duration::from_secs(seconds)));
        for (second, is_seen) in told.iter().filter(|(second, _)| *second <= at_s) {
            target.told(*is_seen, time(*second));
        }
        target.landing_begins(time(10));
        assert_eq!(target.is_seen(time(at_s)), expected, "{told:?} at {at_s} s");
        target.landing_ends();
        assert_eq!(target.is_seen(time(at_s)), None);
    }

    #[test]
    fn a_target_is_seen_as_the_newest_text_says() {
        check(&[(12, true)], 11, None);
        check(&[(12, true)], 12, Some(true));
        check(&[(12, true)], 60, Some(true));
        check(&[(12, true), (15, false)], 15, Some(false));
        check(&[(12, true), (15, false), (16, true)], 16, Some(true));
        // It hovers over it.
        check(&[(5, true)], 10, Some(true));
    }

    #[test]
    fn a_target_that_was_flown_over_or_never_seen_is_not_lost_at_once() {
        for told in [&[][..], &[(3, true), (5, false)]] {
            check(told, 10, None);
            check(told, 17, None);
            check(told, 18, Some(false));
        }
    }
}
