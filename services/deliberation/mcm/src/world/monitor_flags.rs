//! Which flags the monitor has up, by the list in its introspection, and what of that is news.

use std::collections::{BTreeMap, BTreeSet};

use domain::measured::Measured;

/// The source of the introspection's flags.
pub(super) const MONITOR: &str = "monitor";

/// The monitor has raised a flag, or the condition of the flag of this name no longer holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum FlagNews {
    Raised(ListedFlag),
    Fell(String),
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct ListedFlag {
    pub(super) name: String,
    /// Another number is another rise, unless another monitor counts.
    pub(super) rise: u64,
    pub(super) reason: String,
    pub(super) measured: Option<Measured>,
}

/// How the flags stand by an introspection. One that is neither up nor undecided is down.
#[derive(Debug, Clone, Default)]
pub(super) struct Level {
    pub(super) up: Vec<ListedFlag>,
    /// A monitor that was started not long ago cannot say yet.
    pub(super) undecided: BTreeSet<String>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Taken {
    /// `None`: by a monitor before this one.
    rise: Option<u64>,
    /// It said nothing of a vehicle at rest, and was let fall there.
    fell_on_ground: bool,
}

/// What was taken in of the monitor's flags. What the next introspection says beside that is news; what is answered stays taken in as long
/// as it is listed.
#[derive(Debug, Default)]
pub(super) struct MonitorFlags(BTreeMap<String, Taken>);

impl MonitorFlags {
    /// The monitor was started again, and counts from one.
    pub(super) fn monitor_started(&mut self) {
        self.0.values_mut().for_each(|it| it.rise = None);
    }

    pub(super) fn expect(&mut self, name: &str) {
        self.0.insert(name.to_owned(), Taken::default());
    }

    /// What has risen and fallen by this introspection.
    pub(super) fn compare(&mut self, level: Level) -> Vec<FlagNews> {
        let Level { up, undecided } = level;
        let listed: BTreeSet<&str> = up.iter().map(|it| &*it.name).collect();
        let fallen = self.0.extract_if(.., |name, _| !listed.contains(&**name) && !undecided.contains(name));
        let mut news: Vec<_> = fallen.map(|(name, _)| FlagNews::Fell(name)).collect();
        for flag in up {
            match self.0.get_mut(&flag.name) {
                Some(taken) if taken.rise.is_none_or(|it| it == flag.rise) => taken.rise = Some(flag.rise),
                _ => {
                    self.0.insert(flag.name.clone(), Taken { rise: Some(flag.rise), fell_on_ground: false });
                    news.push(FlagNews::Raised(flag));
                }
            }
        }
        news
    }

    pub(super) fn fell_on_ground(&mut self, name: &str) {
        if let Some(taken) = self.0.get_mut(name) {
            taken.fell_on_ground = true;
        }
    }

    /// The vehicle lifts off: what was let fall on the ground, and is still listed, counts as raised. What was answered in the air stays
    /// answered.
    pub(super) fn lifts_off(&mut self) {
        self.0.retain(|_, taken| !taken.fell_on_ground);
    }

    /// Another flight begins: what is still listed and is not up, since it was answered or was of no more interest on the ground, counts
    /// as raised.
    pub(super) fn next_flight(&mut self, is_up: impl Fn(&str) -> bool) {
        self.0.retain(|name, _| is_up(name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What happens to a flag.
    enum Happens {
        /// It is up, by the rise of this number.
        Up(u64),
        Down,
        Undecided,
        /// The monitor is started again.
        Start,
        /// It is let fall, for the vehicle is on the ground.
        OnGround,
        LiftsOff,
        /// Another flight begins; whether the flag is up.
        NextFlight(bool),
    }
    use Happens::{Down, LiftsOff, NextFlight, OnGround, Start, Undecided, Up};

    /// `expected` is the news: whether it has risen or fallen, each time.
    #[track_caller]
    fn check(happens: &[Happens], expected: &[bool]) {
        let (mut flags, mut news) = (MonitorFlags::default(), Vec::new());
        let listed = |rise| ListedFlag { name: "f".into(), rise, reason: String::new(), measured: None };
        for it in happens {
            match *it {
                Up(rise) => news.extend(flags.compare(Level { up: vec![listed(rise)], ..Level::default() })),
                Down => news.extend(flags.compare(Level::default())),
                Undecided => news.extend(flags.compare(Level { undecided: ["f".into()].into(), ..Level::default() })),
                Start => flags.monitor_started(),
                OnGround => flags.fell_on_ground("f"),
                LiftsOff => flags.lifts_off(),
                NextFlight(is_up) => flags.next_flight(|_| is_up),
            }
        }
        let raised: Vec<bool> = news.iter().map(|it| matches!(it, FlagNews::Raised(_))).collect();
        assert_eq!(raised, expected);
    }

    #[test]
    fn what_differs_from_what_was_taken_in_is_news() {
        check(&[Down, Up(1), Up(1), Down, Down], &[true, false]);
        check(&[Up(1), Down, Up(2), Up(2)], &[true, false, true]);
        // It fell and rose between two introspections.
        check(&[Up(1), Up(2), Up(2)], &[true, true]);
    }

    #[test]
    fn a_monitor_that_was_started_again_says_nothing_new_before_it_knows() {
        check(&[Up(7), Start, Undecided, Undecided, Up(1), Up(1), Down], &[true, false]);
        check(&[Up(7), Start, Undecided, Down], &[true, false]);
        check(&[Start, Undecided, Down], &[]);
        check(&[Start, Undecided, Up(1)], &[true]);
        // Its number does not count beside that of the monitor before it, but does from then on.
        check(&[Up(7), Start, Up(1), Up(2)], &[true, true]);
    }

    #[test]
    fn what_was_let_fall_on_the_ground_counts_when_the_vehicle_lifts_off_and_what_was_answered_with_the_next_flight() {
        check(&[Up(1), OnGround, Up(1)], &[true]);
        check(&[Up(1), OnGround, LiftsOff, Up(1)], &[true, true]);
        check(&[Up(1), LiftsOff, Up(1)], &[true]);
        check(&[Up(1), NextFlight(false), Up(1)], &[true, true]);
        // What is up still falls.
        check(&[Up(1), NextFlight(true), Up(1), Down], &[true, false]);
        // What was let fall on the ground, and was gone since, is not remembered when it has come back and was answered.
        check(&[Up(1), OnGround, Down, Up(2), LiftsOff, Up(2)], &[true, false, true]);
        check(&[Up(1), OnGround, Up(2), LiftsOff, Up(2)], &[true, true]);
        check(&[Up(1), OnGround, NextFlight(false), Up(1), LiftsOff, Up(1)], &[true, true]);
    }
}
