//! Which commands the autopilot takes: one table, every refusal with its reason.
//!
//! Accepting a command says that it will be tried. What came of it shows in the status.

use domain::wire::{Senseless, finite};
use kittiwake_proto::v1;

use crate::failsafe::Condition;

/// A takeoff goes at least this much above where the vehicle stands.
const LEAST_CLIMB_M: f64 = 0.5;

/// A command, checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Let the motors turn.
    Arm,
    /// Stop them.
    Disarm,
    /// Climb straight up.
    Takeoff {
        /// To this height above the origin.
        altitude_m: f64,
    },
    /// Land where the vehicle is.
    Land,
    /// Come to rest and stay.
    Loiter,
    /// Follow setpoints.
    Offboard,
}

/// Where the vehicle is between standing and flying, as far as commands are concerned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Motors off.
    Disarmed,
    /// Armed on the ground.
    OnGround,
    /// Anything else.
    InAir,
}

/// What an answer depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Situation {
    /// Standing or flying.
    pub phase: Phase,
    /// Estimated height above the origin.
    pub height_m: f64,
    /// Whether setpoints and proof of life are fresh.
    pub setpoints: bool,
    /// What forbids to take off, the worst if there is more than one.
    pub unfit: Option<Condition>,
}

/// Why a command is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// It says nothing, or a number in it is none.
    #[error("the command makes no sense: {0}")]
    Senseless(Senseless),
    /// This mode has a command of its own.
    #[error("the mode cannot be set: only LOITER and OFFBOARD can")]
    NoSuchMode,
    /// It takes motors.
    #[error("the vehicle is disarmed")]
    Disarmed,
    /// It takes ground.
    #[error("the vehicle is in the air")]
    InAir,
    /// It takes air.
    #[error("the vehicle is on the ground")]
    OnGround,
    /// A takeoff to where the vehicle already is.
    #[error("a takeoff to {altitude_m:.1} m is no climb from {height_m:.1} m")]
    NoClimb {
        /// Asked for.
        altitude_m: f64,
        /// Where the vehicle stands.
        height_m: f64,
    },
    /// Offboard mode follows setpoints, and there are none.
    #[error("there are no fresh offboard setpoints")]
    NoSetpoints,
    /// A failure forbids it.
    #[error("{0}")]
    Unfit(Condition),
    /// A fault says so.
    #[error("an injected fault rejects it")]
    Injected,
}

impl TryFrom<v1::VehicleCommand> for Command {
    type Error = Refusal;
    fn try_from(it: v1::VehicleCommand) -> Result<Command, Refusal> {
        use v1::vehicle_command::Command as C;
        match it.command.ok_or(Refusal::Senseless(Senseless::Missing("command")))? {
            C::Arm(_) => Ok(Command::Arm),
            C::Disarm(_) => Ok(Command::Disarm),
            C::Takeoff(it) => finite("altitude_m", it.altitude_m)
                .map(|altitude_m| Command::Takeoff { altitude_m })
                .map_err(Refusal::Senseless),
            C::Land(_) => Ok(Command::Land),
            C::SetMode(it) => match it.mode() {
                v1::FlightMode::Loiter => Ok(Command::Loiter),
                v1::FlightMode::Offboard => Ok(Command::Offboard),
                v1::FlightMode::Unspecified
                | v1::FlightMode::Takeoff
                | v1::FlightMode::Land
                | v1::FlightMode::Return => Err(Refusal::NoSuchMode),
            },
        }
    }
}

/// Whether `command` makes sense in `situation`.
///
/// A command whose effect already holds is accepted, so that one may be repeated when its
/// acknowledgement was lost. Landing and disarming on the ground are the exceptions PX4's users
/// would notice: there is nothing to land, whereas disarming twice does no harm.
pub fn judge(command: Command, situation: &Situation) -> Result<(), Refusal> {
    use {Command as C, Phase as P};
    let fit = situation.unfit.map_or(Ok(()), |it| Err(Refusal::Unfit(it)));
    match (command, situation.phase) {
        (C::Arm, P::Disarmed) => fit,
        (C::Arm, P::OnGround | P::InAir) => Ok(()),
        (C::Disarm, P::Disarmed | P::OnGround) => Ok(()),
        (C::Disarm, P::InAir) => Err(Refusal::InAir),
        (C::Takeoff { .. }, P::Disarmed) => Err(Refusal::Disarmed),
        (C::Takeoff { .. }, P::InAir) => Err(Refusal::InAir),
        (C::Takeoff { altitude_m }, P::OnGround) if altitude_m < situation.height_m + LEAST_CLIMB_M => {
            Err(Refusal::NoClimb { altitude_m, height_m: situation.height_m })
        }
        (C::Takeoff { .. }, P::OnGround) => fit,
        (C::Land, P::Disarmed | P::OnGround) => Err(Refusal::OnGround),
        (C::Land, P::InAir) => Ok(()),
        (C::Loiter, P::Disarmed | P::OnGround) => Ok(()),
        (C::Loiter, P::InAir) => fit,
        (C::Offboard, _) if !situation.setpoints => Err(Refusal::NoSetpoints),
        (C::Offboard, P::Disarmed) => Ok(()),
        (C::Offboard, P::OnGround | P::InAir) => fit,
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
        check(Command::Takeoff { altitude_m: 10.0 }, &[OnGround]);
        check(Command::Takeoff { altitude_m: 0.2 }, &[]);
        check(Command::Land, &[InAir]);
        check(Command::Loiter, &[Disarmed, OnGround, InAir]);
        check(Command::Offboard, &[Disarmed, OnGround, InAir]);
    }

    #[test]
    fn what_does_not_fly_is_not_armed_and_only_lands() {
        #[track_caller]
        fn check(command: Command, accepted_in: &[Phase]) {
            for phase in [Disarmed, OnGround, InAir] {
                let answer = judge(command, &Situation { phase, unfit: Some(Condition::MotorFailed), ..FIT });
                assert_eq!(answer.is_ok(), accepted_in.contains(&phase), "{command:?} {phase:?}: {answer:?}");
            }
        }
        check(Command::Arm, &[OnGround, InAir]);
        check(Command::Disarm, &[Disarmed, OnGround]);
        check(Command::Takeoff { altitude_m: 10.0 }, &[]);
        check(Command::Land, &[InAir]);
        check(Command::Loiter, &[Disarmed, OnGround]);
        check(Command::Offboard, &[Disarmed]);
    }

    #[test]
    fn offboard_takes_setpoints() {
        for phase in [Disarmed, OnGround, InAir] {
            let without = Situation { phase, setpoints: false, ..FIT };
            assert_eq!(judge(Command::Offboard, &without), Err(Refusal::NoSetpoints));
        }
    }
}
