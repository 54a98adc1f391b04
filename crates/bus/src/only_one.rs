//! One process of a service for each vehicle: a second one ends before it receives anything.
//!
//! One that was away (stopped, or cut off) for longer than its token stays counts as gone, and another may have been started since.
//! When both are there the newer one stays and the older one ends: both know their order by their names. The newer one has waited until
//! nobody else was there, so the token of a dead process ends nobody.

#![expect(clippy::disallowed_methods, reason = "a token that is stale is awaited on the wall clock")]

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use zenoh::sample::SampleKind;
use zenoh::{Session, Wait};

use crate::clock::monotonic_ns;
use crate::presence::{self, Instances};
use crate::wake::Wake;
use crate::{BusError, keys};

/// Longer than the lease of a session: by then the token of a process that was killed has vanished. A router that takes as long
/// for an answer has none.
const STALE_LIMIT: Duration = Duration::from_secs(5);
/// Pause before the tokens are asked for again.
const PAUSE: Duration = Duration::from_millis(100);

/// Waits until no other process is this service.
///
/// # Errors
/// If one still is when every stale token must have vanished, or if nobody says whether one is.
pub(crate) fn wait_to_be(session: &Session, service: &str) -> Result<(), BusError> {
    let until = Instant::now() + STALE_LIMIT;
    loop {
        // The last answer has as much time as the first one: one that is cut off would look as if nobody were there.
        let others = presence::instances(session, service, Instant::now() + STALE_LIMIT)?;
        match judge(&others, until <= Instant::now()) {
            Verdict::Alone => return Ok(()),
            Verdict::AskAgain => std::thread::sleep(PAUSE),
            Verdict::Taken => {
                let instance = others.found.join(", ");
                return Err(BusError::RunsAlready { service: service.to_owned(), instance });
            }
            Verdict::Unanswered => {
                return Err(BusError::Unanswered { service: service.to_owned(), waited: STALE_LIMIT });
            }
        }
    }
}

/// The name of this start of a process: when it was, by the machine's clock that is never set, and the number of its session, which no
/// other has.
pub(crate) fn instance(session: &Session) -> String {
    format!("{:016x}-{}", monotonic_ns(), session.zid())
}

/// Whether the process `other` was started after `own`. Older programs have no time in their names: they count as
/// older, and know nothing of this.
fn is_newer(other: &str, own: &str) -> bool {
    let rank = |it: &str| it.split_once('-').and_then(|(start, _)| u64::from_str_radix(start, 16).ok());
    (rank(own), own) < (rank(other), other)
}

/// A newer process that has one of the services of this one.
#[derive(Clone, Default)]
pub(crate) struct Successor(Arc<OnceLock<(String, String)>>);

impl Successor {
    /// An error once there is one.
    pub(crate) fn check(&self) -> Result<(), BusError> {
        match self.0.get().cloned() {
            Some((service, instance)) => Err(BusError::Superseded { service, instance }),
            None => Ok(()),
        }
    }
}

/// Watches whether a newer process than `own` has one of `services`; the loop of `wake` ends then.
pub(crate) fn watch(
    session: &Session,
    services: Vec<&'static str>,
    own: String,
    wake: Wake,
) -> Result<Successor, BusError> {
    let (successor, key) = (Successor::default(), keys::alive("*", "*"));
    let found = successor.clone();
    session
        .liveliness()
        .declare_subscriber(&key)
        // A process that appeared while the link was down is reported once the link is back.
        .history(true)
        .callback(move |sample| {
            let Some((service, instance)) = keys::parse_alive(sample.key_expr().as_str()) else { return };
            if sample.kind() == SampleKind::Put && services.contains(&service) && is_newer(instance, &own) {
                // The first one counts.
                let _ = found.0.set((service.to_owned(), instance.to_owned()));
                wake.stop();
            }
        })
        .background()
        .wait()
        .map_err(|cause| BusError::Declare { key: key.clone(), cause: cause.to_string() })?;
    Ok(successor)
}

/// What an answer about the others means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Alone,
    /// A token may be stale, or there is no answer yet.
    AskAgain,
    Taken,
    Unanswered,
}

/// `is_late`: every stale token must have vanished.
fn judge(others: &Instances, is_late: bool) -> Verdict {
    match (others.found.is_empty(), others.is_whole, is_late) {
        (true, true, _) => Verdict::Alone,
        (_, _, false) => Verdict::AskAgain,
        (false, _, true) => Verdict::Taken,
        (true, false, true) => Verdict::Unanswered,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_processes_both_know_the_same_one_as_the_newer() {
        /// In the order of their starts.
        const STARTS: [&str; 7] = [
            "0f",
            "ffffffffffffffffffffffffffffffff",
            "0000000000000000-ff",
            "0000000000000001-1",
            "000000000000000a-1",
            "000000000000000a-2",
            "ffffffffffffffff-0",
        ];
        for (place, own) in STARTS.iter().enumerate() {
            for (other_place, other) in STARTS.iter().enumerate() {
                assert_eq!(is_newer(other, own), place < other_place, "{own} meets {other}");
            }
        }
    }

    #[test]
    fn nobody_is_alone_by_an_answer_that_was_cut_off() {
        #[track_caller]
        fn check(found: &[&str], is_whole: bool, expected: [Verdict; 2]) {
            let others = Instances { found: found.iter().map(|it| (*it).to_owned()).collect(), is_whole };
            assert_eq!([false, true].map(|is_late| judge(&others, is_late)), expected, "{others:?}");
        }
        check(&[], true, [Verdict::Alone, Verdict::Alone]);
        check(&[], false, [Verdict::AskAgain, Verdict::Unanswered]);
        check(&["7"], true, [Verdict::AskAgain, Verdict::Taken]);
        check(&["7"], false, [Verdict::AskAgain, Verdict::Taken]);
    }
}
