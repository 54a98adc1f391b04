//! What a set of samples comes to.

use serde::Serialize;

/// Figures of a set of samples, in its own unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Statistics {
    pub count: usize,
    pub max: f64,
    pub min: f64,
    pub mean: f64,
    /// Of the sample, divided by one less than the count.
    pub std_dev: f64,
    pub p50: f64,
    pub p99: f64,
}

impl Statistics {
    /// `None` of nothing.
    pub(crate) fn of(samples: &[f64]) -> Option<Statistics> {
        let mut sorted = samples.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        let count = sorted.len();
        let mean = sorted.iter().sum::<f64>() / count as f64;
        let squares: f64 = sorted.iter().map(|it| (it - mean).powi(2)).sum();
        let std_dev = if count < 2 { 0.0 } else { (squares / (count - 1) as f64).sqrt() };
        Some(Statistics { count, max, min, mean, std_dev, p50: rank(&sorted, 0.50), p99: rank(&sorted, 0.99) })
    }
}

/// The smallest sample that the given share of all does not exceed; `sorted` is not empty.
fn rank(sorted: &[f64], share: f64) -> f64 {
    let index = (share * sorted.len() as f64).ceil() as usize;
    sorted[index.clamp(1, sorted.len()) - 1]
}

/// The sample at the given share of the order by `key`; `None` of nothing.
pub(crate) fn at_rank<T>(samples: &[T], share: f64, key: impl Fn(&T) -> f64) -> Option<&T> {
    let mut order: Vec<&T> = samples.iter().collect();
    order.sort_by(|a, b| key(a).total_cmp(&key(b)));
    let index = (share * order.len() as f64).ceil() as usize;
    order.get(index.clamp(1, order.len().max(1)) - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_those_of_a_textbook() {
        let it = Statistics::of(&[2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0]).unwrap();
        assert_eq!((it.count, it.min, it.max, it.mean, it.p50, it.p99), (8, 2.0, 9.0, 5.0, 4.0, 9.0));
        assert!((it.std_dev - (32.0f64 / 7.0).sqrt()).abs() < 1e-12);
        assert_eq!(Statistics::of(&[]), None);
        assert_eq!(at_rank(&[3, 1, 2], 0.5, |it| f64::from(*it)), Some(&2));
    }
}
