//! Stories over the shipped compose file and an image of the shipped Dockerfile, seen from the host.
//!
//! They need a container engine, and `KITTIWAKE_IMAGE` with the name of an image of this tree, and so they are ignored unless
//! they are asked for: `cargo test --test compose -- --ignored`. `.ci/run` builds the image and runs them.

#![expect(clippy::disallowed_methods, reason = "stories wait for real processes, up to a limit")]
#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

mod support;

mod bad_input;
mod cuts;
mod cycles;
mod fleet;
mod flight;
mod orders;
