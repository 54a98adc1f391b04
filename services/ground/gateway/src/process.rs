//! Which processes are there and which of them make progress.
//!
//! A liveliness token says that a process has a link, a heartbeat that its loop turns; a process
//! with a token and no heartbeat is stale, which is not the same as dead.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::v1;

/// More processes than a system has; others would be somebody's mistake.
const MOST_PROCESSES: usize = 64;

/// The processes of one vehicle, or those of none, by the name of their service.
#[derive(Debug, Clone, Default)]
pub struct Processes(BTreeMap<String, Process>);

/// The newest start of a process.
#[derive(Debug, Clone)]
pub struct Process {
    /// Unique to this start.
    pub instance: String,
    /// Its last heartbeat and when that came.
    pub heartbeat: Option<(Time, v1::Heartbeat)>,
    link: Link,
}

#[derive(Debug, Clone)]
enum Link {
    Up { since: Time },
    Gone,
}

/// How a process fares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Health {
    /// It is there and makes progress.
    Alive,
    /// It is there and has not shown progress for too long.
    Stale,
    /// It is gone.
    Dead,
}

impl Health {
    /// For people and programs: `alive`, `stale`, `dead`.
    pub fn name(self) -> &'static str {
        match self {
            Health::Alive => "alive",
            Health::Stale => "stale",
            Health::Dead => "dead",
        }
    }
}

impl Processes {
    /// A process appeared or vanished.
    pub fn on_peer(&mut self, now: Time, service: String, instance: String, alive: bool) {
        let known = self.0.get_mut(&service).filter(|it| it.instance == instance);
        match (known, alive) {
            (Some(process), true) => process.link = Link::Up { since: now },
            (Some(process), false) => process.link = Link::Gone,
            (None, true) => self.start(now, service, instance),
            // The end of an earlier start, told late: the newer one lives on.
            (None, false) => {}
        }
    }

    /// A process shows progress.
    pub fn on_heartbeat(&mut self, now: Time, heartbeat: v1::Heartbeat) {
        let replaceable = self.0.get(&heartbeat.service).is_none_or(|it| matches!(it.link, Link::Gone));
        let same = self.0.get(&heartbeat.service).is_some_and(|it| it.instance == heartbeat.instance);
        // The last heartbeat of an earlier start may arrive after the first sign of the newer one.
        if replaceable && !same {
            self.start(now, heartbeat.service.clone(), heartbeat.instance.clone());
        }
        if let Some(process) = self.0.get_mut(&heartbeat.service)
            && process.instance == heartbeat.instance
        {
            process.heartbeat = Some((now, heartbeat));
        }
    }

    /// By name, in alphabetical order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Process)> {
        self.0.iter().map(|(service, process)| (service.as_str(), process))
    }

    /// The process of a service, if one was ever seen.
    pub fn get(&self, service: &str) -> Option<&Process> {
        self.0.get(service)
    }

    fn start(&mut self, now: Time, service: String, instance: String) {
        if self.0.len() < MOST_PROCESSES || self.0.contains_key(&service) {
            self.0.insert(service, Process { instance, heartbeat: None, link: Link::Up { since: now } });
        }
    }
}

impl Process {
    /// How it fares, when `stale_after` without a sign of progress is too long.
    pub fn health(&self, now: Time, stale_after: Duration) -> Health {
        let Link::Up { since } = self.link else { return Health::Dead };
        let last_sign = self.heartbeat.as_ref().map_or(since, |(at, _)| since.max(*at));
        if now - last_sign <= stale_after { Health::Alive } else { Health::Stale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    enum Sign {
        Up(&'static str),
        Gone(&'static str),
        Beat(&'static str),
    }
    use Sign::{Beat, Gone, Up};

    /// Plays the signs of the instances of one service, one a second, and looks `later` seconds after the last.
    #[track_caller]
    fn check(signs: &[Sign], later: u64, expected: Option<(&str, Health)>) {
        let at = |s| Time::after(Duration::from_secs(s));
        let mut processes = Processes::default();
        for (s, sign) in signs.iter().enumerate() {
            let now = at(s as u64);
            match sign {
                Up(instance) => processes.on_peer(now, "mcm".into(), instance.to_string(), true),
                Gone(instance) => processes.on_peer(now, "mcm".into(), instance.to_string(), false),
                Beat(instance) => {
                    let (service, instance) = ("mcm".into(), instance.to_string());
                    processes.on_heartbeat(now, v1::Heartbeat { service, instance, ..Default::default() });
                }
            }
        }
        let now = at(signs.len() as u64 - 1 + later);
        let seen = processes.get("mcm").map(|it| (it.instance.as_str(), it.health(now, Duration::from_secs(2))));
        assert_eq!(seen, expected);
    }

    #[test]
    fn a_process_lives_while_it_has_a_link_and_a_heart() {
        check(&[Up("1")], 2, Some(("1", Health::Alive)));
        check(&[Up("1")], 3, Some(("1", Health::Stale)));
        check(&[Beat("1")], 0, Some(("1", Health::Alive)));
        check(&[Up("1"), Beat("1")], 2, Some(("1", Health::Alive)));
        check(&[Up("1"), Beat("1")], 3, Some(("1", Health::Stale)));
        check(&[Up("1"), Beat("1"), Gone("1")], 0, Some(("1", Health::Dead)));
        check(&[Up("1"), Gone("1"), Up("1")], 0, Some(("1", Health::Alive)));
        check(&[Gone("1")], 0, None);
    }

    #[test]
    fn late_news_of_an_earlier_start_is_no_news() {
        check(&[Up("1"), Up("2"), Gone("1")], 0, Some(("2", Health::Alive)));
        check(&[Up("1"), Up("2"), Beat("1")], 0, Some(("2", Health::Alive)));
        check(&[Up("1"), Gone("1"), Beat("1")], 0, Some(("1", Health::Dead)));
        check(&[Up("1"), Gone("1"), Beat("2")], 0, Some(("2", Health::Alive)));
    }
}
