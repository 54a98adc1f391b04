//! What the deaths of a campaign come to: how long until one is noticed, until its successor works, and how far the vehicle
//! flew meanwhile.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nix::sys::signal::Signal;

use crate::trouble::Victim;

/// How a process was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum How {
    /// Killed alone, once.
    Killed,
    /// It hung until its supervisor killed it.
    Hung,
    /// Killed with another one, up to 1.5 s apart.
    OneOfTwo,
    /// Killed several times, each time as soon as it was back.
    AgainAndAgain,
    /// Killed, and its state spoiled before it was back.
    Garbled,
    /// Killed with all others of the aircraft's computer, which stayed without power for a while.
    CompanionOff,
}

impl How {
    /// For a table.
    fn words(self) -> &'static str {
        match self {
            How::Killed => "killed",
            How::Hung => "hung",
            How::OneOfTwo => "one of two killed",
            How::AgainAndAgain => "killed again and again",
            How::Garbled => "killed, its state garbled",
            How::CompanionOff => "with its computer",
        }
    }

    /// The signal that it is lost by.
    pub fn signal(self) -> Signal {
        match self {
            How::Hung => Signal::SIGSTOP,
            How::Killed | How::OneOfTwo | How::AgainAndAgain | How::Garbled | How::CompanionOff => Signal::SIGKILL,
        }
    }
}

/// One loss of a process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Whom.
    pub victim: Victim,
    /// How.
    pub how: How,
    /// Wall seconds until the launcher said so.
    pub detected_s: Option<f64>,
    /// Wall seconds until its successor was heard on the bus; for a router, until anybody was.
    pub resumed_s: Option<f64>,
    /// Metres that the vehicle flew until then.
    pub flown_m: f64,
}

/// The table of all losses, for people.
pub fn table(losses: &[Loss]) -> String {
    let mut groups: BTreeMap<(How, Victim), Vec<&Loss>> = BTreeMap::new();
    losses.iter().for_each(|it| groups.entry((it.how, it.victim)).or_default().push(it));
    let mut text = String::from(
        "| lost | how | number | not back at the end | noticed after, s | back on the bus after, s | flown until then, m |\n|---|---|---|---|---|---|---|\n",
    );
    for ((how, victim), losses) in groups {
        let how = how.words();
        let detected = distribution(losses.iter().filter_map(|it| it.detected_s).collect());
        let resumed = distribution(losses.iter().filter_map(|it| it.resumed_s).collect());
        let back: Vec<f64> = losses.iter().filter(|it| it.resumed_s.is_some()).map(|it| it.flown_m).collect();
        let (number, not_back) = (losses.len(), losses.len() - back.len());
        let flown = distribution(back);
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {victim} | {how} | {number} | {not_back} | {detected} | {resumed} | {flown} |");
    }
    text
}

/// Median, p90 and greatest of the samples.
fn distribution(mut samples: Vec<f64>) -> String {
    samples.sort_by(f64::total_cmp);
    match samples.last() {
        None => "-".to_owned(),
        Some(max) => format!("{:.2} / {:.2} / {max:.2}", rank(&samples, 0.5), rank(&samples, 0.9)),
    }
}

/// The smallest sample that the given share of all does not exceed; `sorted` is not empty.
fn rank(sorted: &[f64], share: f64) -> f64 {
    let index = (share * sorted.len() as f64).ceil() as usize;
    sorted[index.clamp(1, sorted.len()) - 1]
}

/// The least-squares slope of samples of (x, y); `None` where all x are the same.
pub fn slope(samples: &[(f64, f64)]) -> Option<f64> {
    let count = samples.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| samples.iter().map(of).sum::<f64>() / count;
    let (mean_x, mean_y) = (mean(|it| it.0), mean(|it| it.1));
    let spread: f64 = samples.iter().map(|it| (it.0 - mean_x).powi(2)).sum();
    let common: f64 = samples.iter().map(|it| (it.0 - mean_x) * (it.1 - mean_y)).sum();
    (0.0 < spread).then(|| common / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_are_grouped_by_how_and_whom() {
        let loss = |victim, how, s: f64| Loss {
            victim,
            how,
            detected_s: Some(s / 10.0),
            resumed_s: (s < 9.0).then_some(s),
            flown_m: s * 100.0,
        };
        let killed = (1..=10).map(|it| loss(Victim::Mcm, How::Killed, f64::from(it)));
        let losses: Vec<Loss> =
            killed.chain([loss(Victim::Mcm, How::OneOfTwo, 5.0), loss(Victim::Router, How::Hung, 4.0)]).collect();
        let expected = "\
| lost | how | number | not back at the end | noticed after, s | back on the bus after, s | flown until then, m |
|---|---|---|---|---|---|---|
| mcm | killed | 10 | 2 | 0.50 / 0.90 / 1.00 | 4.00 / 8.00 / 8.00 | 400.00 / 800.00 / 800.00 |
| router | hung | 1 | 0 | 0.40 / 0.40 / 0.40 | 4.00 / 4.00 / 4.00 | 400.00 / 400.00 / 400.00 |
| mcm | one of two killed | 1 | 0 | 0.50 / 0.50 / 0.50 | 5.00 / 5.00 / 5.00 | 500.00 / 500.00 / 500.00 |
";
        assert_eq!(table(&losses), expected);
    }

    #[test]
    fn a_slope_is_that_of_a_textbook() {
        let line: Vec<(f64, f64)> = (0..5).map(|x| (f64::from(x), 3.0 + 2.0 * f64::from(x))).collect();
        assert_eq!(slope(&line), Some(2.0));
        assert_eq!(slope(&[(0.0, 1.0), (1.0, 0.0), (2.0, 2.0)]), Some(0.5));
        assert_eq!(slope(&[(1.0, 1.0)]), None);
        assert_eq!(slope(&[]), None);
    }
}
