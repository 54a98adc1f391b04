//! The persisted state of the manager: the mission as far as it has come, what was ordered, and which flags are up, so that a restart of
//! the process does not begin again what was ended, nor fly again what was flown.
//!
//! The step and the skill are not persisted: the manager asks for a plan from where the vehicle is by then. Where the
//! state is stored is the shell's business.

use domain::contingency::AUTOPILOT_PREEMPTS;
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::memory::MemoryLoss;
use domain::mission::{MissionOutcome, MissionReport};
use domain::mission_clock::MissionClock;
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;

use super::control::Frame;
use super::crash::Crash;
use super::memory::Memory;
use super::news::{MONITOR, Told};
use super::orders::{self, Operator};
use super::{Over, SELF, UnplannedLanding, World};
use crate::clients::planner::FlownMission;
use crate::journal::{CONTINGENCY, Cause, Said};

/// Why a persisted state cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UnusableState {
    /// The manager was started with another mission since.
    #[error("it belongs to another mission file")]
    OfAnotherMission,
    /// A part of it makes no sense.
    #[error(transparent)]
    InvalidMessage(#[from] InvalidMessage),
}

impl World {
    /// The state of this manager, which was started with the mission of identity `configured`.
    pub(crate) fn persist(&self, configured: &str) -> v1::McmMemory {
        let mut memory = v1::McmMemory {
            configured: self.memory.flown_file().unwrap_or(configured).to_owned(),
            started: self.people.operator.has_started(),
            landing_site: self.people.operator.landing_site().map(Into::into),
            overriding: self.people.operator.overriding().unwrap_or_default().to_owned(),
            flags: self.flags_to_remember(),
            loss: self.memory.health().loss.clone().map(Into::into),
            decisions: self.permissions.stored(),
            decision_numbers: self.out.journal.ceiling(),
            tower_start: self.permissions.tower_start(),
            flight: self.permissions.flight().to_owned(),
            planned_for: self.planner.planned_for(),
            ..self.flight_to_remember()
        };
        self.planner.mission().persist(&mut memory);
        memory
    }

    fn flags_to_remember(&self) -> Vec<v1::RememberedFlag> {
        let remembered = |(name, flag): (&str, &crate::flags::Flag)| v1::RememberedFlag {
            name: name.to_owned(),
            reason: flag.reason().to_owned(),
            sources: flag.sources().map(str::to_owned).collect(),
            acknowledged_by: flag.acknowledged_by().unwrap_or_default().to_owned(),
            overridden: flag.overridden(),
        };
        self.flags.iter().map(remembered).collect()
    }

    fn flight_to_remember(&self) -> v1::McmMemory {
        let (outcome, reason) = match self.mission.over.clone() {
            Some(over) => (over.outcome.into(), over.reason),
            None => (v1::MissionOutcome::Unspecified, String::new()),
        };
        let crash = self.landings.crash.as_ref();
        v1::McmMemory {
            outcome: outcome as i32,
            reason,
            report: self.mission.report.clone().map(Into::into),
            is_next: self.mission.is_next_uploaded,
            began_utc_ms: self.mission.clock.began_utc_ms(),
            clock_set_by_ms: self.mission.clock.set_by_ms(),
            started_s: self.mission.started_s,
            unplanned_landing: self.landings.unplanned_landing.as_ref().map(|it| it.why.clone()).unwrap_or_default(),
            crash: crash.map(|it| it.why.clone()).unwrap_or_default(),
            is_crash_inspected: crash.is_some_and(|it| it.is_inspected),
            flying: self.seen.was_flying,
            lands_by_plan: self.seen.was_flying && self.landing_by_plan().is_some(),
            lands_at: self.landing_by_plan().filter(|_| self.seen.was_flying).map(Into::into),
            frame: self.mission_frame().map(Into::into),
            takes_control: self.takes_control(),
            told: Some(v1::ToldByMonitor { flight_s: 0.0, ..self.monitor.told.to_wire(self.now.time) }),
            ..v1::McmMemory::default()
        }
    }

    /// Continues from `memory`; to be called before anything else. The numbers of the tower's decisions, those of the manager's own, and a crash
    /// count for another mission as well. So does everything else, the flight and its grants among it, of a vehicle that was in the air: its
    /// mission file was changed while it flew, and what was ordered holds; the rest waits for an operator.
    ///
    /// # Errors
    /// Why the rest of the state cannot be used; nothing else is changed then.
    pub(crate) fn resume(&mut self, configured: &str, mut memory: v1::McmMemory) -> Result<(), UnusableState> {
        let grants = self.permissions.restore(&memory.decisions, memory.tower_start);
        self.out.journal.number_above(memory.decision_numbers);
        let (why, is_inspected) = (std::mem::take(&mut memory.crash), memory.is_crash_inspected);
        self.landings.crash = (!why.is_empty()).then_some(Crash { why, is_inspected });
        let is_of_another = memory.configured != configured;
        if is_of_another && !(memory.flying && memory.report.is_none()) {
            return Err(UnusableState::OfAnotherMission);
        }
        grants?;
        let mission = FlownMission::restored(&mut memory)?;
        let frame = memory.frame.map(Frame::try_from).transpose()?;
        let landing_site = memory.landing_site.map(Ned::try_from).transpose()?;
        let lands_at = memory.lands_at.map(Ned::try_from).transpose()?;
        let outcome = match memory.outcome() {
            v1::MissionOutcome::Unspecified => None,
            outcome => Some(MissionOutcome::try_from(outcome)?),
        };
        let report = memory.report.take().map(MissionReport::try_from).transpose()?;
        let overriding = Some(std::mem::take(&mut memory.overriding)).filter(|it| !it.is_empty());
        self.permissions.go_on_with(std::mem::take(&mut memory.flight));
        self.restore_frame(frame);
        let of_file = std::mem::replace(self.planner.mission_mut(), mission);
        if !is_of_another {
            self.planner.restore_planned_for(memory.planned_for);
        }
        self.people.operator = Operator::restored(memory.started, landing_site, overriding);
        let over = outcome.map(|outcome| Over { outcome, reason: std::mem::take(&mut memory.reason) });
        self.resume_flight(&memory, over, report, lands_at);
        for flag in memory.flags {
            self.restore_flag(flag);
        }
        self.restore_taking(memory.takes_control);
        self.memory = match is_of_another {
            false => Memory::restored(memory.loss.map(Into::into)),
            true => {
                let why = "the mission file was changed while the vehicle flew".to_owned();
                let loss = MemoryLoss { id: memory.decision_numbers.max(1), why };
                Memory::of_another_mission(loss, memory.configured, of_file)
            }
        };
        self.show_memory();
        Ok(())
    }

    fn resume_flight(
        &mut self,
        memory: &v1::McmMemory,
        over: Option<Over>,
        report: Option<MissionReport>,
        lands_at: Option<Ned>,
    ) {
        self.seen.was_flying = memory.flying;
        self.landings.landed_by_plan = lands_at.filter(|_| memory.lands_by_plan);
        let why = Some(memory.unplanned_landing.clone()).filter(|it| !it.is_empty());
        self.landings.unplanned_landing = why.map(|why| UnplannedLanding { since: self.now.time, why });
        self.monitor.told = Told::remembered(memory.told.unwrap_or_default());
        self.mission.clock = MissionClock::resumed(memory.began_utc_ms, memory.clock_set_by_ms);
        self.mission.started_s = memory.started_s.filter(|it| it.is_finite());
        if over.is_some() {
            (self.mission.over, self.mission.report) = (over, report);
            self.mission.is_next_uploaded = memory.is_next;
        }
    }

    /// A flag that the monitor had raised, or that was injected, is up until an introspection says otherwise.
    fn restore_flag(&mut self, mut flag: v1::RememberedFlag) {
        let Some(row) = self.flags.number(&flag.name) else {
            let text = format!("flag `{}` has no row in the table any more: not acted on", flag.name);
            return self.say("contingency", text);
        };
        let own = |it: &String| [orders::SOURCE, SELF].contains(&it.as_str());
        if flag.sources.iter().any(|it| !own(it)) {
            flag.sources.retain(own);
            flag.sources.push(MONITOR.to_owned());
            self.monitor.news.of_monitor.expect(&flag.name);
        }
        let text = format!("flag `{}` is up since before the mission manager was started again", flag.name);
        let said = Said::new(CONTINGENCY, DecisionKind::ContingencyRaised, text).about(row);
        self.record(said.led_to_by(Cause::Nothing));
        let acknowledged_by = Some(flag.acknowledged_by).filter(|it| !it.is_empty());
        if flag.name == AUTOPILOT_PREEMPTS {
            // Once its reason has been judged, the status alone does not tell it any more.
            self.seen.flight.remember_pre_emption();
            if flag.sources.iter().all(|it| it != SELF) {
                flag.sources.push(SELF.to_owned());
            }
        }
        self.flags.restore(self.now.time, row, flag.reason, flag.sources, acknowledged_by, flag.overridden);
    }
}
