//! The aircraft and the ground as they are deployed: a router each, and between them a narrow link with
//! certificates, which is cut, narrowed and attacked.

#![expect(clippy::disallowed_methods, reason = "stories wait for real processes, up to a limit")]
#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

#[path = "../support/mod.rs"]
#[allow(dead_code)] // Written for the stories; what both need is used here too.
mod support;

mod access;
mod bad_credentials;
mod certificates;
mod cuts;
mod narrow;
mod routers;
mod world;
