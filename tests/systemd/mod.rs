//! Stories over the shipped units, under a systemd that is process 1 of a container, seen from outside: an aircraft and its
//! ground, installed by the commands of docs/deployment.md.
//!
//! They need a container engine, and `KITTIWAKE_SYSTEMD_IMAGE` with the name of an image of `tests/systemd/Dockerfile`, and so
//! they are ignored unless they are asked for: `cargo test --test stories -- --ignored systemd::`. `.ci/long` builds the image and runs them.

mod documented;
mod flight;
mod lost;
mod machine;
mod package;
mod sandbox;
mod site;
mod upgrade;
