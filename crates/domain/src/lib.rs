//! The types that all processes share: time, geometry, geodesy, energy, areas, missions, plans, skills, the autopilot's
//! vocabulary, contingency rules, the airspace rule, and the conversions between messages and these types.
//!
//! Nothing here reads a clock, opens a socket or spawns a task; time is always an argument. The only input is a file
//! that a human wrote ([`file::Source::read`]).

pub mod aircraft;
pub mod airspace;
pub mod alternates;
pub mod area;
pub mod area_map;
pub mod camera;
pub mod consumption;
pub mod contingency;
pub mod control_character;
pub mod corners;
pub mod decision;
pub mod declared_skill;
pub mod energy;
pub mod feed;
pub mod file;
pub mod flight_state;
pub mod fmu;
pub mod geodesy;
pub mod geometry;
pub mod ground;
pub mod harm;
pub mod headway;
pub mod hours;
pub mod known_ground;
pub mod measured;
pub mod memory;
pub mod mission;
pub mod mission_clock;
pub mod outline;
pub mod payload_command;
pub mod permission;
pub mod plan;
pub mod quantity;
pub mod route;
pub mod site;
pub mod situation;
pub mod skill;
pub mod slack;
pub mod speeds;
pub mod state;
pub mod survey;
pub mod task;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
pub mod time;
pub mod traffic;
pub mod trust;
pub mod way;
pub mod wind_triangle;
pub mod wire;
