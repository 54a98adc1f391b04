//! The greatest of recent values, in little memory.

use std::time::Duration;

use domain::time::Time;

/// The greatest value of this and of the window before it: what was seen within one window counts, and what is older than two does not.
#[derive(Debug, Clone)]
pub(crate) struct Greatest {
    window: Duration,
    this: f64,
    last: f64,
    ends: Time,
}

impl Greatest {
    /// Nothing was seen yet, which is zero.
    pub(crate) fn within(window: Duration) -> Greatest {
        Greatest { window, this: 0.0, last: 0.0, ends: Time::ZERO }
    }

    /// This value was seen.
    pub(crate) fn see(&mut self, now: Time, value: f64) {
        self.turn(now);
        self.this = self.this.max(value);
    }

    /// The greatest recent value.
    pub(crate) fn at(&self, now: Time) -> f64 {
        let mut turned = self.clone();
        turned.turn(now);
        turned.this.max(turned.last)
    }

    fn turn(&mut self, now: Time) {
        if self.ends <= now {
            // After two windows in which nothing was seen the one before this is empty, too.
            let is_long_ago = self.ends + self.window <= now;
            self.last = if is_long_ago { 0.0 } else { self.this };
            self.this = 0.0;
            self.ends = now + self.window;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_counts_for_one_window_and_no_longer_than_two() {
        let at = |s| Time::after(Duration::from_secs(s));
        let mut greatest = Greatest::within(Duration::from_secs(10));
        assert_eq!(greatest.at(at(0)), 0.0);
        greatest.see(at(1), 3.0);
        greatest.see(at(2), 2.0);
        assert_eq!([2, 10, 12].map(|s| greatest.at(at(s))), [3.0; 3]);
        assert_eq!([22, 100].map(|s| greatest.at(at(s))), [0.0; 2]);
        greatest.see(at(12), 1.0);
        assert_eq!((greatest.at(at(12)), greatest.at(at(23))), (3.0, 1.0));
    }
}
