//! One process of a service for each vehicle: a second one ends before it receives anything.

#![expect(clippy::disallowed_methods, reason = "a token that is stale is awaited on the wall clock")]

use std::time::{Duration, Instant};

use zenoh::Session;

use crate::BusError;
use crate::presence::{self, Instances};

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
