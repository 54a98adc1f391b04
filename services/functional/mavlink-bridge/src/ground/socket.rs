//! The socket to ground stations, in threads of its own.

#![expect(clippy::disallowed_methods, reason = "only the age of addresses on the wire, of which no decision depends")]

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use domain::time::Time;

use super::GroundEndpoint;
use crate::frame::{Found, Framer};
use crate::link::Link;

/// Datagrams in the queue of what has arrived, and frames in that of what is sent: a second of full rates.
const QUEUE: usize = 512;
/// Ground stations that are sent to at once.
const MOST_STATIONS: usize = 4;
/// After this silence a ground station is no longer sent to: it says at least once a second that it is there.
const STATION_GONE: Duration = Duration::from_secs(30);

/// The way to ground stations.
#[derive(Debug)]
pub struct GroundSocket {
    incoming: Receiver<Vec<u8>>,
    outgoing: SyncSender<Vec<u8>>,
}

/// Who has spoken, and when.
#[derive(Debug, Default, Clone)]
struct Stations(Arc<Mutex<Vec<(SocketAddr, Instant)>>>);

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
        let (arrived, incoming) = sync_channel(QUEUE);
        let (outgoing, frames) = sync_channel::<Vec<u8>>(QUEUE);
        let stations = Stations::default();
        let heard = stations.clone();
        thread::spawn(move || {
            let mut buffer = [0; 65_536];
            loop {
                // An error is that of a former send: nobody listens there yet.
                let Ok((length, from)) = socket.recv_from(&mut buffer) else { continue };
                let is_wanted = only.is_none_or(|it| it == from) && heard.note(from, &buffer[..length]);
                if is_wanted {
                    if let Err(TrySendError::Disconnected(_)) = arrived.try_send(buffer[..length].to_vec()) {
                        return;
                    }
                    wake();
                }
            }
        });
        thread::spawn(move || {
            for frame in frames {
                let to = only.map_or_else(|| stations.present(), |it| vec![it]);
                // What a ground station misses is said again.
                to.into_iter().for_each(|it| drop(sender.send_to(&frame, it)));
            }
        });
        Ok(GroundSocket { incoming, outgoing })
    }
}

impl Stations {
    /// Something has arrived from this address; whether it is one of those that count.
    fn note(&self, from: SocketAddr, bytes: &[u8]) -> bool {
        let mut stations = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        stations.retain(|(_, heard)| now - *heard < STATION_GONE);
        if let Some((_, heard)) = stations.iter_mut().find(|(known, _)| *known == from) {
            *heard = now;
            return true;
        }
        let speaks = Framer::datagram(bytes).iter().any(|it| matches!(it, Found::Frame(frame) if frame.is_known()));
        let is_taken = speaks && stations.len() < MOST_STATIONS;
        if is_taken {
            stations.push((from, now));
        }
        is_taken
    }

    fn present(&self) -> Vec<SocketAddr> {
        let stations = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        stations.iter().filter(|(_, heard)| now - *heard < STATION_GONE).map(|(address, _)| *address).collect()
    }
}

impl Link for GroundSocket {
    fn receive(&mut self, _now: Time) -> Option<Vec<u8>> {
        self.incoming.try_recv().ok()
    }

    fn send(&mut self, frame: &[u8], _now: Time) {
        // A full queue is a network that takes nothing: the frame is lost, as on the wire.
        let _ = self.outgoing.try_send(frame.to_vec());
    }

    fn is_datagram(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Frame;
    use std::sync::mpsc::channel;

    const PATIENCE: Duration = Duration::from_secs(60);

    fn station() -> UdpSocket {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        socket
    }

    #[test]
    fn a_station_that_listens_hears_frames_and_is_heard_and_a_stranger_is_not() {
        let (station, stranger) = (station(), station());
        let (woken, wake) = channel();
        let endpoint = GroundEndpoint::UdpOut(station.local_addr().unwrap());
        let mut socket = GroundSocket::open(&endpoint, move || woken.send(()).unwrap_or(())).unwrap();
        let frame = Frame::new(1, 255, 190, 0, &[0, 0, 0, 0, 6, 8, 0, 4, 3]);
        socket.send(frame.bytes(), Time::ZERO);
        let mut buffer = [0; 300];
        let (length, bridge) = station.recv_from(&mut buffer).unwrap();
        assert_eq!(&buffer[..length], frame.bytes());
        let bridge = SocketAddr::from((Ipv4Addr::LOCALHOST, bridge.port()));
        stranger.send_to(frame.bytes(), bridge).unwrap();
        let other = Frame::new(2, 255, 190, 0, &[0, 0, 0, 0, 6, 8, 0, 4, 3]);
        station.send_to(other.bytes(), bridge).unwrap();
        wake.recv_timeout(PATIENCE).unwrap();
        assert_eq!(socket.receive(Time::ZERO).as_deref(), Some(other.bytes()));
        assert_eq!(socket.receive(Time::ZERO), None);
    }

    #[test]
    fn a_few_stations_that_speak_mavlink_are_sent_to() {
        let stations = Stations::default();
        let address = |port: u16| SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let frame = Frame::new(1, 255, 190, 0, &[0, 0, 0, 0, 6, 8, 0, 4, 3]);
        assert!(!stations.note(address(1), b"GET / HTTP/1.1"));
        for port in 2..10 {
            let is_taken = stations.note(address(port), frame.bytes());
            assert_eq!(is_taken, usize::from(port) < 2 + MOST_STATIONS, "{port}");
        }
        assert_eq!(stations.present(), (2..6).map(address).collect::<Vec<_>>());
    }
}
