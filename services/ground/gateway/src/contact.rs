//! Publishes to each vehicle that the ground is connected, and when the ground last heard the vehicle.
//!
//! The vehicle's monitor regards the link as lost when these messages stop, and also when they report that the ground
//! has heard nothing for long: a link that works in one direction only is not enough.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::{Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::GroundContact;
use node::{Effect, VehicleId};

/// Wall time between two messages: a twentieth of the ten seconds after which a link counts as lost.
const PERIOD: Duration = Duration::from_millis(500);

/// When each vehicle was last heard.
#[derive(Debug)]
pub(crate) struct GroundContacts {
    pace: Pace,
    due: Time,
    heard: BTreeMap<VehicleId, Time>,
}

/// Whether a message of a vehicle's shows that the vehicle was heard: no process on the ground publishes it.
pub(crate) fn shows_contact(message: &Message) -> bool {
    use Message as M;
    matches!(message, M::Introspection(_) | M::VehicleStatus(_) | M::McmStatus(_) | M::Heartbeat(_))
}

impl GroundContacts {
    pub(crate) fn new(pace: Pace) -> GroundContacts {
        GroundContacts { pace, due: Time::ZERO, heard: BTreeMap::new() }
    }

    /// A message arrived.
    pub(crate) fn on_message(&mut self, now: Time, vehicle: &VehicleId, message: &Message) {
        if shows_contact(message) {
            self.heard.insert(vehicle.clone(), now);
        }
    }

    /// Publishes to every vehicle that was heard, if that is due; one that is not in `known` is forgotten. `record_trouble` says why
    /// their flights are not recorded although they are to, if so.
    pub(crate) fn publish_due<V>(
        &mut self,
        now: Time,
        known: &BTreeMap<VehicleId, V>,
        record_trouble: impl Fn() -> Option<String>,
        effects: &mut Vec<Effect>,
    ) {
        if now < self.due {
            return;
        }
        let record_trouble = record_trouble().unwrap_or_default();
        self.due = now + self.pace.wall(PERIOD);
        self.heard.retain(|vehicle, _| known.contains_key(vehicle));
        effects.extend(self.heard.iter().map(|(vehicle, heard)| {
            let heard_age_wall_s = self.pace.to_wall(now - *heard).as_secs_f64();
            let record_trouble = record_trouble.clone();
            Effect::publish_to(vehicle, GroundContact { heard_age_wall_s, record_trouble })
        }));
    }

    pub(crate) fn due(&self) -> Time {
        self.due
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1::{Introspection, PermissionLedger};

    #[test]
    fn each_vehicle_receives_the_time_at_which_it_was_last_heard() {
        let at = |s| Time::after(Duration::from_secs_f64(s));
        let (vehicle, mut contacts): (VehicleId, _) = ("uav1".into(), GroundContacts::new(Pace::new(2.0).unwrap()));
        let known = BTreeMap::from([(vehicle.clone(), ())]);
        let published = |contacts: &mut GroundContacts, now| {
            let mut effects = Vec::new();
            contacts.publish_due(at(now), &known, || Some("the disk is full".into()), &mut effects);
            let age = |effect| match effect {
                Effect::Publish { message: Message::GroundContact(contact), .. } => {
                    assert_eq!(contact.record_trouble, "the disk is full");
                    contact.heard_age_wall_s
                }
                other => panic!("unexpected {other:?}"),
            };
            effects.into_iter().map(age).collect::<Vec<_>>()
        };
        assert!(published(&mut contacts, 0.0).is_empty(), "no vehicle was heard");
        contacts.on_message(at(1.0), &vehicle, &Introspection::default().into());
        assert_eq!(published(&mut contacts, 1.0), [0.0]);
        assert!(
            published(&mut contacts, 1.9).is_empty(),
            "half a second of wall time is a second of mission time at this speed"
        );
        contacts.on_message(at(2.0), &vehicle, &PermissionLedger::default().into());
        assert_eq!(published(&mut contacts, 3.0), [1.0], "the ledger is published on the ground");
    }
}
