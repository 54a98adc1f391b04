//! The progress of the mission, from the messages of the processes.

use domain::wire::decision::told;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{
    DecisionRecord, McmStatus, MissionPhase, MissionReport, MissionStatus, ObjectiveReport, ObjectiveState,
    SkillFeedback, SkillKind,
};

use crate::output::visible;

/// The newest message of each kind.
#[derive(Debug, Default)]
pub struct Progress {
    mission: MissionStatus,
    mcm: McmStatus,
    feedback: SkillFeedback,
}

/// The stage of the mission: a line is printed when it changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    phase: MissionPhase,
    objective: u32,
    step: u32,
    steps: u32,
    skill: SkillKind,
    in_transition: bool,
}

impl Progress {
    /// Takes in a message; returns a line for a decision.
    pub fn on(&mut self, message: Message) -> Option<String> {
        match message {
            Message::McmStatus(it) => self.mcm = it,
            Message::MissionStatus(it) => self.mission = it,
            Message::SkillFeedback(it) => self.feedback = it,
            Message::DecisionRecord(record) => {
                let DecisionRecord { at_s, topic, text, .. } = &record;
                let line = format!("[{at_s:7.1} s] {topic}: {text}");
                let line = line + &told(record).addition();
                return Some(visible::one_line(&line).into_owned());
            }
            _ => {}
        }
        None
    }

    /// The report, once the mission is over.
    pub fn report(&self) -> Option<&MissionReport> {
        self.mcm.report.as_ref()
    }

    /// Changes with the stage of the mission.
    pub fn stage(&self) -> Stage {
        Stage {
            phase: self.mcm.phase(),
            objective: self.objective(),
            step: self.mcm.step_number,
            steps: self.mcm.step_count,
            skill: self.mcm.skill(),
            in_transition: self.mcm.in_transition,
        }
    }

    /// From 0 to 1: finished objectives, and steps of the present one.
    pub fn fraction(&self) -> f64 {
        if self.report().is_some() {
            return 1.0;
        }
        let objectives = self.mission.objectives.len().max(1) as f64;
        let steps = f64::from(self.mcm.step_count.max(1));
        let behind = f64::from(self.mcm.step_number.saturating_sub(1)) / steps;
        ((f64::from(self.objective()) + behind.min(1.0)) / objectives).min(1.0)
    }

    /// Objective, step n of m, skill, position as (north, east, height) in metres, distance left.
    pub fn line(&self) -> String {
        let mut parts = vec![phase(self.mcm.phase()).to_owned()];
        if let Some(objective) = self.mission.objectives.get(self.objective() as usize) {
            let (number, count) = (self.objective() + 1, self.mission.objectives.len());
            parts[0] = format!("objective {number} of {count} `{}`", objective.name);
            if self.mcm.phase() != MissionPhase::Nominal {
                parts.push(phase(self.mcm.phase()).to_owned());
            }
        }
        if 0 < self.mcm.step_number {
            parts.push(format!("step {} of {}", self.mcm.step_number, self.mcm.step_count));
        }
        if !self.mcm.acting.is_empty() {
            parts.push(format!("response to `{}`", self.mcm.acting));
        }
        if self.mcm.in_transition {
            parts.push("in transition".into());
        }
        parts.extend(skill(self.mcm.skill()).map(str::to_owned));
        parts.extend(self.motion());
        if !self.mission.hold.is_empty() {
            parts.push(format!("holds: {}", self.mission.hold));
        }
        visible::one_line(&parts.join(", ")).into_owned()
    }

    /// The progress as a report, for a mission without a report of its own.
    pub fn unfinished(&self, vehicle: &str, reason: &str) -> MissionReport {
        let objectives = self.mission.objectives.iter().map(|it| ObjectiveReport {
            name: it.name.clone(),
            state: it.state,
            reason: it.reason.clone(),
            plan_steps: it.plan_steps,
            replans: it.replans,
            permissions: it.permissions.clone(),
        });
        MissionReport {
            reason: reason.to_owned(),
            vehicle: vehicle.to_owned(),
            mission: self.mission.mission.clone(),
            objectives: objectives.collect(),
            ..Default::default()
        }
    }

    fn objective(&self) -> u32 {
        self.mcm.step.as_ref().map_or(self.mission.current_objective, |it| it.objective)
    }

    /// The feedback of the skill that runs, not of one that has ended.
    fn motion(&self) -> Option<String> {
        if self.mcm.skill_id == 0 || self.feedback.skill_id != self.mcm.skill_id {
            return None;
        }
        let at = self.feedback.position.as_ref()?;
        let left = self.feedback.distance_left_m;
        // Rounding must not give "-0".
        let (north, east, height) = (at.north_m.round() + 0.0, at.east_m.round() + 0.0, (-at.down_m).round() + 0.0);
        Some(format!("at ({north}, {east}, {height}), {left:.0} m left"))
    }
}

/// An objective's state in a word.
pub fn objective_state(state: ObjectiveState) -> &'static str {
    match state {
        ObjectiveState::Success => "achieved",
        ObjectiveState::Failure => "failed",
        ObjectiveState::Waiting | ObjectiveState::Unspecified => "not attempted",
    }
}

fn phase(phase: MissionPhase) -> &'static str {
    match phase {
        MissionPhase::Unspecified | MissionPhase::Starting => "starting",
        MissionPhase::Nominal => "nominal",
        MissionPhase::Replanning => "replanning",
        MissionPhase::Contingency => "contingency",
        MissionPhase::Ending => "ending",
        MissionPhase::Over => "mission over",
    }
}

fn skill(kind: SkillKind) -> Option<&'static str> {
    match kind {
        SkillKind::Unspecified => None,
        SkillKind::Land => Some("land"),
        SkillKind::Takeoff => Some("takeoff"),
        SkillKind::Stop => Some("stop"),
        SkillKind::Offboard => Some("offboard"),
        SkillKind::Release => Some("release"),
        SkillKind::Task => Some("task"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1::{Ned, Objective, PlanStep, RejectedAlternative};

    fn in_flight() -> Progress {
        let mut progress = Progress::default();
        let objective = |name: &str| Objective { name: name.into(), ..Default::default() };
        let objectives = vec![objective("deliver"), objective("return")];
        progress.on(MissionStatus { objectives, ..Default::default() }.into());
        progress.on(McmStatus {
            phase: MissionPhase::Nominal.into(),
            step: Some(PlanStep { objective: 0, ..Default::default() }),
            step_number: 2,
            step_count: 4,
            skill: SkillKind::Offboard.into(),
            skill_id: 7,
            ..Default::default()
        }
        .into());
        let position = Some(Ned { north_m: -0.2, east_m: 121.3, down_m: -5.0 });
        progress.on(SkillFeedback { skill_id: 7, position, distance_left_m: 378.7, ..Default::default() }.into());
        progress
    }

    #[test]
    fn the_line_tells_objective_step_skill_position_and_distance() {
        assert_eq!(in_flight().line(), "objective 1 of 2 `deliver`, step 2 of 4, offboard, at (0, 121, 5), 379 m left");
        assert_eq!(in_flight().fraction(), 0.125);
    }

    #[test]
    fn before_anything_is_heard_it_starts() {
        assert_eq!(Progress::default().line(), "starting");
        assert_eq!(Progress::default().fraction(), 0.0);
    }

    #[test]
    fn feedback_of_an_ended_skill_is_not_shown() {
        let mut progress = in_flight();
        progress.on(SkillFeedback { skill_id: 6, position: Some(Ned::default()), ..Default::default() }.into());
        assert_eq!(progress.line(), "objective 1 of 2 `deliver`, step 2 of 4, offboard");
    }

    #[test]
    fn moving_is_no_new_stage_but_the_next_step_is() {
        let mut progress = in_flight();
        let before = progress.stage();
        progress.on(SkillFeedback { skill_id: 7, distance_left_m: 1.0, ..Default::default() }.into());
        assert_eq!(progress.stage(), before);
        let next = McmStatus { step_number: 3, ..progress.mcm.clone() };
        progress.on(next.into());
        assert_ne!(progress.stage(), before);
    }

    #[test]
    fn a_name_forges_no_line() {
        let mut progress = Progress::default();
        let name = "d\nmission over: success\u{1b}[31m".to_owned();
        let objectives = vec![Objective { name, ..Default::default() }];
        progress.on(MissionStatus { objectives, ..Default::default() }.into());
        let expected = "objective 1 of 1 `d\\nmission over: success\\u001b[31m`, starting";
        assert_eq!(progress.line(), expected);
        let decision =
            DecisionRecord { topic: "permission".into(), text: "A\r\u{1b}[2KX".into(), ..Default::default() };
        let line = progress.on(decision.into());
        assert_eq!(line.as_deref(), Some("[    0.0 s] permission: A\\r\\u001b[2KX"));
    }

    #[test]
    fn a_decision_is_printed_at_once() {
        let decision =
            DecisionRecord { at_s: 12.34, topic: "step".into(), text: "takeoff".into(), ..Default::default() };
        assert_eq!(Progress::default().on(decision.clone().into()).unwrap(), "[   12.3 s] step: takeoff");
        let rejected = vec![RejectedAlternative { what: "home".into(), why: "too far".into() }];
        let decision = DecisionRecord { rejected, ..decision };
        assert_eq!(Progress::default().on(decision.into()).unwrap(), "[   12.3 s] step: takeoff; not home: too far");
    }
}
