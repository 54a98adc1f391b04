//! The conversions between the wire and the domain; the only place where one can fail.
//!
//! A number that is no number never gets past here.

use kittiwake_proto::v1;

use crate::area::{Area, AreaKind};
use crate::geometry::{Ned, NedVelocity};
use crate::skill::Goal;

/// A message that was well-formed and made no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Senseless {
    /// A field without which the message says nothing.
    #[error("`{0}` is missing")]
    Missing(&'static str),
    /// A number that is not one, or out of any sensible range.
    #[error("`{field}` is {value}, expected {expected}")]
    OutOfRange {
        /// The field's name.
        field: &'static str,
        /// What it held.
        value: String,
        /// What it may hold.
        expected: &'static str,
    },
}

impl From<Ned> for v1::Ned {
    fn from(it: Ned) -> v1::Ned {
        v1::Ned { north_m: it.north_m, east_m: it.east_m, down_m: it.down_m }
    }
}

impl TryFrom<v1::Ned> for Ned {
    type Error = Senseless;
    fn try_from(it: v1::Ned) -> Result<Ned, Senseless> {
        let ned = Ned::new(it.north_m, it.east_m, it.down_m);
        if ned.is_sound() { Ok(ned) } else { Err(out_of_range("position", ned, "metres within 1,000 km")) }
    }
}

impl From<NedVelocity> for v1::NedVelocity {
    fn from(it: NedVelocity) -> v1::NedVelocity {
        v1::NedVelocity { north_m_s: it.north_m_s, east_m_s: it.east_m_s, down_m_s: it.down_m_s }
    }
}

impl TryFrom<v1::NedVelocity> for NedVelocity {
    type Error = Senseless;
    fn try_from(it: v1::NedVelocity) -> Result<NedVelocity, Senseless> {
        let velocity = NedVelocity::new(it.north_m_s, it.east_m_s, it.down_m_s);
        if velocity.is_sound() { Ok(velocity) } else { Err(out_of_range("velocity", velocity, "below 1,000 m/s")) }
    }
}

impl From<Goal> for v1::SkillGoal {
    fn from(goal: Goal) -> v1::SkillGoal {
        use v1::skill_goal::Goal as G;
        let goal = match goal {
            Goal::Land => G::Land(v1::LandGoal {}),
            Goal::Takeoff { climb_m } => G::Takeoff(v1::TakeoffGoal { climb_m }),
            Goal::Stop => G::Stop(v1::StopGoal {}),
            Goal::Position { target, speed_limit_m_s, yaw_rad, hold_at_target } => {
                G::Position(v1::PositionGoal { target: Some(target.into()), speed_limit_m_s, yaw_rad, hold_at_target })
            }
            Goal::Velocity { velocity, yaw_rate_rad_s, timeout_s } => {
                G::Velocity(v1::VelocityGoal { velocity: Some(velocity.into()), yaw_rate_rad_s, timeout_s })
            }
        };
        v1::SkillGoal { goal: Some(goal) }
    }
}

impl TryFrom<v1::SkillGoal> for Goal {
    type Error = Senseless;
    fn try_from(it: v1::SkillGoal) -> Result<Goal, Senseless> {
        use v1::skill_goal::Goal as G;
        Ok(match it.goal.ok_or(Senseless::Missing("goal"))? {
            G::Land(_) => Goal::Land,
            G::Takeoff(it) => Goal::Takeoff { climb_m: positive("climb_m", it.climb_m)? },
            G::Stop(_) => Goal::Stop,
            G::Position(it) => Goal::Position {
                target: it.target.ok_or(Senseless::Missing("target"))?.try_into()?,
                speed_limit_m_s: positive("speed_limit_m_s", it.speed_limit_m_s)?,
                yaw_rad: it.yaw_rad.map(|it| finite("yaw_rad", it)).transpose()?,
                hold_at_target: it.hold_at_target,
            },
            G::Velocity(it) => Goal::Velocity {
                velocity: it.velocity.ok_or(Senseless::Missing("velocity"))?.try_into()?,
                yaw_rate_rad_s: it.yaw_rate_rad_s.map(|it| finite("yaw_rate_rad_s", it)).transpose()?,
                timeout_s: it.timeout_s.map(|it| positive("timeout_s", it)).transpose()?,
            },
        })
    }
}

impl From<&Area> for v1::Area {
    fn from(it: &Area) -> v1::Area {
        v1::Area {
            name: it.name.clone(),
            kind: match it.kind {
                AreaKind::Permission => v1::AreaKind::Permission,
                AreaKind::KeepOut => v1::AreaKind::KeepOut,
            } as i32,
            corners: it.corners.iter().map(|&it| it.into()).collect(),
            floor_m: it.floor_m,
            ceiling_m: it.ceiling_m,
            from_utc_ms: it.from_utc_ms,
            until_utc_ms: it.until_utc_ms,
        }
    }
}

impl TryFrom<v1::Area> for Area {
    type Error = Senseless;
    fn try_from(it: v1::Area) -> Result<Area, Senseless> {
        let kind = match it.kind() {
            v1::AreaKind::Permission => AreaKind::Permission,
            v1::AreaKind::KeepOut => AreaKind::KeepOut,
            v1::AreaKind::Unspecified => return Err(Senseless::Missing("kind")),
        };
        Ok(Area {
            name: it.name,
            kind,
            corners: it.corners.into_iter().map(Ned::try_from).collect::<Result<_, _>>()?,
            floor_m: it.floor_m.map(|it| finite("floor_m", it)).transpose()?,
            ceiling_m: it.ceiling_m.map(|it| finite("ceiling_m", it)).transpose()?,
            from_utc_ms: it.from_utc_ms,
            until_utc_ms: it.until_utc_ms,
        })
    }
}

/// `value` if it is a finite number.
pub fn finite(field: &'static str, value: f64) -> Result<f64, Senseless> {
    if value.is_finite() { Ok(value) } else { Err(out_of_range(field, value, "a finite number")) }
}

/// `value` if it is finite and more than zero.
pub fn positive(field: &'static str, value: f64) -> Result<f64, Senseless> {
    if value.is_finite() && 0.0 < value { Ok(value) } else { Err(out_of_range(field, value, "more than zero")) }
}

fn out_of_range(field: &'static str, value: impl std::fmt::Debug, expected: &'static str) -> Senseless {
    Senseless::OutOfRange { field, value: format!("{value:?}"), expected }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_survives_the_wire() {
        #[track_caller]
        fn check(goal: Goal) {
            assert_eq!(Goal::try_from(v1::SkillGoal::from(goal)), Ok(goal));
        }
        check(Goal::Land);
        check(Goal::Stop);
        check(Goal::Takeoff { climb_m: 10.0 });
        check(Goal::Position {
            target: Ned::new(1.0, 2.0, -3.0),
            speed_limit_m_s: 5.0,
            yaw_rad: Some(1.0),
            hold_at_target: true,
        });
        check(Goal::Velocity { velocity: NedVelocity::new(1.0, 0.0, 0.0), yaw_rate_rad_s: None, timeout_s: None });
    }

    #[test]
    fn what_is_no_number_never_becomes_a_goal() {
        #[track_caller]
        fn check(goal: Goal) {
            assert!(Goal::try_from(v1::SkillGoal::from(goal)).is_err(), "{goal:?}");
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
        assert_eq!(Goal::try_from(v1::SkillGoal { goal: None }), Err(Senseless::Missing("goal")));
    }
}
