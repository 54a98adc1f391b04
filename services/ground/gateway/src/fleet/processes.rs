//! Which processes have a link, and which of them make progress.
//!
//! A liveliness token says that a process has a link, a heartbeat that its loop runs; a process
//! with a token and without heartbeats is stale, which is not the same as dead.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::v1;

/// The gateway's own service. It has a link like others, and does not receive its own heartbeats.
const SELF: &str = "gateway";
/// Joins for one message and leaves: its absence is normal.
const VISITOR: &str = "injector";
/// More processes than a system has; the names come from the network.
const MAX_PROCESSES: usize = 64;

/// The processes of one vehicle, or those of the ground, by the name of their service.
#[derive(Debug, Clone, Default)]
pub(crate) struct Processes(BTreeMap<String, Process>);

/// The newest instance of a process.
#[derive(Debug, Clone)]
pub(crate) struct Process {
    /// The id of the instance, unique to one start.
    pub(crate) instance: String,
    /// The last heartbeat, and when it arrived.
    pub(crate) heartbeat: Option<(Time, v1::Heartbeat)>,
    link: Link,
    /// Whether its heartbeats never arrive here.
    is_self: bool,
}

#[derive(Debug, Clone)]
enum Link {
    Up { since: Time },
    Gone,
}

/// The health of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Health {
    /// It has a link and makes progress.
    Alive,
    /// It has a link and has not shown progress for too long.
    Stale,
    /// It has no link.
    Dead,
    /// Nothing is heard of its vehicle.
    Unheard,
}

impl Health {
    /// For people and programs.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Health::Alive => "alive",
            Health::Stale => "stale",
            Health::Dead => "dead",
            Health::Unheard => "unheard",
        }
    }
}

impl Processes {
    /// A process appeared or vanished.
    pub(crate) fn on_peer(&mut self, now: Time, service: String, instance: String, alive: bool) {
        let known = self.0.get_mut(&service).filter(|it| it.instance == instance);
        match (known, alive) {
            (Some(_), false) if service == VISITOR => drop(self.0.remove(&service)),
            (Some(process), true) => process.link = Link::Up { since: now },
            (Some(process), false) => process.link = Link::Gone,
            (None, true) => self.start(now, service, instance),
            // The end of an earlier instance, reported late: the newer instance is still alive.
            (None, false) => {}
        }
    }

    /// A process shows progress.
    pub(crate) fn on_heartbeat(&mut self, now: Time, heartbeat: v1::Heartbeat) {
        let replaceable = self.0.get(&heartbeat.service).is_none_or(|it| matches!(it.link, Link::Gone));
        let same = self.0.get(&heartbeat.service).is_some_and(|it| it.instance == heartbeat.instance);
        // The last heartbeat of an earlier instance may arrive after the first event of the newer one.
        if replaceable && !same {
            self.start(now, heartbeat.service.clone(), heartbeat.instance.clone());
        }
        if let Some(process) = self.0.get_mut(&heartbeat.service)
            && process.instance == heartbeat.instance
        {
            process.heartbeat = Some((now, heartbeat));
        }
    }

    /// The processes by name, in alphabetical order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, &Process)> {
        self.0.iter().map(|(service, process)| (service.as_str(), process))
    }

    /// The process of a service, if one was ever seen.
    pub(crate) fn get(&self, service: &str) -> Option<&Process> {
        self.0.get(service)
    }

    fn start(&mut self, now: Time, service: String, instance: String) {
        if self.0.len() < MAX_PROCESSES || self.0.contains_key(&service) {
            let is_self = service == SELF;
            self.0.insert(service, Process { instance, heartbeat: None, link: Link::Up { since: now }, is_self });
        }
    }
}

impl Process {
    /// Its health; `stale_after` is how long a sign of progress may be missing.
    pub(crate) fn health(&self, now: Time, stale_after: Duration) -> Health {
        let Link::Up { since } = self.link else { return Health::Dead };
        if self.is_self && self.heartbeat.is_none() {
            return Health::Alive;
        }
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

    /// Applies events of the instances of one service, one a second, and compares the result `later` seconds after the
    /// last.
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
    fn a_process_lives_while_it_has_a_link_and_makes_progress() {
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
    fn late_events_of_an_earlier_instance_change_nothing() {
        check(&[Up("1"), Up("2"), Gone("1")], 0, Some(("2", Health::Alive)));
        check(&[Up("1"), Up("2"), Beat("1")], 0, Some(("2", Health::Alive)));
        check(&[Up("1"), Gone("1"), Beat("1")], 0, Some(("1", Health::Dead)));
        check(&[Up("1"), Gone("1"), Beat("2")], 0, Some(("2", Health::Alive)));
    }

    #[test]
    fn a_visitor_that_has_left_is_no_dead_process() {
        let mut processes = Processes::default();
        processes.on_peer(Time::ZERO, VISITOR.into(), "1".into(), true);
        assert_eq!(processes.iter().count(), 1);
        processes.on_peer(Time::ZERO, VISITOR.into(), "1".into(), false);
        assert_eq!(processes.iter().count(), 0);
    }

    #[test]
    fn the_gateway_itself_is_alive_without_heartbeats() {
        let mut processes = Processes::default();
        processes.on_peer(Time::ZERO, SELF.into(), "1".into(), true);
        processes.on_peer(Time::ZERO, "mcm".into(), "1".into(), true);
        let later = Time::after(Duration::from_secs(60));
        let health = |service| processes.get(service).map(|it| it.health(later, Duration::from_secs(2)));
        assert_eq!((health(SELF), health("mcm")), (Some(Health::Alive), Some(Health::Stale)));
    }
}
