//! What is prepared and checked before anything runs: certificates, tokens, files.

pub mod access;
pub mod certs;
pub mod check;
pub mod operator_token;
