//! A gripper under the vehicle that holds one load, and opens on command. The load is too light to change how it flies.

use std::time::Duration;

use domain::fmu;
use domain::time::Time;

/// What the gripper does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum GripperState {
    /// It holds the load.
    Holding,
    /// It was told to open, and holds the load until then.
    Opening {
        /// When it is open.
        at: Time,
    },
    /// It is open. Nothing closes it again.
    Open,
}

/// The gripper, with the time it takes to open.
#[derive(Debug, Clone)]
pub(crate) struct Gripper {
    state: GripperState,
    opens_in: Duration,
    /// It takes the command and does not open: a fault.
    pub(crate) stuck: bool,
}

impl Gripper {
    /// With a load, or open; `opens_in` in mission time.
    pub(crate) fn new(holds_load: bool, opens_in: Duration) -> Gripper {
        let state = if holds_load { GripperState::Holding } else { GripperState::Open };
        Gripper { state, opens_in, stuck: false }
    }

    /// Opens it. Told again, it opens no later.
    pub(crate) fn release(&mut self, now: Time) {
        if self.state == GripperState::Holding {
            self.state = GripperState::Opening { at: now + self.opens_in };
        }
    }

    /// Time has passed. One that is stuck opens once it is free again.
    pub(crate) fn step(&mut self, now: Time) {
        if let GripperState::Opening { at } = self.state
            && at <= now
            && !self.stuck
        {
            self.state = GripperState::Open;
        }
    }

    /// As the autopilot reports it.
    pub(crate) fn report(&self) -> fmu::Gripper {
        match self.state {
            GripperState::Holding | GripperState::Opening { .. } => fmu::Gripper::Holding,
            GripperState::Open => fmu::Gripper::Released,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: u64) -> Time {
        Time::after(Duration::from_secs(s))
    }

    #[test]
    fn it_opens_once_after_its_time_and_stays_open() {
        let mut gripper = Gripper::new(true, Duration::from_secs(2));
        gripper.step(at(9));
        assert_eq!(gripper.report(), fmu::Gripper::Holding, "nothing opens it by itself");
        gripper.release(at(10));
        gripper.release(at(11));
        gripper.step(at(11));
        assert_eq!(gripper.report(), fmu::Gripper::Holding);
        gripper.step(at(12));
        assert_eq!(gripper.report(), fmu::Gripper::Released);
        gripper.release(at(20));
        assert_eq!(gripper.report(), fmu::Gripper::Released);
    }

    #[test]
    fn one_that_is_stuck_holds_its_load_until_it_is_free() {
        let mut gripper = Gripper { stuck: true, ..Gripper::new(true, Duration::from_secs(2)) };
        gripper.release(at(10));
        gripper.step(at(100));
        assert_eq!(gripper.report(), fmu::Gripper::Holding);
        gripper.stuck = false;
        gripper.step(at(101));
        assert_eq!(gripper.report(), fmu::Gripper::Released);
    }

    #[test]
    fn without_a_load_it_is_open() {
        assert_eq!(Gripper::new(false, Duration::from_secs(2)).report(), fmu::Gripper::Released);
    }
}
