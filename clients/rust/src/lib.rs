//! A skill of one's own: [`offer`] carries out the tasks that a vehicle orders. docs/skills.md describes the exchange, and the
//! declaration in `config/skills`.

#![expect(clippy::disallowed_methods, reason = "a skill works by the wall clock")]

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

pub use bus::{BusError, Stop};
use bus::{Link, Scope};
pub use domain::declared_skill::CANCELLED;
use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1::{self, TaskState};
use node::{Effect, Event, Node};

/// A process reports at least once a second.
const PERIOD: Duration = Duration::from_millis(500);
/// How often it is looked at what the work has come to.
const LOOK: Duration = Duration::from_millis(50);
/// The router is tried for this long.
const OPEN_LIMIT: Duration = Duration::from_secs(15);

/// Which skill of which vehicle a process carries out.
#[derive(Debug, Clone)]
pub struct Offer {
    /// The router, as `kittiwake up` prints it.
    pub connect: String,
    /// The vehicle's name.
    pub vehicle: String,
    /// The name of the declaration.
    pub skill: String,
    /// Its version.
    pub version: u32,
}

/// One order, as who carries it out sees it.
#[derive(Debug)]
pub struct Task {
    /// The numbers among the inputs of the declaration.
    pub inputs: BTreeMap<String, f64>,
    /// The texts among them.
    pub texts: BTreeMap<String, String>,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    cancelled: bool,
    progress: f64,
    reason: String,
    results: BTreeMap<String, f64>,
    outcome: Option<String>,
}

impl Task {
    fn of(order: &v1::TaskOrder) -> Task {
        let (texts, numbers): (Vec<_>, Vec<_>) = order.inputs.iter().partition(|it| !it.text.is_empty());
        let inputs = numbers.into_iter().map(|it| (it.name.clone(), it.value)).collect();
        let texts = texts.into_iter().map(|it| (it.name.clone(), it.text.clone())).collect();
        Task { inputs, texts, state: Mutex::default(), changed: Condvar::new() }
    }

    /// Waits; returns whether the task is to end: the vehicle waits `interrupt_s` of the declaration, and flies on.
    pub fn is_cancelled_within(&self, time: Duration) -> bool {
        let until = Instant::now() + time;
        let mut state = self.state();
        while !state.cancelled {
            let Some(left) = until.checked_duration_since(Instant::now()) else { return false };
            state = self.changed.wait_timeout(state, left).map_or_else(|it| it.into_inner().0, |it| it.0);
        }
        true
    }

    /// How far it has come, from 0 to 1.
    pub fn has_come(&self, progress: f64) {
        self.state().progress = progress;
    }

    /// Why it will end as it does, for people.
    pub fn because(&self, reason: impl Into<String>) {
        self.state().reason = reason.into();
    }

    /// Something that was found out: told with the outcome. The name ends in the unit.
    pub fn has_found(&self, name: &str, value: f64) {
        self.state().results.insert(name.to_owned(), value);
    }

    fn cancel(&self) {
        self.state().cancelled = true;
        self.changed.notify_all();
    }

    fn has_ended(&self) -> bool {
        self.state().outcome.is_some()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Carries out the tasks of a skill by `work`, which returns the outcome, until stopped.
///
/// # Errors
/// If no router answers, or the connection is lost for good.
pub fn offer(
    offer: Offer,
    stop: &Stop,
    work: impl Fn(&Task) -> String + Send + Sync + 'static,
) -> Result<(), BusError> {
    let link = Link {
        connect: vec![offer.connect.clone()],
        scope: Scope::Vehicle(offer.vehicle.clone()),
        open_timeout: OPEN_LIMIT,
    };
    let mut process = Process {
        offer,
        work: Arc::new(work),
        present: None,
        next: None,
        told: None,
        next_report: Time::ZERO,
        next_look: Time::ZERO,
    };
    bus::Process::of(&mut process, &link).run(stop)
}

struct Process {
    offer: Offer,
    work: Arc<dyn Fn(&Task) -> String + Send + Sync>,
    /// The last order.
    present: Option<(String, Arc<Task>)>,
    /// One that begins once the present one has ended.
    next: Option<v1::TaskOrder>,
    /// The task and whether it had ended, in the last report.
    told: Option<(String, bool)>,
    next_report: Time,
    next_look: Time,
}

impl Process {
    fn take(&mut self, order: v1::TaskOrder) {
        let is_present = self.present.as_ref().is_some_and(|(id, _)| *id == order.request_id);
        match (&self.present, is_present, order.cancel) {
            (Some((_, task)), true, true) => task.cancel(),
            (_, true, false) => {}
            (_, false, true) => {
                self.next.take_if(|it| it.request_id == order.request_id);
            }
            (present, false, false) => {
                // Another order: the one before was given up.
                present.iter().for_each(|(_, task)| task.cancel());
                self.next = Some(order);
            }
            (None, true, true) => {}
        }
    }

    fn begin_next(&mut self) {
        if self.present.as_ref().is_some_and(|(_, task)| !task.has_ended()) {
            return;
        }
        let Some(order) = self.next.take() else { return };
        let task = Arc::new(Task::of(&order));
        self.present = Some((order.request_id, task.clone()));
        let work = self.work.clone();
        thread::spawn(move || {
            let ended = EndsTask(&task);
            let outcome = work(ended.0);
            task.state().outcome = Some(outcome);
        });
    }

    fn report(&self) -> v1::TaskReport {
        let Offer { skill, version, .. } = &self.offer;
        let mut report = v1::TaskReport { skill: skill.clone(), version: *version, ..v1::TaskReport::default() };
        report.set_state(TaskState::Ready);
        if let Some((request_id, task)) = &self.present {
            let state = task.state();
            report.request_id.clone_from(request_id);
            report.progress = state.progress;
            report.reason.clone_from(&state.reason);
            report.set_state(if state.outcome.is_some() { TaskState::Ended } else { TaskState::Running });
            if let Some(outcome) = &state.outcome {
                report.outcome.clone_from(outcome);
                let result = |(name, value): (&String, &f64)| v1::TaskValue {
                    name: name.clone(),
                    value: *value,
                    ..Default::default()
                };
                report.results = state.results.iter().map(result).collect();
            }
        }
        report
    }
}

/// A task whose work has panicked has ended too.
struct EndsTask<'a>(&'a Task);

impl Drop for EndsTask<'_> {
    fn drop(&mut self) {
        let mut state = self.0.state();
        if thread::panicking() {
            "it has panicked".clone_into(&mut state.reason);
            state.outcome = Some("error".to_owned());
        }
    }
}

impl Node for Process {
    fn name(&self) -> &'static str {
        "skill-process"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::TaskOrder]
    }

    fn on(&mut self, _: Now, event: Event, _: &mut Vec<Effect>) {
        if let Event::Message { message: Message::TaskOrder(order), .. } = event
            && order.skill == self.offer.skill
        {
            self.take(order);
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.begin_next();
        self.next_look = now.time + LOOK;
        let state = self.present.as_ref().map(|(id, task)| (id.clone(), task.has_ended()));
        if self.next_report <= now.time || state != self.told {
            (self.told, self.next_report) = (state, now.time + PERIOD);
            effects.push(Effect::publish(self.report()));
        }
    }

    fn deadline(&self) -> Option<Time> {
        let works = self.present.as_ref().is_some_and(|(_, task)| !task.has_ended());
        Some(if works || self.next.is_some() { self.next_look.min(self.next_report) } else { self.next_report })
    }
}
