//! Those who call and have not shown a certificate yet: anybody at all.

use std::future::Future;
use std::net::IpAddr;

use tokio::task::{AbortHandle, JoinSet};

/// Handshakes under way at once: more than there are vehicles that call the ground. How many links there may be
/// afterwards is for zenoh and the bus to limit.
const PLACES: usize = 64;

/// Callers whose handshake is under way. There is always a place for the next one: who keeps places without using them
/// loses them, and whoever has most of them first, so that nobody keeps out others from elsewhere.
#[derive(Debug, Default)]
pub(crate) struct Callers {
    tasks: JoinSet<()>,
    /// Oldest first.
    places: Vec<(IpAddr, AbortHandle)>,
}

impl Callers {
    /// Looks after a caller from this address, at the price of another if there is no place.
    pub(crate) fn greet(&mut self, from: IpAddr, greeting: impl Future<Output = ()> + Send + 'static) {
        while self.tasks.try_join_next().is_some() {}
        self.places.retain(|(_, it)| !it.is_finished());
        if PLACES <= self.places.len() {
            let addresses: Vec<IpAddr> = self.places.iter().map(|it| it.0).collect();
            let (who, place) = self.places.remove(first_to_go(&addresses));
            tracing::debug!(%who, "hung up on: too many callers");
            place.abort();
        }
        self.places.push((from, self.tasks.spawn(greeting)));
    }
}

/// The oldest of the address that has most of these, which are in the order of their age.
fn first_to_go(addresses: &[IpAddr]) -> usize {
    let count = |address: &IpAddr| addresses.iter().filter(|it| *it == address).count();
    let most = addresses.iter().map(count).max();
    addresses.iter().position(|it| Some(count(it)) == most).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_has_most_places_loses_the_oldest() {
        #[track_caller]
        fn check(hosts: &[u8], expected: usize) {
            let addresses: Vec<IpAddr> = hosts.iter().map(|host| [10, 0, 0, *host].into()).collect();
            assert_eq!(first_to_go(&addresses), expected, "{hosts:?}");
        }
        check(&[1], 0);
        check(&[1, 2, 3], 0);
        check(&[1, 2, 2], 1);
        check(&[1, 2, 3, 3, 2, 3], 2);
        check(&[1, 2, 2, 1], 0);
    }
}
