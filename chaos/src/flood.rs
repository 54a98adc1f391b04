//! A flood: messages that nobody expects, as fast as their rate says.

use std::time::Duration;

use bus::{Process, Stop};
use domain::time::{Now, Time};
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1::FlagEvent;
use node::{Effect, Event, Node};

use crate::system::link;

/// What the unknown flags are called, with a number.
pub(crate) const FLAG: &str = "unheard_of";
/// Messages are sent in batches of this period.
const PERIOD: Duration = Duration::from_millis(10);

/// Publishes `rate_hz` events of an unknown flag a second for `time`, at the router at `locator`.
pub(crate) fn flood(locator: &str, rate_hz: u32, time: Duration) {
    let per_batch = (f64::from(rate_hz) * PERIOD.as_secs_f64()).ceil() as u32;
    let batches = (time.as_secs_f64() / PERIOD.as_secs_f64()) as u32;
    let mut node = Flood { per_batch, batches, next: Time::ZERO, stop: Stop::new() };
    let stop = node.stop.clone();
    if let Err(cause) = Process::of(&mut node, &link(locator)).run(&stop) {
        tracing::warn!(%cause, "no flood");
    }
}

struct Flood {
    per_batch: u32,
    batches: u32,
    next: Time,
    stop: Stop,
}

impl Node for Flood {
    fn name(&self) -> &'static str {
        "flood"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        if now.time < self.next {
            return;
        }
        if self.batches == 0 {
            self.stop.stop();
            return;
        }
        (self.next, self.batches) = (now.time + PERIOD, self.batches - 1);
        for number in 0..self.per_batch {
            let name = format!("{FLAG}_{number}");
            effects.push(Effect::publish(FlagEvent {
                name,
                raised: true,
                source: "flood".into(),
                ..Default::default()
            }));
        }
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.next)
    }
}
