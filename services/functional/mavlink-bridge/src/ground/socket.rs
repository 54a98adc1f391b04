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
use crate::link::{LONGEST_DATAGRAM, Link};

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

    fn admit(&mut self, speaks: bool) -> bool {
        lock(&self.arrivals.0).admit(speaks, self.arrivals.now())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Frame;
    use crate::ground::Ground;
    use crate::signing::{Key, RADIO_STATUS, SignedLink, Signing};
    use std::net::SocketAddr;
    use std::sync::mpsc::{Receiver, channel};
    use std::time::Duration;

    const PATIENCE: Duration = Duration::from_secs(60);
    /// 2026-01-01.
    const UTC_MS: i64 = 1_767_225_600_000;

    fn station() -> UdpSocket {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        socket
    }

    /// A ground station's.
    fn heartbeat(sequence: u8) -> Frame {
        Frame::new(sequence, 255, 190, 0, &[0, 0, 0, 0, 6, 8, 0, 4, 3])
    }

    #[test]
    fn a_station_that_listens_hears_frames_and_is_heard_and_a_stranger_is_not() {
        let (station, stranger) = (station(), station());
        let (woken, wake) = channel();
        let endpoint = GroundEndpoint::UdpOut(station.local_addr().unwrap());
        let mut socket = GroundSocket::open(&endpoint, move || woken.send(()).unwrap_or(())).unwrap();
        let frame = heartbeat(1);
        socket.send(frame.bytes(), Time::ZERO);
        let mut buffer = [0; 300];
        let (length, bridge) = station.recv_from(&mut buffer).unwrap();
        assert_eq!(&buffer[..length], frame.bytes());
        let bridge = SocketAddr::from((Ipv4Addr::LOCALHOST, bridge.port()));
        stranger.send_to(frame.bytes(), bridge).unwrap();
        let other = heartbeat(2);
        station.send_to(other.bytes(), bridge).unwrap();
        wake.recv_timeout(PATIENCE).unwrap();
        assert_eq!(socket.receive(Time::ZERO).as_deref(), Some(other.bytes()));
        assert_eq!(socket.receive(Time::ZERO), None);
    }

    /// A bridge that listens for ground stations behind `link`, and where that is.
    fn listening(key: Option<&Key>) -> (Ground, SocketAddr, Receiver<()>) {
        let (woken, wake) = channel();
        let free = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let socket = GroundSocket::open(&GroundEndpoint::UdpIn(free), move || woken.send(()).unwrap_or(())).unwrap();
        let link: Box<dyn Link> = Box::new(socket);
        let link: Box<dyn Link> = match key {
            Some(key) => Box::new(SignedLink::new(link, Signing::new(key.clone(), 1), || UTC_MS)),
            None => link,
        };
        (Ground::new(link), free, wake)
    }

    /// Takes in what arrives until a frame goes on to the vehicle.
    #[track_caller]
    fn onward(ground: &mut Ground, wake: &Receiver<()>) -> Vec<Frame> {
        loop {
            wake.recv_timeout(PATIENCE).unwrap();
            let onward = ground.take_from_ground(Some(1), Time::ZERO);
            if !onward.is_empty() {
                return onward;
            }
        }
    }

    #[test]
    fn four_strangers_do_not_keep_out_a_station_that_signs() {
        let key: Key = "11".repeat(32).parse().unwrap();
        let (mut ground, bridge, wake) = listening(Some(&key));
        // What a radio says needs no signature, and gives no place either.
        let radio = Frame::new(1, 51, 68, RADIO_STATUS, &[1; 9]);
        let strangers = [(); 8].map(|()| station());
        for stranger in &strangers {
            stranger.send_to(heartbeat(1).bytes(), bridge).unwrap();
            stranger.send_to(radio.bytes(), bridge).unwrap();
        }
        let station = station();
        let signed = Signing::new(key, 0).sign(heartbeat(2), UTC_MS);
        station.send_to(signed.bytes(), bridge).unwrap();
        assert_eq!(onward(&mut ground, &wake), [signed]);
        ground.act(Some(1), Time::ZERO);
        station.recv_from(&mut [0; 300]).unwrap();
        // The frame to the station was sent after what would have gone to them.
        for stranger in &strangers {
            stranger.set_nonblocking(true).unwrap();
            assert!(stranger.recv_from(&mut [0; 300]).is_err());
        }
    }

    #[test]
    fn a_datagram_that_is_longer_than_any_of_mavlink_is_dropped() {
        let (mut ground, bridge, wake) = listening(None);
        let station = station();
        let padded = |sequence: u8, length: usize| {
            let mut datagram = heartbeat(sequence).bytes().to_vec();
            datagram.resize(length, 0);
            datagram
        };
        for datagram in [padded(1, LONGEST_DATAGRAM + 1), padded(2, LONGEST_DATAGRAM), padded(3, 65_000)] {
            station.send_to(&datagram, bridge).unwrap();
        }
        assert_eq!(onward(&mut ground, &wake), [heartbeat(2)]);
        station.send_to(heartbeat(4).bytes(), bridge).unwrap();
        assert_eq!(onward(&mut ground, &wake), [heartbeat(4)]);
    }
}
