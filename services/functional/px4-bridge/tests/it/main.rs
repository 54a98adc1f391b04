//! The bridge over the captured flight of a real PX4, over scripted samples, and over garbage.

mod bad_input;
mod data;
mod fuzz;
mod pictures;
mod replay;
mod rig;
mod samples;
