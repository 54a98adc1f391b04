//! The launcher's own connection to the bus: it receives messages and sends none.

use std::sync::mpsc::Sender;

use domain::time::{Now, Time};
use kittiwake_proto::topics::Topic;
use node::{Effect, Event, Node};

use crate::up::Happening;

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
            Topic::PlannerStatus,
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
