//! The mission report, for people and for programs.

use kittiwake_proto::json::to_json;
use kittiwake_proto::v1::{MissionOutcome, MissionReport, ObjectiveReport, ObjectiveState};

use crate::output::visible;
use crate::up::progress::objective_state;

/// One JSON document: canonical proto3 JSON, as over HTTP.
pub fn json(report: &MissionReport) -> String {
    format!("{:#}", to_json(report))
}

/// A few lines of text.
pub fn text(report: &MissionReport) -> String {
    let achieved = report.objectives.iter().filter(|it| it.state() == ObjectiveState::Success).count();
    let outcome = match report.outcome() {
        MissionOutcome::Success => "mission over: success",
        MissionOutcome::Failure => "mission over: objectives failed",
        MissionOutcome::Emergency => "mission over: emergency",
        MissionOutcome::Crash => "mission over: crashed",
        MissionOutcome::Unspecified => "mission not finished",
    };
    // The duration is known only if the mission is over.
    let took = match report.outcome() {
        MissionOutcome::Unspecified => String::new(),
        _ => format!(" in {:.0} s", report.duration_s),
    };
    let mut text = format!(
        "{outcome}, {achieved} of {} objectives achieved{took}{}",
        report.objectives.len(),
        because(&report.reason)
    );
    let width = report.objectives.iter().map(|it| visible::one_line(&it.name).len()).max().unwrap_or_default();
    for it in &report.objectives {
        text += &format!(
            "\n  {:width$}  {}{}; {}, {}",
            visible::one_line(&it.name),
            state(it),
            because(&it.reason),
            count(it.plan_steps, "step"),
            count(it.replans, "replan"),
        );
        if !it.permissions.is_empty() {
            text += &format!("; asked to enter {}", visible::one_line(&it.permissions.join(", ")));
        }
    }
    text
}

/// The progress in a word. An objective that waits and has a plan was being flown when the mission ended.
fn state(objective: &ObjectiveReport) -> &'static str {
    match objective.state() {
        ObjectiveState::Waiting if 0 < objective.plan_steps => "begun",
        state => objective_state(state),
    }
}

fn because(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!(": {}", visible::one_line(reason)) }
}

fn count(number: u32, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> MissionReport {
        let objective = |name: &str, state: ObjectiveState, reason: &str| ObjectiveReport {
            name: name.into(),
            state: state.into(),
            reason: reason.into(),
            plan_steps: 6,
            replans: 1,
            permissions: vec!["A".into(), "B".into()],
        };
        MissionReport {
            outcome: MissionOutcome::Failure.into(),
            reason: "an objective failed".into(),
            vehicle: "uav1".into(),
            mission: "reference".into(),
            duration_s: 331.4,
            objectives: vec![
                objective("deliver", ObjectiveState::Failure, "B never answered"),
                objective("return", ObjectiveState::Success, ""),
            ],
        }
    }

    #[test]
    fn people_read_it() {
        let expected = "\
mission over: objectives failed, 1 of 2 objectives achieved in 331 s: an objective failed
  deliver  failed: B never answered; 6 steps, 1 replan; asked to enter A, B
  return   achieved; 6 steps, 1 replan; asked to enter A, B";
        assert_eq!(text(&report()), expected);
    }

    #[test]
    fn a_mission_that_was_interrupted_tells_what_had_begun() {
        let mut report = report();
        report.set_outcome(MissionOutcome::Unspecified);
        report.reason = "interrupted".into();
        report.objectives[0].set_state(ObjectiveState::Waiting);
        report.objectives[0].reason.clear();
        report.objectives[1] = ObjectiveReport { name: "return".into(), ..Default::default() };
        let expected = "\
mission not finished, 0 of 2 objectives achieved: interrupted
  deliver  begun; 6 steps, 1 replan; asked to enter A, B
  return   not attempted; 0 steps, 0 replans";
        assert_eq!(text(&report), expected);
    }

    #[test]
    fn a_name_forges_no_line() {
        let mut report = report();
        report.objectives.truncate(1);
        report.objectives[0].name = "d\n  return  achieved".into();
        report.objectives[0].reason = "\u{1b}[2K".into();
        report.objectives[0].permissions = vec!["A\r".into()];
        let text = text(&report);
        let expected = "  d\\n  return  achieved  failed: \\u001b[2K; 6 steps, 1 replan; asked to enter A\\r";
        assert_eq!(text.lines().skip(1).collect::<Vec<_>>(), [expected]);
    }

    #[test]
    fn programs_read_it() {
        let json: serde_json::Value = serde_json::from_str(&json(&report())).unwrap();
        assert_eq!(json["outcome"], "MISSION_OUTCOME_FAILURE");
        assert_eq!(json["durationS"], 331.4);
        assert_eq!(json["objectives"][0]["state"], "OBJECTIVE_STATE_FAILURE");
        assert_eq!(json["objectives"][1]["planSteps"], 6);
    }
}
