//! The persisted state of the manager: the mission as far as it has come, what was ordered, and which flags are up, so that a restart of
//! the process does not begin again what was ended, nor fly again what was flown.
//!
//! The step and the skill are not persisted: the manager asks for a plan from where the vehicle is by then. Where the
//! state is stored is the shell's business.

use domain::contingency::AUTOPILOT_PREEMPTS;
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::memory::{MemoryHealth, MemoryLoss};
use domain::mission::{MissionOutcome, MissionReport};
use domain::mission_clock::MissionClock;
use domain::trust::Known;
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;

use super::control::Frame;
use super::memory::Memory;
use super::monitor_flags::MONITOR;
use super::orders::{self, Operator};
use super::told::Told;
use super::{Over, SELF, World};
use crate::clients::planner::FlownMission;
use crate::flags::Flag;
use crate::journal::{CONTINGENCY, Cause, Said};

/// Why a persisted state cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UnusableState {
    /// The manager was started with another mission since.
    #[error("it belongs to another mission file")]
    OfAnotherMission,
    /// A part makes no sense.
    #[error(transparent)]
    InvalidMessage(#[from] InvalidMessage),
}

impl World {
    /// The state of this manager, which was started with the mission of identity `configured`.
    pub(crate) fn persist(&self, configured: &str) -> v1::McmMemory {
        v1::McmMemory {
            configured: self.memory.of_another.as_ref().map_or(configured, |(flown, _)| flown).to_owned(),
            mission: Some(self.planner.mission.stored()),
            orders: Some(v1::StoredOrders {
                started: self.people.operator.has_started,
                landing_site: self.people.operator.landing_site.map(Into::into),
                takes_control: self.sending().takes_control,
            }),
            flags: self.flags.iter().map(stored_flag).collect(),
            end: self.mission.over.as_ref().map(Into::into),
            flight: Some(self.stored_flight()),
            clock: Some(v1::StoredClock {
                began_utc_ms: self.mission.clock.began_utc_ms(),
                set_by_ms: self.mission.clock.set_by_ms(),
                started_s: self.mission.started_s,
            }),
            loss: self.memory.health.loss.clone().map(Into::into),
            decisions: self.permissions.stored(),
            decision_numbers: self.out.journal.numbers.ceiling(),
            crash: self.landings.crash.clone(),
        }
    }

    fn stored_flight(&self) -> v1::StoredFlight {
        let in_air = self.was_flying();
        v1::StoredFlight {
            name: self.permissions.flight().to_owned(),
            in_air,
            lands_at: self.landings.by_plan.filter(|_| in_air).map(|it| it.value.into()),
            rests_at: self.landings.rests_at.filter(|_| !in_air).map(Into::into),
            frame: self.mission_frame().map(Into::into),
            unplanned_landing: self.landings.unplanned.as_ref().map(|it| it.value.clone()).unwrap_or_default(),
            told: Some(v1::ToldByMonitor { flight_s: 0.0, ..self.monitor.told.to_wire(self.now.time) }),
        }
    }

    /// Continues from `memory`; to be called before anything else. The numbers of the tower's decisions, those of the manager's own, and a crash
    /// count for another mission as well. So does everything else, the flight and its grants among it, of a vehicle that was in the air: its
    /// mission file was changed while it flew, and what was ordered holds; the rest waits for an operator.
    ///
    /// # Errors
    /// Why the rest of the state cannot be used; nothing else is changed then.
    pub(crate) fn resume(&mut self, configured: &str, memory: v1::McmMemory) -> Result<(), UnusableState> {
        let grants = self.permissions.restore(memory.decisions);
        self.out.journal.numbers.go_on_above(memory.decision_numbers);
        self.landings.crash = memory.crash;
        let (flight, clock) = (memory.flight.unwrap_or_default(), memory.clock.unwrap_or_default());
        let is_of_another = memory.configured != configured;
        if is_of_another && !(flight.in_air && memory.end.as_ref().is_none_or(|it| it.report.is_none())) {
            return Err(UnusableState::OfAnotherMission);
        }
        grants?;
        let mission = FlownMission::try_from(memory.mission.ok_or(InvalidMessage::Missing("mission"))?)?;
        let over = memory.end.map(Over::try_from).transpose()?;
        let orders = memory.orders.unwrap_or_default();
        let operator = Operator::try_from(&orders)?;
        self.resume_flight(flight)?;
        self.people.operator = operator;
        self.restore_taking(orders.takes_control);
        self.mission.over = over;
        self.mission.clock = MissionClock::resumed(clock.began_utc_ms, clock.set_by_ms);
        self.mission.started_s = clock.started_s.filter(|it| it.is_finite());
        memory.flags.into_iter().for_each(|it| self.restore_flag(it));
        let of_file = std::mem::replace(&mut self.planner.mission, mission);
        let changed = "the mission file was changed while the vehicle flew".to_owned();
        let change = MemoryLoss { id: memory.decision_numbers.max(1), why: changed };
        let loss = Some(change).filter(|_| is_of_another).or(memory.loss.map(Into::into));
        let of_another = is_of_another.then_some((memory.configured, of_file));
        self.memory = Memory { health: MemoryHealth { loss, failing: None }, of_another };
        self.show_memory();
        Ok(())
    }

    fn resume_flight(&mut self, flight: v1::StoredFlight) -> Result<(), InvalidMessage> {
        let frame = flight.frame.map(Frame::try_from).transpose()?;
        let [lands_at, rests_at] = [flight.lands_at, flight.rests_at].map(|it| it.map(Ned::try_from));
        let (lands_at, rests_at) = (lands_at.transpose()?, rests_at.transpose()?);
        self.permissions.go_on_with(flight.name);
        self.restore_frame(frame);
        self.seen.flies = Some(Known::restored(flight.in_air));
        self.landings.by_plan = lands_at.map(Known::restored);
        self.landings.rests_at = rests_at;
        let why = Some(flight.unplanned_landing).filter(|it| !it.is_empty());
        self.landings.unplanned = why.map(Known::restored);
        self.monitor.told = Told::remembered(flight.told.unwrap_or_default());
        Ok(())
    }

    /// A flag that the monitor had raised, or that was injected, is up until an introspection says otherwise.
    fn restore_flag(&mut self, flag: v1::RememberedFlag) {
        let v1::RememberedFlag { name, reason, mut sources, acknowledged_by, overridden, overrides } = flag;
        let Some(row) = self.flags.number(&name) else {
            let text = format!("flag `{name}` has no row in the table any more: not acted on");
            return self.say("contingency", text);
        };
        let own = |it: &String| [orders::SOURCE, SELF].contains(&it.as_str());
        if sources.iter().any(|it| !own(it)) {
            sources.retain(own);
            sources.push(MONITOR.to_owned());
            self.monitor.listed.expect(&name);
        }
        let text = format!("flag `{name}` is up since before the mission manager was started again");
        let said = Said::new(CONTINGENCY, DecisionKind::ContingencyRaised, text).about(row);
        self.record(said.led_to_by(Cause::Nothing));
        if name == AUTOPILOT_PREEMPTS {
            // Once its reason has been judged, the status alone does not tell it any more.
            self.seen.flight.remember_pre_emption();
            if sources.iter().all(|it| it != SELF) {
                sources.push(SELF.to_owned());
            }
        }
        let acknowledged_by = Some(acknowledged_by).filter(|it| !it.is_empty());
        let (since, measured) = (self.now.time, None);
        self.flags.restore(row, Flag { since, reason, measured, sources, acknowledged_by, overridden, overrides });
    }
}

fn stored_flag((name, flag): (&str, &Flag)) -> v1::RememberedFlag {
    v1::RememberedFlag {
        name: name.to_owned(),
        reason: flag.reason.clone(),
        sources: flag.sources.clone(),
        acknowledged_by: flag.acknowledged_by.clone().unwrap_or_default(),
        overridden: flag.overridden,
        overrides: flag.overrides,
    }
}

impl From<&Over> for v1::StoredEnd {
    fn from(over: &Over) -> v1::StoredEnd {
        let Over { outcome, reason, report, is_next_uploaded } = over.clone();
        let outcome = v1::MissionOutcome::from(outcome) as i32;
        v1::StoredEnd { outcome, reason, report: report.map(Into::into), is_next: is_next_uploaded }
    }
}

impl TryFrom<v1::StoredEnd> for Over {
    type Error = InvalidMessage;

    fn try_from(end: v1::StoredEnd) -> Result<Over, InvalidMessage> {
        let outcome = MissionOutcome::try_from(end.outcome())?;
        let report = end.report.map(MissionReport::try_from).transpose()?;
        Ok(Over { outcome, reason: end.reason, report, is_next_uploaded: end.is_next })
    }
}
