//! The wire contract as its users see it.

mod golden;
mod json;
mod schema;
mod topics;
