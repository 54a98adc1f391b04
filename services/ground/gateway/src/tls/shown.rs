//! The certificate that clients see: that of its files, also after these were replaced.
//!
//! A certificate runs out, and nobody may have to end the gateway in flight to renew it. Files that cannot be used take nothing away:
//! what is being copied is not whole for a moment.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::SystemTime;

use rustls::server::{ClientHello, ResolvesServerCert};
use rustls::sign::CertifiedKey;

use super::{Demand, Files, Pair, Refusal, Texts};

pub(crate) mod watch;

/// The certificate of the next handshake, and the key to it.
pub struct ShownCertificate {
    files: Files,
    state: Mutex<State>,
}

/// What a look finds.
type Seen = Result<Texts, Refusal>;

struct State {
    shown: Option<Pair>,
    /// What was seen last, and what of that was acted on last.
    newest: Seen,
    settled: Seen,
    /// Why what was acted on last is not used.
    refusal: Option<Refusal>,
    /// Why the files of now are not acted on yet: what is wrong with their date.
    waiting: Option<Refusal>,
    /// What is wrong, as it was told last.
    problem: Option<String>,
}

impl ShownCertificate {
    /// Begins with what is in the files.
    pub(super) fn read(files: Files, demand: Demand, now: SystemTime) -> Result<ShownCertificate, Refusal> {
        let seen = files.read();
        let (shown, refusal) = match seen.as_ref().map_err(Refusal::clone).and_then(|it| files.parse(it)) {
            Ok(pair) => (Some(pair), None),
            Err(refusal) => (None, Some(refusal)),
        };
        let out_of_date = shown.as_ref().and_then(|it| files.out_of_date(it, now));
        match (&refusal, out_of_date, demand) {
            (Some(refusal), _, Demand::Valid | Demand::Usable) => return Err(refusal.clone()),
            (None, Some(out_of_date), Demand::Valid) => return Err(out_of_date),
            _ => {}
        }
        let state = State { shown, newest: seen.clone(), settled: seen, refusal, waiting: None, problem: None };
        Ok(ShownCertificate { files, state: Mutex::new(state) })
    }

    /// What is wrong, as far as it was told.
    pub fn problem(&self) -> Option<String> {
        self.lock().problem.as_ref().map(|it| format!("gateway: {it}"))
    }

    /// What clients say against the date of the certificate.
    pub fn out_of_date(&self, now: SystemTime) -> Option<Refusal> {
        self.lock().shown.as_ref().and_then(|it| self.files.out_of_date(it, now))
    }

    /// Reads the files again, and tells what is wrong when that has changed. What is seen once may be a part of what somebody is
    /// writing, or a certificate whose key is still to come, so it counts when it is seen twice.
    pub fn look(&self, now: SystemTime) {
        // A disk that hangs delays no handshake.
        let seen = self.files.read();
        let mut state = self.lock();
        let is_settled = seen == state.newest;
        state.newest = seen.clone();
        if is_settled {
            // Nothing waits any more where the files are again as they were.
            state.waiting = None;
            if seen != state.settled {
                self.act_on(seen, &mut state, now);
            }
        }
        let problem = self.wrong(&state, now);
        if problem == state.problem {
            return;
        }
        if let Some(problem) = &problem {
            tracing::warn!("{problem}");
        }
        state.problem = problem;
    }

    fn act_on(&self, seen: Seen, state: &mut State, now: SystemTime) {
        let parsed = seen.clone().and_then(|it| self.files.parse(&it));
        let wrong_date = parsed.as_ref().ok().and_then(|it| self.files.out_of_date(it, now));
        let shows_valid = state.shown.as_ref().is_some_and(|it| self.files.out_of_date(it, now).is_none());
        if wrong_date.is_some() && shows_valid {
            // One that is not valid yet, or no more, takes the place of none that is. It is looked at again until the dates say otherwise.
            state.waiting = wrong_date;
            return;
        }
        state.settled = seen;
        state.refusal = match parsed {
            Ok(pair) => {
                tracing::info!("{}: was changed; it is shown from now on", self.files.certificate.display());
                state.shown = Some(pair);
                None
            }
            Err(refusal) => Some(refusal),
        };
    }

    fn wrong(&self, state: &State, now: SystemTime) -> Option<String> {
        let out_of_date = || state.shown.as_ref().and_then(|it| self.files.out_of_date(it, now));
        match (state.waiting.as_ref().or(state.refusal.as_ref()), &state.shown) {
            (Some(refusal), Some(_)) => Some(format!("{refusal}; the certificate of before is shown")),
            (Some(refusal), None) => Some(format!("{refusal}; until it is mended no client gets a connection")),
            (None, _) => out_of_date().map(|it| it.to_string()),
        }
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl ResolvesServerCert for ShownCertificate {
    fn resolve(&self, _: ClientHello) -> Option<Arc<CertifiedKey>> {
        self.lock().shown.as_ref().map(|it| it.key.clone())
    }
}

/// Without the key.
impl fmt::Debug for ShownCertificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ShownCertificate").field("of", &self.files.certificate).finish_non_exhaustive()
    }
}
