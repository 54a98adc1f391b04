//! Random missions and random trouble: drawn from a seed, flown on a virtual clock, judged, and shrunk.
//!
//! A [`script::Script`] is data: drawing it ([`draw`]) flies nothing, flying it ([`fly`]) draws nothing. So it can be printed, flown
//! again, and shortened ([`mod@shrink`]).

pub(crate) mod dice;
pub mod draw;
pub mod ending;
pub mod fly;
pub mod hash;
pub mod oracle;
mod random_mission;
pub mod script;
pub mod shrink;
pub mod trouble;
