//! The monitor from outside: what it publishes about what the vehicle says.

mod expressions;
mod properties;
mod rig;
mod rules;
mod shipped_table;
mod sources;
mod stream;
