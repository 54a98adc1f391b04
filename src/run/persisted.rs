//! A service whose state is stored, so that another process can continue from it.
//!
//! A thread of its own saves the state (see [`Writer`]): the loop never waits for a disk. What must not happen before the
//! state is on the disk waits for it: the answer to a request that may have changed it, such as an operator's order, and at
//! the start the first write, without which no mission begins. What the vehicle is to do at once does not wait.

#![expect(clippy::disallowed_methods, reason = "the disk is on the wall clock")]

use std::collections::BTreeMap;
use std::io;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use domain::memory::MemoryLoss;
use domain::time::{Now, Time};
use kittiwake_proto::json::{from_json, to_json};
use kittiwake_proto::topics::{Service, Topic};
use node::{Effect, Event, Node, Token};
use simulation::resumable::{Resumable, Resumed};
use store::{InUse, Loaded, Medium, State, Store};

use crate::output;
use crate::run::writer::{HandedOver, Progress, Writer};

/// A disk that has not answered for this long counts as one that cannot be written.
const DISK_LIMIT: Duration = Duration::from_secs(2);
/// A disk that has not answered for this long counts as one that cannot be read, and whose state may be outdated: longer,
/// since an operator has to decide then.
const LOSS_LIMIT: Duration = Duration::from_secs(5);

/// Why a service cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// Another process has its state.
    #[error(transparent)]
    InUse(#[from] InUse),
    /// The operating system has no thread.
    #[error("the operating system refuses a thread: {0}")]
    Thread(#[from] io::Error),
}

/// A service and what saves its state.
pub struct Persisted<N: Resumable> {
    service: N,
    writer: Writer,
    /// By number, as they were handed over, at most three: the newest state, before it the one that is being saved, and before that the
    /// one whose outcome was not heard of yet, or that has failed. A service that changes as fast as the disk saves hears of those.
    handed_over: Vec<(u64, N::Memory)>,
    /// The number of the newest state of which the service knows that it is on the disk.
    known_saved: u64,
    /// Names the loss that it is if nothing can be saved from the start.
    loss: u64,
    has_saved: bool,
    /// As the service was told last.
    outcome: Option<Result<(), String>>,
    /// Requests whose answers wait for the state of this number, and since when.
    waiting: BTreeMap<Token, Wait>,
}

struct Wait {
    number: u64,
    since: Instant,
    reply: Option<Effect>,
}

impl<N: Resumable> Persisted<N> {
    /// `service`, which continues from the state in the store that `open` opens, and reports it if there was one that
    /// cannot be used. `loss` would name that loss; `wake` has the service act.
    ///
    /// # Errors
    /// If another process uses the same state.
    pub fn new<M: Medium + Send + 'static>(
        mut service: N,
        loss: u64,
        open: impl FnOnce() -> Result<(Store<M>, Loaded), InUse> + Send + 'static,
        wake: impl Fn() + Send + 'static,
    ) -> Result<Persisted<N>, StartError> {
        let (writer, loaded) = Writer::start(open, wake)?;
        if let Err(why) = take_up(&mut service, &loaded)? {
            output::error_line(format_args!("{}: {why}", service.name()));
            service.memory_lost(MemoryLoss { id: loss, why });
        }
        let (handed_over, waiting) = (Vec::new(), BTreeMap::new());
        let (known_saved, has_saved, outcome) = (0, false, None);
        let mut persisted = Persisted { service, writer, handed_over, known_saved, loss, has_saved, outcome, waiting };
        persisted.hand_over();
        let progress = persisted.writer.first_progress(DISK_LIMIT);
        persisted.hear_of(progress);
        Ok(persisted)
    }

    /// Has the state saved if it has changed.
    fn hand_over(&mut self) {
        let memory = self.service.memory();
        if self.handed_over.last().is_some_and(|(_, newest)| *newest == memory) {
            return;
        }
        let HandedOver { number, replaces_one } = self.writer.save(to_json(&memory).to_string().into_bytes());
        if replaces_one {
            self.handed_over.pop();
        }
        self.handed_over.push((number, memory));
    }

    /// The number of the newest state; 0 before the first.
    fn number(&self) -> u64 {
        self.handed_over.last().map_or(0, |(number, _)| *number)
    }

    /// The service hears how the newest attempt has ended, if that is news to it.
    fn hear_of(&mut self, progress: Progress) {
        let done = progress.done;
        let attempted = self.handed_over.iter().find(|(number, _)| *number == done);
        if let (Some(Ok(())), Some((_, memory))) = (&progress.outcome, attempted)
            && self.known_saved < done
        {
            self.known_saved = done;
            self.service.memory_saved(memory);
        }
        // One that has failed is tried again.
        let (newest, known_saved) = (self.number(), self.known_saved);
        self.handed_over.retain(|(number, _)| *number == newest || done <= *number && known_saved < *number);
        let waited = progress.since.map_or(Duration::ZERO, |it| it.elapsed());
        let limit = if waited < LOSS_LIMIT { DISK_LIMIT } else { LOSS_LIMIT };
        let (outcome, is_certain) = match progress.outcome {
            Some(Err(why)) => (Err(why), true),
            Some(Ok(())) if waited < DISK_LIMIT => (Ok(()), true),
            // Without any outcome the first one has been awaited in vain.
            Some(Ok(())) | None => (Err(format!("the disk has not answered for {limit:?}")), LOSS_LIMIT <= waited),
        };
        if self.outcome.as_ref() == Some(&outcome) {
            return;
        }
        match &outcome {
            Ok(()) if self.outcome.is_some() => {
                output::error_line(format_args!("{}: its state is written again", self.service.name()));
            }
            Ok(()) => {}
            Err(why) => output::error_line(format_args!("{}: its state is not written: {why}", self.service.name())),
        }
        self.has_saved |= outcome.is_ok();
        let loss = Some(self.loss).filter(|_| !self.has_saved && is_certain);
        self.service.memory_written(outcome.clone(), loss);
        self.outcome = Some(outcome);
    }

    /// The answer to `token` waits for the newest state.
    fn expect(&mut self, token: Token) {
        let wait = Wait { number: self.number(), since: Instant::now(), reply: None };
        self.waiting.insert(token, wait);
    }

    /// Takes answers out that must wait, and puts those in whose wait is over.
    fn hold_back(&mut self, effects: &mut Vec<Effect>) {
        let done = self.writer.progress().done;
        let newest = self.number();
        effects.retain_mut(|effect| {
            let Effect::Reply { token, response } = effect else { return true };
            let Some(wait) = self.waiting.get_mut(token) else { return true };
            // The service itself may have had to wait, and has changed since.
            let reply = Some(Effect::Reply { token: *token, response: response.clone() });
            *wait = Wait { number: newest, since: Instant::now(), reply };
            false
        });
        self.waiting.retain(|_, wait| {
            let is_over = wait.number <= done || DISK_LIMIT <= wait.since.elapsed();
            let reply = wait.reply.take_if(|_| is_over);
            let is_answered = reply.is_some();
            effects.extend(reply);
            !is_answered
        });
    }
}

/// Lets `service` continue from what was found; the inner error says why it cannot.
fn take_up<N: Resumable>(
    service: &mut N,
    loaded: &Receiver<Result<Loaded, InUse>>,
) -> Result<Result<(), String>, InUse> {
    let mut resume = |State { bytes, version }: State| {
        if version != N::FORMAT {
            let format = N::FORMAT;
            return Err(format!(
                "an earlier version of the program has saved it, in format {version}, expected {format}"
            ));
        }
        let json = serde_json::from_slice(&bytes).map_err(|it| it.to_string())?;
        match service.resume(from_json(&json)?) {
            Ok(()) => Ok(()),
            Err(Resumed::AnotherMission) => {
                output::error_line(format_args!(
                    "{}: starts fresh: it was started with another mission",
                    service.name()
                ));
                Ok(())
            }
            Err(Resumed::Unusable(why)) => Err(why),
        }
    };
    Ok(match loaded.recv_timeout(LOSS_LIMIT) {
        Err(_) => Err(format!("the disk has not answered for {LOSS_LIMIT:?}")),
        Ok(Err(in_use)) => return Err(in_use),
        Ok(Ok(Loaded::Nothing)) => Ok(()),
        Ok(Ok(Loaded::Newest(state))) => resume(state),
        // Better than nothing for a vehicle in the air, and on the ground it waits nevertheless.
        Ok(Ok(Loaded::Behind(state, trouble))) => {
            let used = resume(state).map_or_else(|why| format!("not used: {why}"), |()| "used".to_owned());
            Err(format!("{trouble}; the state before it is {used}"))
        }
        Ok(Ok(Loaded::Unusable(trouble))) => Err(trouble.to_string()),
    })
}

impl<N: Resumable> Node for Persisted<N> {
    fn name(&self) -> &'static str {
        self.service.name()
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.service.subscriptions()
    }

    fn serves(&self) -> &'static [Service] {
        self.service.serves()
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let request = match &event {
            Event::Request { token, .. } => Some(*token),
            _ => None,
        };
        self.service.on(now, event, effects);
        self.hand_over();
        if let Some(token) = request {
            self.expect(token);
            self.hold_back(effects);
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let progress = self.writer.progress();
        self.hear_of(progress);
        self.service.act(now, effects);
        self.hand_over();
        self.hold_back(effects);
        let service = &self.service;
        self.waiting.retain(|token, wait| wait.reply.is_some() || service.answers_later(*token));
    }

    fn answers_later(&self, token: Token) -> bool {
        self.waiting.get(&token).is_some_and(|it| it.reply.is_some()) || self.service.answers_later(token)
    }

    fn deadline(&self) -> Option<Time> {
        self.service.deadline()
    }

    fn is_over(&self) -> bool {
        self.service.is_over()
    }
}

#[cfg(test)]
mod tests;
