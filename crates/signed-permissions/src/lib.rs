//! Permissions that a vehicle can check: signed by the control tower, and believed by rules that no repeated, delayed or
//! changed message gets around.
//!
//! `statement` is what is signed, [`key`] signs and verifies (Ed25519), [`belief`] is the vehicle's side. Nothing here reads a
//! clock, a file or a network.

pub mod belief;
pub mod key;
mod statement;
