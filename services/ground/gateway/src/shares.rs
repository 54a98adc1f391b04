//! Shares of something that there is a limited number of, such as event streams: at most a number for each holder of a
//! token, so that none of them takes what the others need. Some are reserved for holders who may give orders, so that no number of
//! observers takes what an operator needs.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};

use axum::http::StatusCode;
use axum::http::header::RETRY_AFTER;

use crate::access::Identity;
use crate::http::problem::Problem;

/// One in this many is reserved for those who may give orders, if there is more than one.
const RESERVED_ONE_IN: usize = 16;

/// What there is, and who has it.
#[derive(Debug)]
pub(crate) struct Shares {
    total: usize,
    /// Of them: for those who may give orders.
    reserved: usize,
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
        let reserved = if total < 2 { 0 } else { total.div_ceil(RESERVED_ONE_IN) };
        Arc::new(Shares { total, reserved, each, held: Mutex::default() })
    }

    /// Takes one for the client with this token.
    ///
    /// # Errors
    /// When there is none left, or none left for this holder.
    pub(crate) fn take_for(self: &Arc<Shares>, client: &Identity) -> Result<Share, Taken> {
        self.take(&client.name, client.may_order())
    }

    /// Takes one for `who`, who may give orders or not.
    ///
    /// # Errors
    /// When there is none left, or none left for this holder.
    pub(crate) fn take(self: &Arc<Shares>, who: &Arc<str>, may_order: bool) -> Result<Share, Taken> {
        let (mut held, total) = (self.lock(), if may_order { self.total } else { self.total - self.reserved });
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
        let first = shares.take(&anna, true).unwrap();
        let _second = shares.take(&anna, true).unwrap();
        assert_eq!(shares.take(&anna, true).unwrap_err(), Taken::ByHolder(anna.clone(), 2));
        let third = shares.take(&ben, true).unwrap();
        assert_eq!(third.holder(), &ben);
        assert_eq!(shares.take(&ben, true).unwrap_err(), Taken::ByAll(3));
        drop(first);
        let _fourth = shares.take(&ben, true).unwrap();
        drop(third);
        assert_eq!(shares.take(&anna, false).unwrap_err(), Taken::ByAll(2), "the last one is for those who may order");
        let _fifth = shares.take(&anna, true).unwrap();
        assert_eq!(shares.lock().values().sum::<usize>(), 3);
    }
}
