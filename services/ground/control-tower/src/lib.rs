//! Grants, denies, ignores and revokes permissions to enter areas.
//!
//! A request gets a receipt at once. The decision arrives with the ledger, which is published on every
//! change and repeated, so that a message lost on the link delays a decision and never loses it.
//! Decisions come from a [`Policy`] or from an operator, and the operator's wins: what an operator has
//! denied or revoked is denied to every later request until an operator grants it, and the expiry that an
//! operator has set is not moved by another request.
//!
//! The tower does not know where areas or vehicles are, and calls no other service.

use std::collections::BTreeMap;

use domain::quantity::Positive;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::{Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, VehicleId};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::config::Config;
use crate::ledger::{Ledger, expiry};
use crate::permission::Ruling;
use crate::policy::Policy;

pub mod config;
mod ledger;
mod permission;
pub mod policy;

/// More vehicles than one tower is meant for; the names come from the network.
const MAX_VEHICLES: usize = 64;

/// The control tower of a fleet.
pub struct ControlTower {
    config: Config,
    policy: Policy,
    chance: ChaCha8Rng,
    pace: Pace,
    vehicles: BTreeMap<VehicleId, Vehicle>,
}

/// A vehicle's ledger, and when it is published next even if nothing changes.
struct Vehicle {
    ledger: Ledger,
    publish_at: Time,
}

impl ControlTower {
    /// A tower that has decided nothing yet. `seed` drives [`Policy::Random`].
    pub fn new(config: &Config, policy: Policy, seed: u64, pace: Pace) -> ControlTower {
        ControlTower {
            config: config.clone(),
            policy,
            chance: ChaCha8Rng::seed_from_u64(seed),
            pace,
            vehicles: BTreeMap::new(),
        }
    }

    fn request(&mut self, now: Now, id: VehicleId, request: &v1::PermissionRequest) -> v1::PermissionReceipt {
        let fresh = expiry(now, self.config.grant_valid_s.seconds(), self.pace);
        let (config, policy, chance) = (&self.config, self.policy, &mut self.chance);
        let answer = || policy.answer(config, chance);
        let taken = vehicle(&mut self.vehicles, now, id)
            .and_then(|vehicle| vehicle.ledger.request(now, request, fresh, answer).map_err(|it| it.to_string()));
        self.forget_empty_ledgers();
        v1::PermissionReceipt { received: taken.is_ok(), refusal: taken.err().unwrap_or_default() }
    }

    fn decide(&mut self, now: Now, id: VehicleId, request: &v1::DecideRequest) -> v1::DecideReply {
        let decided = self.ruling(now, &id, request).and_then(|ruling| {
            let vehicle = vehicle(&mut self.vehicles, now, id)?;
            vehicle.ledger.rule(&request.area, ruling).map_err(|it| it.to_string())
        });
        self.forget_empty_ledgers();
        v1::DecideReply { accepted: decided.is_ok(), refusal: decided.err().unwrap_or_default() }
    }

    /// A refused request leaves nothing behind: a vehicle has a ledger from its first permission on.
    fn forget_empty_ledgers(&mut self) {
        self.vehicles.retain(|_, vehicle| !vehicle.ledger.is_empty());
    }

    /// The request as a ruling, or why it is invalid.
    fn ruling(&self, now: Now, id: &VehicleId, request: &v1::DecideRequest) -> Result<Ruling, String> {
        if !request.vehicle.is_empty() && *request.vehicle != **id {
            return Err(format!("sent to vehicle `{id}`, but names `{}`", request.vehicle));
        }
        let reason = request.reason.clone();
        match v1::Decision::try_from(request.decision) {
            Ok(v1::Decision::Grant) => {
                let valid = request.valid_for_s.map(Positive::try_from).transpose();
                let valid = valid.map_err(|it| format!("`valid_for_s`: {it}"))?.unwrap_or(self.config.grant_valid_s);
                Ok(Ruling::Grant { expiry: expiry(now, valid.seconds(), self.pace) })
            }
            Ok(v1::Decision::Deny) => Ok(Ruling::Deny { reason }),
            Ok(v1::Decision::Revoke) => Ok(Ruling::Revoke { reason }),
            Ok(v1::Decision::Unspecified) => Err("`decision` is missing".to_owned()),
            Err(_) => Err(format!("found `decision` {}, expected grant, deny or revoke", request.decision)),
        }
    }
}

/// The vehicle, known or new; an error if there are too many.
fn vehicle(vehicles: &mut BTreeMap<VehicleId, Vehicle>, now: Now, id: VehicleId) -> Result<&mut Vehicle, String> {
    if MAX_VEHICLES <= vehicles.len() && !vehicles.contains_key(&id) {
        return Err(format!("{MAX_VEHICLES} vehicles have asked already, the most that are served"));
    }
    Ok(vehicles.entry(id).or_insert_with(|| Vehicle { ledger: Ledger::default(), publish_at: now.time }))
}

impl Node for ControlTower {
    fn name(&self) -> &'static str {
        "control-tower"
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[]
    }

    fn serves(&self) -> &'static [Service] {
        &[Service::Permission, Service::Decide]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        let Event::Request { vehicle, token, request } = event else { return };
        let response = match request {
            Request::Permission(it) => Response::Permission(self.request(now, vehicle, &it)),
            Request::Decide(it) => Response::Decide(self.decide(now, vehicle, &it)),
            // The bus delivers no request that `serves` does not name.
            _ => return,
        };
        effects.push(Effect::Reply { token, response });
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let fresh = expiry(now, self.config.grant_valid_s.seconds(), self.pace);
        for (id, vehicle) in &mut self.vehicles {
            vehicle.ledger.advance(now, fresh);
            if vehicle.ledger.take_changed() || vehicle.publish_at <= now.time {
                vehicle.publish_at = now.time + self.pace.wall(self.config.ledger_rate_hz.period());
                effects.push(Effect::publish_to(id, vehicle.ledger.to_wire(now.time)));
            }
        }
    }

    fn deadline(&self) -> Option<Time> {
        self.vehicles.values().flat_map(|it| [Some(it.publish_at), it.ledger.deadline()]).flatten().min()
    }
}
