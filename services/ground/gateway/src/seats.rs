//! Who may keep a connection open. Connections without a valid token get few seats, and lose them to newcomers; those of
//! token holders have seats of their own, so that no number of strangers keeps an operator out. Some of those are reserved for holders who
//! may give orders, so that no number of observers keeps an operator out either.
//!
//! Every connection begins as a stranger's. A newcomer for whom there is no seat takes that of the oldest stranger at its own
//! address, if that address has its full number, otherwise of the oldest at the address with the most: an address that floods
//! displaces itself. With its first request under a valid token a connection leaves the strangers.

use std::collections::BTreeMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard};

use tokio::sync::oneshot;

use crate::config::Clients;
use crate::http::caller::Network;
use crate::shares::{Share, Shares, Taken};

/// All seats.
#[derive(Debug)]
pub(crate) struct Seats {
    strangers: Mutex<Strangers<oneshot::Sender<()>>>,
    holders: Arc<Shares>,
}

/// The seat of one connection; given back with the value.
#[derive(Debug)]
pub(crate) struct Seat {
    seats: Arc<Seats>,
    /// The client's address.
    pub(crate) address: IpAddr,
    number: u64,
    /// Once its client has shown a token; with what keeps the connection open.
    holder: Mutex<Option<(Share, oneshot::Sender<()>)>>,
}

impl Seats {
    /// With room for `connections`, of which strangers get the configured number, and no more than half.
    pub(crate) fn new(connections: usize, limits: &Clients) -> Arc<Seats> {
        let strangers = usize::from(limits.strangers.get()).min(connections / 2);
        let of_holders = connections - strangers;
        let holders = Shares::new(of_holders, limits.connections_per_token.get().into());
        let strangers = Strangers::new(strangers, limits.strangers_per_address.get().into());
        Arc::new(Seats { strangers: Mutex::new(strangers), holders })
    }

    /// A seat for a connection from `address`, which has to close when the receiver ends.
    pub(crate) fn take(self: &Arc<Seats>, address: IpAddr) -> (Seat, oneshot::Receiver<()>) {
        let (stay, close) = oneshot::channel();
        let number = self.lock().admit(Network::of(address), stay);
        (Seat { seats: self.clone(), address, number, holder: Mutex::default() }, close)
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, Strangers<oneshot::Sender<()>>> {
        self.strangers.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Seat {
    /// The client has shown that it is `who`, and whether that one may order something.
    pub(crate) fn claim(&self, who: &Arc<str>, may_order: bool) -> Result<(), Taken> {
        let mut holder = self.holder.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if holder.as_ref().is_some_and(|(share, _)| share.holder() == who) {
            return Ok(());
        }
        let (before, stay) = match holder.take() {
            // Its old share may be the last one.
            Some((share, stay)) => (Some((share.holder().clone(), share.may_order())), stay),
            None => match self.seats.lock().leave(self.number) {
                Some(stay) => (None, stay),
                // A newcomer has just displaced it: the connection is about to close.
                None => return Ok(()),
            },
        };
        let claimed = self.seats.holders.take(who, may_order);
        match (claimed, before) {
            (Ok(share), _) => *holder = Some((share, stay)),
            (Err(taken), Some((before, may_order))) => {
                *holder = self.seats.holders.take(&before, may_order).ok().map(|share| (share, stay));
                return Err(taken);
            }
            (Err(taken), None) => {
                self.seats.lock().sitting.insert(self.number, (Network::of(self.address), stay));
                return Err(taken);
            }
        }
        Ok(())
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.seats.lock().leave(self.number);
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

    /// Lets a newcomer in, and returns its number.
    fn admit(&mut self, from: Network, stay: T) -> u64 {
        if let Some(displaced) = self.displaced_by(from) {
            self.sitting.remove(&displaced);
        }
        self.last += 1;
        self.sitting.insert(self.last, (from, stay));
        self.last
    }

    /// Who has to leave for a newcomer.
    fn displaced_by(&self, from: Network) -> Option<u64> {
        let mut counts = BTreeMap::<Network, usize>::new();
        self.sitting.values().for_each(|(network, _)| *counts.entry(*network).or_default() += 1);
        let of = |network: Network| self.sitting.iter().find(|(_, it)| it.0 == network).map(|(number, _)| *number);
        if counts.get(&from).is_some_and(|count| self.per_address <= *count) {
            return of(from);
        }
        if self.sitting.len() < self.most {
            return None;
        }
        let largest = counts.values().max()?;
        // Of several, the one whose oldest has sat longest.
        self.sitting.iter().find(|(_, (network, _))| counts.get(network) == Some(largest)).map(|(number, _)| *number)
    }

    /// A stranger leaves, by itself or because it is none any more.
    fn leave(&mut self, number: u64) -> Option<T> {
        self.sitting.remove(&number).map(|(_, stay)| stay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroU16;

    /// Who sits after these came, by the last part of the address and the order of arrival.
    #[track_caller]
    fn check(came: &[u8], expected: &[(u64, u8)]) {
        let network = |last: u8| Network::of([192, 0, 2, last].into());
        let mut strangers = Strangers::new(4, 3);
        for last in came {
            strangers.admit(network(*last), *last);
        }
        let sitting: Vec<_> = strangers.sitting.iter().map(|(number, (_, last))| (*number, *last)).collect();
        assert_eq!(sitting, expected);
    }

    #[test]
    fn an_address_that_floods_displaces_itself() {
        check(&[1, 1, 1], &[(1, 1), (2, 1), (3, 1)]);
        check(&[1, 1, 1, 1, 1], &[(3, 1), (4, 1), (5, 1)]);
        check(&[2, 1, 1, 1, 1, 1], &[(1, 2), (4, 1), (5, 1), (6, 1)]);
        // No seat is left: one of the address that has the most.
        check(&[1, 2, 2, 3, 4], &[(1, 1), (3, 2), (4, 3), (5, 4)]);
        // All have one: the oldest.
        check(&[1, 2, 3, 4, 5], &[(2, 2), (3, 3), (4, 4), (5, 5)]);
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

    #[test]
    fn a_token_holder_is_not_displaced_and_has_a_limit_of_its_own() {
        let (seats, anna, ben) = (seats(4, 2, 2), "anna".into(), "ben".into());
        let here = [127, 0, 0, 1].into();
        let take = || seats.take(here);
        let ((first, mut first_closes), (second, _second_closes)) = (take(), take());
        assert_eq!(
            (first.claim(&anna, true), first.claim(&anna, true), second.claim(&anna, true)),
            (Ok(()), Ok(()), Ok(()))
        );
        let (third, mut third_closes) = take();
        assert_eq!(third.claim(&anna, true), Err(Taken::TooManyOfOne(anna, 2)));
        let (_fourth, mut fourth_closes) = take();
        let (_fifth, _fifth_closes) = take();
        let is_closed = |it: &mut oneshot::Receiver<()>| it.try_recv() == Err(oneshot::error::TryRecvError::Closed);
        assert!(is_closed(&mut third_closes) && !is_closed(&mut fourth_closes) && !is_closed(&mut first_closes));
        // Displaced in the moment in which it shows its token: nothing is left behind.
        assert_eq!(third.claim(&ben, true), Ok(()));
        assert_eq!(first.claim(&ben, true), Ok(()), "another token over the same connection");
        drop((first, second, third));
        assert!(is_closed(&mut first_closes));
        let again: Vec<_> = (0..2).map(|_| take()).collect();
        assert!(again.iter().all(|(seat, _)| seat.claim(&ben, true) == Ok(())));
    }

    #[test]
    fn those_who_only_watch_leave_seats_to_those_who_may_order() {
        // One of sixteen.
        let seats = seats(18, 2, 5);
        let take = || seats.take([127, 0, 0, 1].into());
        let sit = |number: usize| {
            let (seat, closes) = take();
            assert_eq!(seat.claim(&format!("watcher {}", number / 5).into(), false), Ok(()), "{number}");
            (seat, closes)
        };
        let _watching: Vec<_> = (0..15).map(sit).collect();
        let (one_more, _closes) = take();
        assert_eq!(one_more.claim(&"watcher 9".into(), false), Err(Taken::AllForWatchers(15)));
        assert_eq!(one_more.claim(&"anna".into(), true), Ok(()));
    }
}
