//! What every process agrees on, without any input or output: time, geometry, missions, skills,
//! permissions, contingency rules, and the conversions between these and the wire.
//!
//! Nothing here reads a clock, opens a socket or spawns a task; time is always an argument.

pub mod area;
pub mod contingency;
pub mod corners;
pub mod detour;
pub mod file;
pub mod geometry;
pub mod mission;
pub mod quantity;
pub mod route;
pub mod skill;
pub mod time;
pub mod wire;
