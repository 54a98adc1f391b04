//! Records that repeat themselves: flags that rise and fall faster than anybody reads must not push other decisions out of the
//! journal and the recording. What is decided does not change, only how often it is said.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;

/// The same is said this often within a window; how often more is said once, at its end.
const MOST: u32 = 3;
/// What is kept at a time: there is no end to what may be said.
const MOST_KEPT: usize = 256;
/// In mission time.
const WINDOW: Duration = Duration::from_secs(10);

/// What was said lately, by what it is about, and how often.
#[derive(Debug, Default)]
pub(crate) struct Repeats(BTreeMap<String, Counted>);

#[derive(Debug)]
struct Counted {
    /// The first of them.
    text: String,
    since: Time,
    times: u32,
}

impl Repeats {
    /// Whether this is said now, or only counted. `about`: the same for words that tell the same, as a flag's reason may have
    /// another value each time.
    pub(crate) fn is_said(&mut self, at: Time, about: &str, text: &str) -> bool {
        if let Some(said) = self.0.get_mut(about) {
            said.times = said.times.saturating_add(1);
            return said.times <= MOST;
        }
        if self.0.len() < MOST_KEPT {
            self.0.insert(about.to_owned(), Counted { text: text.to_owned(), since: at, times: 1 });
        }
        true
    }

    /// The windows that are over: what is to be said about the words that were only counted in them.
    pub(crate) fn over(&mut self, now: Time) -> Vec<String> {
        let mut counted = Vec::new();
        self.0.retain(|_, said| {
            let is_over = said.since + WINDOW <= now;
            if is_over && MOST < said.times {
                let (more, window_s) = (said.times - MOST, WINDOW.as_secs());
                let times = if more == 1 { "once more".to_owned() } else { format!("{more} more times") };
                counted.push(format!("{} ({times} in {window_s} s)", said.text));
            }
            !is_over
        });
        counted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    #[test]
    fn what_repeats_is_said_three_times_and_counted() {
        let mut repeats = Repeats::default();
        let said = (0..500)
            .filter(|it| repeats.is_said(at(it * 10), "obstacle", &format!("flag `obstacle` raised: {it} m")))
            .count();
        assert!(repeats.is_said(at(5_000), "stop", "`obstacle`: stop"));
        assert_eq!((said, repeats.over(at(9_999))), (3, Vec::new()));
        assert_eq!(repeats.over(at(10_000)), ["flag `obstacle` raised: 0 m (497 more times in 10 s)"]);
        assert!(repeats.is_said(at(10_010), "obstacle", "flag `obstacle` raised: 7 m"), "a new window begins");
        assert!(repeats.over(at(20_020)).is_empty() && repeats.0.is_empty(), "nothing is kept");
    }

    #[test]
    fn what_is_never_the_same_is_all_said_and_little_is_kept() {
        let mut repeats = Repeats::default();
        assert!((0..10_000).all(|it| repeats.is_said(at(it), &it.to_string(), "flag `obstacle` raised")));
        assert_eq!(repeats.0.len(), MOST_KEPT);
    }
}
