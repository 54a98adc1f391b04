//! The stream of setpoints, with the proof of life that goes with each.

use std::time::Duration;

use domain::geometry::{Ned, NedVelocity};
use domain::time::Time;

use crate::fsm::SkillId;

/// Where, or how, to fly offboard. Made of checked goals only: every number is one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setpoint {
    /// Position control.
    Position {
        /// Where to.
        target: Ned,
        /// No faster than this.
        speed_limit_m_s: f64,
        /// Heading; `None`: as it is.
        yaw_rad: Option<f64>,
    },
    /// Velocity control.
    Velocity {
        /// How.
        velocity: NedVelocity,
        /// Turn rate; `None`: heading as it is.
        yaw_rate_rad_s: Option<f64>,
    },
}

/// At most one setpoint is streamed; it belongs to a skill that runs, that wants to, or that has
/// just ended.
#[derive(Debug)]
pub struct Stream {
    period: Duration,
    flowing: Option<Flow>,
}

#[derive(Debug)]
struct Flow {
    owner: SkillId,
    setpoint: Setpoint,
    due: Time,
}

impl Stream {
    /// A stream that does not flow; `period` in mission time.
    pub fn new(period: Duration) -> Stream {
        Stream { period, flowing: None }
    }

    /// From now on, this setpoint; the first one is due at once.
    pub fn switch(&mut self, owner: SkillId, setpoint: Setpoint, now: Time) {
        self.flowing = Some(Flow { owner, setpoint, due: now });
    }

    /// Lets it run dry.
    pub fn stop(&mut self) {
        self.flowing = None;
    }

    /// Whose setpoint flows.
    pub fn owner(&self) -> Option<SkillId> {
        self.flowing.as_ref().map(|it| it.owner)
    }

    /// The setpoint to be sent at this moment. One that was late is not made up for.
    pub fn due(&mut self, now: Time) -> Option<Setpoint> {
        let flow = self.flowing.as_mut().filter(|it| it.due <= now)?;
        flow.due = now + self.period;
        Some(flow.setpoint)
    }

    /// When the next one is due.
    pub fn deadline(&self) -> Option<Time> {
        self.flowing.as_ref().map(|it| it.due)
    }
}
