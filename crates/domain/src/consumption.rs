//! What a flight takes, measured against what the vehicle's figures say, so that forecasts in flight go by both.
//!
//! Power at the terminals leaves out what the cells lose inside, so that a sound vehicle measures a few per cent less than its figures,
//! which have those losses in them. Less is never believed: a forecast may be too careful, but not too bold.

use std::time::Duration;

use crate::time::Time;

/// Older measurements count less, by this time constant. (ENG: longer than a climb or a gust, shorter than what a detour takes.)
const TIME_CONSTANT_S: f64 = 30.0;
/// There is no value before this much flight was measured. (ENG: a takeoff is over by then.)
const LEAST: Duration = Duration::from_secs(30);
/// A gap longer than this between two measurements is not bridged.
const LONGEST_GAP_S: f64 = 1.0;
/// Forecasts go no further than this above the figures: more is a mistake of a sensor. (ENG: icing was measured to take 1.8 times as much.)
const MOST: f64 = 3.0;

/// Energy that was measured, and that the figures say for the same time.
#[derive(Debug, Clone, Default)]
pub struct Consumption {
    last: Option<Time>,
    measured_j: f64,
    expected_j: f64,
    flown: Duration,
}

impl Consumption {
    /// At `now` the vehicle flies, takes `measured_w`, and would take `expected_w` by its figures.
    pub fn measure(&mut self, now: Time, measured_w: f64, expected_w: f64) {
        let Some(last) = self.last.replace(now) else { return };
        let passed = now - last;
        let passed_s = passed.as_secs_f64();
        if LONGEST_GAP_S < passed_s {
            return;
        }
        let kept = (-passed_s / TIME_CONSTANT_S).exp();
        self.measured_j = self.measured_j * kept + measured_w * passed_s;
        self.expected_j = self.expected_j * kept + expected_w * passed_s;
        self.flown += passed;
    }

    /// What the flight takes as a multiple of the figures; `None` before enough was measured.
    pub fn ratio(&self) -> Option<f64> {
        (LEAST <= self.flown && 0.0 < self.expected_j).then(|| self.measured_j / self.expected_j)
    }

    /// By what forecasts multiply the figures: never less than 1.
    pub fn factor(&self) -> f64 {
        self.ratio().unwrap_or(1.0).clamp(1.0, MOST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Measures ten times a second for this long, from `begins_s` on.
    fn measured(consumption: &mut Consumption, begins_s: u32, seconds: u32, measured_w: f64) {
        for tenth in 0..seconds * 10 {
            let now = Time::after(Duration::from_secs(1) * begins_s + Duration::from_millis(100) * tenth);
            consumption.measure(now, measured_w, 700.0);
        }
    }

    #[test]
    fn what_is_measured_counts_after_half_a_minute_and_never_makes_a_forecast_bolder() {
        let mut consumption = Consumption::default();
        measured(&mut consumption, 0, 20, 1050.0);
        assert_eq!((consumption.ratio(), consumption.factor()), (None, 1.0));
        measured(&mut consumption, 20, 20, 1050.0);
        assert!((consumption.factor() - 1.5).abs() < 1e-9);
        measured(&mut consumption, 40, 300, 630.0);
        assert!(consumption.ratio().is_some_and(|it| (it - 0.9).abs() < 1e-3), "{consumption:?}");
        assert_eq!(consumption.factor(), 1.0);
        measured(&mut consumption, 340, 300, 70_000.0);
        assert_eq!(consumption.factor(), 3.0);
    }

    #[test]
    fn a_change_is_seen_within_a_minute() {
        let mut consumption = Consumption::default();
        measured(&mut consumption, 0, 300, 700.0);
        measured(&mut consumption, 300, 60, 1400.0);
        assert!(consumption.ratio().is_some_and(|it| 1.8 < it && it < 2.0), "{consumption:?}");
    }
}
