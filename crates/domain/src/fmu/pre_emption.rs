//! Whether the autopilot flies something else than what was asked for, for a reason of its own.
//!
//! One that only misses our setpoints is no such case: it waits for us, and any command of ours ends it. Nobody but us can, so that who
//! leaves it alone leaves it for good. But where something else was the reason, our setpoints stop at once, and the autopilot misses them
//! soon after: what it misses from the beginning is the reason, and what it misses later is the consequence. An autopilot that says which
//! reason is left is believed.

use std::time::Duration;

use super::{FailsafeReason, FlightMode};
use crate::time::Time;

/// The reason is reported this soon after the mode. (A real PX4 reports both within 12 ms, and misses setpoints after 1 s.)
const REASON_WITHIN: Duration = Duration::from_millis(250);

/// What one status says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reported {
    /// One of the autopilot's own failsafes flies.
    pub failsafe: bool,
    /// The mode that was asked for.
    pub intended: Option<FlightMode>,
    /// The mode that is flown.
    pub actual: Option<FlightMode>,
    /// Its failures name the offboard signal as lost.
    pub signal_lost: bool,
    /// Why the failsafe flies, if the autopilot says.
    pub reason: Option<FailsafeReason>,
}

/// The pre-emption that lasts, if one does.
#[derive(Debug, Clone, Copy, Default)]
pub struct PreEmption(Option<Lasting>);

#[derive(Debug, Clone, Copy)]
struct Lasting {
    since: Time,
    /// It misses our setpoints, and nothing else is known to be the reason.
    waits_for_us: bool,
}

impl PreEmption {
    /// One that lasts, and had a reason of its own before anything was heard.
    pub fn remembered() -> PreEmption {
        PreEmption(Some(Lasting { since: Time::ZERO, waits_for_us: false }))
    }

    /// Takes in a status.
    pub fn update(&mut self, now: Time, status: Reported) {
        let Reported { failsafe, intended, actual, signal_lost, reason } = status;
        self.0 = (failsafe || intended != actual).then(|| {
            let lasting = self.0.unwrap_or(Lasting { since: now, waits_for_us: false });
            let is_reason = signal_lost && now - lasting.since <= REASON_WITHIN;
            let waits_for_us = match reason {
                Some(FailsafeReason::Setpoints) => true,
                Some(FailsafeReason::Other) => false,
                None => signal_lost && (lasting.waits_for_us || is_reason),
            };
            Lasting { waits_for_us, ..lasting }
        });
    }

    /// Whether it has a reason of its own.
    pub fn holds(&self) -> bool {
        self.0.is_some_and(|it| !it.waits_for_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use FlightMode::{Loiter, Offboard};

    #[test]
    fn what_it_misses_from_the_beginning_is_the_reason_and_what_it_misses_later_is_not() {
        /// Times in ms, each with the mode that is flown in place of offboard and whether the signal is lost.
        #[track_caller]
        fn check(statuses: &[(u64, FlightMode, bool)], expected: bool) {
            let mut pre_emption = PreEmption::default();
            for (ms, actual, signal_lost) in statuses {
                let (intended, actual, failsafe) = (Some(Offboard), Some(*actual), *actual != Offboard);
                let status = Reported { failsafe, intended, actual, signal_lost: *signal_lost, reason: None };
                pre_emption.update(Time::after(Duration::from_millis(*ms)), status);
            }
            assert_eq!(pre_emption.holds(), expected, "{statuses:?}");
        }
        check(&[(0, Offboard, false)], false);
        check(&[(0, Loiter, false)], true);
        check(&[(0, Loiter, true), (9000, Loiter, true)], false);
        check(&[(0, Loiter, false), (20, Loiter, true), (9000, Loiter, true)], false);
        // A fence, at which our setpoints stop.
        check(&[(0, Loiter, false), (1000, Loiter, true)], true);
        // It is missed no more, and still it holds.
        check(&[(0, Loiter, true), (500, Loiter, false)], true);
        check(&[(0, Loiter, true), (500, Loiter, false), (900, Loiter, true)], true);
        // One that is remembered lasts, whatever is missed by now.
        let missing = Reported {
            failsafe: true,
            intended: Some(Offboard),
            actual: Some(Loiter),
            signal_lost: true,
            reason: None,
        };
        let mut remembered = PreEmption::remembered();
        remembered.update(Time::after(Duration::from_secs(9)), missing);
        assert!(remembered.holds());
        // Over, and again.
        check(&[(0, Loiter, false), (500, Offboard, false), (9000, Loiter, true)], false);
        // What is said counts more than what was seen, whenever it is said.
        let because = |reason| Reported { reason: Some(reason), ..missing };
        for first in [missing, because(FailsafeReason::Other), because(FailsafeReason::Setpoints)] {
            let mut pre_emption = PreEmption::default();
            pre_emption.update(Time::ZERO, first);
            pre_emption.update(Time::after(Duration::from_secs(9)), because(FailsafeReason::Other));
            assert!(pre_emption.holds(), "{first:?}");
            pre_emption.update(Time::after(Duration::from_secs(10)), because(FailsafeReason::Setpoints));
            assert!(!pre_emption.holds(), "{first:?}");
        }
    }
}
