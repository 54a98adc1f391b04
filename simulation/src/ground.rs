//! The ground as a vehicle hears it: the gateway's contact messages, without the gateway.

use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::Topic;
use kittiwake_proto::v1::GroundContact;
use node::{Effect, Event, Node};

use crate::VEHICLE;

/// Between two contact messages, as in the gateway (`gateway::contact`).
const PERIOD: Duration = Duration::from_millis(500);

/// Stands in for the gateway, whose name it has on the bus.
#[derive(Debug, Default)]
pub(crate) struct Ground {
    /// When the vehicle was last heard.
    heard: Option<Time>,
    due: Time,
}

impl Node for Ground {
    fn name(&self) -> &'static str {
        "gateway"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::VehicleStatus, Topic::McmStatus, Topic::Heartbeat]
    }

    fn on(&mut self, now: Now, event: Event, _: &mut Vec<Effect>) {
        // The ground's own processes beat too.
        if matches!(event, Event::Message { vehicle, .. } if vehicle == VEHICLE.into()) {
            self.heard = Some(now.time);
        }
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let Some(heard) = self.heard.filter(|_| self.due <= now.time) else { return };
        self.due = now.time + PERIOD;
        let heard_age_wall_s = (now.time - heard).as_secs_f64();
        let contact = GroundContact { heard_age_wall_s, record_trouble: String::new() };
        effects.push(Effect::publish_to(&VEHICLE.into(), contact));
    }

    fn deadline(&self) -> Option<Time> {
        self.heard.map(|_| self.due)
    }
}
