//! The socket to ground stations, in threads of its own.

#![expect(clippy::disallowed_methods, reason = "only the age of addresses on the wire, of which no decision depends")]

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, UdpSocket};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use domain::time::Time;

use super::GroundEndpoint;
use super::arrivals::Arrivals;
use crate::link::{LONGEST_DATAGRAM, Link, Voice};

/// Frames in the queue of what is sent: a second of full rates.
const QUEUE: usize = 512;

/// The way to ground stations.
#[derive(Debug)]
pub struct GroundSocket {
    arrivals: Shared,
    outgoing: SyncSender<Vec<u8>>,
}

/// What has arrived, and since when the socket is open.
#[derive(Debug, Clone)]
struct Shared(Arc<Mutex<Arrivals>>, Instant);

impl GroundSocket {
    /// Opens it; `wake` is called whenever something has arrived.
    ///
    /// # Errors
    /// If the address cannot be listened on.
    pub fn open(endpoint: &GroundEndpoint, wake: impl Fn() + Send + 'static) -> io::Result<GroundSocket> {
        let told =
            |error: io::Error| io::Error::new(error.kind(), format!("the ground station at {endpoint}: {error}"));
        let (local, only) = match *endpoint {
            GroundEndpoint::UdpIn(address) => (address, None),
            GroundEndpoint::UdpOut(address) if address.is_ipv4() => ((Ipv4Addr::UNSPECIFIED, 0).into(), Some(address)),
            GroundEndpoint::UdpOut(address) => ((Ipv6Addr::UNSPECIFIED, 0).into(), Some(address)),
        };
        let socket = UdpSocket::bind(local).map_err(told)?;
        let sender = socket.try_clone().map_err(told)?;
        let (outgoing, frames) = sync_channel::<Vec<u8>>(QUEUE);
        let arrivals = only.map_or_else(Arrivals::of_any, Arrivals::of_only);
        let arrivals = Shared(Arc::new(Mutex::new(arrivals)), Instant::now());
        let (arrived, present) = (Arc::downgrade(&arrivals.0), arrivals.clone());
        thread::spawn(move || {
            // What is longer fills it, and is dropped.
            let mut buffer = [0; LONGEST_DATAGRAM + 1];
            loop {
                // An error is that of a former send: nobody listens there yet.
                let Ok((length, from)) = socket.recv_from(&mut buffer) else { continue };
                // Nobody takes it any more.
                let Some(arrived) = arrived.upgrade() else { return };
                if length <= LONGEST_DATAGRAM && lock(&arrived).put(from, &buffer[..length]) {
                    wake();
                }
            }
        });
        thread::spawn(move || {
            for frame in frames {
                let to = lock(&present.0).present(present.now());
                // What a ground station misses is said again.
                to.into_iter().for_each(|it| drop(sender.send_to(&frame, it)));
            }
        });
        Ok(GroundSocket { arrivals, outgoing })
    }
}

impl Shared {
    fn now(&self) -> Time {
        Time::after(self.1.elapsed())
    }
}

/// The data are whole even if a thread panicked while it held the lock.
fn lock(arrivals: &Mutex<Arrivals>) -> MutexGuard<'_, Arrivals> {
    arrivals.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Link for GroundSocket {
    fn receive(&mut self, _now: Time) -> Option<Vec<u8>> {
        lock(&self.arrivals.0).take()
    }

    fn send(&mut self, frame: &[u8], _now: Time) {
        // A full queue is a network that takes nothing: the frame is lost, as on the wire.
        let _ = self.outgoing.try_send(frame.to_vec());
    }

    fn is_datagram(&self) -> bool {
        true
    }

    fn admit(&mut self, voice: Voice) -> bool {
        lock(&self.arrivals.0).admit(voice, self.arrivals.now())
    }
}

#[cfg(test)]
mod tests;
