//! Those who call and have not shown a certificate yet: anybody at all.

#![cfg_attr(test, expect(clippy::disallowed_methods, reason = "any moment to begin with"))]

use std::future::Future;
use std::net::{IpAddr, Ipv6Addr};
use std::time::{Duration, Instant};

use tokio::task::{AbortHandle, JoinSet};

/// Handshakes under way at once: more than there are vehicles that call the ground. How many links there may be
/// afterwards is for zenoh and the bus to limit.
const PLACES: usize = 64;

/// Between two lines about callers that were not let in.
const QUIET: Duration = Duration::from_secs(60);

/// Callers whose handshake is under way. There is always a place for the next one: who keeps places without using them
/// loses them, and the network with most of them first, so that nobody keeps out others from elsewhere.
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
        self.places.push((network(from), self.tasks.spawn(greeting)));
    }
}

/// Who counts as one caller: an address of IPv4, and the /64 of one of IPv6, of which a single host has all addresses.
fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V4(address) => address.into(),
        IpAddr::V6(address) => Ipv6Addr::from_bits(address.to_bits() & !u128::from(u64::MAX)).into(),
    }
}

/// Callers that were not let in: one line a minute however many there are, since anybody may call.
#[derive(Debug, Default)]
pub(crate) struct Refusals {
    reported: Option<Instant>,
    count: u64,
}

impl Refusals {
    /// Counts one; how many there were since the last line, with this one, if another line is due.
    pub(crate) fn count(&mut self, now: Instant) -> Option<u64> {
        self.count += 1;
        if self.reported.is_some_and(|it| now.saturating_duration_since(it) < QUIET) {
            return None;
        }
        self.reported = Some(now);
        Some(std::mem::take(&mut self.count))
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

    #[test]
    fn a_network_of_ipv6_is_one_caller() {
        #[track_caller]
        fn check(one: &str, other: &str, same: bool) {
            let [one, other] = [one, other].map(|it| network(it.parse().unwrap()));
            assert_eq!(one == other, same, "{one} {other}");
        }
        check("2001:db8::1", "2001:db8::ffff:1:2:3", true);
        check("2001:db8::1", "2001:db8:0:1::1", false);
        check("10.0.0.1", "10.0.0.2", false);
        check("::ffff:10.0.0.1", "10.0.0.1", true);
        check("::ffff:10.0.0.1", "::ffff:10.0.0.2", false);
    }

    #[test]
    fn refusals_are_a_line_a_minute() {
        let (mut refusals, start) = (Refusals::default(), Instant::now());
        let lines: Vec<_> = (0..150u64).filter_map(|s| refusals.count(start + Duration::from_secs(s))).collect();
        assert_eq!(lines, [1, 60, 60]);
    }
}
