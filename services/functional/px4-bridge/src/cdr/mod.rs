//! PX4's messages as bytes: CDR as its Zenoh module writes it, by a table of definitions.
//!
//! Four bytes of header, then little-endian XCDR1: every number aligned to its own size, counted from after the header. PX4 sends
//! more bytes than the message has, with whatever was in its memory; they are ignored.

mod definition;
mod record;

pub use definition::{Definition, Definitions, Field, InvalidDefinitions, Kind};
pub use record::{CdrError, Record, Value};

/// The header: CDR, little-endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];
