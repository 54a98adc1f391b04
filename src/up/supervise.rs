//! The restart policy: which process is started when. It starts nothing itself.
//!
//! Time is the launcher's own since its start, as a value.

use std::collections::BTreeMap;
use std::fmt;
use std::num::NonZeroU32;
use std::time::Duration;

use domain::quantity::{Positive, Seconds};
use serde::Deserialize;

use crate::composition::{Composition, ONBOARD};
use crate::outcome::Outcome;
use crate::service::Service;

/// A child of the launcher.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Child {
    /// The router, which must listen before the others start.
    Router,
    /// One of the services.
    Service(Service),
    /// Several services in one process.
    Onboard(Composition),
}

impl Child {
    /// Its subcommand, and the prefix of its log.
    pub fn name(self) -> &'static str {
        match self {
            Child::Router => "router",
            Child::Service(service) => service.name(),
            Child::Onboard(_) => ONBOARD,
        }
    }

    /// The services that it runs.
    pub fn services(self) -> Vec<Service> {
        match self {
            Child::Router => Vec::new(),
            Child::Service(service) => vec![service],
            Child::Onboard(composition) => composition.services(),
        }
    }

    /// The processes in which these services run, those of the composition in one.
    pub fn of_services(services: &[Service], onboard: Option<Composition>) -> Vec<Child> {
        let is_apart = |it: &Service| !onboard.is_some_and(|onboard| onboard.hosts(*it));
        let apart = services.iter().copied().filter(is_apart).map(Child::Service);
        onboard.map(Child::Onboard).into_iter().chain(apart).collect()
    }
}

impl fmt::Display for Child {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How a process that died is started again, in wall time.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "Keys")]
pub struct Policy(Keys);

/// Its keys in the configuration file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    /// Delay after the first death; doubled with each further one in the window.
    first_delay_s: Seconds<0, 60_000>,
    /// The longest delay.
    longest_delay_s: Seconds<0, 60_000>,
    /// Number of deaths in the window at which the system counts as not to be kept up.
    deaths: NonZeroU32,
    /// The length of the window.
    window_s: Positive,
}

impl TryFrom<Keys> for Policy {
    type Error = String;
    fn try_from(keys: Keys) -> Result<Policy, String> {
        let (first, longest) = (keys.first_delay_s.get(), keys.longest_delay_s.get());
        if longest < first {
            let expected = "expected the first to be at most the longest";
            return Err(format!("found a first delay of {first} s and a longest of {longest} s, {expected}"));
        }
        Ok(Policy(keys))
    }
}

/// The state of a child.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Not started, because the router does not listen yet.
    Blocked,
    /// To be started at this time.
    Due(Duration),
    /// Started at this time, and not on the bus since.
    Started(Duration),
    /// On the bus; for the router: listening.
    Seen,
}

/// How a child ended, as the operating system reports it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// It exited with this code.
    Code(i32),
    /// It was killed by this signal.
    Signal(i32),
    /// It is gone, and the operating system does not say how: somebody else was told.
    Unknown,
    /// The operating system did not start it: it has no descriptors, processes or memory left at the moment.
    NotStarted,
}

impl Ending {
    /// Whether it refused its input, which does not become better by trying again.
    pub fn is_refusal(self) -> bool {
        self == Ending::Code(u8::from(Outcome::BadInput).into())
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ending::Code(code) => write!(f, "with exit code {code}"),
            Ending::Signal(signal) => write!(f, "by signal {signal}"),
            Ending::Unknown => f.write_str("in an unknown way"),
            Ending::NotStarted => f.write_str("before it was started"),
        }
    }
}

/// What follows when a child has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// It is started again after this long.
    Restart(Duration),
    /// The same, although the system cannot be kept up, for this reason: it is needed.
    KeepTrying(Duration, String),
    /// The system cannot be kept up, for this reason.
    GiveUp(String),
}

/// The children's states and past deaths.
pub struct Supervisor {
    policy: Policy,
    states: BTreeMap<Child, State>,
    deaths: BTreeMap<Child, Vec<Duration>>,
    /// How often in a row it was not seen in time after a start.
    unseen: BTreeMap<Child, u32>,
}

/// The time to be seen after a start is doubled no more often than this. (ENG: from 15 s, as shipped, to two minutes.)
const MOST_DOUBLINGS: u32 = 3;

impl Supervisor {
    /// For these children and the router. Nothing is started yet; the router is due at once.
    pub fn new(policy: &Policy, children: &[Child]) -> Supervisor {
        let children = children.iter().map(|it| (*it, State::Blocked));
        let states = children.chain([(Child::Router, State::Due(Duration::ZERO))]).collect();
        Supervisor { policy: policy.clone(), states, deaths: BTreeMap::new(), unseen: BTreeMap::new() }
    }

    /// The children to start now; they count as started.
    pub fn due(&mut self, now: Duration) -> Vec<Child> {
        let due = |it: &State| matches!(it, State::Due(at) if *at <= now);
        let mut children = Vec::new();
        for (child, state) in self.states.iter_mut().filter(|(_, state)| due(state)) {
            *state = State::Started(now);
            children.push(*child);
        }
        children
    }

    /// When [`Supervisor::due`] will next have something.
    pub fn deadline(&self) -> Option<Duration> {
        let due = |it: &State| if let State::Due(at) = it { Some(*at) } else { None };
        self.states.values().filter_map(due).min()
    }

    /// The router listens: the children that waited for it are due.
    pub fn router_listens(&mut self, now: Duration) {
        self.states.insert(Child::Router, State::Seen);
        self.unseen.remove(&Child::Router);
        for state in self.states.values_mut() {
            match state {
                State::Blocked => *state = State::Due(now),
                // Nobody could be seen without a router.
                State::Started(since) => *since = now,
                State::Due(_) | State::Seen => {}
            }
        }
    }

    /// Nobody can be seen at the moment: the time limit of started processes begins again. A router is seen in
    /// another way.
    pub fn nobody_can_be_seen(&mut self, now: Duration) {
        for (child, state) in &mut self.states {
            if let State::Started(since) = state
                && *child != Child::Router
            {
                *since = now;
            }
        }
    }

    /// Whether the router listens.
    pub fn router_is_seen(&self) -> bool {
        self.states.get(&Child::Router) == Some(&State::Seen)
    }

    /// Whether the router listens, and nobody is on the bus: perhaps it passes nothing on.
    pub fn nobody_is_seen(&self) -> bool {
        self.router_is_seen() && self.states.iter().all(|(child, it)| *child == Child::Router || *it != State::Seen)
    }

    /// The child that is the service of this name, or has it.
    pub fn child(&self, service: &str) -> Option<Child> {
        self.states.keys().copied().find(|child| child.services().iter().any(|it| it.name() == service))
    }

    /// A service appeared on the bus. One of several in a process speaks for all: they appear together, once all are ready.
    pub fn seen(&mut self, child: Child) {
        if let Some(state @ State::Started(_)) = self.states.get_mut(&child) {
            *state = State::Seen;
            self.unseen.remove(&child);
        }
    }

    /// A child hangs: returns whether it is to be killed; it is missing until it is started again. One that has ended already, and
    /// waits for its start, is only silent.
    pub fn hangs(&mut self, child: Child, now: Duration) -> bool {
        match self.states.get_mut(&child) {
            None | Some(State::Blocked | State::Due(_)) => false,
            Some(state) => {
                *state = State::Started(now);
                true
            }
        }
    }

    /// The children that were started this long ago and have not been seen: they hang before anybody has heard them. While the router
    /// does not listen it is the only one that can be waited for. They count as started now, and have twice the time, which is returned with
    /// them, when they are started again: on a machine with too much to do to start takes long, and a kill makes it longer.
    pub fn overdue(&mut self, now: Duration, limit: Duration) -> Vec<(Child, Duration)> {
        let router_listens = self.router_is_seen();
        let mut children = Vec::new();
        for (child, state) in &mut self.states {
            let unseen = self.unseen.entry(*child).or_default();
            let limit = limit * 2u32.pow(*unseen);
            if let State::Started(since) = state
                && *since + limit <= now
                && (router_listens || *child == Child::Router)
            {
                *since = now;
                *unseen = (*unseen + 1).min(MOST_DOUBLINGS);
                children.push((*child, limit));
            }
        }
        children
    }

    /// The children that have not been seen since they were started.
    pub fn missing(&self) -> Vec<Child> {
        self.states.iter().filter(|(_, state)| **state != State::Seen).map(|(child, _)| *child).collect()
    }

    /// A child ended without having been asked to end. While an aircraft is answered for, `is_needed`, nothing is given up.
    pub fn ended(&mut self, child: Child, ending: Ending, now: Duration, is_needed: bool) -> Verdict {
        match self.hopeless(child, ending, now) {
            Some(reason) if is_needed => {
                let delay = self.policy.0.longest_delay_s.seconds();
                self.states.insert(child, State::Due(now + delay));
                Verdict::KeepTrying(delay, reason)
            }
            Some(reason) => Verdict::GiveUp(reason),
            None => {
                let doublings = self.deaths.get(&child).map_or(0, |it| it.len() - 1).min(30) as i32;
                let delay = self.policy.0.first_delay_s.get() * 2f64.powi(doublings);
                let delay = Duration::from_secs_f64(delay.min(self.policy.0.longest_delay_s.get()));
                self.states.insert(child, State::Due(now + delay));
                Verdict::Restart(delay)
            }
        }
    }

    /// Counts a death; why there is no hope that starting the child again helps.
    fn hopeless(&mut self, child: Child, ending: Ending, now: Duration) -> Option<String> {
        if ending.is_refusal() {
            return Some(format!("{child} refused its input"));
        }
        let window = self.policy.0.window_s.seconds();
        let deaths = self.deaths.entry(child).or_default();
        deaths.retain(|at| now.saturating_sub(*at) < window);
        deaths.push(now);
        let (count, most) = (deaths.len(), self.policy.0.deaths.get());
        (most as usize <= count).then(|| format!("{child} ended {count} times within {window:?}, last {ending}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANNER: Child = Child::Service(Service::Planner);
    const KILLED: Ending = Ending::Signal(9);

    fn at(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn started() -> Supervisor {
        let policy = "first_delay_s = 0.2\nlongest_delay_s = 0.5\ndeaths = 4\nwindow_s = 10.0";
        let mut supervisor = Supervisor::new(&toml::from_str(policy).unwrap(), &Service::ALL.map(Child::Service));
        supervisor.due(at(0));
        supervisor.router_listens(at(10));
        supervisor.due(at(10));
        Service::ALL.iter().for_each(|it| supervisor.seen(Child::Service(*it)));
        supervisor
    }

    #[test]
    fn who_is_started_while_nobody_can_be_seen_is_not_overdue_before_that_is_over_but_a_router_is() {
        let limit = at(1000);
        let mut supervisor = started();
        supervisor.ended(PLANNER, KILLED, at(1000), true);
        assert_eq!(supervisor.due(at(2000)), [PLANNER]);
        supervisor.nobody_can_be_seen(at(9000));
        assert_eq!(supervisor.overdue(at(9999), limit), []);
        assert_eq!(supervisor.overdue(at(10_000), limit), [(PLANNER, limit)]);
        supervisor.ended(Child::Router, KILLED, at(20_000), true);
        assert_eq!(supervisor.due(at(21_000)), [Child::Router]);
        supervisor.nobody_can_be_seen(at(22_000));
        assert_eq!(supervisor.overdue(at(22_000), limit), [(Child::Router, limit)]);
    }

    #[test]
    fn who_is_not_seen_in_time_after_a_start_is_overdue_while_the_router_listens() {
        let limit = at(1000);
        let mut supervisor = started();
        assert_eq!(supervisor.overdue(at(60_000), limit), []);
        supervisor.ended(PLANNER, KILLED, at(60_000), true);
        assert_eq!(supervisor.overdue(at(70_000), limit), [], "it is not started yet");
        assert_eq!(supervisor.due(at(70_000)), [PLANNER]);
        assert_eq!(supervisor.overdue(at(70_999), limit), []);
        assert_eq!(supervisor.overdue(at(71_000), limit), [(PLANNER, limit)]);
        assert_eq!(supervisor.overdue(at(71_500), limit), [], "it is being killed");
        // A router that hangs before it listens keeps the others away.
        supervisor.ended(Child::Router, KILLED, at(72_000), true);
        assert_eq!(supervisor.due(at(73_000)), [Child::Router]);
        assert_eq!(supervisor.overdue(at(74_000), limit), [(Child::Router, limit)]);
        supervisor.router_listens(at(75_000));
        // A machine with too much to do gets more time each time.
        assert_eq!(supervisor.overdue(at(76_999), limit), []);
        assert_eq!(supervisor.overdue(at(77_000), limit), [(PLANNER, 2 * limit)]);
        supervisor.seen(PLANNER);
        assert_eq!(supervisor.overdue(at(90_000), limit), []);
        // Who was seen meanwhile has the same time as at first.
        supervisor.ended(PLANNER, KILLED, at(91_000), true);
        assert_eq!(supervisor.due(at(92_000)), [PLANNER]);
        assert_eq!(supervisor.overdue(at(93_000), limit), [(PLANNER, limit)]);
        supervisor.ended(Child::Router, KILLED, at(94_000), true);
        assert_eq!(supervisor.due(at(95_000)), [Child::Router]);
        assert_eq!(supervisor.overdue(at(96_000), limit), [(Child::Router, limit)]);
    }

    #[test]
    fn the_router_comes_first_and_everybody_must_be_seen() {
        let mut supervisor = Supervisor::new(&started().policy, &Service::ALL.map(Child::Service));
        assert_eq!(supervisor.due(at(0)), [Child::Router]);
        assert_eq!(supervisor.due(at(5)), []);
        assert!(!supervisor.nobody_is_seen(), "there is no router that could pass on what they say");
        supervisor.router_listens(at(10));
        assert!(supervisor.nobody_is_seen());
        assert_eq!(supervisor.deadline(), Some(at(10)));
        assert_eq!(supervisor.due(at(10)).len(), Service::ALL.len());
        for service in Service::ALL {
            assert!(supervisor.missing().contains(&Child::Service(service)));
            supervisor.seen(Child::Service(service));
            assert!(!supervisor.nobody_is_seen());
        }
        assert_eq!(supervisor.missing(), []);
        assert_eq!(supervisor.child("planner"), Some(PLANNER));
        assert!(supervisor.hangs(PLANNER, at(0)));
        assert_eq!((supervisor.missing(), supervisor.due(at(5000))), (vec![PLANNER], vec![]), "it has not ended yet");
    }

    #[test]
    fn services_in_one_process_are_one_child_that_dies_and_comes_back_as_one() {
        let onboard: Composition = "mcm,planner".parse().unwrap();
        let child = Child::Onboard(onboard);
        let services = [Service::Monitor, Service::Planner, Service::Mcm];
        let children = Child::of_services(&services, Some(onboard));
        assert_eq!(children, [child, Child::Service(Service::Monitor)]);
        let mut supervisor = Supervisor::new(&started().policy, &children);
        supervisor.router_listens(at(10));
        assert_eq!(supervisor.due(at(10)).len(), 2);
        let found = ["mcm", "planner", "onboard", "monitor"].map(|it| supervisor.child(it));
        assert_eq!(found, [Some(child), Some(child), None, Some(Child::Service(Service::Monitor))]);
        supervisor.seen(child);
        assert_eq!(supervisor.missing(), [Child::Service(Service::Monitor)]);
        assert!(supervisor.hangs(child, at(0)));
        assert_eq!(supervisor.ended(child, KILLED, at(1000), false), Verdict::Restart(at(200)));
        assert_eq!(supervisor.due(at(1200)), [child]);
    }

    #[test]
    fn a_death_is_answered_later_each_time_until_it_is_one_too_many() {
        let mut supervisor = started();
        for (now, delay) in [(1000, 200), (2000, 400), (3000, 500)] {
            assert_eq!(supervisor.ended(PLANNER, KILLED, at(now), false), Verdict::Restart(at(delay)));
            assert_eq!(supervisor.due(at(now + delay - 1)), []);
            assert_eq!(supervisor.due(at(now + delay)), [PLANNER]);
        }
        let Verdict::GiveUp(reason) = supervisor.ended(PLANNER, KILLED, at(4000), false) else { panic!("goes on") };
        assert_eq!(reason, "planner ended 4 times within 10s, last by signal 9");
    }

    #[test]
    fn nothing_is_given_up_while_the_aircraft_needs_it() {
        for ending in [KILLED, Ending::Code(2)] {
            let mut supervisor = started();
            for death in 1..=20 {
                let verdict = supervisor.ended(PLANNER, ending, at(100 * death), true);
                let is_restart = match &verdict {
                    Verdict::Restart(_) => death < 4 && ending == KILLED,
                    Verdict::KeepTrying(delay, _) => *delay == at(500),
                    Verdict::GiveUp(_) => false,
                };
                assert!(is_restart, "death {death}, {ending}: {verdict:?}");
                assert_eq!(supervisor.due(at(100 * death + 500)), [PLANNER]);
            }
            assert!(matches!(supervisor.ended(PLANNER, ending, at(2100), false), Verdict::GiveUp(_)));
        }
    }

    #[test]
    fn one_that_is_dead_already_does_not_hang_and_is_started_again() {
        for child in [Child::Router, PLANNER] {
            let mut supervisor = started();
            assert_eq!(supervisor.ended(child, KILLED, at(1000), true), Verdict::Restart(at(200)));
            assert!(!supervisor.hangs(child, at(0)), "{child} is silent because it is dead");
            assert_eq!(supervisor.due(at(1200)), [child]);
        }
    }

    #[test]
    fn old_deaths_are_forgotten() {
        let mut supervisor = started();
        for death in 0..20 {
            let verdict = supervisor.ended(PLANNER, KILLED, at(11_000 * death), false);
            assert_eq!(verdict, Verdict::Restart(at(200)));
        }
    }

    #[test]
    fn bad_input_does_not_become_better_by_trying_again() {
        let verdict = started().ended(PLANNER, Ending::Code(2), at(1000), false);
        assert_eq!(verdict, Verdict::GiveUp("planner refused its input".into()));
    }

    #[test]
    fn a_process_that_exits_unasked_is_started_again_even_with_code_0() {
        assert_eq!(started().ended(PLANNER, Ending::Code(0), at(1000), false), Verdict::Restart(at(200)));
    }
}
