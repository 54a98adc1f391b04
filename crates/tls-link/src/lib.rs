//! Zenoh's link over TLS, in place of zenoh's own.
//!
//! Zenoh reads and writes a link from two threads. Its own TLS link lets both into one rustls connection at once,
//! which rustls does not allow (zenoh's issue 2557, open with 1.10.2): now and then a write finds the connection
//! in the middle of a read and fails with "handshake not complete", and the link is made anew; worse, it writes into
//! memory that the other is using, and the router is gone. Between two idle routers the first happened once in three
//! minutes. This crate has the name and version of that one, so that the workspace's `[patch.crates-io]` puts it in its
//! place; a test sees to it that it does. It is to be dropped when zenoh has mended its own.
//!
//! It does less, and some things otherwise:
//!
//! - Both ends show a certificate, always, and only the named authority is trusted. (Zenoh's trusts every
//!   authority of the public web besides.)
//! - A write ends when the kernel has taken it. Zenoh's leaves up to 64 kB in the connection's own buffer, where
//!   what is urgent stands behind what is not.
//! - A link that is closed is closed at once, and what waits in it is thrown away.
//! - A link whose other end has a certificate that ran out ends with the next message, and zenoh says something
//!   several times a second.

mod callers;
mod link;
mod manager;
mod settings;

pub use manager::LinkManagerUnicastTls;
pub use settings::{Papers, TlsConfigurator};

use zenoh_link_commons::LocatorInspector;
use zenoh_protocol::core::Locator;
use zenoh_result::ZResult;

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
