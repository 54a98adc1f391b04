//! What a start of the autopilot resets: its clock, its local frame, and the silence until it speaks.

use std::time::Duration;

use domain::fmu::{Command, Setpoint};
use domain::time::Time;
use nalgebra::Vector3;

use crate::frame::{ned, vector};

/// From a restart until the first message. (PX4 and ArduPilot in software in the loop: 1.0 to 1.4 s.)
const SILENCE: Duration = Duration::from_millis(1400);

/// The present start, and where the local frame lies since then.
#[derive(Debug, Clone)]
pub(crate) struct Boot {
    at: Time,
    silent_until: Time,
    /// Changes with each start and each move of the frame.
    pub(crate) epoch: u64,
    /// What is added to positions of the simulation to have those of the local frame.
    pub(crate) frame_offset: Vector3<f64>,
}

impl Boot {
    /// With the simulation.
    pub(crate) fn new() -> Boot {
        Boot { at: Time::ZERO, silent_until: Time::ZERO, epoch: 0, frame_offset: Vector3::zeros() }
    }

    /// Starts again; its estimator takes the place where it is, `here`, for the origin.
    pub(crate) fn again(&mut self, here: Vector3<f64>, now: Time) {
        (self.at, self.silent_until) = (now, now + SILENCE);
        self.epoch += 1;
        self.frame_offset = -here;
    }

    /// The local frame moves: from now on every position is this much greater.
    pub(crate) fn move_frame(&mut self, by: Vector3<f64>) {
        self.epoch += 1;
        self.frame_offset += by;
    }

    /// Whether it has not come up yet: it hears and says nothing.
    pub(crate) fn is_silent(&self, now: Time) -> bool {
        now < self.silent_until
    }

    /// The autopilot's clock.
    pub(crate) fn microseconds(&self, now: Time) -> u64 {
        (now - self.at).as_micros() as u64
    }

    /// A command as the simulation has it.
    pub(crate) fn command(&self, command: Command) -> Command {
        match command {
            Command::Takeoff { height_m } => Command::Takeoff { height_m: height_m + self.frame_offset.z },
            other => other,
        }
    }

    /// A setpoint as the simulation has it.
    pub(crate) fn setpoint(&self, setpoint: Setpoint) -> Setpoint {
        match setpoint {
            Setpoint::Position { target, speed_limit_m_s, yaw_rad } => {
                Setpoint::Position { target: ned(vector(target) - self.frame_offset), speed_limit_m_s, yaw_rad }
            }
            velocity => velocity,
        }
    }
}
