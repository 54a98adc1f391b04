//! One process of a service for each vehicle: a second one ends before it receives anything.

#![expect(clippy::disallowed_methods, reason = "a token that is stale is awaited on the wall clock")]

use std::time::{Duration, Instant};

use zenoh::Session;

use crate::{BusError, presence};

/// Longer than the lease of a session: by then the token of a process that was killed has vanished.
const STALE_LIMIT: Duration = Duration::from_secs(5);
/// Pause before the tokens are asked for again.
const PAUSE: Duration = Duration::from_millis(100);

/// Waits until no other process is this service.
///
/// # Errors
/// If one still is when every stale token must have vanished.
pub(crate) fn wait_to_be(session: &Session, service: &str) -> Result<(), BusError> {
    let until = Instant::now() + STALE_LIMIT;
    loop {
        let others = presence::instances(session, service, until)?;
        if others.is_empty() {
            return Ok(());
        }
        if until <= Instant::now() {
            return Err(BusError::RunsAlready { service: service.to_owned(), instance: others.join(", ") });
        }
        std::thread::sleep(PAUSE);
    }
}
