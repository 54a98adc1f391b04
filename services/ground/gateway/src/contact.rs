//! Tells each vehicle that the ground is there and hears it.
//!
//! The vehicle's monitor takes the link for lost when this stops coming, and also when it comes and says
//! that nothing of the vehicle has come for long: one way alone is no link.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::{Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::GroundContact;
use node::{Effect, VehicleId};

/// Of wall time: a link is lost after ten seconds or so, of which this is a twentieth.
const PERIOD: Duration = Duration::from_millis(500);

/// When each vehicle was last heard.
#[derive(Debug)]
pub(crate) struct Contacts {
    pace: Pace,
    due: Time,
    heard: BTreeMap<VehicleId, Time>,
}

impl Contacts {
    pub(crate) fn new(pace: Pace) -> Contacts {
        Contacts { pace, due: Time::ZERO, heard: BTreeMap::new() }
    }

    /// Something arrived. Only what nobody but the vehicle says speaks for it.
    pub(crate) fn hear(&mut self, now: Time, vehicle: &VehicleId, message: &Message) {
        use Message as M;
        if let M::Introspection(_) | M::VehicleStatus(_) | M::McmStatus(_) | M::Heartbeat(_) = message {
            self.heard.insert(vehicle.clone(), now);
        }
    }

    /// Says so to all of them, if it is time to; a vehicle that is gone from `known` is forgotten.
    pub(crate) fn tell<V>(&mut self, now: Time, known: &BTreeMap<VehicleId, V>, effects: &mut Vec<Effect>) {
        if now < self.due {
            return;
        }
        self.due = now + self.pace.wall(PERIOD);
        self.heard.retain(|vehicle, _| known.contains_key(vehicle));
        effects.extend(self.heard.iter().map(|(vehicle, heard)| {
            let heard_age_wall_s = self.pace.to_wall(now - *heard).as_secs_f64();
            Effect::publish_to(vehicle, GroundContact { heard_age_wall_s })
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
    fn a_vehicle_is_told_when_it_was_last_heard() {
        let at = |s| Time::after(Duration::from_secs_f64(s));
        let (vehicle, mut contacts): (VehicleId, _) = ("uav1".into(), Contacts::new(Pace::new(2.0).unwrap()));
        let known = BTreeMap::from([(vehicle.clone(), ())]);
        let told = |contacts: &mut Contacts, now| {
            let mut effects = Vec::new();
            contacts.tell(at(now), &known, &mut effects);
            let age = |it| match it {
                Effect::Publish { message: Message::GroundContact(it), .. } => it.heard_age_wall_s,
                other => panic!("unexpected {other:?}"),
            };
            effects.into_iter().map(age).collect::<Vec<_>>()
        };
        assert!(told(&mut contacts, 0.0).is_empty(), "nobody was heard");
        contacts.hear(at(1.0), &vehicle, &Introspection::default().into());
        assert_eq!(told(&mut contacts, 1.0), [0.0]);
        assert!(told(&mut contacts, 1.9).is_empty(), "half a second of wall time is one at this speed");
        contacts.hear(at(2.0), &vehicle, &PermissionLedger::default().into());
        assert_eq!(told(&mut contacts, 3.0), [1.0], "the ledger is the ground's own");
    }
}
