//! What is prepared and checked before anything runs: certificates, tokens, files.

pub mod access;
pub mod autopilot_check;
pub mod certs;
pub mod check;
pub mod doctor;
pub mod operator_token;
pub mod px4_check;
