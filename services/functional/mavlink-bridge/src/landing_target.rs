//! Whether a landing on a target sees it. ArduPilot says so in texts alone, and also of a target that it only flies over.

use std::time::Duration;

use domain::time::Time;

/// A target that nothing was heard of counts as not seen once the landing has come down slowly for this time. (ENG: ArduPilot comes down by
/// 0.5 m/s below 10 m, and its sensor should see the target below 8 m: LAND_SPEED, LAND_ALT_LOW and PLND_ALT_MAX. It does not say so itself
/// where no range finder measures the height, nor with PLND_STRICT 0.)
const LOOKS_FOR: Duration = Duration::from_secs(8);
/// Slower than from farther up, by WPNAV_SPEED_DN: 1.5 m/s.
const SLOWLY_M_S: f64 = 1.0;

/// What was heard of the target.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LandingTarget {
    /// When the landing on it began.
    landing_since: Option<Time>,
    /// Since when it comes down slowly.
    slow_since: Option<Time>,
    /// Whether it was seen, by the newest text, and when that came.
    told: Option<(Time, bool)>,
}

impl LandingTarget {
    /// The autopilot says whether it sees the target.
    pub(crate) fn told(&mut self, is_seen: bool, now: Time) {
        self.told = Some((now, is_seen));
    }

    /// How fast it comes down.
    pub(crate) fn descends(&mut self, down_m_s: f64, now: Time) {
        let is_slow = self.landing_since.is_some() && down_m_s <= SLOWLY_M_S;
        self.slow_since = is_slow.then(|| self.slow_since.unwrap_or(now));
    }

    /// A landing on it begins.
    pub(crate) fn landing_begins(&mut self, now: Time) {
        (self.landing_since, self.slow_since) = (Some(now), None);
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
            _ => self.slow_since.is_some_and(|at| LOOKS_FOR <= now - at).then_some(false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The landing begins at 10 s, fast, and is slow from 20 s on; what was told at which second, and what is known at another one.
    #[track_caller]
    fn check(told: &[(u64, bool)], at_s: u64, expected: Option<bool>) {
        let mut target = LandingTarget::default();
        for second in 0..=at_s {
            let now = Time::after(Duration::from_secs(second));
            if second == 10 {
                target.landing_begins(now);
            }
            target.descends(if second < 20 { 1.5 } else { 0.5 }, now);
            for (_, is_seen) in told.iter().filter(|(at, _)| *at == second) {
                target.told(*is_seen, now);
            }
        }
        let now = Time::after(Duration::from_secs(at_s));
        assert_eq!(target.is_seen(now), expected, "{told:?} at {at_s} s");
        target.landing_ends();
        assert_eq!(target.is_seen(now), None);
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
    fn a_target_that_was_flown_over_or_never_seen_is_lost_only_near_the_ground() {
        for told in [&[][..], &[(3, true), (5, false)]] {
            check(told, 10, None);
            check(told, 27, None);
            check(told, 28, Some(false));
        }
    }
}
