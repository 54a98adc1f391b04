//! Stories over the shipped units, under a systemd that is process 1 of a container, seen from outside: an aircraft and its
//! ground, installed by the commands of docs/deployment.md.
//!
//! They need a container engine, and `KITTIWAKE_SYSTEMD_IMAGE` with the name of an image of `tests/systemd/Dockerfile`, and so
//! they are ignored unless they are asked for: `cargo test --test systemd -- --ignored`. `.ci/run` builds the image and runs them.

#![expect(clippy::disallowed_methods, reason = "stories wait for real processes, up to a limit")]
#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

mod documented;
#[path = "../support/engine.rs"]
mod engine;
mod flight;
mod lost;
mod machine;
mod sandbox;
mod site;
mod upgrade;
#[path = "../support/wait.rs"]
mod wait;
