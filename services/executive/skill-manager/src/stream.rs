//! The stream of setpoints.

use std::time::Duration;

use domain::fmu::Setpoint;
use domain::time::Time;

use crate::fsm::SkillId;

/// Streams at most one setpoint. It belongs to a skill that runs, that is about to start, or that
/// has just ended.
#[derive(Debug)]
pub(crate) struct SetpointStream {
    period: Duration,
    active: Option<Active>,
}

#[derive(Debug)]
struct Active {
    owner: SkillId,
    setpoint: Setpoint,
    due: Time,
}

impl SetpointStream {
    /// A stream that sends nothing yet; `period` in mission time.
    pub(crate) fn new(period: Duration) -> SetpointStream {
        SetpointStream { period, active: None }
    }

    /// Streams the setpoint of a skill that is about to start, since the mode offboard needs one.
    /// A stream that flies the vehicle is left alone. Returns whether a setpoint is due now.
    pub(crate) fn prepare(&mut self, owner: SkillId, setpoint: Option<Setpoint>, now: Time) -> bool {
        let begins = self.active.is_none() && setpoint.is_some();
        if begins {
            self.active = setpoint.map(|setpoint| Active { owner, setpoint, due: now });
        }
        begins
    }

    /// Streams the setpoint of the skill that flies from now on; the first one is due at once. A skill
    /// that `commanded` nothing takes over a stream but begins none.
    pub(crate) fn switch(&mut self, owner: SkillId, setpoint: Option<Setpoint>, commanded: bool, now: Time) {
        let setpoint = setpoint.filter(|_| commanded || self.active.is_some());
        self.active = setpoint.map(|setpoint| Active { owner, setpoint, due: now });
    }

    /// Whether it streams for this skill: before the skill flies, only if it flew the vehicle for none before.
    pub(crate) fn is_of(&self, skill: SkillId) -> bool {
        self.active.as_ref().is_some_and(|it| it.owner == skill)
    }

    /// How long two more setpoints take.
    pub(crate) fn time_for_two(&self) -> Duration {
        self.period * 2
    }

    /// Ends the stream.
    pub(crate) fn stop(&mut self) {
        self.active = None;
    }

    /// Ends the stream if it belongs to this skill.
    pub(crate) fn stop_if_of(&mut self, owner: SkillId) {
        self.active.take_if(|it| it.owner == owner);
    }

    /// The setpoint to be sent at this moment. One that was missed is not sent later.
    pub(crate) fn due(&mut self, now: Time) -> Option<Setpoint> {
        let active = self.active.as_mut().filter(|it| it.due <= now)?;
        active.due = now + self.period;
        Some(active.setpoint)
    }

    /// When the next one is due.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.active.as_ref().map(|it| it.due)
    }
}
