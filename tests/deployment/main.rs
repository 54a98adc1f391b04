//! The aircraft and the ground as they are deployed: a router each, and between them a thin link with
//! certificates, which is cut, narrowed and tried by strangers.

#[path = "../support/mod.rs"]
#[allow(dead_code)] // Written for the stories; what both need is used here too.
mod support;

mod access;
mod bad_papers;
mod cuts;
mod narrow;
mod proxy;
mod routers;
mod world;
