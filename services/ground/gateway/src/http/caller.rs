//! Where a request comes from: the client's address, and the seat that its connection takes.

use std::fmt;
use std::net::{IpAddr, Ipv6Addr};
use std::sync::Arc;

use axum::http::request::Parts;

use crate::access::Identity;
use crate::http::problem::Problem;
use crate::seats::Seat;

/// The client of a request. The server adds it to each request; a router that is called without a server has none.
#[derive(Debug, Clone, Default)]
pub(crate) struct Caller(pub(crate) Option<Arc<Seat>>);

/// The clients that share the limits of one address: an IPv4 address, or an IPv6 network of 64 bits, which is what a provider
/// gives to one customer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Network(IpAddr);

impl Caller {
    /// The client of the request with these parts.
    pub(crate) fn of(parts: &Parts) -> Caller {
        parts.extensions.get().cloned().unwrap_or_default()
    }

    /// The client's address; empty where it is not known.
    pub(crate) fn address(&self) -> String {
        self.0.as_ref().map(|it| it.address.to_string()).unwrap_or_default()
    }

    /// The address that refusals are counted by.
    pub(crate) fn network(&self) -> String {
        self.0.as_ref().map(|it| Network::of(it.address).to_string()).unwrap_or_default()
    }

    /// The connection belongs to the holder of a token from now on.
    ///
    /// # Errors
    /// When the holder has too many connections, or all that are kept for such holders are taken.
    pub(crate) fn identified_as(&self, who: &Identity) -> Result<(), Problem> {
        let claim = |seat: &Arc<Seat>| seat.claim(who);
        self.0.as_ref().map_or(Ok(()), claim).map_err(|taken| taken.problem("connections"))
    }
}

impl Network {
    /// The network of an address.
    pub(crate) fn of(address: IpAddr) -> Network {
        match address.to_canonical() {
            IpAddr::V4(address) => Network(address.into()),
            IpAddr::V6(address) => Network(Ipv6Addr::from_bits(address.to_bits() >> 64 << 64).into()),
        }
    }
}

impl fmt::Display for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            IpAddr::V4(address) => address.fmt(f),
            IpAddr::V6(address) => write!(f, "{address}/64"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clients_of_one_network_share_its_limits() {
        for (address, network) in [
            ("192.0.2.7", "192.0.2.7"),
            ("::ffff:192.0.2.7", "192.0.2.7"),
            ("2001:db8:0:1:aaaa::1", "2001:db8:0:1::/64"),
            ("2001:db8:0:1:bbbb::2", "2001:db8:0:1::/64"),
            ("2001:db8:0:2::1", "2001:db8:0:2::/64"),
        ] {
            assert_eq!(Network::of(address.parse().unwrap()).to_string(), network);
        }
    }
}
