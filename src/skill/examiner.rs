//! The examiner's place on the bus: orders go out, reports come in.

use std::sync::mpsc::{Receiver, Sender};
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node};

/// How often it is looked whether there is an order.
const LOOK: Duration = Duration::from_millis(20);

pub(super) struct Examiner {
    pub(super) orders: Receiver<v1::TaskOrder>,
    pub(super) reports: Sender<v1::TaskReport>,
    pub(super) next: Time,
}

impl Node for Examiner {
    fn name(&self) -> &'static str {
        "skill-examiner"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::TaskReport]
    }

    fn on(&mut self, _: Now, event: Event, _: &mut Vec<Effect>) {
        if let Event::Message { message: Message::TaskReport(report), .. } = event {
            // Nobody listens any more once the examination is over.
            let _ = self.reports.send(report);
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        effects.extend(self.orders.try_iter().map(Effect::publish));
        self.next = now.time + LOOK;
    }

    fn deadline(&self) -> Option<Time> {
        Some(self.next)
    }
}
