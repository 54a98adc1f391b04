//! Shares of something that there is a limited number of, such as event streams: at most a number for each holder of a
//! token, so that none of them takes what the others need.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};

use axum::http::StatusCode;
use axum::http::header::RETRY_AFTER;

use crate::http::problem::Problem;

/// What there is, and who has it.
#[derive(Debug)]
pub(crate) struct Shares {
    total: usize,
    each: usize,
    held: Mutex<BTreeMap<Arc<str>, usize>>,
}

/// One of them; given back with the value.
#[derive(Debug)]
pub(crate) struct Share {
    of: Arc<Shares>,
    who: Arc<str>,
}

/// Why there is none.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// This holder has as many as one may have.
    ByHolder(Arc<str>, usize),
    /// All holders together have all that there are.
    ByAll(usize),
}

impl Shares {
    /// `total` of them, and at most `each` for one holder.
    pub(crate) fn new(total: usize, each: usize) -> Arc<Shares> {
        Arc::new(Shares { total, each, held: Mutex::default() })
    }

    /// Takes one for `who`.
    ///
    /// # Errors
    /// When there is none left, or none left for this holder.
    pub(crate) fn take(self: &Arc<Shares>, who: &Arc<str>) -> Result<Share, Taken> {
        self.take_leaving(who, 0)
    }

    /// Takes one for `who`, unless no more than `rest` are left, which are for others.
    ///
    /// # Errors
    /// When there is none left, or none left for this holder.
    pub(crate) fn take_leaving(self: &Arc<Shares>, who: &Arc<str>, rest: usize) -> Result<Share, Taken> {
        let (mut held, total) = (self.lock(), self.total.saturating_sub(rest));
        if held.get(who).is_some_and(|it| self.each <= *it) {
            return Err(Taken::ByHolder(who.clone(), self.each));
        }
        if total <= held.values().sum() {
            return Err(Taken::ByAll(total));
        }
        *held.entry(who.clone()).or_default() += 1;
        Ok(Share { of: self.clone(), who: who.clone() })
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Arc<str>, usize>> {
        self.held.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Share {
    /// Whose it is.
    pub(crate) fn holder(&self) -> &Arc<str> {
        &self.who
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut held = self.of.lock();
        if let Some(count) = held.get_mut(&self.who) {
            *count -= 1;
            if *count == 0 {
                held.remove(&self.who);
            }
        }
    }
}

impl Taken {
    /// The answer to who wanted one of `what`, such as `event streams`.
    pub(crate) fn problem(self, what: &str) -> Problem {
        let problem = match self {
            Taken::ByHolder(who, each) => Problem::new(
                StatusCode::TOO_MANY_REQUESTS,
                format!("{who} has {each} {what} open, the most that one token may have; close one of them"),
            ),
            Taken::ByAll(total) => Problem::unavailable(format!("all {total} {what} are in use; try again")),
        };
        problem.with_header(RETRY_AFTER, "1")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holder_leaves_the_others_their_share_and_what_is_dropped_is_free_again() {
        let shares = Shares::new(3, 2);
        let (anna, ben): (Arc<str>, Arc<str>) = ("anna".into(), "ben".into());
        let first = shares.take(&anna).unwrap();
        let _second = shares.take(&anna).unwrap();
        assert_eq!(shares.take(&anna).unwrap_err(), Taken::ByHolder(anna.clone(), 2));
        let third = shares.take(&ben).unwrap();
        assert_eq!(third.holder(), &ben);
        assert_eq!(shares.take(&ben).unwrap_err(), Taken::ByAll(3));
        drop(first);
        let _fourth = shares.take(&ben).unwrap();
        drop(third);
        assert_eq!(shares.take_leaving(&anna, 1).unwrap_err(), Taken::ByAll(2), "the last one is for others");
        let _fifth = shares.take(&anna).unwrap();
        assert_eq!(shares.lock().values().sum::<usize>(), 3);
    }
}
