//! Objectives, and how a mission ended.

use kittiwake_proto::v1;

use super::{InvalidMessage, duration, feeds_to_wire, finite};
use crate::geometry::Ned;
use crate::mission::terms::{Order, Terms};
use crate::mission::{
    Mission, MissionOutcome, MissionReport, Objective, ObjectiveReport, ObjectiveStatus, Progress, ReleaseProgress,
};
use crate::survey::Survey;
use crate::task::Task;

fn from_progress(progress: Progress) -> (v1::ObjectiveState, String) {
    match progress {
        Progress::Waiting => (v1::ObjectiveState::Waiting, String::new()),
        Progress::Success => (v1::ObjectiveState::Success, String::new()),
        Progress::Failure(reason) => (v1::ObjectiveState::Failure, reason),
    }
}

fn to_progress(state: v1::ObjectiveState, reason: String) -> Result<Progress, InvalidMessage> {
    match state {
        v1::ObjectiveState::Unspecified => Err(InvalidMessage::Missing("state")),
        v1::ObjectiveState::Waiting => Ok(Progress::Waiting),
        v1::ObjectiveState::Success => Ok(Progress::Success),
        v1::ObjectiveState::Failure => Ok(Progress::Failure(reason)),
    }
}

impl From<ObjectiveStatus> for v1::Objective {
    fn from(status: ObjectiveStatus) -> v1::Objective {
        let (state, reason) = from_progress(status.progress);
        let terms = status.objective.terms;
        v1::Objective {
            name: status.objective.name,
            position: Some(status.objective.position.into()),
            flying: status.objective.flying,
            state: state as i32,
            reason,
            plan_steps: status.plan_steps,
            replans: status.replans,
            permissions: status.permissions,
            worth: terms.worth,
            after: terms.after,
            reach_within_s: terms.within.map(|it| it.as_secs_f64()),
            reach_by_utc_ms: terms.by_utc_ms,
            dwell_s: terms.dwell.as_secs_f64(),
            survey: status.objective.survey.map(Into::into),
            drop: terms.drop,
            land_on_target: terms.land_on_target,
            actions: terms.actions,
            tasks: terms.tasks.iter().map(Into::into).collect(),
            tasks_done: status.tasks_done as u32,
            along: terms.along.iter().map(Into::into).collect(),
            along_failure: status.along_failure.unwrap_or_default(),
            release: v1::ReleaseProgress::from(status.release) as i32,
        }
    }
}

impl From<ReleaseProgress> for v1::ReleaseProgress {
    fn from(release: ReleaseProgress) -> v1::ReleaseProgress {
        match release {
            ReleaseProgress::NotPlanned => v1::ReleaseProgress::Unspecified,
            ReleaseProgress::Planned => v1::ReleaseProgress::Planned,
            ReleaseProgress::Seen => v1::ReleaseProgress::Seen,
        }
    }
}

impl From<v1::ReleaseProgress> for ReleaseProgress {
    fn from(release: v1::ReleaseProgress) -> ReleaseProgress {
        match release {
            v1::ReleaseProgress::Unspecified => ReleaseProgress::NotPlanned,
            v1::ReleaseProgress::Planned => ReleaseProgress::Planned,
            v1::ReleaseProgress::Seen => ReleaseProgress::Seen,
        }
    }
}

/// As it is before the flight.
impl From<&Mission> for v1::MissionStatus {
    fn from(mission: &Mission) -> v1::MissionStatus {
        v1::MissionStatus {
            mission: mission.name.clone(),
            objectives: mission.objectives.iter().map(|it| ObjectiveStatus::waiting(it).into()).collect(),
            areas: mission.areas.iter().map(Into::into).collect(),
            free_order: mission.order == Order::Free,
            sites: mission.sites.iter().map(Into::into).collect(),
            origin: mission.origin.map(Into::into),
            feeds: feeds_to_wire(&mission.feeds, &mission.areas),
            ..v1::MissionStatus::default()
        }
    }
}

impl From<Survey> for v1::Survey {
    fn from(survey: Survey) -> v1::Survey {
        v1::Survey {
            corners: survey.corners().iter().map(|it| (*it).into()).collect(),
            spacing_m: survey.spacing_m(),
            picture_distance_m: survey.picture_distance_m(),
            heading_deg: survey.heading_deg(),
            passed: survey.passed() as u32,
        }
    }
}

impl TryFrom<v1::Survey> for Survey {
    type Error = InvalidMessage;
    fn try_from(survey: v1::Survey) -> Result<Survey, InvalidMessage> {
        let corners = survey.corners.into_iter().map(Ned::try_from).collect::<Result<_, _>>()?;
        let lines = Survey::new(corners, survey.spacing_m, survey.heading_deg)?;
        Ok(lines.with_pictures(survey.picture_distance_m)?.with_passed(survey.passed as usize))
    }
}

impl TryFrom<v1::Objective> for ObjectiveStatus {
    type Error = InvalidMessage;
    fn try_from(status: v1::Objective) -> Result<ObjectiveStatus, InvalidMessage> {
        let (state, release) = (status.state(), status.release().into());
        let position = Ned::try_from(status.position.ok_or(InvalidMessage::Missing("position"))?)?;
        let survey = status.survey.map(Survey::try_from).transpose()?;
        let end = survey.as_ref().and_then(|it| it.turns().last()).map(|it| it.at.at_height(position.height_m()));
        let terms = Terms {
            worth: status.worth.map(|it| finite("worth", it)).transpose()?,
            after: status.after,
            within: status.reach_within_s.map(|it| duration("reach_within_s", it)).transpose()?,
            by_utc_ms: status.reach_by_utc_ms,
            dwell: duration("dwell_s", status.dwell_s)?,
            drop: status.drop,
            land_on_target: status.land_on_target,
            actions: status.actions,
            tasks: status.tasks.into_iter().map(Task::try_from).collect::<Result<_, _>>()?,
            along: status.along.into_iter().map(Task::try_from).collect::<Result<_, _>>()?,
        };
        Ok(ObjectiveStatus {
            objective: Objective {
                name: status.name,
                position: end.unwrap_or(position),
                // A survey on the ground would never be over, and no load is dropped there.
                flying: status.flying || survey.is_some() || terms.drop,
                terms,
                survey,
            },
            progress: to_progress(state, status.reason)?,
            plan_steps: status.plan_steps,
            replans: status.replans,
            permissions: status.permissions,
            release,
            tasks_done: status.tasks_done as usize,
            along_failure: Some(status.along_failure).filter(|it| !it.is_empty()),
        })
    }
}

impl From<MissionOutcome> for v1::MissionOutcome {
    fn from(outcome: MissionOutcome) -> v1::MissionOutcome {
        match outcome {
            MissionOutcome::Success => v1::MissionOutcome::Success,
            MissionOutcome::Failure => v1::MissionOutcome::Failure,
            MissionOutcome::Emergency => v1::MissionOutcome::Emergency,
            MissionOutcome::Crash => v1::MissionOutcome::Crash,
        }
    }
}

impl TryFrom<v1::MissionOutcome> for MissionOutcome {
    type Error = InvalidMessage;
    fn try_from(outcome: v1::MissionOutcome) -> Result<MissionOutcome, InvalidMessage> {
        match outcome {
            v1::MissionOutcome::Unspecified => Err(InvalidMessage::Missing("outcome")),
            v1::MissionOutcome::Success => Ok(MissionOutcome::Success),
            v1::MissionOutcome::Failure => Ok(MissionOutcome::Failure),
            v1::MissionOutcome::Emergency => Ok(MissionOutcome::Emergency),
            v1::MissionOutcome::Crash => Ok(MissionOutcome::Crash),
        }
    }
}

impl From<MissionReport> for v1::MissionReport {
    fn from(report: MissionReport) -> v1::MissionReport {
        let objective = |it: ObjectiveReport| {
            let (state, reason) = from_progress(it.progress);
            v1::ObjectiveReport {
                name: it.name,
                state: state as i32,
                reason,
                plan_steps: it.plan_steps,
                replans: it.replans,
                permissions: it.permissions,
            }
        };
        v1::MissionReport {
            outcome: v1::MissionOutcome::from(report.outcome) as i32,
            reason: report.reason,
            vehicle: report.vehicle,
            mission: report.mission,
            duration_s: report.duration_s,
            objectives: report.objectives.into_iter().map(objective).collect(),
        }
    }
}

impl TryFrom<v1::MissionReport> for MissionReport {
    type Error = InvalidMessage;
    fn try_from(report: v1::MissionReport) -> Result<MissionReport, InvalidMessage> {
        let objective = |it: v1::ObjectiveReport| {
            Ok(ObjectiveReport {
                progress: to_progress(it.state(), it.reason)?,
                name: it.name,
                plan_steps: it.plan_steps,
                replans: it.replans,
                permissions: it.permissions,
            })
        };
        Ok(MissionReport {
            outcome: report.outcome().try_into()?,
            reason: report.reason,
            vehicle: report.vehicle,
            mission: report.mission,
            duration_s: super::finite("duration_s", report.duration_s)?,
            objectives: report.objectives.into_iter().map(objective).collect::<Result<_, InvalidMessage>>()?,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::generators::{name, ned};
    use super::*;

    fn progress() -> impl Strategy<Value = Progress> {
        prop_oneof![Just(Progress::Waiting), Just(Progress::Success), name().prop_map(Progress::Failure)]
    }

    fn terms() -> impl Strategy<Value = Terms> {
        let time = || (0..1_000_000u64).prop_map(Duration::from_millis);
        let worth = prop::option::of(0.0..1e6);
        let after = prop::collection::vec(name(), 0..3);
        let tasks = || prop::collection::vec(super::super::task::tests::task(), 0..3);
        let payload = (any::<bool>(), prop::collection::vec(name(), 0..3), tasks(), tasks());
        (worth, after, prop::option::of(time()), prop::option::of(any::<i64>()), time(), payload, any::<bool>())
            .prop_map(|(worth, after, within, by_utc_ms, dwell, (drop, actions, tasks, along), land_on_target)| Terms {
                worth,
                after,
                within,
                by_utc_ms,
                dwell,
                drop,
                land_on_target,
                actions,
                tasks,
                along,
            })
    }

    fn survey() -> impl Strategy<Value = Survey> {
        let sides = (-500.0..500.0, -500.0..500.0, 10.0..300.0, 10.0..300.0);
        let pictures = prop::option::of(0.1..100.0);
        (sides, 5.0..50.0, prop::option::of(-360.0..360.0), pictures, 0..300_usize).prop_map(
            |((north_m, east_m, length_m, width_m), spacing_m, heading_deg, picture_distance_m, passed)| {
                let corner = |north: f64, east: f64| Ned::new(north_m + north * length_m, east_m + east * width_m, 0.0);
                let corners = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
                let lines = Survey::new(corners, spacing_m, heading_deg).expect("a rectangle");
                lines.with_pictures(picture_distance_m).expect("in range").with_passed(passed)
            },
        )
    }

    pub(crate) fn objective() -> impl Strategy<Value = ObjectiveStatus> {
        let names = prop::collection::vec(name(), 0..3);
        let place = (ned(), prop::option::of(survey()), any::<bool>());
        let release = [ReleaseProgress::NotPlanned, ReleaseProgress::Planned, ReleaseProgress::Seen];
        let release = prop::sample::select(release.to_vec());
        let failure = prop::option::of(name().prop_filter("none is empty", |it| !it.is_empty()));
        let counts = (any::<u32>(), any::<u32>(), release, 0..5_usize, failure);
        (name(), place, terms(), progress(), counts, names).prop_map(
            |(name, (position, survey, flying), terms, progress, counts, permissions)| {
                let (plan_steps, replans, release, tasks_done, along_failure) = counts;
                let end =
                    survey.as_ref().and_then(|it| it.turns().last()).map(|it| it.at.at_height(position.height_m()));
                let position = end.unwrap_or(position);
                let flying = flying || survey.is_some() || terms.drop;
                ObjectiveStatus {
                    objective: Objective { name, position, flying, terms, survey },
                    progress,
                    plan_steps,
                    replans,
                    permissions,
                    release,
                    tasks_done,
                    along_failure,
                }
            },
        )
    }

    fn report() -> impl Strategy<Value = MissionReport> {
        use MissionOutcome::*;
        let outcome = prop::sample::select(vec![Success, Failure, Emergency, Crash]);
        let objective = (name(), progress(), any::<u32>(), any::<u32>(), prop::collection::vec(name(), 0..3)).prop_map(
            |(name, progress, plan_steps, replans, permissions)| ObjectiveReport {
                name,
                progress,
                plan_steps,
                replans,
                permissions,
            },
        );
        (outcome, name(), name(), name(), 0.0..1e6, prop::collection::vec(objective, 0..3)).prop_map(
            |(outcome, reason, vehicle, mission, duration_s, objectives)| MissionReport {
                outcome,
                reason,
                vehicle,
                mission,
                duration_s,
                objectives,
            },
        )
    }

    proptest! {
        #[test]
        fn objectives_and_reports_survive_the_wire(objective in objective(), report in report()) {
            prop_assert_eq!(ObjectiveStatus::try_from(v1::Objective::from(objective.clone())), Ok(objective));
            prop_assert_eq!(MissionReport::try_from(v1::MissionReport::from(report.clone())), Ok(report));
        }
    }
}
