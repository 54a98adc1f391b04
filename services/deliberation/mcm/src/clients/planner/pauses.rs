//! Pauses before a plan is asked for again, growing with each failure.
//!
//! So a short disturbance does not use up every try, a contingency can respond first, and manager, planner and tower never ask
//! each other without end at one moment.

use std::time::Duration;

use domain::time::Time;

/// The pause after the first, second, .. failure in a row, in units of the first pause.
const PAUSES: [u32; 5] = [0, 1, 2, 4, 8];

/// Failures in a row, and until when no plan is asked for.
#[derive(Debug, Default)]
pub(crate) struct Pauses {
    failures: usize,
    unusable_answers: usize,
    /// When the last failure was, and until when no plan is asked for.
    last: Time,
    until: Time,
}

impl Pauses {
    pub(crate) fn begin(&mut self, now: Time, first_pause: Duration) {
        self.last = now;
        self.until = now + first_pause * PAUSES[self.failures.min(PAUSES.len() - 1)];
        self.failures += 1;
    }

    /// Until when no plan is asked for.
    pub(crate) fn until(&self) -> Time {
        self.until
    }

    /// A step was flown. One that is over within the first pause after a failure proves no progress.
    pub(crate) fn end(&mut self, now: Time, first_pause: Duration) {
        if self.last + first_pause <= now {
            self.failures = 0;
        }
        self.until = Time::ZERO;
    }

    /// Something other than a failure asks for a plan.
    pub(crate) fn skip(&mut self) {
        self.until = Time::ZERO;
    }

    /// The planner's answer could not be used; returns how long to wait before asking again.
    pub(crate) fn unusable_answer(&mut self, first_pause: Duration) -> Duration {
        self.unusable_answers += 1;
        first_pause * PAUSES[self.unusable_answers.min(PAUSES.len() - 1)]
    }

    /// The planner's answer could be used.
    pub(crate) fn answered(&mut self) {
        self.unusable_answers = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_grow_until_a_step_is_flown() {
        let second = Duration::from_secs(1);
        let mut pauses = Pauses::default();
        let mut next = || {
            pauses.begin(Time::ZERO, second);
            pauses.until().as_secs_f64()
        };
        assert_eq!([next(), next(), next(), next(), next(), next()], [0.0, 1.0, 2.0, 4.0, 8.0, 8.0]);
        pauses.end(Time::ZERO, second);
        pauses.begin(Time::ZERO, second);
        assert_eq!(pauses.until().as_secs_f64(), 8.0, "a step that ends at once proves nothing");
        pauses.end(Time::after(second), second);
        pauses.begin(Time::after(second), second);
        assert_eq!(pauses.until(), Time::after(second));
        assert_eq!([0; 3].map(|_| pauses.unusable_answer(second).as_secs()), [1, 2, 4]);
        pauses.answered();
        assert_eq!(pauses.unusable_answer(second), second);
    }
}
