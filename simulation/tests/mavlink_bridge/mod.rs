//! The bridge as the layers above and the autopilots see it.

mod bad_input;
mod captured;
mod ground;
mod pictures;
mod rig;
mod skills;
mod stories;
