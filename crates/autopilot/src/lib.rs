//! What the bridges to autopilots share: commands by MAVLink's numbers, which PX4 also takes over its own topics, the declared skills
//! that are one of them, PX4's gripper, whether a target to land on is seen, and what a report of a picture says.
//!
//! It knows no wire: a bridge sends the commands and gives it the acknowledgements.

pub mod command;
pub mod gripper;
pub mod picture;
pub mod target;
pub mod tasks;
