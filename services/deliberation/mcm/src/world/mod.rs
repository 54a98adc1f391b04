//! What the manager knows and wants. Leaves ask it questions and give it orders by verbs; no code outside this folder
//! uses its fields, but the node takes what is to be sent.
//!
//! Nothing here waits or reads a clock.

use domain::plan::StepId;
use std::cell::OnceCell;
use std::sync::Arc;

use behavior_tree::Library;
use domain::consumption::Consumption;
use domain::contingency::Contingencies;
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::mission::{MissionOutcome, MissionReport};
use domain::mission_clock::MissionClock;
use domain::time::{Now, Time};
use domain::trust::Known;
use kittiwake_proto::v1;

use crate::clients::permissions::Permissions;
use crate::clients::planner::Planner;
use crate::clients::skills::{Handle, Progress, Skills};
use crate::config::Limits;
use crate::flags::Flags;
use crate::journal::{Entry, Journal, Said};
use crate::outbox::Outbox;
use crate::permits::{Beyond, Permits};
use crate::vehicle::{ConfirmedState, FlightJudge, Vehicle};

mod airspace;
mod airspace_watch;
mod alternates;
mod conditions;
mod contingencies;
mod control;
mod crash;
mod decision;
mod energy;
mod ground;
mod harm;
mod intake;
mod limits;
mod memory;
mod mission_requests;
mod monitor_flags;
mod narrowing;
mod next_flight;
mod operator;
mod orders;
pub(crate) mod persisted;
mod places;
mod plans;
mod possible;
mod progress;
mod raise;
mod response_way;
mod responses;
mod situation;
mod slack;
mod start;
mod status;
mod steps;
mod told;
mod traffic;
mod ways;

pub(crate) use airspace::WhatMayBeEntered;
use airspace_watch::AirspaceWatch;
use alternates::Alternates;
pub(crate) use alternates::Choice;
use control::Control;
pub(crate) use control::OF_ITS_OWN;
use crash::Crash;
use decision::Decided;
pub(crate) use harm::Down;
use memory::Memory;
use mission_requests::MissionRequests;
use monitor_flags::{FlagNews, MonitorFlags};
pub(crate) use narrowing::{Barrier, NarrowedGoal};
use orders::Operator;
use progress::FlightWatch;
pub(crate) use response_way::ResponseWay;
use responses::ActiveResponse;
pub(crate) use responses::Reset;
pub(crate) use status::Reporter;
use told::Told;
use traffic::SeenTraffic;
pub(crate) use ways::{Stay, WayOut};

/// The source of flags that the manager raises itself.
const SELF: &str = "mcm";

/// Everything that leaves may ask and order.
pub(crate) struct World {
    now: Now,
    setup: Setup,
    monitor: Monitor,
    seen: Seen,
    flags: Flags,
    skills: Skills,
    planner: Planner,
    permissions: Permissions,
    mission: Mission,
    people: People,
    memory: Memory,
    control: Control,
    watch: Watch,
    answer: Answer,
    landings: Landings,
    pub(crate) out: Out,
}

struct Setup {
    limits: Limits,
    table: Arc<Contingencies>,
    library: Arc<Library<World>>,
}

/// What the monitor tells, and whether it does.
#[derive(Default)]
struct Monitor {
    /// The newest vehicle, and flags in order, that the tree has not taken in yet.
    vehicle: Option<Vehicle>,
    flags: Vec<FlagNews>,
    /// Its flags as they were listed last.
    listed: MonitorFlags,
    /// What monitors have told, for one that is started again and for this process after a restart.
    told: Told,
    /// Since when it is waited for.
    watches_since: Option<Time>,
    /// When an introspection arrived last, whatever it knew.
    spoke: Option<Time>,
}

#[derive(Default)]
struct Seen {
    /// As it was heard last.
    vehicle: Option<Vehicle>,
    flight: FlightJudge,
    confirmed: ConfirmedState,
    /// What the flight takes against the vehicle's figures.
    consumption: Consumption,
    /// Other traffic, as the monitor has told last.
    traffic: SeenTraffic,
    /// Each declared skill, as the monitor has told last.
    skills: Vec<v1::DeclaredSkill>,
    /// Whether the vehicle was in flight by the same message.
    skills_in_flight: bool,
    /// Whether it flies; `None` before it is seen, if nothing was restored.
    flies: Option<Known<bool>>,
    /// Since when it is on the ground, with its motors on and with its motors off.
    armed_on_ground_since: Option<Time>,
    at_rest_since: Option<Time>,
}

#[derive(Default)]
struct Watch {
    airspace: AirspaceWatch,
    alternates: Alternates,
    progress: FlightWatch,
}

/// What was decided, and the response that follows from it.
#[derive(Default)]
struct Answer {
    decided: Decided,
    /// What the vehicle may do with its permissions, once it was asked at this wake.
    permits: OnceCell<Permits>,
    /// The response that is under way.
    response: Option<ActiveResponse>,
    /// Where it flies, with its row.
    response_way: Option<(usize, ResponseWay)>,
    /// What it enters although it is not permitted.
    beyond: Beyond,
    in_transition: bool,
    /// Nothing was to be answered at some decision since the last response began.
    has_rested: bool,
}

/// Landings that were not planned, that have failed, and that are under way.
#[derive(Default)]
struct Landings {
    /// Where the vehicle was when a flag rose that forbids to land there.
    no_landing_at: Option<Ned>,
    /// The landing of a step is flown that began here over the ground; restored: it was flown when the previous process ended.
    by_plan: Option<Known<Ned>>,
    /// The vehicle has landed where no plan wanted it to, for this reason: the mission goes on only when an operator resumes it.
    unplanned: Option<Known<String>>,
    crash: Option<Crash>,
    /// Where landings have failed.
    blocked_sites: Vec<Ned>,
    /// Where the vehicle has come to rest since its local frame is this one; `None`: nowhere but at its origin.
    rests_at: Option<Ned>,
}

/// What people have ordered, and what they have uploaded.
#[derive(Default)]
struct People {
    operator: Operator,
    requests: MissionRequests,
}

#[derive(Default)]
pub(crate) struct Out {
    pub(crate) outbox: Outbox,
    journal: Journal,
}

#[derive(Debug, Default)]
struct Mission {
    /// Latched: no nominal flight after it.
    over: Option<Over>,
    /// Mission time when the first plan was asked for, also by the process before a restart.
    started_s: Option<f64>,
    vehicle_name: String,
    /// It is another flight's, and the tree has not begun again for it yet.
    begins_again: bool,
    /// What it tells of the time since the mission was begun.
    clock: MissionClock,
}

#[derive(Debug, Clone, PartialEq)]
struct Over {
    outcome: MissionOutcome,
    reason: String,
    /// `None` until it is made.
    report: Option<MissionReport>,
    /// Another mission was uploaded since, which can be begun.
    is_next_uploaded: bool,
}

impl World {
    /// A world in which nothing is known yet. `instance` makes request ids unique among restarts.
    pub(crate) fn new(
        limits: Limits,
        vehicle_name: &str,
        instance: u64,
        table: Contingencies,
        library: Arc<Library<World>>,
    ) -> World {
        let mission = Mission { vehicle_name: vehicle_name.to_owned(), ..Mission::default() };
        World {
            now: Now::default(),
            flags: Flags::of(&table),
            seen: Seen::default(),
            setup: Setup { limits, table: Arc::new(table), library },
            monitor: Monitor::default(),
            skills: Skills::new(instance),
            planner: Planner::new(instance),
            permissions: Permissions::new(vehicle_name, instance, limits),
            mission,
            people: People::default(),
            memory: Memory::default(),
            control: Control::default(),
            watch: Watch::default(),
            answer: Answer::default(),
            landings: Landings::default(),
            out: Out::default(),
        }
    }

    pub(crate) fn set_now(&mut self, now: Now) {
        self.now = now;
        self.mission.clock.pass(now, self.setup.limits.pace);
        self.permissions.pass(now, self.setup.limits.pace);
        self.permissions.know_areas(self.planner.areas());
        self.answer.permits.take();
    }

    /// Mission time.
    pub(crate) fn now(&self) -> Time {
        self.now.time
    }

    pub(crate) fn limits(&self) -> &Limits {
        &self.setup.limits
    }

    pub(crate) fn library(&self) -> &Arc<Library<World>> {
        &self.setup.library
    }

    /// Records in words what is not a choice between alternatives.
    pub(crate) fn say(&mut self, topic: &'static str, text: impl Into<String>) {
        self.record(Said::new(topic, DecisionKind::Note, text));
    }

    pub(crate) fn record(&mut self, said: Said) {
        self.out.journal.decided(self.now, Entry::Said(said));
    }

    pub(crate) fn skill_progress(&self, skill: Handle) -> Option<&Progress> {
        self.skills.progress(skill)
    }

    pub(crate) fn halt_skill(&mut self, skill: Handle) {
        self.skills.halt(self.now.time, skill);
    }

    pub(crate) fn vehicle(&self) -> Option<&Vehicle> {
        self.seen.vehicle.as_ref()
    }

    /// Whether the vehicle is known to fly.
    pub(crate) fn is_flying(&self) -> bool {
        self.seen.vehicle.is_some_and(|it| it.flying)
    }

    /// Whether the vehicle flies, or has not been heard since a restart and flew before.
    pub(crate) fn may_fly(&self) -> bool {
        self.seen.vehicle.map_or(self.was_flying(), |it| it.flying)
    }

    /// Whether the vehicle was in the air when it was looked at last, also before a restart.
    fn was_flying(&self) -> bool {
        self.seen.flies.is_some_and(|it| it.value)
    }

    /// Whether the vehicle is known to stand on the ground.
    pub(crate) fn is_on_ground(&self) -> bool {
        self.seen.vehicle.is_some_and(|it| !it.flying)
    }

    /// Why the mission is over, if it is.
    pub(crate) fn over(&self) -> Option<&str> {
        self.mission.over.as_ref().map(|over| over.reason.as_str())
    }

    /// Latches the end of the mission; the first reason stays, except that a crash replaces it before the report is
    /// made.
    pub(crate) fn end_mission(&mut self, outcome: MissionOutcome, reason: impl Into<String>) {
        let (reason, is_crash) = (reason.into(), outcome == MissionOutcome::Crash);
        if is_crash {
            self.landings.crash.get_or_insert(Crash { why: reason.clone(), is_inspected: false });
        }
        if self.mission.over.is_none() || (is_crash && self.report().is_none()) {
            self.mission.over = Some(Over { outcome, reason, report: None, is_next_uploaded: false });
        }
    }

    fn report(&self) -> Option<&MissionReport> {
        self.mission.over.as_ref()?.report.as_ref()
    }

    pub(crate) fn publish_decisions(&mut self) {
        for record in self.out.journal.records(self.now, &self.flags, &self.setup.table) {
            let at_s = self.mission.clock.seconds(record.at_s);
            self.out.outbox.publish(v1::DecisionRecord { at_s, ..record.into() });
        }
    }

    /// When something is due here, apart from the tree.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.skills.deadline(self.setup.limits.skill_silence)
    }

    /// The step that a permission is needed for that is asked for now.
    pub(super) fn needed_by(&self) -> StepId {
        self.planner.flight.step().map_or(StepId(0), |(step, ..)| step.id)
    }
}
