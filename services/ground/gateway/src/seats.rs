//! Who may keep a connection open. Connections without a valid token get few seats, and lose them to newcomers; those of
//! token holders have seats of their own, so that no number of strangers keeps an operator out. Some of those are reserved for holders who
//! may give orders, so that no number of observers keeps an operator out either.
//!
//! Every connection begins as a stranger's. A newcomer for whom there is no seat takes that of a stranger at its own
//! address, if that address has its full number, otherwise of one at the address with the most: an address that floods
//! displaces itself. Which one of these is drawn by lot: a newcomer has to encrypt before it can show its token, and if always the
//! oldest had to leave, those who arrive meanwhile would displace it for certain, at each new attempt.
//!
//! With its first request under a valid token a connection leaves the strangers. It is a stranger's again when that token
//! is not valid any more, and closes if the strangers have no seat left: it displaces nobody.

use std::collections::BTreeMap;
use std::hash::{BuildHasher as _, RandomState};
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard};

use tokio::sync::oneshot;

use crate::access::Identity;
use crate::config::Clients;
use crate::http::caller::Network;
use crate::shares::{Share, Shares, Taken};

/// All seats.
#[derive(Debug)]
pub(crate) struct Seats {
    sitting: Mutex<Sitting>,
    holders: Arc<Shares>,
}

/// Who sits, by the number of the connection.
#[derive(Debug)]
struct Sitting {
    strangers: Strangers<oneshot::Sender<()>>,
    claimed: BTreeMap<u64, Claimed>,
}

/// The seat of a connection whose client has shown a valid token.
#[derive(Debug)]
struct Claimed {
    who: Identity,
    share: Share,
    /// Keeps the connection open.
    stay: oneshot::Sender<()>,
    from: Network,
}

/// The seat of one connection; given back with the value.
#[derive(Debug)]
pub(crate) struct Seat {
    seats: Arc<Seats>,
    /// The client's address.
    pub(crate) address: IpAddr,
    number: u64,
}

impl Seats {
    /// With room for `connections`, of which strangers get the configured number, and no more than half.
    pub(crate) fn new(connections: usize, limits: &Clients) -> Arc<Seats> {
        let strangers = usize::from(limits.strangers.get()).min(connections / 2);
        let of_holders = connections - strangers;
        let holders = Shares::new(of_holders, limits.connections_per_token.get().into());
        let strangers = Strangers::new(strangers, limits.strangers_per_address.get().into());
        Arc::new(Seats { sitting: Mutex::new(Sitting { strangers, claimed: BTreeMap::new() }), holders })
    }

    /// A seat for a connection from `address`, which has to close when the receiver ends.
    pub(crate) fn take(self: &Arc<Seats>, address: IpAddr) -> (Seat, oneshot::Receiver<()>) {
        // Each has keys of its own, which nobody outside can guess.
        self.take_by_lot(address, RandomState::new().hash_one(()) as usize)
    }

    /// The lot decides who has to leave.
    fn take_by_lot(self: &Arc<Seats>, address: IpAddr, lot: usize) -> (Seat, oneshot::Receiver<()>) {
        let (stay, close) = oneshot::channel();
        let number = self.lock().strangers.admit(Network::of(address), stay, lot);
        (Seat { seats: self.clone(), address, number }, close)
    }

    /// Gives back the seats of holders whose token is not valid any more.
    pub(crate) fn keep(&self, is_valid: impl Fn(&Identity) -> bool) {
        let mut sitting = self.lock();
        let Sitting { strangers, claimed } = &mut *sitting;
        for (number, Claimed { from, stay, .. }) in claimed.extract_if(.., |_, it| !is_valid(&it.who)) {
            strangers.come_back(number, from, stay);
        }
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Sitting> {
        self.sitting.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Seat {
    /// The client has shown the token of `who`.
    pub(crate) fn claim(&self, who: &Identity) -> Result<(), Taken> {
        let (holders, number) = (&self.seats.holders, self.number);
        let mut sitting = self.seats.lock();
        // With other roles it has another share, although the token is the same.
        if sitting.claimed.get(&number).is_some_and(|it| it.who == *who) {
            return Ok(());
        }
        let (before, from, stay) = match sitting.claimed.remove(&number) {
            Some(Claimed { who, share, from, stay }) => {
                // It may be the last one.
                drop(share);
                (Some(who), from, stay)
            }
            None => match sitting.strangers.leave(number) {
                Some((from, stay)) => (None, from, stay),
                // A newcomer has just displaced it: the connection is about to close.
                None => return Ok(()),
            },
        };
        let (refusal, now) = match (holders.take_for(who), before) {
            (Ok(share), _) => (Ok(()), Some((who.clone(), share))),
            (Err(taken), before) => (Err(taken), before.and_then(|it| Some((it.clone(), holders.take_for(&it).ok()?)))),
        };
        match now {
            Some((who, share)) => {
                sitting.claimed.insert(number, Claimed { who, share, stay, from });
            }
            None => sitting.strangers.stay(number, from, stay),
        }
        refusal
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut sitting = self.seats.lock();
        sitting.strangers.leave(self.number);
        sitting.claimed.remove(&self.number);
    }
}

/// The connections without a token, by the order of their arrival, each with something that is dropped when it is displaced.
#[derive(Debug)]
struct Strangers<T> {
    most: usize,
    per_address: usize,
    last: u64,
    sitting: BTreeMap<u64, (Network, T)>,
}

impl<T> Strangers<T> {
    fn new(most: usize, per_address: usize) -> Strangers<T> {
        Strangers { most, per_address, last: 0, sitting: BTreeMap::new() }
    }

    /// Lets a newcomer in, and returns its number. Of those who may have to leave for it, `lot` decides who does.
    fn admit(&mut self, from: Network, stay: T, lot: usize) -> u64 {
        let candidates = self.displaced_by(from);
        if let Some(drawn) = lot.checked_rem(candidates.len()).and_then(|it| candidates.get(it)) {
            self.sitting.remove(drawn);
        }
        self.last += 1;
        self.sitting.insert(self.last, (from, stay));
        self.last
    }

    /// One that has left comes back, if it displaces nobody.
    fn come_back(&mut self, number: u64, from: Network, stay: T) {
        if self.displaced_by(from).is_empty() {
            self.stay(number, from, stay);
        }
    }

    /// One that has just left has not left.
    fn stay(&mut self, number: u64, from: Network, stay: T) {
        self.sitting.insert(number, (from, stay));
    }

    /// Those of whom one has to leave for a newcomer, the oldest first; none if there is a seat for it.
    fn displaced_by(&self, from: Network) -> Vec<u64> {
        let mut counts = BTreeMap::<Network, usize>::new();
        self.sitting.values().for_each(|(network, _)| *counts.entry(*network).or_default() += 1);
        let of = |has_to: &dyn Fn(&Network) -> bool| {
            self.sitting.iter().filter(|(_, (network, _))| has_to(network)).map(|(number, _)| *number).collect()
        };
        if counts.get(&from).is_some_and(|count| self.per_address <= *count) {
            return of(&|network| *network == from);
        }
        if self.sitting.len() < self.most {
            return Vec::new();
        }
        let largest = counts.values().max();
        of(&|network| counts.get(network) == largest)
    }

    /// A stranger leaves, by itself or because it has become a token holder.
    fn leave(&mut self, number: u64) -> Option<(Network, T)> {
        self.sitting.remove(&number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroU16;

    use domain::file::Source;

    use crate::access::{Role, Tokens, entry};

    /// Who sits after these came, by the last part of the address and the order of arrival; the lot is the same each time.
    #[track_caller]
    fn check(lot: usize, came: &[u8], expected: &[(u64, u8)]) {
        let network = |last: u8| Network::of([192, 0, 2, last].into());
        let mut strangers = Strangers::new(4, 3);
        for last in came {
            strangers.admit(network(*last), *last, lot);
        }
        let sitting: Vec<_> = strangers.sitting.iter().map(|(number, (_, last))| (*number, *last)).collect();
        assert_eq!(sitting, expected);
    }

    #[test]
    fn an_address_that_floods_displaces_itself() {
        for lot in 0..9 {
            check(lot, &[1, 1, 1], &[(1, 1), (2, 1), (3, 1)]);
        }
        check(0, &[1, 1, 1, 1, 1], &[(3, 1), (4, 1), (5, 1)]);
        check(1, &[1, 1, 1, 1, 1], &[(1, 1), (4, 1), (5, 1)]);
        check(2, &[1, 1, 1, 1, 1], &[(1, 1), (2, 1), (5, 1)]);
        check(0, &[2, 1, 1, 1, 1, 1], &[(1, 2), (4, 1), (5, 1), (6, 1)]);
        check(5, &[2, 1, 1, 1, 1, 1], &[(1, 2), (2, 1), (3, 1), (6, 1)]);
        // No seat is left: one of the address that has the most.
        check(0, &[1, 2, 2, 3, 4], &[(1, 1), (3, 2), (4, 3), (5, 4)]);
        check(1, &[1, 2, 2, 3, 4], &[(1, 1), (2, 2), (4, 3), (5, 4)]);
        // All have one: any of them.
        check(0, &[1, 2, 3, 4, 5], &[(2, 2), (3, 3), (4, 4), (5, 5)]);
        check(2, &[1, 2, 3, 4, 5], &[(1, 1), (2, 2), (4, 4), (5, 5)]);
        check(7, &[1, 2, 3, 4, 5], &[(1, 1), (2, 2), (3, 3), (5, 5)]);
    }

    /// If always the oldest had to leave, not one of them would be left.
    #[test]
    fn a_newcomer_may_stay_although_as_many_arrive_after_it_as_there_are_seats() {
        for from_its_own_address in [true, false] {
            let seats = seats(128, 64, 9);
            let address = |last: u8| [192, 0, 2, if from_its_own_address { 1 } else { last }].into();
            let flood =
                |lasts: std::ops::RangeInclusive<u8>| lasts.map(|it| seats.take(address(it))).collect::<Vec<_>>();
            let tries = (0..200).filter(|_| {
                let _before = flood(1..=64);
                let (_seat, mut closes) = seats.take(address(0));
                let _after = flood(65..=128);
                !is_closed(&mut closes)
            });
            // 73 on average; chance does not go so far from that.
            let stayed = tries.count();
            assert!((20..140).contains(&stayed), "{stayed}");
        }
    }

    fn seats(connections: usize, strangers: u16, per_token: u16) -> Arc<Seats> {
        let number = |it| NonZeroU16::new(it).unwrap();
        Seats::new(
            connections,
            &Clients {
                strangers: number(strangers),
                strangers_per_address: number(strangers),
                connections_per_token: number(per_token),
                streams_per_token: number(1),
                downloads_per_token: number(1),
                write_timeout_s: 1.0.try_into().unwrap(),
            },
        )
    }

    fn is_closed(closes: &mut oneshot::Receiver<()>) -> bool {
        closes.try_recv() == Err(oneshot::error::TryRecvError::Closed)
    }

    fn identity(name: &str, role: Role, token: &str) -> Identity {
        let source = Source { path: "tokens".into(), text: entry(name, &[role], token) };
        Tokens::parse(&source).unwrap().identify(token, 0).unwrap().clone()
    }

    #[test]
    fn a_token_holder_is_not_displaced_and_has_a_limit_of_its_own() {
        let seats = seats(4, 2, 2);
        let [anna, ben] = ["anna", "ben"].map(|it| identity(it, Role::Operator, it));
        // The oldest stranger has to leave.
        let take = || seats.take_by_lot([127, 0, 0, 1].into(), 0);
        let ((first, mut first_closes), (second, _second_closes)) = (take(), take());
        assert_eq!((first.claim(&anna), first.claim(&anna), second.claim(&anna)), (Ok(()), Ok(()), Ok(())));
        let (third, mut third_closes) = take();
        assert_eq!(third.claim(&anna), Err(Taken::TooManyOfOne("anna".into(), 2)));
        let (_fourth, mut fourth_closes) = take();
        let (_fifth, _fifth_closes) = take();
        assert!(is_closed(&mut third_closes) && !is_closed(&mut fourth_closes) && !is_closed(&mut first_closes));
        // Displaced in the moment in which it shows its token: nothing is left behind.
        assert_eq!(third.claim(&ben), Ok(()));
        assert_eq!(first.claim(&ben), Ok(()), "another token over the same connection");
        drop((first, second, third));
        assert!(is_closed(&mut first_closes));
        let again: Vec<_> = (0..2).map(|_| take()).collect();
        assert!(again.iter().all(|(seat, _)| seat.claim(&ben) == Ok(())));
    }

    #[test]
    fn who_is_refused_under_another_token_keeps_the_seat_of_the_first() {
        let seats = seats(6, 3, 1);
        let [anna, ben] = ["anna", "ben"].map(|it| identity(it, Role::Operator, it));
        let take = || seats.take_by_lot([127, 0, 0, 1].into(), 0);
        let ((first, mut first_closes), (second, _second_closes)) = (take(), take());
        assert_eq!((first.claim(&anna), second.claim(&ben)), (Ok(()), Ok(())));
        assert_eq!(first.claim(&ben), Err(Taken::TooManyOfOne("ben".into(), 1)));
        let _newcomers: Vec<_> = (0..9).map(|_| take()).collect();
        assert!(!is_closed(&mut first_closes), "it is not a stranger's");
        assert_eq!(take().0.claim(&anna), Err(Taken::TooManyOfOne("anna".into(), 1)));
    }

    #[test]
    fn whoever_has_a_token_that_was_replaced_keeps_neither_its_owner_out_nor_a_seat() {
        let seats = seats(8, 4, 2);
        let [stolen, new] = ["stolen", "new"].map(|it| identity("anna", Role::Operator, it));
        let take = || seats.take_by_lot([127, 0, 0, 1].into(), 0);
        let claimed_with = |who: &Identity| {
            let (seat, closes) = take();
            assert_eq!(seat.claim(who), Ok(()));
            (seat, closes)
        };
        let mut of_the_thief = [(); 2].map(|()| claimed_with(&stolen));
        // At once, before anybody has looked whose token is still valid.
        let mut of_anna = [(); 2].map(|()| claimed_with(&new));
        // All four seats of holders are taken.
        assert_eq!(take().0.claim(&identity("ben", Role::Operator, "ben")), Err(Taken::All(4)));
        let (_stranger, mut stranger_closes) = take();
        seats.keep(|who| *who != stolen);
        assert!(!of_the_thief.iter_mut().any(|(_, closes)| is_closed(closes)), "there are seats for strangers");
        let _of_ben = claimed_with(&identity("ben", Role::Operator, "ben"));
        let _newcomers: Vec<_> = (0..4).map(|_| take()).collect();
        assert!(of_the_thief.iter_mut().all(|(_, closes)| is_closed(closes)), "newcomers displace strangers");
        assert!(is_closed(&mut stranger_closes));
        assert!(!of_anna.iter_mut().any(|(_, closes)| is_closed(closes)));
    }

    #[test]
    fn whose_token_was_taken_away_displaces_no_stranger() {
        let seats = seats(4, 2, 2);
        let anna = identity("anna", Role::Operator, "anna");
        let take = || seats.take_by_lot([127, 0, 0, 1].into(), 0);
        let (first, mut first_closes) = take();
        assert_eq!(first.claim(&anna), Ok(()));
        let mut strangers = [(); 2].map(|()| take());
        seats.keep(|_| false);
        assert!(is_closed(&mut first_closes));
        assert!(!strangers.iter_mut().any(|(_, closes)| is_closed(closes)));
        // About to close, as one that was displaced.
        assert_eq!(first.claim(&anna), Ok(()));
    }

    #[test]
    fn those_who_only_watch_leave_seats_to_those_who_may_order() {
        // One of sixteen.
        let seats = seats(18, 2, 5);
        let take = || seats.take_by_lot([127, 0, 0, 1].into(), 0);
        let watcher = |number: usize| identity(&format!("watcher {number}"), Role::Observer, &number.to_string());
        let sit = |number: usize| {
            let (seat, closes) = take();
            assert_eq!(seat.claim(&watcher(number / 5)), Ok(()), "{number}");
            (seat, closes)
        };
        let _watching: Vec<_> = (0..15).map(sit).collect();
        let (one_more, _closes) = take();
        assert_eq!(one_more.claim(&watcher(9)), Err(Taken::AllForWatchers(15)));
        assert_eq!(one_more.claim(&identity("anna", Role::Operator, "anna")), Ok(()));
    }

    #[test]
    fn whose_roles_are_changed_keeps_the_seat_and_has_it_under_the_new_ones_from_the_next_request() {
        // One of two.
        let seats = seats(4, 2, 2);
        let take = || seats.take_by_lot([127, 0, 0, 1].into(), 0);
        let (first, mut first_closes) = take();
        let [watches, orders] = [Role::Observer, Role::Operator].map(|it| identity("anna", it, "token"));
        assert_eq!(first.claim(&watches), Ok(()));
        let source = Source { path: "tokens".into(), text: entry("anna", &[Role::Operator], "token") };
        let changed = Tokens::parse(&source).unwrap();
        seats.keep(|who| changed.has_token(&who.token_hash(), 0));
        let _newcomers: Vec<_> = (0..9).map(|_| take()).collect();
        assert!(!is_closed(&mut first_closes), "it is not a stranger's");
        let (other, _other_closes) = take();
        let ben = identity("ben", Role::Observer, "ben");
        assert_eq!(other.claim(&ben), Err(Taken::AllForWatchers(1)));
        assert_eq!((first.claim(&orders), other.claim(&ben)), (Ok(()), Ok(())));
    }
}
