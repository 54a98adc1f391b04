//! The link between both routers, as troubles see it.

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use faulty_link::{CLEAR, Proxy, Shape};

use crate::trouble::Ways;

/// A link and the number of its faults.
#[derive(Debug)]
pub(crate) struct FaultyLink {
    proxy: Proxy,
    faults: AtomicU32,
}

impl FaultyLink {
    /// A link to the ground's router.
    pub(crate) fn to(ground: SocketAddr, seed: u64) -> FaultyLink {
        FaultyLink { proxy: Proxy::to(ground, seed), faults: AtomicU32::new(0) }
    }

    /// Where the aircraft calls.
    pub(crate) fn address(&self) -> SocketAddr {
        self.proxy.address
    }

    /// The ground's end of the link.
    pub(crate) fn ground(&self) -> SocketAddr {
        self.proxy.target
    }

    /// Whether it has a fault now: then an order may be refused.
    pub(crate) fn is_faulty(&self) -> bool {
        0 < self.faults.load(Ordering::SeqCst)
    }

    /// Nothing passes for a while; `meanwhile` happens right after the cut. Of two cuts at a time the end of the first one ends
    /// both.
    pub(crate) fn cut(&self, ways: Ways, time: Duration, meanwhile: impl FnOnce()) {
        let begin = || {
            self.proxy.cut(ways.directions());
            meanwhile();
        };
        self.for_a_while(time, begin, || self.proxy.heal());
    }

    /// It is slow, or narrow, for a while. Of two shapes at a time the second one replaces the first.
    pub(crate) fn shape(&self, delay: Duration, bits_per_s: Option<u64>, time: Duration) {
        let bits_per_s = bits_per_s.map(|it| it as f64);
        self.for_a_while(time, || self.proxy.shape(Shape { bits_per_s, delay, ..CLEAR }), || self.proxy.shape(CLEAR));
    }

    fn for_a_while(&self, time: Duration, begin: impl FnOnce(), end: impl FnOnce()) {
        self.faults.fetch_add(1, Ordering::SeqCst);
        begin();
        std::thread::sleep(time);
        end();
        self.faults.fetch_sub(1, Ordering::SeqCst);
    }
}
