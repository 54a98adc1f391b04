//! The autopilot's estimate: the true state plus an error that wanders, grows without satellites, and
//! follows injected faults.

use nalgebra::Vector3;

use crate::config;
use crate::multirotor::Multirotor;
use crate::noise::{GaussMarkov, Noise, NoiseStream};

/// Correlation time of the slow wander, and how often it moves.
const WANDER_TAU_S: f64 = 60.0;
const WANDER_PERIOD_S: f64 = 0.1;
/// The estimate follows the wander with this time constant, so that it never jumps.
const WANDER_LAG_S: f64 = 8.0;
/// Time constant of the return to the true state once the cause of an error has ended.
const RECOVERY_TAU_S: f64 = 1.0;
/// The true error without satellites, as a share of the reported standard deviation.
const DRIFT_SHARE: f64 = 1.0 / 3.0;

/// Injected faults of the estimator.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct EstimatorFaults {
    /// No satellites are received.
    pub(crate) gnss_lost: bool,
    /// It reports itself as invalid.
    pub(crate) invalid: bool,
    /// The estimate drifts at this speed, m/s.
    pub(crate) drift_m_s: f64,
    /// The estimate is off by this, NED, since it has jumped.
    pub(crate) offset: Vector3<f64>,
}

/// The estimate at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimate {
    /// NED.
    pub(crate) position: Vector3<f64>,
    /// NED.
    pub(crate) velocity: Vector3<f64>,
    /// Whether the horizontal part is vouched for.
    pub(crate) horizontal_valid: bool,
    /// Whether the vertical part is.
    pub(crate) vertical_valid: bool,
    /// Standard deviation of the horizontal position.
    pub(crate) eph_m: f64,
    /// Standard deviation of the height.
    pub(crate) epv_m: f64,
}

/// The estimator with its errors.
#[derive(Debug, Clone)]
pub(crate) struct Estimator {
    config: config::Estimator,
    /// The injected faults.
    pub(crate) faults: EstimatorFaults,
    noise: Noise,
    wander: GaussMarkov,
    until_next_s: f64,
    /// The part of the error that follows the wander.
    wander_error: Vector3<f64>,
    wander_velocity: Vector3<f64>,
    /// The error that faults have added, and its direction.
    error: Vector3<f64>,
    error_velocity: Vector3<f64>,
    direction: Vector3<f64>,
    deviation_m: f64,
}

impl Estimator {
    /// Without faults.
    pub(crate) fn new(config: config::Estimator, seed: u64) -> Estimator {
        let mut noise = Noise::new(seed, NoiseStream::Estimator);
        let direction = noise.direction();
        Estimator {
            config,
            faults: EstimatorFaults::default(),
            noise,
            wander: GaussMarkov::default(),
            until_next_s: 0.0,
            wander_error: Vector3::zeros(),
            wander_velocity: Vector3::zeros(),
            error: Vector3::zeros(),
            error_velocity: Vector3::zeros(),
            direction,
            deviation_m: 0.0,
        }
    }

    /// Advances by `dt_s`.
    pub(crate) fn step(&mut self, dt_s: f64) {
        self.step_wander(dt_s);
        let EstimatorFaults { gnss_lost, drift_m_s, .. } = self.faults;
        let growth = drift_m_s + if gnss_lost { self.config.dead_reckoning_m_s.get() } else { 0.0 };
        if growth > 0.0 {
            let speed = drift_m_s + (growth - drift_m_s) * DRIFT_SHARE;
            self.error_velocity = self.direction * speed;
            self.deviation_m += growth * dt_s;
        } else {
            self.error_velocity = -self.error / RECOVERY_TAU_S;
            self.deviation_m -= self.deviation_m * dt_s / RECOVERY_TAU_S;
        }
        self.error += self.error_velocity * dt_s;
    }

    /// The estimate of the true state.
    pub(crate) fn estimate(&self, truth: &Multirotor) -> Estimate {
        let eph_m = self.config.eph_m.get() + self.deviation_m;
        let valid = !self.faults.invalid;
        Estimate {
            position: truth.position + self.wander_error + self.error + self.faults.offset,
            // The velocity drifts too: a filter that follows a wrong source takes both from it.
            velocity: truth.velocity + self.wander_velocity + self.error_velocity,
            horizontal_valid: valid && eph_m <= self.config.eph_limit_m.get(),
            vertical_valid: valid,
            eph_m,
            epv_m: self.config.epv_m.get(),
        }
    }

    fn step_wander(&mut self, dt_s: f64) {
        self.until_next_s -= dt_s;
        if self.until_next_s <= 0.0 {
            self.until_next_s += WANDER_PERIOD_S;
            let deviation = Vector3::repeat(self.config.wander_m.get());
            self.wander.step(&mut self.noise, WANDER_PERIOD_S, WANDER_TAU_S, deviation);
        }
        self.wander_velocity = (self.wander.0 - self.wander_error) / WANDER_LAG_S;
        self.wander_error += self.wander_velocity * dt_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;

    #[test]
    fn it_wanders_drifts_and_returns_without_a_jump() {
        let truth = Multirotor::new(shipped::config().airframe);
        let mut estimator = Estimator::new(shipped::config().estimator, 1);
        let mut last = Vector3::zeros();
        let mut furthest = |estimator: &mut Estimator, seconds: usize| {
            let mut furthest = 0.0_f64;
            for _ in 0..seconds * 250 {
                estimator.step(0.004);
                let position = estimator.estimate(&truth).position;
                assert!((position - last).norm() < 0.05, "from {last} to {position}");
                last = position;
                furthest = furthest.max(position.norm());
            }
            furthest
        };
        let wander_m = furthest(&mut estimator, 600);
        assert!((0.05..0.8).contains(&wander_m), "{wander_m}");
        estimator.faults.gnss_lost = true;
        assert!(furthest(&mut estimator, 10) > 2.0);
        assert!(!estimator.estimate(&truth).horizontal_valid);
        estimator.faults.gnss_lost = false;
        furthest(&mut estimator, 10);
        assert!(estimator.estimate(&truth).horizontal_valid);
        assert!(furthest(&mut estimator, 10) < 0.8);
    }
}
