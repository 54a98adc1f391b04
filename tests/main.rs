//! Stories over real processes: one program, so that what they share is compiled and linked once.

#![expect(clippy::disallowed_methods, reason = "stories wait for real processes, up to a limit")]
#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

mod autopilots;
mod compose;
mod px4;
mod stories;
mod support;
mod systemd;
