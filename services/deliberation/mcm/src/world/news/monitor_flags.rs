//! Which flags the monitor has up: by its events, and by the lists of its introspections.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::measured::Measured;
use domain::time::Time;

use super::FlagNews;

/// The source of the introspection's flags.
pub(in crate::world) const MONITOR: &str = "monitor";

/// A flag in the list of an introspection.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::world) struct ListedFlag {
    pub(in crate::world) name: String,
    pub(in crate::world) reason: String,
    pub(in crate::world) measured: Option<Measured>,
}

/// What is known of one flag that the monitor has raised.
#[derive(Debug, Clone, Copy, Default)]
struct Standing {
    /// When an event has raised it, as long as no list has had it since; `None`: the last list had it.
    unlisted_since: Option<Time>,
    /// It said nothing of a vehicle at rest, and was let fall there.
    fell_on_ground: bool,
}

/// The flags of the monitor. Where it says what is not known yet, that is news: the event itself may have been lost, or sent while this
/// process or the monitor was down.
///
/// | known of the flag        | what happens                | then                                                             |
/// |--------------------------|-----------------------------|------------------------------------------------------------------|
/// | nothing                  | an event raises it          | it is not listed yet                                             |
/// | nothing                  | it is listed                | it has risen, and is listed                                      |
/// | not listed yet           | it is listed                | it is listed                                                     |
/// | not listed yet           | an event lets it fall       | nothing is known                                                 |
/// | not listed yet           | it is not, for the limit    | it has fallen: between two lists, and that event was lost        |
/// | listed                   | an event about it           | it is listed until the next list                                 |
/// | listed                   | it is not                   | it has fallen                                                    |
/// | any, fell on the ground  | the vehicle lifts off       | nothing is known: it rises with the next list                    |
/// | any, not up (answered)   | another flight begins       | nothing is known: it rises with the next list                    |
///
/// An event counts by itself, whatever is known. After a start of the monitor nothing has fallen by a list before that monitor could have raised it.
#[derive(Debug, Default)]
pub(in crate::world) struct MonitorFlags {
    known: BTreeMap<String, Standing>,
    /// Since when introspections of the monitor that runs now are heard.
    heard_since: Option<Time>,
}

impl MonitorFlags {
    /// The monitor was started again, and needs time to find again what it had raised flags for.
    pub(in crate::world) fn monitor_started(&mut self) {
        self.heard_since = None;
    }

    /// Counts a flag as one that the last list had.
    pub(in crate::world) fn expect(&mut self, name: &str) {
        self.known.insert(name.to_owned(), Standing::default());
    }

    /// An event of the monitor.
    pub(super) fn hear(&mut self, name: &str, raised: bool, now: Time) {
        match self.known.get_mut(name) {
            // The next list says whether it still is.
            Some(it) if it.unlisted_since.is_none() => it.fell_on_ground &= !raised,
            _ if raised => {
                self.known.insert(name.to_owned(), Standing { unlisted_since: Some(now), fell_on_ground: false });
            }
            _ => {
                self.known.remove(name);
            }
        }
    }

    /// Takes in a list; what has risen and fallen by it. An event that is not listed is awaited for `limit`. What is not listed has not
    /// fallen before the monitor has been heard for `limit` and the time that `judged_after` tells; `None`: never.
    pub(super) fn list(
        &mut self,
        flags: Vec<ListedFlag>,
        now: Time,
        limit: Duration,
        judged_after: impl Fn(&str) -> Option<Duration>,
    ) -> Vec<FlagNews> {
        let since = *self.heard_since.get_or_insert(now);
        let is_judged = |name: &str| judged_after(name).is_some_and(|it| it.saturating_add(limit) <= now - since);
        let is_awaited = |it: &Standing| it.unlisted_since.is_some_and(|raised| now < raised + limit);
        let listed: BTreeSet<&str> = flags.iter().map(|it| &*it.name).collect();
        let fallen = self
            .known
            .extract_if(.., |name, standing| !listed.contains(&**name) && !is_awaited(standing) && is_judged(name));
        let mut news: Vec<_> = fallen.map(|(name, _)| of_monitor(name, false, String::new(), None)).collect();
        for ListedFlag { name, reason, measured } in flags {
            match self.known.get_mut(&name) {
                Some(standing) => standing.unlisted_since = None,
                None => {
                    self.known.insert(name.clone(), Standing::default());
                    news.push(of_monitor(name, true, reason, measured));
                }
            }
        }
        news
    }

    /// A flag was let fall since the vehicle is on the ground.
    pub(in crate::world) fn fell_on_ground(&mut self, name: &str) {
        if let Some(standing) = self.known.get_mut(name) {
            standing.fell_on_ground = true;
        }
    }

    /// The vehicle lifts off: what was let fall on the ground, and is still listed, counts as raised. What was answered in the air stays
    /// answered.
    pub(in crate::world) fn lifts_off(&mut self) {
        self.known.retain(|_, standing| !standing.fell_on_ground);
    }

    /// Another flight begins: what is still listed and is not up, since it was answered or was of no more interest on the ground, counts
    /// as raised.
    pub(in crate::world) fn next_flight(&mut self, is_up: impl Fn(&str) -> bool) {
        self.known.retain(|name, _| is_up(name));
    }
}

fn of_monitor(name: String, raised: bool, reason: String, measured: Option<Measured>) -> FlagNews {
    FlagNews { name, raised, source: MONITOR.to_owned(), reason, measured }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_millis(500);

    fn at(ms: u64) -> Time {
        Time::after(Duration::from_millis(ms))
    }

    /// A monitor raises the flag once its condition has lasted for this.
    const RAISED_WITHIN: Duration = Duration::from_millis(2000);

    /// What happens to a flag, each with its milliseconds since the monitor has been heard for long enough.
    enum Happens {
        Event(u64, bool),
        List(u64, bool),
        /// The monitor is started again.
        Start,
        /// It is let fall, for the vehicle is on the ground.
        OnGround,
        LiftsOff,
        /// Another flight begins; whether the flag is up.
        NextFlight(bool),
    }
    use Happens::{Event, LiftsOff, List, NextFlight, OnGround, Start};

    /// `expected` is what the lists say beside the events.
    #[track_caller]
    fn check(happens: &[Happens], expected: &[bool]) {
        let mut flags = MonitorFlags::default();
        let list = |flags: &mut MonitorFlags, ms, is_up: bool| {
            let listed = ListedFlag { name: "f".into(), reason: String::new(), measured: None };
            flags.list(is_up.then_some(listed).into_iter().collect(), at(ms), LIMIT, |_| Some(RAISED_WITHIN))
        };
        list(&mut flags, 0, false);
        let long_enough_ms = (LIMIT + RAISED_WITHIN).as_millis() as u64;
        let mut news = Vec::new();
        for it in happens {
            match *it {
                Event(ms, raised) => flags.hear("f", raised, at(long_enough_ms + ms)),
                List(ms, is_up) => news.extend(list(&mut flags, long_enough_ms + ms, is_up)),
                Start => flags.monitor_started(),
                OnGround => flags.fell_on_ground("f"),
                LiftsOff => flags.lifts_off(),
                NextFlight(is_up) => flags.next_flight(|_| is_up),
            }
        }
        let raised: Vec<bool> = news.iter().map(|it| it.raised).collect();
        assert_eq!(raised, expected);
    }

    #[test]
    fn a_flag_stays_up_until_a_monitor_that_was_started_again_could_have_raised_it() {
        check(&[List(0, true), Start, List(100, false), List(2599, false)], &[true]);
        check(&[List(0, true), Start, List(100, false), List(2600, false)], &[true, false]);
        check(&[List(0, true), Start, List(100, false), List(2000, true), List(2600, false)], &[true, false]);
        check(&[List(0, true), Start, Event(50, false), List(100, false)], &[true]);
        // The monitor died before it could list it.
        check(&[Event(0, true), Start, List(100, false), List(2599, false)], &[]);
        check(&[Event(0, true), Start, List(100, false), List(2600, false)], &[false]);
    }

    #[test]
    fn a_flag_whose_event_was_lost_rises_and_falls_by_the_list() {
        check(&[List(0, false), List(10, true), List(20, false)], &[true, false]);
        check(&[Event(0, true), Event(5, false), List(600, false)], &[]);
        // It fell before an introspection could list it.
        check(&[Event(0, true), List(10, false), List(490, false)], &[]);
        check(&[Event(0, true), List(10, false), List(500, false), List(600, false)], &[false]);
        // A list that says what an event has said is no news: the flag may have been answered since.
        check(&[Event(0, true), List(10, true), List(20, false)], &[false]);
        // The list was under way when it rose.
        check(&[Event(0, true), List(10, false), List(20, true), List(600, true)], &[]);
    }

    #[test]
    fn what_was_let_fall_on_the_ground_counts_when_the_vehicle_lifts_off_and_what_was_answered_with_the_next_flight() {
        check(&[List(0, true), OnGround, List(10, true)], &[true]);
        check(&[List(0, true), OnGround, LiftsOff, List(10, true)], &[true, true]);
        check(&[Event(0, true), OnGround, List(10, true), LiftsOff, List(20, true)], &[true]);
        check(&[List(0, true), LiftsOff, List(10, true)], &[true]);
        check(&[List(0, true), NextFlight(false), List(10, true)], &[true, true]);
        // What is up still falls.
        check(&[List(0, true), NextFlight(true), List(10, true), List(20, false)], &[true, false]);
        // What was let fall on the ground, and was gone since, is not remembered when it has come back and was answered.
        check(
            &[List(0, true), OnGround, List(10, false), List(20, true), LiftsOff, List(30, true)],
            &[true, false, true],
        );
        check(&[Event(0, true), OnGround, Event(10, false), Event(20, true), LiftsOff, List(30, true)], &[]);
        check(&[List(0, true), OnGround, Event(10, true), LiftsOff, List(20, true)], &[true]);
        check(&[List(0, true), OnGround, NextFlight(false), List(10, true), LiftsOff, List(20, true)], &[true, true]);
    }

    #[test]
    fn a_flag_of_which_the_list_says_nothing_stays_up_however_long() {
        let mut flags = MonitorFlags::default();
        flags.expect("f");
        for ms in [0, 10_000, 1_000_000] {
            assert_eq!(flags.list(Vec::new(), at(ms), LIMIT, |_| None), []);
        }
        let fallen = flags.list(Vec::new(), at(1_000_010), LIMIT, |_| Some(RAISED_WITHIN));
        assert_eq!(fallen.len(), 1, "it was heard again");
    }
}
