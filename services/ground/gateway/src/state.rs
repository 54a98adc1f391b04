//! What is known of each vehicle, folded from everything that arrives.
//!
//! The fold keeps messages as they came; it is [`view`](crate::view) that makes JSON of them, and
//! only when somebody asks. What happened, as opposed to what is, comes out as [`Occurrence`]s.

use std::collections::BTreeMap;
use std::sync::Arc;

use domain::time::{Now, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::{Event, VehicleId};

use crate::flags::Flags;
use crate::occurrence::{self, Occurrence};
use crate::process::Processes;
use crate::skills::Skills;

/// More aircraft than a receiver tells apart; the ids come from the network.
const MOST_TRAFFIC: usize = 64;
/// More vehicles than one gateway is meant for; the names come from the network.
const MOST_VEHICLES: usize = 64;

/// Every vehicle and every process that belongs to none.
#[derive(Debug, Clone, Default)]
pub struct Fleet {
    /// By name.
    pub vehicles: BTreeMap<VehicleId, Vehicle>,
    /// Ground processes.
    pub ground: Processes,
}

/// One vehicle.
#[derive(Debug, Clone, Default)]
pub struct Vehicle {
    /// The autopilot's status.
    pub status: Option<Seen<v1::VehicleStatus>>,
    /// The monitor's aggregate.
    pub introspection: Option<Seen<v1::Introspection>>,
    /// Objectives, areas and plan.
    pub planner: Option<Seen<v1::PlannerStatus>>,
    /// What the mission manager does.
    pub mcm: Option<Seen<v1::McmStatus>>,
    /// What the control tower has decided.
    pub ledger: Option<Seen<v1::PermissionLedger>>,
    /// The mission manager's tree.
    pub tree: Option<Seen<v1::TreeSnapshot>>,
    /// Other aircraft by their ids, as they were last reported.
    pub traffic: BTreeMap<String, Seen<v1::TransponderReport>>,
    /// The wind as the vehicle has it.
    pub wind: Option<Seen<v1::WindEstimate>>,
    /// What flies.
    pub skills: Skills,
    /// What is wrong.
    pub flags: Flags,
    /// Who is there.
    pub processes: Processes,
}

/// The newest message of a topic; shared with the snapshots that are made of it.
#[derive(Debug, Clone)]
pub struct Seen<M> {
    /// When it arrived.
    pub at: Time,
    /// What it says.
    pub message: Arc<M>,
}

/// The fleet at a moment.
#[derive(Debug, Clone, Default)]
pub struct Snapshot {
    /// What is known.
    pub fleet: Fleet,
    /// When.
    pub now: Now,
}

impl Fleet {
    /// Takes in one event; `happened` receives what is worth a line in the vehicle's history.
    pub fn fold(&mut self, now: Now, event: Event, happened: &mut Vec<(VehicleId, Occurrence)>) {
        match event {
            Event::Message { vehicle, message: Message::Heartbeat(it) } if vehicle.is_empty() => {
                self.ground.on_heartbeat(now.time, it);
            }
            Event::Message { vehicle, message } => {
                if let Some(state) = self.vehicle(&vehicle) {
                    state.fold(now.time, message, |it| happened.push((vehicle.clone(), it)));
                }
            }
            Event::Peer { vehicle, service, instance, alive } if vehicle.is_empty() => {
                self.ground.on_peer(now.time, service, instance, alive);
            }
            Event::Peer { vehicle, service, instance, alive } => {
                if let Some(state) = self.vehicle(&vehicle) {
                    if !alive && service == "skill-manager" {
                        state.skills.on_manager_gone();
                    }
                    state.processes.on_peer(now.time, service, instance, alive);
                }
            }
            // It serves nothing and calls nobody.
            Event::Request { .. } | Event::Reply { .. } => {}
        }
    }

    /// The vehicle's state, from its first sign on; `None` if it has no name or there are too many.
    fn vehicle(&mut self, name: &VehicleId) -> Option<&mut Vehicle> {
        let known = self.vehicles.contains_key(name);
        let acceptable = !name.is_empty() && self.vehicles.len() < MOST_VEHICLES;
        (known || acceptable).then(|| self.vehicles.entry(name.clone()).or_default())
    }
}

impl Vehicle {
    fn fold(&mut self, now: Time, message: Message, mut happened: impl FnMut(Occurrence)) {
        match message {
            Message::VehicleStatus(it) => self.status = seen(now, it),
            Message::Introspection(it) => {
                self.flags.on_listed(now, &it.flags);
                self.introspection = seen(now, it);
            }
            Message::SkillEvent(it) => {
                self.skills.on_event(&it);
                happened(Occurrence::Skill(it));
            }
            Message::SkillFeedback(it) => self.skills.on_feedback(it),
            Message::FlagEvent(it) => {
                self.flags.on_event(now, &it);
                happened(Occurrence::Flag(it));
            }
            Message::PermissionLedger(it) => {
                occurrence::decided(self.ledger.as_ref().map(|it| &*it.message), &it).for_each(&mut happened);
                self.ledger = seen(now, it);
            }
            Message::PlannerStatus(it) => {
                occurrence::progressed(self.planner.as_ref().map(|it| &*it.message), &it).for_each(&mut happened);
                self.planner = seen(now, it);
            }
            Message::McmStatus(it) => {
                self.flags.on_contingencies(&it.contingencies);
                occurrence::reported(self.mcm.as_ref().map(|it| &*it.message), &it).map(&mut happened);
                self.mcm = seen(now, it);
            }
            Message::DecisionRecord(it) => happened(Occurrence::Decision(it)),
            Message::TreeSnapshot(it) => self.tree = seen(now, it),
            Message::TransponderReport(it) => self.on_traffic(now, it),
            Message::WindEstimate(it) => self.wind = seen(now, it),
            Message::Heartbeat(it) => self.processes.on_heartbeat(now, it),
            // Not subscribed to: the monitor's aggregate has what these say, and no operator reads stamps.
            Message::McmTiming(_)
            | Message::GroundContact(_)
            | Message::VehicleCommand(_)
            | Message::OffboardControlMode(_)
            | Message::TrajectorySetpoint(_)
            | Message::VehicleCommandAck(_)
            | Message::VehicleAttitude(_)
            | Message::VehicleLocalPosition(_)
            | Message::VehicleGlobalPosition(_)
            | Message::VehicleLandDetected(_)
            | Message::BatteryStatus(_) => {}
        }
    }

    /// One more is told in the place of the one that was not heard of for longest.
    fn on_traffic(&mut self, now: Time, report: v1::TransponderReport) {
        if MOST_TRAFFIC <= self.traffic.len() && !self.traffic.contains_key(&report.id) {
            let oldest = self.traffic.iter().min_by_key(|(_, it)| it.at).map(|(id, _)| id.clone());
            if let Some(oldest) = oldest {
                self.traffic.remove(&oldest);
            }
        }
        self.traffic.insert(report.id.clone(), Seen { at: now, message: Arc::new(report) });
    }
}

fn seen<M>(at: Time, message: M) -> Option<Seen<M>> {
    Some(Seen { at, message: Arc::new(message) })
}
