//! A gripper that tells of itself only by its acknowledgements, as PX4's does: in progress at once, accepted once it has moved.

use domain::fmu::Gripper;

use crate::command::{ACCEPTED, NumberedCommand};

/// MAV_CMD_DO_GRIPPER.
pub const COMMAND: u16 = 211;
/// GRIPPER_ACTION_RELEASE, in its second parameter; 1 grabs.
const RELEASE: f64 = 0.0;

/// Its state, by the acknowledgements.
#[derive(Debug, Default)]
pub struct SilentGripper {
    /// After the last accepted command.
    state: Option<Gripper>,
    /// After a command that is not answered yet.
    awaited: Option<Gripper>,
}

impl SilentGripper {
    /// A command is sent, to it or to something else.
    pub fn sent(&mut self, command: &NumberedCommand) {
        if command.number == COMMAND {
            let [_, action, ..] = command.params;
            self.awaited = Some(if action == RELEASE { Gripper::Released } else { Gripper::Holding });
        }
    }

    /// The command `number` of ours is acknowledged with this MAV_RESULT; returns whether the gripper has moved.
    pub fn acknowledged(&mut self, number: u16, result: u8) -> bool {
        let moved = self.awaited.take_if(|_| number == COMMAND && result == ACCEPTED);
        self.state = moved.or(self.state);
        moved.is_some()
    }

    /// The vehicle is armed: what was done to it on the ground, such as another load, is not known.
    pub fn armed(&mut self) {
        *self = SilentGripper::default();
    }

    /// Its state; silent until a command was accepted.
    pub fn state(&self) -> Gripper {
        self.state.unwrap_or(Gripper::Silent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::IN_PROGRESS;

    #[test]
    fn only_an_accepted_command_says_what_it_does() {
        let command =
            |action| NumberedCommand { number: COMMAND, params: [1.0, action, 0., 0., 0., 0., 0.], repeats: 0 };
        let mut gripper = SilentGripper::default();
        assert!(!gripper.acknowledged(COMMAND, ACCEPTED), "somebody else's");
        gripper.sent(&command(0.0));
        assert!(!gripper.acknowledged(COMMAND, IN_PROGRESS) && !gripper.acknowledged(176, ACCEPTED));
        assert_eq!(gripper.state(), Gripper::Silent);
        assert!(gripper.acknowledged(COMMAND, ACCEPTED));
        assert_eq!(gripper.state(), Gripper::Released);
        gripper.sent(&command(1.0));
        assert!(!gripper.acknowledged(COMMAND, 4));
        assert_eq!(gripper.state(), Gripper::Released, "it refused to grab");
        assert!(gripper.acknowledged(COMMAND, ACCEPTED));
        assert_eq!(gripper.state(), Gripper::Holding);
        gripper.armed();
        assert_eq!(gripper.state(), Gripper::Silent);
    }
}
