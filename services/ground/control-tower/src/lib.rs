//! Grants, denies, ignores and revokes permissions to enter areas.
//!
//! A request gets a receipt at once; the decision arrives with the ledger, which is published on
//! every change and repeated, so that a message lost on the link delays a decision and never loses
//! it. Decisions come from a [`Policy`], or by hand, and a hand wins: what an operator has denied
//! or revoked is denied to every later request until an operator grants it, and the end of a
//! grant by hand is not moved by asking.
//!
//! The tower does not know where areas or vehicles are; it never calls anybody.

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
pub mod ledger;
pub mod permission;
pub mod policy;

/// The control tower of a fleet.
pub struct ControlTower {
    config: Config,
    policy: Policy,
    chance: ChaCha8Rng,
    pace: Pace,
    vehicles: BTreeMap<VehicleId, Book>,
}

/// A vehicle's ledger and when it is sent next even if nothing changes.
struct Book {
    ledger: Ledger,
    send_at: Time,
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

    fn request(&mut self, now: Now, vehicle: VehicleId, request: &v1::PermissionRequest) -> v1::PermissionReceipt {
        let fresh = expiry(now, self.config.grant_valid_s.seconds(), self.pace);
        let answer = || self.policy.answer(&self.config, &mut self.chance);
        let book = self.vehicles.entry(vehicle).or_insert_with(|| Book::new(now));
        let taken = book.ledger.request(now, request, fresh, answer);
        self.close_empty_books();
        match taken {
            Ok(()) => v1::PermissionReceipt { received: true, refusal: String::new() },
            Err(refusal) => v1::PermissionReceipt { received: false, refusal: refusal.to_string() },
        }
    }

    fn decide(&mut self, now: Now, vehicle: VehicleId, request: &v1::DecideRequest) -> v1::DecideReply {
        let decided = self.ruling(now, &vehicle, request).and_then(|ruling| {
            let book = self.vehicles.entry(vehicle).or_insert_with(|| Book::new(now));
            book.ledger.rule(&request.area, ruling).map_err(|it| it.to_string())
        });
        self.close_empty_books();
        match decided {
            Ok(()) => v1::DecideReply { accepted: true, refusal: String::new() },
            Err(refusal) => v1::DecideReply { accepted: false, refusal },
        }
    }

    /// What was refused leaves nothing behind: a vehicle has a ledger from its first permission on.
    fn close_empty_books(&mut self) {
        self.vehicles.retain(|_, book| !book.ledger.is_empty());
    }

    /// The request as a ruling, or why it is none.
    fn ruling(&self, now: Now, vehicle: &VehicleId, request: &v1::DecideRequest) -> Result<Ruling, String> {
        if !request.vehicle.is_empty() && *request.vehicle != **vehicle {
            return Err(format!("sent to vehicle `{vehicle}`, but names `{}`", request.vehicle));
        }
        let reason = request.reason.clone();
        match request.decision() {
            v1::Decision::Grant => {
                let valid = request.valid_for_s.map(Positive::try_from).transpose();
                let valid = valid.map_err(|it| format!("`valid_for_s`: {it}"))?.unwrap_or(self.config.grant_valid_s);
                Ok(Ruling::Grant { expiry: expiry(now, valid.seconds(), self.pace) })
            }
            v1::Decision::Deny => Ok(Ruling::Deny { reason }),
            v1::Decision::Revoke => Ok(Ruling::Revoke { reason }),
            v1::Decision::Unspecified => Err("`decision` is missing".into()),
        }
    }
}

impl Book {
    fn new(now: Now) -> Book {
        Book { ledger: Ledger::default(), send_at: now.time }
    }
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
            _ => return,
        };
        effects.push(Effect::Reply { token, response });
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        let fresh = expiry(now, self.config.grant_valid_s.seconds(), self.pace);
        for (vehicle, book) in &mut self.vehicles {
            book.ledger.advance(now, fresh);
            if book.ledger.take_changed() || book.send_at <= now.time {
                book.send_at = now.time + self.pace.wall(self.config.ledger_rate_hz.period());
                effects.push(Effect::publish_to(vehicle, book.ledger.to_wire(now.time)));
            }
        }
    }

    fn deadline(&self) -> Option<Time> {
        self.vehicles.values().flat_map(|it| [Some(it.send_at), it.ledger.deadline()]).flatten().min()
    }
}
