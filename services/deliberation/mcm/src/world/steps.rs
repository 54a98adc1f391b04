//! The step that is flown: begun, flown, failed or given up; and the next one.

use std::sync::Arc;

use domain::contingency::{LANDING_TARGET_LOST, LEFT_TO_OTHERS, SKILL_FAILED, Severity};
use domain::decision::DecisionKind;
use domain::fmu::Gripper;
use domain::geometry::Ned;
use domain::plan::{FlownStep, PermissionNeed, Step};
use domain::skill::Goal;
use domain::time::Time;
use signed_permissions::key::PublicKey;

use super::orders::is_order;
use super::{SELF, World};
use crate::clients::permissions::Asking;
use crate::journal::{Cause, Said};

impl World {
    /// Begins the present step; `None` if there is none.
    pub(crate) fn begin_step(&mut self) -> Option<Arc<Step>> {
        let (step, number, count) = self.planner.flight.step()?;
        let (step, text) = (step.clone(), format!("step {number} of {count}: {}", step.text));
        // Denials of a step that was interrupted at the moment of the denial.
        self.permissions.forget_old_denials();
        self.record(Said::new("step", DecisionKind::StepBegun, text).led_to_by(Cause::Plan));
        Some(step)
    }

    /// Why the present step is to be given up, if it is: not a landing that touches the ground.
    pub(crate) fn withdrawal(&self) -> Option<&str> {
        self.planner.flight.withdrawal().filter(|_| !self.touches_down())
    }

    /// The present step is given up because it was withdrawn.
    pub(crate) fn give_up_step(&mut self, reason: &str) {
        let text = format!("step {} given up: {reason}", self.step_number());
        self.record(Said::new("step", DecisionKind::StepFailed, text));
        self.permissions.end_asking_ahead();
        self.planner.give_up();
    }

    pub(crate) fn step_flown(&mut self, step: &Step) {
        if let Some(state) = self.planning_state() {
            let is_load_gone = !step.releases() && state.gripper == Some(Gripper::Released);
            let along_failure = self.planner.take_along_failure(step.objective);
            let flown = FlownStep { step: step.clone(), state, at: self.mission_now(), along_failure };
            self.planner.flown(self.now.time, flown, self.setup.limits.config.retry_pause_s.seconds());
            if is_load_gone && self.planner.is_release_ahead() {
                self.planner.withdraw("the load is gone that was to be released");
            }
        }
        let found = match step.nominal.goal {
            Goal::Task(_) => format!(": {}", self.skills.last_words()),
            _ => String::new(),
        };
        let text = format!("step {} succeeded{found}", self.step_number());
        self.record(Said::new("step", DecisionKind::StepSucceeded, text));
    }

    /// A task along the present step has failed. The flight goes on; the planner hears at its end.
    pub(super) fn along_failed(&mut self, reason: String) {
        let text = format!("step {}: {reason}; the flight goes on", self.step_number());
        self.record(Said::new("step", DecisionKind::Note, text));
        self.raise(SKILL_FAILED, SELF, reason.clone());
        self.planner.along_failed(reason);
    }

    pub(crate) fn step_failed(&mut self, reason: String) {
        let text = format!("step {} failed: {reason}", self.step_number());
        self.record(Said::new("step", DecisionKind::StepFailed, text));
        if self.planner.flight.step().is_some_and(|(step, ..)| matches!(step.nominal.goal, Goal::Task(_))) {
            self.raise(SKILL_FAILED, SELF, reason.clone());
        }
        // Also refusals ahead: the next plan knows them before the vehicle is at the border.
        let denials = self.permissions.take_denials();
        self.permissions.end_asking_ahead();
        self.planner.fail(self.now.time, reason, denials, self.setup.limits.config.retry_pause_s.seconds());
    }

    /// The present step is given up because another behavior comes first. An order, or a response that only holds the vehicle or
    /// gets it out of somebody's way, says nothing about the step, and in the air holding ends with the battery at the latest. A takeoff that a flag stops,
    /// and a landing whose target is lost, are of the few that are tried: nothing else ends their repetition.
    pub(crate) fn step_interrupted(&mut self) {
        let takes_off =
            self.planner.flight.step().is_some_and(|(step, ..)| matches!(step.nominal.goal, Goal::Takeoff { .. }));
        let (reason, is_failure) = match self.responder() {
            Some(row) => {
                let (flag, row) = (self.flags.name(row), &self.setup.table.rows()[row]);
                let is_of_others = LEFT_TO_OTHERS.contains(&row.flag.as_str());
                let goes_on = row.only_holds() || row.severity() == Severity::Avoid;
                let is_tried = takes_off || row.flag == LANDING_TARGET_LOST;
                let only_holds = is_of_others || (goes_on && !is_tried);
                (["interrupted by `", flag, "`"].concat(), !is_order(flag) && !only_holds)
            }
            None => ("interrupted".to_owned(), true),
        };
        self.permissions.end_asking_ahead();
        self.planner.interrupt(reason, is_failure);
    }

    fn step_number(&self) -> u32 {
        self.planner.flight.step().map_or(0, |(_, number, _)| number)
    }

    /// Makes the next step the present one; returns whether there is one.
    pub(crate) fn advance(&mut self) -> bool {
        let has_next = self.planner.advance();
        if !has_next {
            self.permissions.end_asking_ahead();
        }
        has_next
    }

    /// Asks for a permission, unless it is held, was asked for ahead, or there is no step that it would be for. Returns when to look again, if
    /// nothing comes.
    pub(crate) fn ask_permission(&mut self, need: &PermissionNeed) -> Time {
        let look_again = self.now.time + self.setup.limits.permission_answer;
        let is_taken_over = self.permissions.take_over(need, self.now.time);
        let has_step = self.planner.flight.step().is_some();
        if is_taken_over || !has_step || self.permissions.meets(need, self.now.time) {
            return look_again;
        }
        let said = Said::new("permission", DecisionKind::PermissionAsked, format!("asking for area {}", need.area));
        self.record(said.about_area(&need.area));
        let by = self.needed_by();
        self.permissions.ask(self.now.time, &need.area, by, &mut self.out.outbox);
        look_again
    }

    /// Asks for a permission that a later step needs, unless it is held.
    pub(crate) fn ask_permission_ahead(&mut self, need: &PermissionNeed) {
        if self.permissions.meets(need, self.now.time) {
            return;
        }
        let text = format!("asking for area {} ahead", need.area);
        self.record(Said::new("permission", DecisionKind::PermissionAsked, text).about_area(&need.area));
        let by = self.needed_by();
        self.permissions.ask_ahead(self.now.time, &need.area, by, &mut self.out.outbox);
    }

    /// A permission that was asked for ahead is denied. The ledger tells of a refusal, which stands for the step that needs the
    /// permission; in other cases that step asks again.
    pub(crate) fn note_denial_ahead(&mut self, area: &str) {
        let reason = self.denial(area).unwrap_or_default().to_owned();
        if self.permissions.forget_unless_refused(area) {
            self.say("permission", format!("area {area} is asked for again when it is needed: {reason}"));
        }
    }

    /// Only what this key verifies is believed from now on.
    pub(crate) fn verify_permissions_with(&mut self, key: PublicKey) {
        self.permissions.verify_with(key);
    }

    pub(crate) fn asking(&mut self, need: &PermissionNeed) -> Asking {
        self.permissions.asking(self.now.time, need, &mut self.out.outbox)
    }

    /// Why `area` was denied.
    pub(crate) fn denial(&self, area: &str) -> Option<&str> {
        self.permissions.denial(area).map(|it| it.reason.as_str())
    }

    pub(crate) fn stop_asking(&mut self, area: &str) {
        self.permissions.stop_asking(area);
    }

    /// Whether the vehicle is where the present step ends, or may fly straight on to the goal of the next one.
    pub(crate) fn may_go_on(&self) -> bool {
        let (Some(vehicle), Some((step, ..))) = (&self.seen.vehicle, self.planner.flight.step()) else { return false };
        let here = vehicle.position;
        let has_arrived = target(step)
            .is_none_or(|(there, _)| here.distance_m(there) <= self.setup.limits.config.arrival_radius_m.get());
        // Land, takeoff and stop begin where this step ends.
        let onward = self.planner.flight.next().and_then(|it| target(it));
        has_arrived || onward.is_some_and(|(there, speed_m_s)| self.breach_on_way(here, there, speed_m_s).is_none())
    }
}

/// The target and speed of a position step; other steps do not move over ground.
fn target(step: &Step) -> Option<(Ned, f64)> {
    match step.nominal.goal {
        Goal::Position { target, speed_limit_m_s, .. } => Some((target, speed_limit_m_s)),
        _ => None,
    }
}
