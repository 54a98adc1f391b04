//! Goals, events and states of skills.

use std::sync::Arc;

use kittiwake_proto::v1;

use super::{InvalidMessage, finite, positive};
use crate::skill::{Goal, SkillEvent, SkillKind, SkillOutcome, SkillPhase};

impl From<SkillKind> for v1::SkillKind {
    fn from(kind: SkillKind) -> v1::SkillKind {
        match kind {
            SkillKind::Land => v1::SkillKind::Land,
            SkillKind::Takeoff => v1::SkillKind::Takeoff,
            SkillKind::Stop => v1::SkillKind::Stop,
            SkillKind::Offboard => v1::SkillKind::Offboard,
            SkillKind::Release => v1::SkillKind::Release,
            SkillKind::Task => v1::SkillKind::Task,
        }
    }
}

impl TryFrom<v1::SkillKind> for SkillKind {
    type Error = InvalidMessage;
    fn try_from(kind: v1::SkillKind) -> Result<SkillKind, InvalidMessage> {
        match kind {
            v1::SkillKind::Unspecified => Err(InvalidMessage::Missing("kind")),
            v1::SkillKind::Land => Ok(SkillKind::Land),
            v1::SkillKind::Takeoff => Ok(SkillKind::Takeoff),
            v1::SkillKind::Stop => Ok(SkillKind::Stop),
            v1::SkillKind::Offboard => Ok(SkillKind::Offboard),
            v1::SkillKind::Release => Ok(SkillKind::Release),
            v1::SkillKind::Task => Ok(SkillKind::Task),
        }
    }
}

impl From<SkillOutcome> for v1::SkillOutcome {
    fn from(outcome: SkillOutcome) -> v1::SkillOutcome {
        match outcome {
            SkillOutcome::Succeeded => v1::SkillOutcome::Succeeded,
            SkillOutcome::Failed => v1::SkillOutcome::Failed,
            SkillOutcome::Cancelled => v1::SkillOutcome::Cancelled,
            SkillOutcome::Aborted => v1::SkillOutcome::Aborted,
            SkillOutcome::Preempted => v1::SkillOutcome::Preempted,
            SkillOutcome::Rejected => v1::SkillOutcome::Rejected,
            SkillOutcome::TimedOut => v1::SkillOutcome::TimedOut,
        }
    }
}

impl TryFrom<v1::SkillOutcome> for SkillOutcome {
    type Error = InvalidMessage;
    fn try_from(outcome: v1::SkillOutcome) -> Result<SkillOutcome, InvalidMessage> {
        match outcome {
            v1::SkillOutcome::Unspecified => Err(InvalidMessage::Missing("outcome")),
            v1::SkillOutcome::Succeeded => Ok(SkillOutcome::Succeeded),
            v1::SkillOutcome::Failed => Ok(SkillOutcome::Failed),
            v1::SkillOutcome::Cancelled => Ok(SkillOutcome::Cancelled),
            v1::SkillOutcome::Aborted => Ok(SkillOutcome::Aborted),
            v1::SkillOutcome::Preempted => Ok(SkillOutcome::Preempted),
            v1::SkillOutcome::Rejected => Ok(SkillOutcome::Rejected),
            v1::SkillOutcome::TimedOut => Ok(SkillOutcome::TimedOut),
        }
    }
}

impl From<Goal> for v1::SkillGoal {
    fn from(goal: Goal) -> v1::SkillGoal {
        use v1::skill_goal::Goal as G;
        let goal = match goal {
            Goal::Land | Goal::LandOnTarget => G::Land(v1::LandGoal { on_target: goal == Goal::LandOnTarget }),
            Goal::Takeoff { climb_m } => G::Takeoff(v1::TakeoffGoal { climb_m }),
            Goal::Stop => G::Stop(v1::StopGoal {}),
            Goal::Position { target, speed_limit_m_s, yaw_rad, hold_at_target } => {
                G::Position(v1::PositionGoal { target: Some(target.into()), speed_limit_m_s, yaw_rad, hold_at_target })
            }
            Goal::Velocity { velocity, yaw_rate_rad_s, timeout_s } => {
                G::Velocity(v1::VelocityGoal { velocity: Some(velocity.into()), yaw_rate_rad_s, timeout_s })
            }
            Goal::Release { over } => G::Release(v1::ReleaseGoal { over: Some(over.into()) }),
            Goal::Task(it) => G::Task(it.as_ref().into()),
        };
        v1::SkillGoal { goal: Some(goal) }
    }
}

impl TryFrom<v1::SkillGoal> for Goal {
    type Error = InvalidMessage;
    fn try_from(it: v1::SkillGoal) -> Result<Goal, InvalidMessage> {
        use v1::skill_goal::Goal as G;
        Ok(match it.goal.ok_or(InvalidMessage::Missing("goal"))? {
            G::Land(it) if it.on_target => Goal::LandOnTarget,
            G::Land(_) => Goal::Land,
            G::Takeoff(it) => Goal::Takeoff { climb_m: positive("climb_m", it.climb_m)? },
            G::Stop(_) => Goal::Stop,
            G::Position(it) => Goal::Position {
                target: it.target.ok_or(InvalidMessage::Missing("target"))?.try_into()?,
                speed_limit_m_s: positive("speed_limit_m_s", it.speed_limit_m_s)?,
                yaw_rad: it.yaw_rad.map(|it| finite("yaw_rad", it)).transpose()?,
                hold_at_target: it.hold_at_target,
            },
            G::Velocity(it) => Goal::Velocity {
                velocity: it.velocity.ok_or(InvalidMessage::Missing("velocity"))?.try_into()?,
                yaw_rate_rad_s: it.yaw_rate_rad_s.map(|it| finite("yaw_rate_rad_s", it)).transpose()?,
                timeout_s: it.timeout_s.map(|it| positive("timeout_s", it)).transpose()?,
            },
            G::Release(it) => Goal::Release { over: it.over.ok_or(InvalidMessage::Missing("over"))?.try_into()? },
            G::Task(it) => Goal::Task(Arc::new(it.try_into()?)),
        })
    }
}

impl From<SkillEvent> for v1::SkillEvent {
    fn from(event: SkillEvent) -> v1::SkillEvent {
        let (state, outcome) = match event.phase {
            SkillPhase::ProcessRequest => (v1::SkillState::ProcessRequest, v1::SkillOutcome::Unspecified),
            SkillPhase::Execute => (v1::SkillState::Execute, v1::SkillOutcome::Unspecified),
            SkillPhase::Cancel => (v1::SkillState::Cancel, v1::SkillOutcome::Unspecified),
            SkillPhase::Closing => (v1::SkillState::Abort, v1::SkillOutcome::Unspecified),
            SkillPhase::Ended(outcome) => (v1::SkillState::Ended, outcome.into()),
        };
        v1::SkillEvent {
            skill_id: event.skill_id,
            request_id: event.request_id,
            kind: v1::SkillKind::from(event.kind) as i32,
            state: state as i32,
            outcome: outcome as i32,
            reason: event.reason,
            position: event.position.map(Into::into),
            velocity: event.velocity.map(Into::into),
            position_timestamp_us: event.position_timestamp_us,
            landed_timestamp_us: event.landed_timestamp_us,
            flown_by_other: event.flown_by_other,
            results: Vec::new(),
            along: event.along,
        }
    }
}

impl TryFrom<v1::SkillEvent> for SkillEvent {
    type Error = InvalidMessage;
    fn try_from(event: v1::SkillEvent) -> Result<SkillEvent, InvalidMessage> {
        let phase = match event.state() {
            v1::SkillState::Unspecified => return Err(InvalidMessage::Missing("state")),
            v1::SkillState::ProcessRequest => SkillPhase::ProcessRequest,
            v1::SkillState::Execute => SkillPhase::Execute,
            v1::SkillState::Cancel => SkillPhase::Cancel,
            v1::SkillState::Report | v1::SkillState::Abort => SkillPhase::Closing,
            v1::SkillState::Ended => SkillPhase::Ended(event.outcome().try_into()?),
        };
        Ok(SkillEvent {
            skill_id: event.skill_id,
            kind: event.kind().try_into()?,
            phase,
            request_id: event.request_id,
            reason: event.reason,
            position: event.position.map(TryInto::try_into).transpose()?,
            velocity: event.velocity.map(TryInto::try_into).transpose()?,
            position_timestamp_us: event.position_timestamp_us,
            landed_timestamp_us: event.landed_timestamp_us,
            flown_by_other: event.flown_by_other,
            along: event.along,
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::super::generators::{name, ned, velocity};
    use super::*;
    use crate::geometry::{Ned, NedVelocity};
    use crate::task::{Stance, TaskGoal};
    use crate::wire::task::tests::task;

    pub(crate) fn task_goal() -> impl Strategy<Value = TaskGoal> {
        let stance = prop::sample::select(vec![Stance::Hovers, Stance::Flies, Stance::Stands]);
        (ned(), stance, task(), 0.0..100.0, 0.1..100.0, name()).prop_map(
            |(over, stance, task, estimate_s, limit_s, outcome)| {
                let (power_w, interrupt_s, succeeds_as) = (estimate_s, estimate_s / 10.0, vec![outcome]);
                TaskGoal { over, stance, task, estimate_s, power_w, limit_s, interrupt_s, succeeds_as }
            },
        )
    }

    pub(crate) fn goal() -> impl Strategy<Value = Goal> {
        let position = (ned(), 0.1..20.0, prop::option::of(-3.0..3.0), any::<bool>()).prop_map(
            |(target, speed_limit_m_s, yaw_rad, hold_at_target)| Goal::Position {
                target,
                speed_limit_m_s,
                yaw_rad,
                hold_at_target,
            },
        );
        let velocity = (velocity(), prop::option::of(-1.0..1.0), prop::option::of(0.1..100.0))
            .prop_map(|(velocity, yaw_rate_rad_s, timeout_s)| Goal::Velocity { velocity, yaw_rate_rad_s, timeout_s });
        let takeoff = (0.1..100.0).prop_map(|climb_m| Goal::Takeoff { climb_m });
        let release = ned().prop_map(|over| Goal::Release { over });
        let task = task_goal().prop_map(|it| Goal::Task(Arc::new(it)));
        prop_oneof![
            Just(Goal::Land),
            Just(Goal::LandOnTarget),
            Just(Goal::Stop),
            takeoff,
            position,
            velocity,
            release,
            task
        ]
    }

    fn event() -> impl Strategy<Value = SkillEvent> {
        use SkillKind as K;
        use SkillOutcome as O;
        let outcomes = [O::Succeeded, O::Failed, O::Cancelled, O::Aborted, O::Preempted, O::Rejected, O::TimedOut];
        let phase = prop_oneof![
            Just(SkillPhase::ProcessRequest),
            Just(SkillPhase::Execute),
            Just(SkillPhase::Cancel),
            Just(SkillPhase::Closing),
            prop::sample::select(outcomes.to_vec()).prop_map(SkillPhase::Ended),
        ];
        let kind = prop::sample::select(vec![K::Land, K::Takeoff, K::Stop, K::Offboard, K::Release, K::Task]);
        let place = (prop::option::of(ned()), prop::option::of(velocity()), any::<u64>(), any::<u64>(), any::<bool>());
        let words = (name(), name());
        (any::<u64>(), name(), kind, phase, words, place).prop_map(
            |(skill_id, request_id, kind, phase, (reason, along), (position, velocity, measured, landed, by_other))| {
                SkillEvent {
                    skill_id,
                    request_id,
                    kind,
                    phase,
                    reason,
                    position,
                    velocity,
                    position_timestamp_us: measured,
                    landed_timestamp_us: landed,
                    flown_by_other: by_other,
                    along,
                }
            },
        )
    }

    proptest! {
        #[test]
        fn goals_and_events_survive_the_wire(goal in goal(), event in event()) {
            prop_assert_eq!(Goal::try_from(v1::SkillGoal::from(goal.clone())), Ok(goal));
            prop_assert_eq!(SkillEvent::try_from(v1::SkillEvent::from(event.clone())), Ok(event));
        }
    }

    #[test]
    fn a_goal_that_cannot_be_flown_is_refused() {
        #[track_caller]
        fn check(goal: Goal) {
            assert!(Goal::try_from(v1::SkillGoal::from(goal.clone())).is_err(), "{goal:?}");
        }
        check(Goal::Takeoff { climb_m: f64::NAN });
        check(Goal::Takeoff { climb_m: -1.0 });
        check(Goal::Position {
            target: Ned::new(f64::INFINITY, 0.0, 0.0),
            speed_limit_m_s: 5.0,
            yaw_rad: None,
            hold_at_target: false,
        });
        check(Goal::Velocity { velocity: NedVelocity::new(0.0, f64::NAN, 0.0), yaw_rate_rad_s: None, timeout_s: None });
        check(Goal::Release { over: Ned::new(0.0, f64::NAN, 0.0) });
        let nowhere = v1::skill_goal::Goal::Release(v1::ReleaseGoal { over: None });
        assert_eq!(Goal::try_from(v1::SkillGoal { goal: Some(nowhere) }), Err(InvalidMessage::Missing("over")));
        assert_eq!(Goal::try_from(v1::SkillGoal { goal: None }), Err(InvalidMessage::Missing("goal")));
    }
}
