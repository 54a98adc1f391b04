//! Zenoh's link over TLS, in place of zenoh's own.
//!
//! Zenoh reads and writes a link from two threads. Its own TLS link lets both into one rustls connection at once, which
//! rustls does not allow (zenoh's issue 2557, open with 1.10.2): now and then a write finds the connection in the middle
//! of a read and fails with "handshake not complete", and the link is made again; worse, it writes into memory that the
//! other thread uses, and the router dies. Between two idle routers the first happened once in three minutes.
//! The patch to be offered to zenoh, `upstream.patch`, mends this in zenoh's own link: there, reading and writing take
//! turns at the connection.
//!
//! Whatever replaces this crate, zenoh's own link once it is mended above all, must keep the following. The tests, in
//! `tests/link.rs`, use nothing but zenoh's traits and settings, so that they can be run against the replacement.
//!
//! | behaviour | test |
//! |---|---|
//! | one thread reads while another writes | `both_directions_are_used_at_once` |
//! | both ends show a certificate of the named authority; no other authority is trusted (zenoh's own link trusts those of the public web besides) | `a_stranger_is_not_let_in_and_lets_nobody_in` |
//! | this cannot be turned off by a setting | `what_would_make_it_less_safe_is_refused` |
//! | each end knows the common name at the other end, by which the bus grants access | `each_end_knows_the_others_name` |
//! | a write ends once the kernel has taken it, so that urgent messages never wait in a buffer of the connection (zenoh's own link keeps up to 64 kB) | `what_was_written_is_out_of_our_hands` |
//! | a link that is closed is closed at once, and what waits in it is thrown away | `a_writer_into_a_link_that_takes_nothing_is_let_go_when_it_is_closed` |
//! | a link ends with the first message after a certificate at its other end has expired | `a_link_ends_with_the_certificate_at_its_other_end` |
//! | a link ends within seconds when its other end is revoked or its authority replaced, and cannot be made again | `a_link_ends_when_its_other_end_is_revoked` |
//! | a renewed certificate is used for the next connection, at both ends, without a restart | `a_renewed_certificate_is_used_for_the_next_connection` |
//! | callers that never finish their handshake keep out nobody else | `silent_callers_are_no_obstacle`, `who_keeps_calling_hangs_up_on_nobody_but_himself` |
//!
//! This crate has the name and version of zenoh's, so that the workspace's `[patch.crates-io]` puts it in its place;
//! `zenoh_uses_this_crate_and_not_its_own` makes sure that it does. Nothing of ours depends on it: who may do what, and
//! whether a certificate is good enough to start with, is decided in the bus, and `credentials` reads the files.

mod callers;
mod link;
mod manager;
mod settings;

pub use manager::LinkManagerUnicastTls;
pub use settings::TlsConfigurator;

use zenoh_link_commons::LocatorInspector;
use zenoh_protocol::core::Locator;
use zenoh_result::ZResult;

/// Under this name it logs: what names itself zenoh is quiet by default.
const LOG: &str = "tls_link";

/// What locators of this link begin with.
pub const TLS_LOCATOR_PREFIX: &str = "tls";

/// Tells zenoh what it may expect of a locator.
#[derive(Debug, Default, Clone, Copy)]
pub struct TlsLocatorInspector;

#[async_trait::async_trait]
impl LocatorInspector for TlsLocatorInspector {
    fn protocol(&self) -> &str {
        TLS_LOCATOR_PREFIX
    }

    async fn is_multicast(&self, _: &Locator) -> ZResult<bool> {
        Ok(false)
    }

    fn is_reliable(&self, _: &Locator) -> ZResult<bool> {
        Ok(true)
    }
}

// The stories use this crate as others do, in the program of its unit tests: one program links faster than two.
#[cfg(test)]
extern crate self as zenoh_link_tls;
#[cfg(test)]
#[path = "../tests/link.rs"]
mod stories;
