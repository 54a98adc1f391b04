//! A node that does what the story says, and keeps what it gets.

use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Service, Topic};
use node::{Effect, Event, Node};

/// Between two turns of a probe that has something to do.
pub const PERIOD: Duration = Duration::from_millis(5);

/// What a probe has been given so far.
#[derive(Clone, Default)]
pub struct Seen(Arc<Mutex<Given>>);

/// Events in order, and where in them each turn has ended.
#[derive(Default)]
pub struct Given {
    events: Vec<Event>,
    ends: Vec<usize>,
}

impl Seen {
    /// The events that `pick` picks, in order.
    pub fn pick<T>(&self, pick: impl FnMut(&Event) -> Option<T>) -> Vec<T> {
        self.lock().events.iter().filter_map(pick).collect()
    }

    /// The same of each turn that is over: of what was there at once when the node looked.
    pub fn turns<T>(&self, mut pick: impl FnMut(&Event) -> Option<T>) -> Vec<Vec<T>> {
        let given = self.lock();
        let starts = std::iter::once(0).chain(given.ends.iter().copied());
        starts
            .zip(&given.ends)
            .map(|(start, end)| given.events[start..*end].iter().filter_map(&mut pick).collect())
            .collect()
    }

    /// Whether any event is like this.
    pub fn any(&self, is_wanted: impl FnMut(&Event) -> bool) -> bool {
        self.lock().events.iter().any(is_wanted)
    }

    /// Whether it was last seen that a process of `service` is there, or that it is gone.
    pub fn peer(&self, service: &str, wanted: bool) -> bool {
        let last = self.pick(|event| match event {
            Event::Peer { service: found, alive, .. } if found == service => Some(*alive),
            _ => None,
        });
        last.last() == Some(&wanted)
    }

    /// The names of the flags that it got, in order.
    pub fn flags(&self) -> Vec<String> {
        self.pick(|event| match event {
            Event::Message { message: Message::FlagEvent(flag), .. } => Some(flag.name.clone()),
            _ => None,
        })
    }

    fn lock(&self) -> MutexGuard<'_, Given> {
        self.0.lock().unwrap()
    }
}

/// How far a story is, for all its probes.
#[derive(Clone, Default)]
pub struct Phase(Arc<AtomicUsize>);

impl Phase {
    /// The story's test goes on to `phase`.
    pub fn set(&self, phase: usize) {
        self.0.store(phase, SeqCst);
    }

    /// The present one.
    pub fn get(&self) -> usize {
        self.0.load(SeqCst)
    }
}

/// Keeps a node from its next event until it is opened. Where all nodes share one thread it keeps nobody: what is sent
/// meanwhile arrives at one moment there.
#[derive(Clone)]
pub struct Gate(Option<Arc<(Mutex<bool>, Condvar)>>);

impl Gate {
    /// One that keeps a node that has a thread of its own.
    pub fn closed() -> Gate {
        Gate(Some(Arc::default()))
    }

    /// One that keeps nobody.
    pub fn without_threads() -> Gate {
        Gate(None)
    }

    /// Waits until it is open.
    pub fn wait(&self) {
        if let Some(gate) = &self.0 {
            let open = gate.0.lock().unwrap();
            drop(gate.1.wait_while(open, |open| !*open).unwrap());
        }
    }

    /// Opens it for good.
    pub fn open(&self) {
        if let Some(gate) = &self.0 {
            *gate.0.lock().unwrap() = true;
            gate.1.notify_all();
        }
    }
}

/// What happens to a probe: an event, or its turn.
pub type Script = Box<dyn FnMut(Option<&Event>, &mut Vec<Effect>) + Send>;

/// A node.
pub struct Probe {
    name: &'static str,
    subscriptions: &'static [Topic],
    serves: &'static [Service],
    script: Script,
    /// When it has its next turn; `None` if it only listens.
    next: Option<Time>,
    /// The phase in which it ends.
    until: Option<(Phase, usize)>,
    pub seen: Seen,
}

impl Probe {
    /// One that only listens.
    pub fn listener(name: &'static str, subscriptions: &'static [Topic]) -> Probe {
        let script = Box::new(|_: Option<&Event>, _: &mut Vec<Effect>| {});
        Probe { name, subscriptions, serves: &[], script, next: None, until: None, seen: Seen::default() }
    }

    /// It also does this with each event.
    pub fn on_event(mut self, mut act: impl FnMut(&Event, &mut Vec<Effect>) + Send + 'static) -> Probe {
        self.script = Box::new(move |event, effects| event.into_iter().for_each(|event| act(event, effects)));
        self
    }

    /// It also does this every few milliseconds.
    pub fn on_turn(mut self, mut act: impl FnMut(&mut Vec<Effect>) + Send + 'static) -> Probe {
        self.next = Some(Time::ZERO);
        self.script = Box::new(move |event, effects| {
            if event.is_none() {
                act(effects);
            }
        });
        self
    }

    /// It also answers requests, or ought to.
    pub fn serving(mut self, serves: &'static [Service]) -> Probe {
        self.serves = serves;
        self
    }

    /// It ends with this phase.
    pub fn until(mut self, phase: &Phase, last: usize) -> Probe {
        self.next = Some(Time::ZERO);
        self.until = Some((phase.clone(), last));
        self
    }
}

impl Node for Probe {
    fn name(&self) -> &'static str {
        self.name
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.subscriptions
    }

    fn serves(&self) -> &'static [Service] {
        self.serves
    }

    fn on(&mut self, _: Now, event: Event, effects: &mut Vec<Effect>) {
        (self.script)(Some(&event), effects);
        self.seen.lock().events.push(event);
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if self.next.is_some_and(|next| next <= now.time) {
            self.next = Some(now.time + PERIOD);
            (self.script)(None, effects);
        }
        let mut given = self.seen.lock();
        let end = given.events.len();
        given.ends.push(end);
    }

    fn deadline(&self) -> Option<Time> {
        self.next
    }

    fn is_over(&self) -> bool {
        self.until.as_ref().is_some_and(|(phase, last)| *last <= phase.get())
    }
}
