//! The duration of recent ticks: for the page, not for measurements.

use kittiwake_proto::v1;

/// Durations within an eighth of each other, roughly, share a class; 2^32 ns is four seconds.
const CLASSES: usize = 8 * 32;

/// The ticks of the present report period and of the one before. It never allocates.
#[derive(Debug, Default)]
pub(crate) struct TickTimes {
    present: Period,
    before: Period,
}

#[derive(Debug, Clone)]
struct Period {
    classes: [u32; CLASSES],
    max_ns: u64,
}

impl Default for Period {
    fn default() -> Period {
        Period { classes: [0; CLASSES], max_ns: 0 }
    }
}

impl TickTimes {
    pub(crate) fn add(&mut self, took_ns: u64) {
        self.present.classes[class(took_ns)] += 1;
        self.present.max_ns = self.present.max_ns.max(took_ns);
    }

    /// A report period is over.
    pub(crate) fn turn(&mut self) {
        self.before = std::mem::take(&mut self.present);
    }

    /// The figures for the status; `None` where nothing takes any time, as on a virtual clock.
    pub(crate) fn told(&self) -> Option<v1::TickTime> {
        let max_ns = self.present.max_ns.max(self.before.max_ns);
        if max_ns == 0 {
            return None;
        }
        let counts = || self.present.classes.iter().zip(&self.before.classes).map(|(one, other)| one + other);
        let ticks: u32 = counts().sum();
        let mut below = 0;
        let median = counts().position(|count| {
            below += count;
            ticks < 2 * below
        });
        let p50_ns = median.map_or(0.0, middle).min(max_ns as f64);
        Some(v1::TickTime { p50_ms: p50_ns / 1e6, max_ms: max_ns as f64 / 1e6, ticks })
    }
}

/// Eight classes to an octave.
fn class(took_ns: u64) -> usize {
    let octave = took_ns.max(8).ilog2();
    let eighth = (took_ns.max(8) >> (octave - 3)) - 8;
    (8 * octave as usize + eighth as usize).min(CLASSES - 1)
}

/// The middle of a class, in nanoseconds.
fn middle(class: usize) -> f64 {
    let (octave, eighth) = (class / 8, class % 8);
    2f64.powi(octave as i32) * (1.0 + (eighth as f64 + 0.5) / 8.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_and_the_longest_of_two_periods_are_published() {
        let mut times = TickTimes::default();
        assert_eq!(times.told(), None);
        [20_000, 21_000, 22_000, 900_000].into_iter().for_each(|it| times.add(it));
        times.turn();
        [19_000, 23_000].into_iter().for_each(|it| times.add(it));
        let told = times.told().unwrap();
        assert_eq!((told.ticks, told.max_ms), (6, 0.9));
        assert!((0.019..0.024).contains(&told.p50_ms), "{told:?}");
        times.turn();
        assert_eq!(times.told().unwrap().max_ms, 0.023);
        times.turn();
        assert_eq!(times.told(), None);
    }

    #[test]
    fn a_class_holds_what_is_near_its_middle() {
        for took in [8, 9, 100, 12_345, 1 << 20, 3_999_999_999] {
            let ratio = middle(class(took)) / took as f64;
            assert!((0.9..1.1).contains(&ratio), "{took}: {ratio}");
        }
        assert_eq!(class(u64::MAX), CLASSES - 1);
        assert_eq!(class(0), class(8));
    }
}
