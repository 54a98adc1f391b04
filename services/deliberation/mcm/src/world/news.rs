//! Messages of the monitor that the monitor leaf has not taken in yet.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::measured::Measured;
use domain::time::Time;

use crate::vehicle::Vehicle;

/// The source of the introspection's flags.
pub(super) const MONITOR: &str = "monitor";

/// A flag was raised, or its condition no longer holds, by this source.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FlagNews {
    pub(super) name: String,
    pub(super) raised: bool,
    pub(super) source: String,
    pub(super) reason: String,
    /// The value that it was raised by.
    pub(super) measured: Option<Measured>,
}

/// A flag in the list of an introspection.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ListedFlag {
    pub(super) name: String,
    pub(super) reason: String,
    pub(super) measured: Option<Measured>,
}

/// What came in.
#[derive(Debug, Default)]
pub(super) struct News {
    vehicle: Option<Vehicle>,
    flags: Vec<FlagNews>,
    /// The flags that the last introspection listed.
    listed: BTreeSet<String>,
    /// Flags that an event of the monitor has raised, and no introspection has listed since, with when.
    unlisted: BTreeMap<String, Time>,
    /// Since when introspections of the monitor that runs now are heard.
    monitor_since: Option<Time>,
}

impl News {
    /// The vehicle of an introspection; it replaces an older one.
    pub(super) fn add_vehicle(&mut self, vehicle: Vehicle) {
        self.vehicle = Some(vehicle);
    }

    /// An event of a single flag.
    pub(super) fn add_flag(&mut self, flag: FlagNews, now: Time) {
        if flag.source == MONITOR {
            match flag.raised && !self.listed.contains(&flag.name) {
                true => self.unlisted.insert(flag.name.clone(), now),
                false => self.unlisted.remove(&flag.name),
            };
        }
        self.flags.push(flag);
    }

    /// The monitor was started again, and needs time to find again what it had raised flags for.
    pub(super) fn monitor_started(&mut self) {
        self.monitor_since = None;
    }

    /// Counts a flag as one that the last introspection listed.
    pub(super) fn expect(&mut self, name: &str) {
        self.listed.insert(name.to_owned());
    }

    /// Takes in the flags that an introspection lists. A difference to the list before counts as
    /// an event: the event itself may have been lost, or sent while this process or the monitor was down. So does a flag that an
    /// event has raised and that is not listed after `limit`: it fell between two introspections, and the event of that was lost.
    /// A flag that is not listed has not fallen before the monitor has been heard for `limit` and the time within which it raises it.
    pub(super) fn list(
        &mut self,
        flags: Vec<ListedFlag>,
        now: Time,
        limit: Duration,
        raised_within: impl Fn(&str) -> Duration,
    ) {
        let since = *self.monitor_since.get_or_insert(now);
        let is_judged = |name: &String| raised_within(name).saturating_add(limit) <= now - since;
        let mut listed: BTreeSet<String> = flags.iter().map(|it| it.name.clone()).collect();
        let news =
            |name, raised, reason, measured| FlagNews { name, raised, source: MONITOR.to_owned(), reason, measured };
        let risen = flags.into_iter().filter(|it| !self.listed.contains(&it.name));
        self.flags.extend(risen.map(|it| news(it.name, true, it.reason, it.measured)));
        self.unlisted.retain(|name, _| !listed.contains(name));
        let is_over = |name: &String, raised: &mut Time| *raised + limit <= now && is_judged(name);
        let never_listed = self.unlisted.extract_if(.., is_over).map(|(name, _)| name);
        let (fallen, unjudged): (Vec<_>, Vec<_>) = self.listed.difference(&listed).cloned().partition(is_judged);
        let fallen = fallen.into_iter().chain(never_listed);
        self.flags.extend(fallen.map(|name| news(name, false, String::new(), None)));
        listed.extend(unjudged);
        self.listed = listed;
    }

    /// The newest vehicle since the last call.
    pub(super) fn take_vehicle(&mut self) -> Option<Vehicle> {
        self.vehicle.take()
    }

    /// The flags since the last call, in order.
    pub(super) fn take_flags(&mut self) -> Vec<FlagNews> {
        std::mem::take(&mut self.flags)
    }
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

    /// What is heard, each with its milliseconds since the monitor has been heard for long enough.
    enum Heard {
        Event(u64, bool),
        List(u64, bool),
        /// It was started again.
        Start,
    }
    use Heard::{Event, List, Start};

    #[track_caller]
    fn check(heard: &[Heard], expected: &[bool]) {
        let mut news = News::default();
        let list = |news: &mut News, ms, is_up: bool| {
            let listed = ListedFlag { name: "f".into(), reason: String::new(), measured: None };
            news.list(is_up.then_some(listed).into_iter().collect(), at(ms), LIMIT, |_| RAISED_WITHIN);
        };
        list(&mut news, 0, false);
        let long_enough_ms = (LIMIT + RAISED_WITHIN).as_millis() as u64;
        for heard in heard {
            match *heard {
                Event(ms, raised) => {
                    let (source, reason) = (MONITOR.into(), String::new());
                    let flag = FlagNews { name: "f".into(), raised, source, reason, measured: None };
                    news.add_flag(flag, at(long_enough_ms + ms));
                }
                List(ms, is_up) => list(&mut news, long_enough_ms + ms, is_up),
                Start => news.monitor_started(),
            }
        }
        let raised: Vec<bool> = news.take_flags().iter().map(|it| it.raised).collect();
        assert_eq!(raised, expected);
    }

    #[test]
    fn a_flag_stays_up_until_a_monitor_that_was_started_again_could_have_raised_it() {
        check(&[List(0, true), Start, List(100, false), List(2599, false)], &[true]);
        check(&[List(0, true), Start, List(100, false), List(2600, false)], &[true, false]);
        check(&[List(0, true), Start, List(100, false), List(2000, true), List(2600, false)], &[true, false]);
        check(&[List(0, true), Start, Event(50, false), List(100, false)], &[true, false]);
        // The monitor died before it could list it.
        check(&[Event(0, true), Start, List(100, false), List(2599, false)], &[true]);
        check(&[Event(0, true), Start, List(100, false), List(2600, false)], &[true, false]);
    }

    #[test]
    fn a_flag_whose_event_was_lost_rises_and_falls_by_the_list() {
        check(&[List(0, false), List(10, true), List(20, false)], &[true, false]);
        check(&[Event(0, true), List(10, true), List(20, false)], &[true, true, false]);
        check(&[Event(0, true), Event(5, false), List(600, false)], &[true, false]);
        // It fell before an introspection could list it.
        check(&[Event(0, true), List(10, false), List(490, false)], &[true]);
        check(&[Event(0, true), List(10, false), List(500, false), List(600, false)], &[true, false]);
        // The list was under way when it rose.
        check(&[Event(0, true), List(10, false), List(20, true), List(600, true)], &[true, true]);
    }
}
