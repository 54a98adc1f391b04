//! Seeded randomness: the same seed gives the same numbers on every machine.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a stream of random numbers is for. Each use has its own, so that a topic sent once more
/// does not change the wind.
#[derive(Debug, Clone, Copy)]
pub enum Use {
    /// Gusts.
    Wind = 1,
    /// Errors of the estimate.
    Estimator = 2,
    /// Errors of each sample.
    Sensors = 3,
}

/// A source of random numbers.
#[derive(Debug, Clone)]
pub struct Noise(ChaCha8Rng);

impl Noise {
    /// The stream of `seed` for one use.
    pub fn new(seed: u64, purpose: Use) -> Noise {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(purpose as u64);
        Noise(rng)
    }

    /// A number of mean 0 and standard deviation 1, never beyond 3: the sum of three uniform ones
    /// (Irwin-Hall), which is close enough to normal for noise and has no outliers.
    pub fn unit(&mut self) -> f64 {
        (0..3).map(|_| self.0.random_range(-1.0..1.0)).sum()
    }

    /// Three of them.
    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.unit(), self.unit(), self.unit())
    }

    /// A direction over ground, any as likely as another.
    pub fn direction(&mut self) -> Vector3<f64> {
        let angle = self.0.random_range(0.0..std::f64::consts::TAU);
        Vector3::new(angle.cos(), angle.sin(), 0.0)
    }
}

/// A random vector that wanders about zero: a first-order Gauss-Markov process.
#[derive(Debug, Clone, Default)]
pub struct Wander(pub Vector3<f64>);

impl Wander {
    /// Goes on by `dt_s`. `tau_s` is how long it remembers, `deviation` its standard deviation.
    pub fn step(&mut self, noise: &mut Noise, dt_s: f64, tau_s: f64, deviation: Vector3<f64>) {
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
            let mut noise = Noise::new(seed, Use::Sensors);
            (0..10_000).map(|_| noise.unit()).collect::<Vec<_>>()
        };
        let variance = draw(1).iter().map(|it| it * it).sum::<f64>() / 10_000.0;
        assert!((variance - 1.0).abs() < 0.05, "{variance}");
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
    }

    #[test]
    fn a_wander_keeps_its_deviation() {
        let (mut noise, mut wander) = (Noise::new(7, Use::Wind), Wander::default());
        let mut sum = 0.0;
        for _ in 0..20_000 {
            wander.step(&mut noise, 0.1, 1.0, Vector3::new(2.0, 2.0, 0.0));
            sum += wander.0.x * wander.0.x;
        }
        let deviation = (sum / 20_000.0_f64).sqrt();
        assert!((1.8..2.2).contains(&deviation), "{deviation}");
    }
}
