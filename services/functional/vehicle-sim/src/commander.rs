//! Which commands the autopilot accepts: one table, and a reason for every refusal.
//!
//! Accepting a command says that it will be tried. The status shows what follows.

use domain::fmu::Command;
use domain::wire::InvalidMessage;

use crate::failsafe::FailsafeCause;

/// A takeoff ends at least this much above where the vehicle stands.
const LEAST_CLIMB_M: f64 = 0.5;

/// Where the vehicle is between standing and flying, as far as commands are concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// The motors are off.
    Disarmed,
    /// Armed on the ground.
    OnGround,
    /// Anything else.
    InAir,
}

/// What the answer to a command depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Situation {
    /// Standing or flying.
    pub(crate) phase: Phase,
    /// Estimated height above the origin.
    pub(crate) height_m: f64,
    /// Whether setpoints and proof of life are fresh.
    pub(crate) setpoints: bool,
    /// What forbids a takeoff, the worst if there is more than one.
    pub(crate) unfit: Option<FailsafeCause>,
}

/// Why a command is rejected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Refusal {
    /// It says nothing, a number in it is not one, or the mode has a command of its own.
    #[error("the command is invalid: {0}")]
    Invalid(InvalidMessage),
    /// The command needs running motors.
    #[error("the vehicle is disarmed")]
    Disarmed,
    /// The command is for a vehicle on the ground.
    #[error("the vehicle is in the air")]
    InAir,
    /// The command is for a vehicle in the air.
    #[error("the vehicle is on the ground")]
    OnGround,
    /// A takeoff to where the vehicle already is.
    #[error("a takeoff to {target_m:.1} m is not a climb from {height_m:.1} m")]
    NoClimb {
        /// The height that was asked for.
        target_m: f64,
        /// Where the vehicle stands.
        height_m: f64,
    },
    /// The mode offboard follows setpoints, and there are none.
    #[error("there are no fresh offboard setpoints")]
    NoSetpoints,
    /// A failure forbids it.
    #[error("{0}")]
    Unfit(FailsafeCause),
    /// Its own checks forbid arming.
    #[error("{0}")]
    NotReady(String),
    /// A fault of the simulator.
    #[error("an injected fault rejects it")]
    Injected,
}

/// Whether `command` is accepted in `situation`.
///
/// A command whose effect already holds is accepted, so that a sender may repeat it when the
/// acknowledgement was lost. PX4's users know two special cases: a landing on the ground is
/// rejected, since there is nothing to land; a second disarming is accepted, since it does no harm.
pub(crate) fn judge(command: Command, situation: &Situation) -> Result<(), Refusal> {
    use {Command as C, Phase as P};
    let fit = situation.unfit.map_or(Ok(()), |it| Err(Refusal::Unfit(it)));
    match (command, situation.phase) {
        (C::Arm, P::Disarmed) => fit,
        (C::Arm, P::OnGround | P::InAir) => Ok(()),
        (C::Disarm, P::Disarmed | P::OnGround) => Ok(()),
        (C::Disarm, P::InAir) => Err(Refusal::InAir),
        (C::Takeoff { .. }, P::Disarmed) => Err(Refusal::Disarmed),
        (C::Takeoff { .. }, P::InAir) => Err(Refusal::InAir),
        (C::Takeoff { height_m }, P::OnGround) if height_m < situation.height_m + LEAST_CLIMB_M => {
            Err(Refusal::NoClimb { target_m: height_m, height_m: situation.height_m })
        }
        (C::Takeoff { .. }, P::OnGround) => fit,
        (C::Land | C::LandOnTarget, P::Disarmed | P::OnGround) => Err(Refusal::OnGround),
        (C::Land | C::LandOnTarget, P::InAir) => Ok(()),
        (C::Loiter, P::Disarmed | P::OnGround) => Ok(()),
        (C::Loiter, P::InAir) => fit,
        (C::Offboard, _) if !situation.setpoints => Err(Refusal::NoSetpoints),
        (C::Offboard, P::Disarmed) => Ok(()),
        (C::Offboard, P::OnGround | P::InAir) => fit,
        // Like a real one, it opens anywhere on command: the sender must see that the place is right.
        (C::Release, _) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Phase::{Disarmed, InAir, OnGround};

    const FIT: Situation = Situation { phase: Disarmed, height_m: 0.1, setpoints: true, unfit: None };

    #[test]
    fn every_command_in_every_phase() {
        #[track_caller]
        fn check(command: Command, accepted_in: &[Phase]) {
            for phase in [Disarmed, OnGround, InAir] {
                let answer = judge(command, &Situation { phase, ..FIT });
                assert_eq!(answer.is_ok(), accepted_in.contains(&phase), "{command:?} {phase:?}: {answer:?}");
            }
        }
        check(Command::Arm, &[Disarmed, OnGround, InAir]);
        check(Command::Disarm, &[Disarmed, OnGround]);
        check(Command::Takeoff { height_m: 10.0 }, &[OnGround]);
        check(Command::Takeoff { height_m: 0.2 }, &[]);
        check(Command::Land, &[InAir]);
        check(Command::Loiter, &[Disarmed, OnGround, InAir]);
        check(Command::Offboard, &[Disarmed, OnGround, InAir]);
        check(Command::Release, &[Disarmed, OnGround, InAir]);
    }

    #[test]
    fn a_vehicle_that_is_unfit_is_not_armed_and_only_lands() {
        #[track_caller]
        fn check(command: Command, accepted_in: &[Phase]) {
            for phase in [Disarmed, OnGround, InAir] {
                let answer = judge(command, &Situation { phase, unfit: Some(FailsafeCause::MotorFailed), ..FIT });
                assert_eq!(answer.is_ok(), accepted_in.contains(&phase), "{command:?} {phase:?}: {answer:?}");
            }
        }
        check(Command::Arm, &[OnGround, InAir]);
        check(Command::Disarm, &[Disarmed, OnGround]);
        check(Command::Takeoff { height_m: 10.0 }, &[]);
        check(Command::Land, &[InAir]);
        check(Command::Loiter, &[Disarmed, OnGround]);
        check(Command::Offboard, &[Disarmed]);
    }

    #[test]
    fn offboard_needs_setpoints() {
        for phase in [Disarmed, OnGround, InAir] {
            let without = Situation { phase, setpoints: false, ..FIT };
            assert_eq!(judge(Command::Offboard, &without), Err(Refusal::NoSetpoints));
        }
    }
}
