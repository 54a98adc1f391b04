//! Grants, denies, ignores and revokes permissions to enter areas.
//!
//! A request gets a receipt at once. The decision arrives with the ledger, which is published on every
//! change and repeated, so that a message lost on the link delays a decision and never loses it. What is too long for the link
//! is refused, and a ledger that is too large is published in parts, so that what was accepted arrives.
//! Decisions come from a [`Policy`] or from an operator, and the operator's wins: what an operator has
//! denied or revoked is denied to every later request until an operator grants it, and the expiry that an
//! operator has set is not moved by another request.
//!
//! What it decides is stored, and a grant is published only once it is on the disk: a tower that is killed and started again
//! knows every grant that is out. A tower that has lost decisions grants nothing until an operator has accepted that; until
//! then every area can be revoked.
//!
//! The air round a site that must be ready is granted only while it is (`sites`): that is above policy and operator.
//!
//! A grant is for one flight of the vehicle and for the place that was requested: a request for another area of the same name, or in another
//! flight, is a new one. The tower does not know what lies there, nor where vehicles are, and calls no other service.

use std::collections::BTreeMap;

use domain::memory::{MemoryHealth, MemoryLoss};
use domain::permission::Permission;
use domain::quantity::Positive;
use domain::time::{Now, Pace, Time};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::{Request, Response, Service, Topic};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, VehicleId};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use signed_permissions::key::SecretKey;

use crate::config::Config;
use crate::ledger::Ledger;
use crate::numbers::Numbers;
use crate::permission::{Expiry, Ruling, Standing};
use crate::policy::Policy;
use crate::sites::Sites;
use crate::stored::Stored;
use crate::texts::{MAX_TROUBLE_BYTES, shortened};
use crate::vehicle::{Rhythm, Vehicle};

pub mod config;
mod ledger;
mod numbers;
mod permission;
mod persisted;
pub mod policy;
mod sites;
mod stored;
mod texts;
mod vehicle;

/// More vehicles than one tower is meant for; the names come from the network.
const MAX_VEHICLES: usize = 64;

/// The control tower of a fleet.
pub struct ControlTower {
    config: Config,
    rhythm: Rhythm,
    policy: Policy,
    chance: ChaCha8Rng,
    pace: Pace,
    /// Differs at each start.
    start: u64,
    stored: Stored,
    /// Signs what is published.
    key: Option<SecretKey>,
    /// What a process before has decided, until the first moment at which there is a time.
    restored: Option<Vec<v1::LedgerMemory>>,
    vehicles: BTreeMap<VehicleId, Vehicle>,
    sites: Sites,
    /// The moment that it was asked to act last.
    acted_at: Time,
}

impl ControlTower {
    /// A tower that has decided nothing yet. `seed` drives [`Policy::Random`]; `start` differs at each start.
    pub fn new(config: &Config, policy: Policy, seed: u64, pace: Pace, start: u64) -> ControlTower {
        ControlTower {
            config: config.clone(),
            rhythm: Rhythm::new(config, pace),
            policy,
            chance: ChaCha8Rng::seed_from_u64(seed),
            pace,
            start,
            stored: Stored::default(),
            key: None,
            restored: None,
            vehicles: BTreeMap::new(),
            sites: Sites::new(&config.sites, pace),
            acted_at: Time::ZERO,
        }
    }

    /// What it decides is stored: no grant is published before [`ControlTower::memory_saved`] has named it.
    pub fn that_is_stored(mut self) -> ControlTower {
        self.stored.begin();
        self
    }

    /// It signs every permission.
    pub fn that_signs_with(mut self, key: SecretKey) -> ControlTower {
        self.key = Some(key);
        self
    }

    /// The persisted state, with which another process can continue.
    pub fn memory(&self) -> v1::TowerMemory {
        let present = || self.vehicles.iter().filter(|(_, it)| !it.ledger.is_empty());
        let present = || present().map(|(id, it)| persisted::to_memory(id, &it.ledger, &it.numbers)).collect();
        let ledgers: Vec<_> = self.restored.clone().unwrap_or_else(present);
        let last_decision = ledgers.iter().map(|it| it.last_decision).max().unwrap_or_default();
        v1::TowerMemory { ledgers, last_decision, loss: self.stored.health().loss.clone().map(Into::into) }
    }

    /// Continues from `memory`; to be called before anything else.
    ///
    /// # Errors
    /// Why the state cannot be used; nothing is changed then.
    pub fn resume(&mut self, mut memory: v1::TowerMemory) -> Result<(), InvalidMessage> {
        persisted::restored(Now::default(), self.pace, &memory.ledgers)?;
        // Older towers had the same numbers for all vehicles.
        for ledger in memory.ledgers.iter_mut().filter(|it| it.last_decision == 0) {
            ledger.last_decision = memory.last_decision;
        }
        self.restored = Some(memory.ledgers);
        if let Some(loss) = memory.loss {
            self.stored.lost(loss.into());
        }
        Ok(())
    }

    /// What a tower before has decided last is lost: nothing is granted until an operator accepts that.
    pub fn memory_lost(&mut self, loss: MemoryLoss) {
        self.stored.lost(loss);
    }

    /// The outcome of the newest attempt to save. `loss` names the loss that a failure is, as long as none has succeeded.
    pub fn memory_written(&mut self, outcome: Result<(), String>, loss: Option<u64>) {
        self.stored.written(outcome, loss);
    }

    /// This state is on the disk.
    pub fn memory_saved(&mut self, memory: &v1::TowerMemory) {
        self.stored.saved(&memory.ledgers);
    }

    /// Takes up what a process before has decided. The policy decides again what was not decided.
    fn wake(&mut self, now: Now) {
        let Some(ledgers) = self.restored.take() else { return };
        // It made sense when the tower was made to continue from it, so it still does.
        for (id, (ledger, numbers)) in persisted::restored(now, self.pace, &ledgers).unwrap_or_default() {
            self.vehicles.insert(id, Vehicle::new(now, ledger, numbers));
        }
        self.ask_policy_again(now);
    }

    fn ask_policy_again(&mut self, now: Now) {
        if self.stored.health().loss.is_some() {
            return;
        }
        let (config, policy, chance) = (&self.config, self.policy, &mut self.chance);
        for vehicle in self.vehicles.values_mut() {
            vehicle.ledger.ask_again(now, || policy.answer(config, chance));
        }
    }

    fn request(&mut self, now: Now, id: &VehicleId, request: &v1::PermissionRequest) -> v1::PermissionReceipt {
        let fresh = Expiry::after(now, self.config.grant_valid_s.seconds(), self.pace);
        let (config, policy, chance) = (&self.config, self.policy, &mut self.chance);
        let knows_all = self.stored.health().loss.is_none();
        let answer = || if knows_all { policy.answer(config, chance) } else { None };
        let was_known = self.vehicles.contains_key(id);
        let taken = vehicle(&mut self.vehicles, now, id).and_then(|Vehicle { ledger, numbers, .. }| {
            ledger.request(now, numbers, request, fresh, answer).map_err(|it| it.to_string())
        });
        self.forget_if_empty(id, was_known);
        v1::PermissionReceipt { received: taken.is_ok(), refusal: taken.err().unwrap_or_default() }
    }

    fn decide(&mut self, now: Now, id: &VehicleId, request: &v1::DecideRequest) -> v1::DecideReply {
        let may_be_granted = self.stored.health().loss.is_some();
        let was_known = self.vehicles.contains_key(id);
        let decided = self.ruling(now, id, request).and_then(|ruling| {
            let Vehicle { ledger, numbers, .. } = vehicle(&mut self.vehicles, now, id)?;
            ledger.rule(now, numbers, &request.area, ruling, may_be_granted).map_err(|it| it.to_string())
        });
        self.forget_if_empty(id, was_known);
        v1::DecideReply { accepted: decided.is_ok(), refusal: decided.err().unwrap_or_default() }
    }

    /// A refused request leaves no vehicle behind.
    fn forget_if_empty(&mut self, id: &VehicleId, was_known: bool) {
        self.vehicles.retain(|known, it| was_known || known != id || !it.ledger.is_empty());
    }

    fn report(&mut self, now: Now, report: &v1::SiteReport) -> v1::SiteReportReply {
        let taken = self.sites.report(now.time, report);
        v1::SiteReportReply { accepted: taken.is_ok(), refusal: taken.err().unwrap_or_default() }
    }

    /// An operator lets the tower grant again.
    fn accept_loss(&mut self, now: Now) -> v1::AcceptLossReply {
        let accepted = self.stored.accept_loss();
        if accepted.is_ok() {
            self.ask_policy_again(now);
            self.vehicles.values_mut().for_each(|it| it.repeat_all(now));
        }
        v1::AcceptLossReply { accepted: accepted.is_ok(), refusal: accepted.err().unwrap_or_default() }
    }

    /// The request as a ruling, or why it is invalid.
    fn ruling(&self, now: Now, id: &VehicleId, request: &v1::DecideRequest) -> Result<Ruling, String> {
        if !request.vehicle.is_empty() && *request.vehicle != **id {
            return Err(format!("sent to vehicle `{id}`, but names `{}`", request.vehicle));
        }
        let reason = request.reason.clone();
        match v1::Decision::try_from(request.decision) {
            Ok(v1::Decision::Grant) => {
                self.stored.may_grant()?;
                if let Some(missing) = self.sites.missing(&request.area, false, now.time) {
                    return Err(missing);
                }
                let valid = request.valid_for_s.map(Positive::try_from).transpose();
                let valid = valid.map_err(|it| format!("`valid_for_s`: {it}"))?.unwrap_or(self.config.grant_valid_s);
                Ok(Ruling::Grant { expiry: Expiry::after(now, valid.seconds(), self.pace) })
            }
            Ok(v1::Decision::Deny) => Ok(Ruling::Deny { reason }),
            Ok(v1::Decision::Revoke) => Ok(Ruling::Revoke { reason }),
            Ok(v1::Decision::Unspecified) => Err("`decision` is missing".to_owned()),
            Err(_) => Err(format!("found `decision` {}, expected grant, deny or revoke", request.decision)),
        }
    }
}

/// The vehicle, known or new; an error if there are too many. One that has no permission makes room.
fn vehicle<'a>(
    vehicles: &'a mut BTreeMap<VehicleId, Vehicle>,
    now: Now,
    id: &VehicleId,
) -> Result<&'a mut Vehicle, String> {
    if MAX_VEHICLES <= vehicles.len() && !vehicles.contains_key(id) {
        vehicles.retain(|_, it| !it.ledger.is_empty());
        if MAX_VEHICLES <= vehicles.len() {
            return Err(format!("{MAX_VEHICLES} vehicles have asked already, the most that are served"));
        }
    }
    Ok(vehicles.entry(id.clone()).or_insert_with(|| Vehicle::new(now, Ledger::default(), Numbers::default())))
}

/// A path may be longer than what can be published.
fn published(health: &MemoryHealth) -> v1::MemoryHealth {
    let MemoryHealth { loss, failing } = health.clone();
    let loss = loss.map(|it| MemoryLoss { why: shortened(&it.why, MAX_TROUBLE_BYTES), ..it });
    MemoryHealth { loss, failing: failing.map(|it| shortened(&it, MAX_TROUBLE_BYTES)) }.into()
}

fn sign(key: &SecretKey, permission: &mut v1::Permission) {
    // What a tower publishes always makes sense; if it did not, no vehicle would believe it without a signature.
    if let Ok(statement) = Permission::try_from(permission.clone()) {
        permission.signature = key.sign(&statement);
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
        &[Service::Permission, Service::Decide, Service::AcceptLoss, Service::SiteReport]
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        self.wake(now);
        let (vehicle, token, request) = match event {
            Event::Request { vehicle, token, request } => (vehicle, token, request),
            // It hears from the tower before it asks for anything, so that it knows which tower there is.
            Event::Peer { vehicle: id, service, alive: true, .. } if !id.is_empty() => {
                // One too many is served once it asks, if there is room by then.
                if let Ok(vehicle) = vehicle(&mut self.vehicles, now, &id)
                    && service == "mcm"
                {
                    vehicle.repeat_parts(now);
                }
                return;
            }
            Event::Peer { .. } | Event::Message { .. } | Event::Reply { .. } => return,
        };
        let response = match request {
            Request::Permission(it) => Response::Permission(self.request(now, &vehicle, &it)),
            Request::Decide(it) => Response::Decide(self.decide(now, &vehicle, &it)),
            Request::AcceptLoss(_) => Response::AcceptLoss(self.accept_loss(now)),
            Request::SiteReport(it) => Response::SiteReport(self.report(now, &it)),
            _ => return,
        };
        effects.push(Effect::Reply { token, response });
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.wake(now);
        let fresh = Expiry::after(now, self.config.grant_valid_s.seconds(), self.pace);
        self.acted_at = now.time;
        let lines = self.vehicles.values().flat_map(|it| it.ledger.lines());
        self.sites.pass(now.time, lines.map(|(area, line)| (area, &line.standing)));
        for (id, vehicle) in &mut self.vehicles {
            vehicle.ledger.advance(now, &mut vehicle.numbers, fresh, |area, standing| {
                self.sites.missing(area, matches!(standing, Standing::Granted { .. }), now.time)
            });
            vehicle.ledger.settle(now.time, |decision| self.stored.has(id, decision));
            while let Some(mut part) = vehicle.next_part(now, self.rhythm) {
                for permission in &mut part.permissions {
                    permission.vehicle = id.to_string();
                    self.key.iter().for_each(|key| sign(key, permission));
                }
                part.tower_start = self.start;
                part.memory = Some(published(self.stored.health()));
                effects.push(Effect::publish_to(id, part));
            }
        }
    }

    fn deadline(&self) -> Option<Time> {
        let of_vehicles = self.vehicles.values().map(|it| it.deadline(self.rhythm)).min();
        of_vehicles.into_iter().chain(self.sites.deadline(self.acted_at)).min()
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as control_tower;
#[cfg(test)]
#[path = "../tests/stories.rs"]
mod stories;
