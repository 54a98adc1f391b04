//! Seeded randomness: the same seed gives the same numbers on every machine.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What random numbers are used for. Each use has its own stream, so that one more message of a
/// topic does not change the wind.
#[derive(Debug, Clone, Copy)]
pub(crate) enum NoiseStream {
    /// Gusts.
    Wind = 1,
    /// Errors of the estimate.
    Estimator = 2,
    /// Errors of single samples.
    Sensors = 3,
}

/// A source of random numbers.
#[derive(Debug, Clone)]
pub(crate) struct Noise(ChaCha8Rng);

impl Noise {
    /// One stream of `seed`.
    pub(crate) fn new(seed: u64, stream: NoiseStream) -> Noise {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream as u64);
        Noise(rng)
    }

    /// A number of mean 0 and standard deviation 1, never beyond 3: the sum of three uniform numbers
    /// (Irwin-Hall), which is close enough to normal for noise and has no outliers.
    pub(crate) fn unit(&mut self) -> f64 {
        (0..3).map(|_| self.0.random_range(-1.0..1.0)).sum()
    }

    /// Three such numbers.
    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.unit(), self.unit(), self.unit())
    }

    /// A horizontal direction; all are equally likely.
    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        let angle = self.0.random_range(0.0..std::f64::consts::TAU);
        Vector3::new(angle.cos(), angle.sin(), 0.0)
    }
}

/// A random vector that wanders around zero: a first-order Gauss-Markov process.
#[derive(Debug, Clone, Default)]
pub(crate) struct GaussMarkov(pub Vector3<f64>);

impl GaussMarkov {
    /// Advances by `dt_s`. `tau_s` is its correlation time, `deviation` its standard deviation.
    pub(crate) fn step(&mut self, noise: &mut Noise, dt_s: f64, tau_s: f64, deviation: Vector3<f64>) {
        let keep = (-dt_s / tau_s).exp();
        let fresh = (1.0 - keep * keep).sqrt();
        self.0 = self.0 * keep + noise.vector().component_mul(&deviation) * fresh;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_unit_variance_and_a_seed_repeats_it() {
        let draw = |seed| {
            let mut noise = Noise::new(seed, NoiseStream::Sensors);
            (0..10_000).map(|_| noise.unit()).collect::<Vec<_>>()
        };
        let variance = draw(1).iter().map(|it| it * it).sum::<f64>() / 10_000.0;
        assert!((variance - 1.0).abs() < 0.05, "{variance}");
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
    }

    #[test]
    fn a_gauss_markov_process_keeps_its_deviation() {
        let (mut noise, mut process) = (Noise::new(7, NoiseStream::Wind), GaussMarkov::default());
        let mut sum = 0.0;
        for _ in 0..20_000 {
            process.step(&mut noise, 0.1, 1.0, Vector3::new(2.0, 2.0, 0.0));
            sum += process.0.x * process.0.x;
        }
        let deviation = (sum / 20_000.0_f64).sqrt();
        assert!((1.8..2.2).contains(&deviation), "{deviation}");
    }
}
