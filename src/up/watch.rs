//! The launcher's own connection to the bus: it receives messages and sends none.

use std::sync::mpsc::Sender;
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::Topic;
use node::{Effect, Event, Node};

use crate::up::Happening;

/// A connection that has ended is made again after this time: what the operating system lacks now it may have again later.
const AGAIN: Duration = Duration::from_secs(3);

/// Whether the launcher hears the bus. While it is deaf it can tell of nobody whether they hang.
///
/// Time is the launcher's own since its start, as a value.
#[derive(Debug, Default)]
pub struct Hearing {
    is_deaf: bool,
    again: Option<Duration>,
}

impl Hearing {
    /// The connection has ended, or could not be made.
    pub fn ended(&mut self, now: Duration) {
        *self = Hearing { is_deaf: true, again: Some(now + AGAIN) };
    }

    /// Something was heard; returns whether the launcher was deaf before.
    pub fn heard(&mut self) -> bool {
        std::mem::take(&mut self.is_deaf)
    }

    /// Whether the connection has ended, and nothing was heard since.
    pub fn is_deaf(&self) -> bool {
        self.is_deaf
    }

    /// Whether the connection is to be made again now; it counts as being made.
    pub fn is_due(&mut self, now: Duration) -> bool {
        self.again.take_if(|it| *it <= now).is_some()
    }
}

/// Passes on what it receives.
pub struct Watch(pub Sender<Happening>);

impl Node for Watch {
    fn name(&self) -> &'static str {
        "launcher"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[
            Topic::McmStatus,
            Topic::DecisionRecord,
            Topic::MissionStatus,
            Topic::SkillFeedback,
            Topic::VehicleStatus,
            Topic::VehicleLandDetected,
            Topic::VehicleLocalPosition,
            Topic::Heartbeat,
        ]
    }

    fn on(&mut self, _: Now, event: Event, _: &mut Vec<Effect>) {
        // Fails only while the launcher ends.
        let _ = self.0.send(Happening::Event(Box::new(event)));
    }

    fn deadline(&self) -> Option<Time> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_connection_that_has_ended_is_made_again_each_time_and_the_launcher_is_deaf_until_it_hears_something() {
        let at = Duration::from_secs;
        let mut hearing = Hearing::default();
        assert!(!hearing.is_deaf() && !hearing.heard() && !hearing.is_due(at(60)));
        for ended in [60, 70] {
            hearing.ended(at(ended));
            assert!(!hearing.is_due(at(ended + 2)));
            assert!(hearing.is_due(at(ended + 3)));
            assert!(!hearing.is_due(at(ended + 4)), "it is being made");
            assert!(hearing.is_deaf());
        }
        assert!(hearing.heard());
        assert!(!hearing.is_deaf() && !hearing.heard());
    }
}
