//! The air in which the vehicle flies: a mean wind with gusts.

use nalgebra::Vector3;

use crate::noise::{GaussMarkov, Noise};

/// Correlation time of the gusts, and how often a new one is drawn.
const GUST_TAU_S: f64 = 3.0;
const GUST_PERIOD_S: f64 = 0.1;
/// How long the estimator averages: routes are planned without gusts.
const ESTIMATE_TAU_S: f64 = 5.0;

/// Wind, horizontal.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wind {
    /// NED, where it blows to, metres per second.
    mean: Vector3<f64>,
    /// Standard deviation of each horizontal component, metres per second.
    gust: f64,
    gusts: GaussMarkov,
    until_next_s: f64,
    estimate: Vector3<f64>,
}

impl Wind {
    /// Sets the mean wind towards north and east, and the standard deviation of its gusts.
    pub(crate) fn set(&mut self, north_m_s: f64, east_m_s: f64, gust_m_s: f64) {
        let (mean, estimate) = (Vector3::new(north_m_s, east_m_s, 0.0), self.estimate);
        *self = Wind { mean, gust: gust_m_s, estimate, ..Wind::default() };
    }

    /// Without its gusts, NED.
    pub(crate) fn mean(&self) -> Vector3<f64> {
        self.mean
    }

    /// Advances by `dt_s` and returns the wind, NED.
    pub(crate) fn step(&mut self, noise: &mut Noise, dt_s: f64) -> Vector3<f64> {
        if self.gust > 0.0 {
            self.until_next_s -= dt_s;
            if self.until_next_s <= 0.0 {
                self.until_next_s += GUST_PERIOD_S;
                self.gusts.step(noise, GUST_PERIOD_S, GUST_TAU_S, Vector3::new(self.gust, self.gust, 0.0));
            }
        }
        let wind = self.mean + self.gusts.0;
        self.estimate += (wind - self.estimate) * (dt_s / ESTIMATE_TAU_S).min(1.0);
        wind
    }

    /// Advances by `dt_s` while the vehicle is parked: an anemometer shows the mean wind.
    pub(crate) fn rest(&mut self, dt_s: f64) {
        self.estimate += (self.mean - self.estimate) * (1.0 - (-dt_s / ESTIMATE_TAU_S).exp());
    }

    /// The wind as the vehicle has estimated it in flight, or has measured it on the ground.
    pub(crate) fn estimate(&self) -> Vector3<f64> {
        self.estimate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::noise::NoiseStream;

    #[test]
    fn gusts_stay_around_the_mean() {
        let (mut noise, mut wind) = (Noise::new(1, NoiseStream::Wind), Wind::default());
        assert_eq!(wind.step(&mut noise, 0.004), Vector3::zeros());
        wind.set(3.0, -4.0, 1.0);
        let (mut sum, mut furthest) = (Vector3::zeros(), 0.0_f64);
        for _ in 0..250_000 {
            let now = wind.step(&mut noise, 0.004);
            sum += now;
            furthest = furthest.max((now - Vector3::new(3.0, -4.0, 0.0)).norm());
        }
        assert!((sum / 250_000.0 - Vector3::new(3.0, -4.0, 0.0)).norm() < 0.3, "{sum}");
        assert!((1.0..8.0).contains(&furthest), "{furthest}");
    }

    #[test]
    fn a_new_wind_is_estimated_within_some_seconds() {
        let (mut noise, mut wind) = (Noise::new(1, NoiseStream::Wind), Wind::default());
        let mut fly = |wind: &mut Wind, seconds: f64| {
            for _ in 0..(seconds / 0.004) as u32 {
                wind.step(&mut noise, 0.004);
            }
            wind.estimate().x
        };
        wind.set(6.0, 0.0, 0.0);
        assert_eq!(wind.estimate().x, 0.0, "not known before the vehicle has met it");
        let after = [fly(&mut wind, 1.0), fly(&mut wind, 29.0)];
        assert!((0.5..2.0).contains(&after[0]) && (5.9..6.0).contains(&after[1]), "{after:?}");
        wind.set(0.0, 0.0, 0.0);
        wind.rest(30.0);
        assert!(wind.estimate().x < 0.1, "also on the ground: {:?}", wind.estimate());
    }
}
