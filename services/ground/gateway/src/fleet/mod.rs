//! The state of each vehicle, folded from every message that arrives.
//!
//! The fold keeps messages as they came; [`view`](crate::view) makes documents of them when a client
//! asks. Events, as opposed to state, come out as [`Occurrence`]s.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use domain::fmu::Status;
use domain::time::{Now, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::{Event, VehicleId};

use crate::contact::shows_contact;
use crate::fleet::decisions::Decisions;
use crate::fleet::flags::Flags;
use crate::fleet::occurrence::Occurrence;
use crate::fleet::processes::{Health, Process, Processes};
use crate::fleet::skills::Skills;
use crate::fleet::track::Track;

pub(crate) mod decisions;
pub(crate) mod flags;
pub(crate) mod ledger;
pub(crate) mod occurrence;
pub(crate) mod processes;
pub(crate) mod skills;
pub(crate) mod track;

/// More aircraft than a receiver distinguishes; the ids come from the network.
const MAX_TRAFFIC: usize = 64;
/// More vehicles than one gateway is meant for; the names come from the network.
pub(crate) const MAX_VEHICLES: usize = 64;

/// Every vehicle, and every process that belongs to none.
#[derive(Debug, Clone, Default)]
pub(crate) struct FleetState {
    /// The vehicles, by name.
    pub(crate) vehicles: BTreeMap<VehicleId, VehicleState>,
    /// Ground processes.
    pub(crate) ground: Processes,
}

/// One vehicle.
#[derive(Debug, Clone, Default)]
pub(crate) struct VehicleState {
    /// When it was last heard.
    heard: Option<Time>,
    /// The autopilot's status.
    pub(crate) status: Option<Seen<v1::VehicleStatus>>,
    /// The monitor's aggregate.
    pub(crate) introspection: Option<Seen<v1::Introspection>>,
    /// Objectives, areas and plan.
    pub(crate) mission: Option<Seen<v1::MissionStatus>>,
    /// What the mission manager does.
    pub(crate) mcm: Option<Seen<v1::McmStatus>>,
    /// What the mission manager decided last.
    pub(crate) decisions: Decisions,
    /// Where it has flown.
    pub(crate) track: Track,
    /// What the control tower has decided.
    pub(crate) ledger: Option<Seen<v1::PermissionLedger>>,
    /// The mission manager's tree.
    pub(crate) tree: Option<Seen<v1::TreeSnapshot>>,
    /// Other aircraft by their ids, as they were last reported.
    pub(crate) traffic: BTreeMap<String, Seen<v1::TransponderReport>>,
    /// The wind as the vehicle estimates it.
    pub(crate) wind: Option<Seen<v1::WindEstimate>>,
    /// How many pictures were taken on the present mission.
    pub(crate) pictures: u32,
    /// Skills under way, and the last that ended.
    pub(crate) skills: Skills,
    /// Flags that are up.
    pub(crate) flags: Flags,
    /// The vehicle's processes.
    pub(crate) processes: Processes,
}

/// The newest message of a topic, shared with the snapshots.
#[derive(Debug, Clone)]
pub(crate) struct Seen<M> {
    /// When it arrived.
    pub(crate) at: Time,
    /// The message.
    pub(crate) message: Arc<M>,
}

/// The fleet at one moment.
#[derive(Debug, Clone, Default)]
pub(crate) struct Snapshot {
    /// The state.
    pub(crate) fleet: FleetState,
    /// The moment.
    pub(crate) now: Now,
}

impl Snapshot {
    /// The mission time of a vehicle; `None` while it is not known.
    pub(crate) fn mission_time_s(&self, vehicle: &str) -> Option<f64> {
        self.fleet.vehicles.get(vehicle)?.mission_time_s(self.now.time)
    }
}

impl FleetState {
    /// Takes in one event; `occurrences` receives what belongs in a vehicle's journal.
    pub(crate) fn fold(&mut self, now: Now, event: Event, occurrences: &mut Vec<(VehicleId, Occurrence)>) {
        match event {
            Event::Message { vehicle, message: Message::Heartbeat(heartbeat) } if vehicle.is_empty() => {
                self.ground.on_heartbeat(now.time, heartbeat);
            }
            Event::Message { vehicle, message } => {
                if let Some(state) = self.vehicle(&vehicle) {
                    state.fold(now.time, message, |it| occurrences.push((vehicle.clone(), it)));
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
            // The gateway serves no requests; replies go to the orders that wait for them.
            Event::Request { .. } | Event::Reply { .. } => {}
        }
    }

    /// The vehicle's state, which begins with its first message; `None` if the name is empty or
    /// there are too many vehicles.
    fn vehicle(&mut self, name: &VehicleId) -> Option<&mut VehicleState> {
        let known = self.vehicles.contains_key(name);
        let acceptable = !name.is_empty() && self.vehicles.len() < MAX_VEHICLES;
        (known || acceptable).then(|| self.vehicles.entry(name.clone()).or_default())
    }
}

impl VehicleState {
    /// The report of the mission that it has: that of the one before says nothing of the next.
    pub(crate) fn report(&self) -> Option<&v1::MissionReport> {
        let report = message_of(&self.mcm)?.report.as_ref()?;
        message_of(&self.mission).is_none_or(|it| it.mission == report.mission).then_some(report)
    }

    /// How long ago it was heard; `None` if it never was.
    pub(crate) fn silent_for(&self, now: Time) -> Option<Duration> {
        self.heard.map(|heard| now - heard)
    }

    /// Its mission time; `None` until its mission manager was heard.
    pub(crate) fn mission_time_s(&self, now: Time) -> Option<f64> {
        let seen = self.mcm.as_ref()?;
        Some(seen.message.mission_time_s? + (now - seen.at).as_secs_f64())
    }

    /// When its mission was begun; `None` as long as that is not known.
    pub(crate) fn mission_began(&self) -> Option<i64> {
        message_of(&self.mcm).map(|it| it.began_utc_ms).filter(|it| *it != 0)
    }

    /// What was heard of the same mission before the gateway was started; `None` if it is of another one.
    pub(crate) fn go_on_from(&mut self, before: VehicleState) -> Option<()> {
        (self.mission_began()? == before.mission_began()?).then_some(())?;
        self.track.go_on_from(before.track);
        self.decisions.go_on_from(before.decisions);
        self.pictures = self.pictures.saturating_add(before.pictures);
        Some(())
    }

    fn add_to_track(&mut self, now: Time, introspection: &v1::Introspection) {
        let position = introspection.local_position.as_ref().and_then(|it| it.position);
        let (Some(mission_time_s), Some(position)) = (self.mission_time_s(now), position) else { return };
        let derived = introspection.derived.unwrap_or_default();
        self.track.add(v1::TrackPoint {
            mission_time_s,
            position: Some(position),
            height_m: derived.height_m,
            ground_speed_m_s: derived.ground_speed_m_s,
            battery_remaining: introspection.battery.as_ref().map(|it| it.remaining),
        });
    }

    /// Whether the vehicle is silent as a whole: each of its processes shows progress more often than once in
    /// `stale_after`.
    pub(crate) fn is_lost(&self, now: Time, stale_after: Duration) -> bool {
        self.silent_for(now).is_some_and(|it| stale_after < it)
    }

    /// The health of one of its processes. While the whole vehicle is silent it is the link that is known to be gone, and
    /// nothing about the processes.
    pub(crate) fn health(&self, process: &Process, now: Time, stale_after: Duration) -> Health {
        if self.is_lost(now, stale_after) { Health::Unheard } else { process.health(now, stale_after) }
    }

    fn fold(&mut self, now: Time, message: Message, mut occurred: impl FnMut(Occurrence)) {
        if shows_contact(&message) {
            self.heard = Some(now);
        }
        match message {
            Message::VehicleStatus(status) => {
                let before = self.status.as_ref().map(|it| (it.at, Status::from(it.message.as_ref().clone())));
                self.status = seen(Status::from(status.clone()).known_since(now, before.as_ref()), status);
            }
            Message::Introspection(introspection) => {
                let changes = self.flags.on_listed(now, &introspection.flags);
                changes.into_iter().map(Occurrence::Flag).for_each(&mut occurred);
                self.add_to_track(now, &introspection);
                self.introspection = seen(now, introspection);
            }
            Message::SkillEvent(event) => {
                self.skills.on_event(&event);
                occurred(Occurrence::Skill(event));
            }
            Message::SkillFeedback(feedback) => self.skills.on_feedback(feedback),
            Message::PermissionLedger(ledger) => {
                let before = self.ledger.as_ref().map(|it| (&*it.message, now - it.at));
                let ledger = ledger::with_part(before, ledger);
                occurrence::permissions(message_of(&self.ledger), &ledger).for_each(&mut occurred);
                self.ledger = seen(now, ledger);
            }
            Message::MissionStatus(status) => {
                occurrence::objectives(message_of(&self.mission), &status).for_each(&mut occurred);
                self.mission = seen(now, status);
            }
            Message::McmStatus(status) => {
                occurrence::report(message_of(&self.mcm), &status).map(&mut occurred);
                self.track.of_mission(status.began_utc_ms);
                if self.mission_began().is_some_and(|it| it != status.began_utc_ms) {
                    self.pictures = 0;
                }
                self.mcm = seen(now, status);
            }
            Message::DecisionRecord(decision) => {
                self.decisions.add(decision.clone());
                occurred(Occurrence::Decision(decision));
            }
            Message::TreeSnapshot(tree) => self.tree = seen(now, tree),
            Message::TransponderReport(report) => self.on_traffic(now, report),
            Message::WindEstimate(wind) => self.wind = seen(now, wind),
            Message::Picture(_) => self.pictures = self.pictures.saturating_add(1),
            Message::Heartbeat(heartbeat) => self.processes.on_heartbeat(now, heartbeat),
            // Not subscribed to: the monitor's aggregate contains these data, and no operator reads timing marks.
            Message::McmTiming(_)
            | Message::SkillControl(_)
            | Message::FlagEvent(_)
            | Message::GroundContact(_)
            | Message::TaskOrder(_)
            | Message::TaskReport(_)
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

    /// Beyond the limit a new aircraft replaces the one whose last report is oldest.
    fn on_traffic(&mut self, now: Time, report: v1::TransponderReport) {
        if MAX_TRAFFIC <= self.traffic.len() && !self.traffic.contains_key(&report.id) {
            let oldest = self.traffic.iter().min_by_key(|(_, seen)| seen.at).map(|(id, _)| id.clone());
            if let Some(oldest) = oldest {
                self.traffic.remove(&oldest);
            }
        }
        self.traffic.insert(report.id.clone(), Seen { at: now, message: Arc::new(report) });
    }
}

/// The message, if one was seen.
pub(crate) fn message_of<M>(seen: &Option<Seen<M>>) -> Option<&M> {
    seen.as_ref().map(|seen| seen.message.as_ref())
}

fn seen<M>(at: Time, message: M) -> Option<Seen<M>> {
    Some(Seen { at, message: Arc::new(message) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kinds of the occurrences that these messages cause.
    fn occurrences(messages: impl IntoIterator<Item = Message>) -> Vec<&'static str> {
        let (mut fleet, mut occurred) = (FleetState::default(), Vec::new());
        for message in messages {
            fleet.fold(Now::default(), Event::Message { vehicle: "uav1".into(), message }, &mut occurred);
        }
        occurred.iter().map(|(_, occurrence)| occurrence.kind()).collect()
    }

    #[test]
    fn an_autopilots_status_that_is_repeated_with_its_time_keeps_its_age() {
        #[track_caller]
        fn check(timestamps_us: [u64; 2], known_since_s: u64) {
            let mut fleet = FleetState::default();
            for (timestamp_us, second) in timestamps_us.into_iter().zip([1, 9]) {
                let message = v1::VehicleStatus { timestamp_us, ..Default::default() }.into();
                let now = Now { time: Time::after(Duration::from_secs(second)), ..Now::default() };
                fleet.fold(now, Event::Message { vehicle: "uav1".into(), message }, &mut Vec::new());
            }
            let status = fleet.vehicles.values().next().and_then(|it| it.status.as_ref()).unwrap();
            assert_eq!(status.at, Time::after(Duration::from_secs(known_since_s)), "{timestamps_us:?}");
        }
        check([7, 7], 1);
        check([7, 8], 9);
        check([0, 0], 9);
    }

    #[test]
    fn a_status_that_is_only_repeated_is_no_event() {
        use v1::ObjectiveState::{Success, Waiting};
        use v1::PermissionState::{Granted, Requested};
        let ledger = |state: v1::PermissionState, valid_for_s| {
            let permission =
                v1::Permission { area: "a".into(), state: state.into(), valid_for_s, ..Default::default() };
            Message::from(v1::PermissionLedger { permissions: vec![permission], ..Default::default() })
        };
        let planner = |step_id, state: v1::ObjectiveState| {
            let steps = vec![v1::PlanStep { id: step_id, ..Default::default() }];
            let objectives = vec![v1::Objective { state: state.into(), ..Default::default() }];
            let plan = Some(v1::Plan { steps, ..Default::default() });
            Message::from(v1::MissionStatus { objectives, plan, ..Default::default() })
        };
        let over = || Message::from(v1::McmStatus { report: Some(Default::default()), ..Default::default() });
        assert_eq!(
            occurrences([ledger(Requested, 0.0), ledger(Granted, 9.0), ledger(Granted, 8.0)]),
            ["permission"; 2]
        );
        assert_eq!(occurrences([planner(1, Waiting), planner(2, Waiting), planner(2, Success)]), ["objective"; 2]);
        assert_eq!(occurrences([v1::McmStatus::default().into(), over(), over()]), ["report"]);
    }

    #[test]
    fn names_from_the_network_do_not_fill_the_memory() {
        let mut fleet = FleetState::default();
        for n in 0..1000 {
            let message = v1::VehicleStatus::default().into();
            let event = Event::Message { vehicle: n.to_string().into(), message };
            fleet.fold(Now::default(), event, &mut Vec::new());
        }
        assert_eq!(fleet.vehicles.len(), 64);
    }
}
