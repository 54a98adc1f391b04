//! The certificate that clients see: that of its files, also after these were replaced.
//!
//! A certificate runs out, and nobody may have to end the gateway in flight to renew it. Files that cannot be used take nothing away:
//! what is being copied is not whole for a moment.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::SystemTime;

use regular_file::{Followed, Unusable};
use rustls::server::{ClientHello, ResolvesServerCert};
use rustls::sign::CertifiedKey;

use super::{Demand, Files, Pair, Refusal, Texts};

/// The certificate of the next handshake, and the key to it.
pub struct ShownCertificate {
    files: Files,
    state: Mutex<State>,
}

/// What a look finds.
type Content = Result<Texts, Refusal>;

struct State {
    /// Without a certificate until the files can be used.
    followed: Followed<Content, Option<Pair>, Refusal>,
    /// What is wrong, as it was told last.
    problem: Option<String>,
}

impl ShownCertificate {
    /// Begins with what is in the files.
    pub(super) fn read(files: Files, demand: Demand, now: SystemTime) -> Result<ShownCertificate, Refusal> {
        let content = files.read();
        let shown = content.clone().and_then(|it| files.parse(&it));
        let out_of_date = shown.as_ref().ok().and_then(|it| files.out_of_date(it, now));
        let followed = match (shown, out_of_date, demand) {
            (Err(refusal), _, Demand::Valid | Demand::Usable) => return Err(refusal),
            (Ok(_), Some(out_of_date), Demand::Valid) => return Err(out_of_date),
            (Ok(pair), ..) => Followed::new(content, Some(pair)),
            (Err(refusal), _, Demand::Nothing) => Followed::refused(content, None, refusal),
        };
        Ok(ShownCertificate { files, state: Mutex::new(State { followed, problem: None }) })
    }

    /// What is wrong, as far as it was told.
    pub fn problem(&self) -> Option<String> {
        self.lock().problem.as_ref().map(|it| format!("gateway: {it}"))
    }

    /// What clients say against the date of the certificate.
    pub fn out_of_date(&self, now: SystemTime) -> Option<Refusal> {
        self.lock().followed.value().as_ref().and_then(|it| self.files.out_of_date(it, now))
    }

    /// Reads the files again, and tells what is wrong when that has changed. What is seen once may be a part of what somebody is
    /// writing, or a certificate whose key is still to come, so it counts when it is seen twice.
    pub fn look(&self, now: SystemTime) {
        // A disk that hangs delays no handshake.
        let content = self.files.read();
        let mut state = self.lock();
        if let Some(Ok(_)) =
            state.followed.look_twice(content, |content, shown| self.parse(content, shown.as_ref(), now))
        {
            tracing::info!("{}: was changed; it is shown from now on", self.files.certificate.display());
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

    fn parse(
        &self,
        content: &Content,
        shown: Option<&Pair>,
        now: SystemTime,
    ) -> Result<Option<Pair>, Unusable<Refusal>> {
        let parsed = content.clone().and_then(|it| self.files.parse(&it)).map_err(Unusable::Content)?;
        let is_valid = |pair: &Pair| self.files.out_of_date(pair, now).is_none();
        match self.files.out_of_date(&parsed, now) {
            // One that is not valid yet, or no more, does not take the place of a valid one.
            Some(wrong_date) if shown.is_some_and(is_valid) => Err(Unusable::Now(wrong_date)),
            _ => Ok(Some(parsed)),
        }
    }

    fn wrong(&self, state: &State, now: SystemTime) -> Option<String> {
        let shown = state.followed.value().as_ref();
        match (state.followed.problem(), shown) {
            (Some(refusal), Some(_)) => Some(format!("{refusal}; still serving the previous certificate")),
            (Some(refusal), None) => Some(format!("{refusal}; until it is mended no client gets a connection")),
            (None, shown) => shown.and_then(|it| self.files.out_of_date(it, now)).map(|it| it.to_string()),
        }
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl ResolvesServerCert for ShownCertificate {
    fn resolve(&self, _: ClientHello) -> Option<Arc<CertifiedKey>> {
        self.lock().followed.value().as_ref().map(|it| it.key.clone())
    }
}

/// Without the key.
impl fmt::Debug for ShownCertificate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ShownCertificate").field("of", &self.files.certificate).finish_non_exhaustive()
    }
}
