//! What is seen of a flight from outside.

use std::time::Duration;

use domain::contingency::{OPERATOR_ABORT, OPERATOR_LAND};
use domain::fmu::Status;
use domain::quantity::Fraction;
use domain::skill::outcome_name;
use domain::time::{Now, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use node::virtual_bus::UTC_START_MS;
use vehicle_sim::VehicleSim;
use witness::Witness;
use witness::modes::Modes;
use witness::setpoints::Setpoints;
use witness::true_time::{Ahead, TrueTime};

use crate::bounds::Bounds;
use crate::files::Files;
use crate::shared::Shared;

/// Lower than this above the ground the vehicle may stand there.
const LOW_M: f64 = 1.0;
/// How often judges look at the truth.
const LOOKS_EVERY: Duration = Duration::from_millis(100);
/// An older status is ignored. (ENG: ten of 2 Hz, more than any monitor waits for.)
const STATUS_SILENT: Duration = Duration::from_secs(5);
/// The autopilot's own limit of a setpoint's age counts from when the setpoint has arrived; then the vehicle says that it has left
/// offboard. Both take a while on a busy machine.
const NOTICE: Duration = Duration::from_secs(1);

#[derive(Debug)]
pub(crate) struct Seen {
    pub(crate) decisions: Vec<(Time, v1::DecisionRecord)>,
    pub(crate) report: Option<v1::MissionReport>,
    pub(crate) aircraft: Option<v1::VehicleLocalPosition>,
    /// Of the battery, 0 to 1.
    pub(crate) charge: Option<f64>,
    pub(crate) manager: v1::McmStatus,
    pub(crate) ledger: v1::PermissionLedger,
    pub(crate) witness: Witness,
    /// By how much the wall clocks were set.
    pub(crate) ahead: Ahead,
    true_time: TrueTime,
    pub(crate) modes: Modes,
    pub(crate) setpoints: Setpoints,
    pub(crate) bounds: Bounds,
    planner: v1::MissionStatus,
    ordered: Vec<v1::Alternate>,
    landed: bool,
    /// The newest status, and when it was heard first.
    status: Option<(Time, Status)>,
    /// When anything was heard last.
    now: Time,
    start_ordered: bool,
    /// The flag of an order to land where the vehicle is.
    landing_ordered: Option<&'static str>,
    /// How each task along a flight has begun and ended, in words.
    pub(crate) along: Vec<String>,
    /// The pictures that were taken.
    pub(crate) pictures: Vec<v1::Picture>,
    /// Commands to release the load.
    pub(crate) releases: usize,
    /// Where the vehicle is simulated.
    pub(crate) world: Option<Shared<VehicleSim>>,
    looks_at: Time,
    /// The height of the ground under the vehicle.
    ground_m: f64,
}

impl Seen {
    /// Whether a task goes on along the present step.
    pub(crate) fn has_task_along(&self) -> bool {
        let step = self.planner.plan.as_ref().and_then(|it| it.steps.first());
        step.is_some_and(|it| !it.along.is_empty())
    }

    /// Nothing yet of a vehicle with these files.
    pub(crate) fn of(files: &Files) -> Seen {
        let vehicle = &files.vehicle_sim;
        let reserve = files.aircraft.energy.budget(Fraction::ZERO).reserve;
        Seen {
            decisions: Vec::new(),
            along: Vec::new(),
            pictures: Vec::new(),
            report: None,
            aircraft: None,
            charge: None,
            manager: v1::McmStatus::default(),
            ledger: v1::PermissionLedger::default(),
            witness: Witness::default().that_sees(files.aircraft.energy),
            ahead: Ahead::default(),
            true_time: TrueTime::default(),
            modes: Modes::default(),
            setpoints: Setpoints::of(vehicle.offboard_loss_s.seconds() + NOTICE),
            bounds: Bounds::of(files.aircraft.flight.highest_m.get(), reserve.get()),
            planner: v1::MissionStatus::default(),
            ordered: Vec::new(),
            landed: false,
            status: None,
            now: Time::ZERO,
            start_ordered: false,
            landing_ordered: None,
            releases: 0,
            world: None,
            looks_at: Time::ZERO,
            ground_m: 0.0,
        }
    }

    pub(crate) fn take_in(&mut self, time: Time, message: &Message) {
        self.now = time;
        let now = Now { time, utc_ms: UTC_START_MS + time.since_start().as_millis() as i64 };
        match message {
            Message::PermissionLedger(_) | Message::MissionStatus(_) => {
                self.witness.take_in(now, &self.true_time.of(self.ahead, message.clone()));
            }
            _ => self.witness.take_in(now, message),
        }
        self.look(now);
        self.modes.take_in(time, message);
        self.setpoints.take_in(time, message);
        let flies = !self.is_on_ground();
        self.bounds.take_in(time, message, &self.manager, flies);
        match message {
            Message::DecisionRecord(it) => self.decisions.push((time, it.clone())),
            Message::McmStatus(it) => {
                if self.start_ordered && it.report.is_none() {
                    (self.start_ordered, self.report) = (false, None);
                }
                self.report = self.report.take().or_else(|| it.report.clone());
                for alternate in it.alternates.iter().filter(|it| it.role() == v1::AlternateRole::Ordered) {
                    if !self.ordered.iter().any(|known| known.position == alternate.position) {
                        self.ordered.push(alternate.clone());
                    }
                }
                self.manager.clone_from(it);
            }
            Message::MissionStatus(it) => self.planner.clone_from(it),
            Message::SkillEvent(it) if !it.along.is_empty() => {
                let how = match it.state() {
                    v1::SkillState::Ended => outcome_name(it.outcome()),
                    _ => "begins",
                };
                let line = format!("{} {how}", it.along);
                // Each step reports it again.
                if self.along.last() != Some(&line) {
                    self.along.push(line);
                }
            }
            Message::PermissionLedger(it) => self.ledger.clone_from(it),
            Message::VehicleLandDetected(it) => {
                if it.landed && !self.landed {
                    self.touched_down();
                }
                self.landed = it.landed;
            }
            Message::VehicleStatus(it) => {
                let status = Status::from(it.clone());
                self.status = Some((status.known_since(time, self.status.as_ref()), status));
            }
            Message::Picture(it) => self.pictures.push(*it),
            Message::VehicleLocalPosition(it) => self.aircraft = Some(*it),
            Message::BatteryStatus(it) => self.charge = Some(it.remaining),
            Message::VehicleCommand(it) => {
                let is_release = matches!(it.command, Some(v1::vehicle_command::Command::Release(_)));
                self.releases += usize::from(is_release);
            }
            _ => {}
        }
    }

    fn look(&mut self, now: Now) {
        let Some(world) = self.world.as_ref().filter(|_| self.looks_at <= now.time) else { return };
        self.looks_at = now.time + LOOKS_EVERY;
        let truth = world.look().truth(now.time);
        self.ground_m = truth.ground_m;
        self.witness.see(now, &truth);
    }

    /// An operator orders the start of a mission: once it begins, the report of the one before counts no longer.
    pub(crate) fn ordered_to_start(&mut self) {
        self.witness.ordered_to_start();
        self.start_ordered = self.report.is_some();
    }

    /// The flag of an order rises, without a place: an abort, or a landing. It lands the vehicle where it is then, and that is a place that
    /// was asked for.
    pub(crate) fn ordered_to_land_here(&mut self, flag: &str) {
        let landing = [OPERATOR_ABORT, OPERATOR_LAND].into_iter().find(|it| *it == flag);
        self.landing_ordered = landing.or(self.landing_ordered);
    }

    fn touched_down(&mut self) {
        let by_order = self.landing_ordered.take().is_some_and(|flag| self.manager.acting == flag);
        if let Some(position) = self.aircraft.as_ref().and_then(|it| it.position).filter(|_| by_order) {
            let name = "where an order has landed it".to_owned();
            self.ordered.push(v1::Alternate { name, position: Some(position), ..v1::Alternate::default() });
        }
    }

    /// On the ground, disarmed. A status that has fallen silent, or is repeated, says nothing of the motors: then both others must say so.
    pub(crate) fn is_on_ground(&self) -> bool {
        match &self.status {
            Some((heard, status)) if self.now - *heard <= STATUS_SILENT => !status.armed && self.is_down(),
            _ => self.landed && self.is_low(),
        }
    }

    /// On the ground, or hardly above it, whether its motors may turn or not.
    pub(crate) fn is_down(&self) -> bool {
        self.landed || self.is_low()
    }

    fn is_low(&self) -> bool {
        let height_m = self.aircraft.as_ref().and_then(|it| it.position).map(|it| -it.down_m - self.ground_m);
        height_m.is_some_and(|it| it < LOW_M)
    }

    pub(crate) fn places(&self) -> Vec<(String, v1::Ned)> {
        let objectives = self.planner.objectives.iter().map(|it| (&it.name, it.position));
        let sites = self.planner.sites.iter().map(|it| (&it.name, it.position));
        let ordered = self.ordered.iter().map(|it| (&it.name, it.position));
        let listed = objectives.chain(sites).chain(ordered);
        let listed = listed.filter_map(|(name, position)| Some((name.clone(), position?)));
        std::iter::once(("home".to_owned(), v1::Ned::default())).chain(listed).collect()
    }

    pub(crate) fn reason_to_stay(&self) -> String {
        let v1::McmStatus { acting, start_awaited, paused, .. } = &self.manager;
        match (acting.as_str(), start_awaited, paused) {
            ("", true, _) => "waits for an operator".to_owned(),
            ("", _, true) => "paused by an operator".to_owned(),
            ("", ..) => self.planner.hold.clone(),
            (flag, ..) => format!("response to `{flag}`"),
        }
    }
}
