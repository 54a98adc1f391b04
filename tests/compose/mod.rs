//! Stories over the shipped compose file and an image of the shipped Dockerfile, seen from the host.
//!
//! They need a container engine, and `KITTIWAKE_IMAGE` with the name of an image of this tree, and so they are ignored unless
//! they are asked for: `cargo test --test stories -- --ignored compose::`. `.ci/run` builds the image and runs one, `.ci/long` all.

mod support;

mod bad_input;
mod cuts;
mod cycles;
mod fleet;
mod flight;
mod orders;
