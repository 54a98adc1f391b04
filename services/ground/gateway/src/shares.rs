//! Shares of something that there is a limited number of, such as event streams or bytes of memory: at most a number for each holder of a
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
    held: Mutex<Held>,
}

/// Who has shares: the clients with one token, or those without any. A token that replaces another of the same name is a new holder:
/// the holder of the old one has no part in the new one's shares.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Holder {
    name: Arc<str>,
    /// The hash of the token; absent where there is none.
    token: Option<[u8; 32]>,
}

/// How many each holder has, and how many of them are held by those who only watch.
#[derive(Debug, Default)]
struct Held {
    by_holder: BTreeMap<Holder, usize>,
    by_watchers: usize,
}

/// One of them, or several; given back with the value.
#[derive(Debug)]
pub(crate) struct Share {
    of: Arc<Shares>,
    who: Holder,
    may_order: bool,
    count: usize,
}

/// Why there is none.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    /// This holder has as many as one may have.
    TooManyOfOne(Arc<str>, usize),
    /// All holders together have all that there are.
    All(usize),
    /// Those who only watch have all that they may have.
    AllForWatchers(usize),
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
        self.take(&client.into(), client.may_order())
    }

    /// Takes one for `who`, who may give orders or not.
    ///
    /// # Errors
    /// When there is none left, or none left for this holder.
    pub(crate) fn take(self: &Arc<Shares>, who: &Holder, may_order: bool) -> Result<Share, Taken> {
        self.take_several(1, who, may_order)
    }

    /// Takes `count` for `who`, who may give orders or not.
    ///
    /// # Errors
    /// When there are not as many left, or not as many left for this holder.
    pub(crate) fn take_several(
        self: &Arc<Shares>,
        count: usize,
        who: &Holder,
        may_order: bool,
    ) -> Result<Share, Taken> {
        let (mut held, for_watchers) = (self.lock(), self.total - self.reserved);
        if self.each < held.by_holder.get(who).copied().unwrap_or_default() + count {
            return Err(Taken::TooManyOfOne(who.name.clone(), self.each));
        }
        if self.total < held.by_holder.values().sum::<usize>() + count {
            return Err(Taken::All(self.total));
        }
        if !may_order && for_watchers < held.by_watchers + count {
            return Err(Taken::AllForWatchers(for_watchers));
        }
        *held.by_holder.entry(who.clone()).or_default() += count;
        held.by_watchers += if may_order { 0 } else { count };
        Ok(Share { of: self.clone(), who: who.clone(), may_order, count })
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Holder {
    /// All clients together that have no token, under this name.
    pub(crate) fn without_token(name: &str) -> Holder {
        Holder { name: name.into(), token: None }
    }
}

impl From<&Identity> for Holder {
    fn from(who: &Identity) -> Holder {
        Holder { name: who.name.clone(), token: Some(who.token_hash()) }
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut held = self.of.lock();
        held.by_watchers -= if self.may_order { 0 } else { self.count };
        if let Some(count) = held.by_holder.get_mut(&self.who) {
            *count -= self.count;
            if *count == 0 {
                held.by_holder.remove(&self.who);
            }
        }
    }
}

impl Taken {
    /// The answer to who wanted one of `what`, such as `event streams`.
    pub(crate) fn problem(self, what: &str) -> Problem {
        let problem = match self {
            Taken::TooManyOfOne(who, each) => Problem::new(
                StatusCode::TOO_MANY_REQUESTS,
                format!("{who} has {each} {what} open, the most that one token may have; close one of them or wait"),
            ),
            Taken::All(total) => Problem::unavailable(format!("all {total} {what} are in use; try again")),
            Taken::AllForWatchers(part) => Problem::unavailable(format!(
                "all {part} {what} for those who only watch are in use, and the rest is kept for those who may order; try again"
            )),
        };
        problem.with_header(RETRY_AFTER, "1")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holder(name: &str) -> Holder {
        Holder::without_token(name)
    }

    #[test]
    fn whoever_has_the_old_token_has_nothing_of_what_the_new_one_may_have() {
        let shares = Shares::new(8, 2);
        let with = |token| Holder { name: "anna".into(), token: Some([token; 32]) };
        let _of_the_thief = [(); 2].map(|()| shares.take(&with(1), true).unwrap());
        assert_eq!(shares.take(&with(1), true).unwrap_err(), Taken::TooManyOfOne("anna".into(), 2));
        let _of_anna = [(); 2].map(|()| shares.take(&with(2), true).unwrap());
        assert_eq!(shares.take(&with(2), true).unwrap_err(), Taken::TooManyOfOne("anna".into(), 2));
    }

    #[test]
    fn one_holder_leaves_the_others_their_share_and_what_is_dropped_is_free_again() {
        let shares = Shares::new(3, 2);
        let (anna, ben) = (holder("anna"), holder("ben"));
        let first = shares.take(&anna, true).unwrap();
        let _second = shares.take(&anna, true).unwrap();
        assert_eq!(shares.take(&anna, true).unwrap_err(), Taken::TooManyOfOne("anna".into(), 2));
        let third = shares.take(&ben, true).unwrap();
        assert_eq!(third.who, ben);
        assert_eq!(shares.take(&ben, true).unwrap_err(), Taken::All(3));
        drop(first);
        let _fourth = shares.take(&ben, true).unwrap();
        drop(third);
        let _fifth = shares.take(&anna, true).unwrap();
        assert_eq!(shares.lock().by_holder.values().sum::<usize>(), 3);
    }

    #[test]
    fn those_who_only_watch_leave_one_for_those_who_may_order() {
        let (shares, eve, anna) = (Shares::new(4, 4), holder("eve"), holder("anna"));
        // What others have who may order counts for the whole, and not for the part of those who watch.
        let _orders = shares.take(&anna, true).unwrap();
        let _watched = [(); 3].map(|()| shares.take(&eve, false).unwrap());
        assert_eq!(shares.take(&anna, true).unwrap_err(), Taken::All(4));
        drop(_orders);
        assert_eq!(shares.take(&eve, false).unwrap_err(), Taken::AllForWatchers(3));
        shares.take(&anna, true).unwrap();
    }

    #[test]
    fn several_are_taken_together_or_not_at_all() {
        let (shares, anna) = (Shares::new(32, 20), holder("anna"));
        let first = shares.take_several(15, &anna, false).unwrap();
        assert_eq!(shares.take_several(6, &anna, false).unwrap_err(), Taken::TooManyOfOne("anna".into(), 20));
        assert_eq!(shares.take_several(16, &holder("eve"), false).unwrap_err(), Taken::AllForWatchers(30));
        let _second = shares.take_several(17, &holder("ben"), true).unwrap();
        assert_eq!(shares.take(&holder("eve"), true).unwrap_err(), Taken::All(32));
        drop(first);
        assert_eq!(shares.lock().by_watchers, 0);
        shares.take_several(15, &anna, false).unwrap();
    }
}
