//! Sockets and serial lines, in threads of their own: the node's loop never waits for them.
//!
//! What arrives goes through a bounded queue, and the loop is woken; what is sent goes through another. What does not fit is lost, as on
//! the wire.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::os::unix::fs::OpenOptionsExt;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use domain::time::Time;
use nix::sys::termios::{BaudRate, SetArg, cfmakeraw, cfsetspeed, tcgetattr, tcsetattr};
use serde::Deserialize;

use crate::link::{LONGEST_DATAGRAM, Link, Voice};

/// Where the autopilot is.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub enum Endpoint {
    /// Listen for datagrams here.
    UdpIn(SocketAddr),
    /// Connect to this address.
    TcpOut(SocketAddr),
    /// This serial line.
    Serial {
        /// The device.
        path: String,
        /// Symbols per second.
        baud: u32,
    },
}

impl FromStr for Endpoint {
    type Err = String;
    fn from_str(text: &str) -> Result<Endpoint, String> {
        let expected = || {
            format!(
                "found autopilot `{text}`, expected `udpin:ADDRESS:PORT`, `tcpout:ADDRESS:PORT` or `serial:DEVICE:BAUD`, such as \
                 udpin:127.0.0.1:14540"
            )
        };
        let (kind, rest) = text.split_once(':').ok_or_else(expected)?;
        match kind {
            "udpin" => rest.parse().map(Endpoint::UdpIn).map_err(|_| expected()),
            "tcpout" => rest.parse().map(Endpoint::TcpOut).map_err(|_| expected()),
            "serial" => {
                let (path, baud) = rest.rsplit_once(':').ok_or_else(expected)?;
                let baud = baud.parse().ok().filter(|it| baud_rate(*it).is_some()).ok_or_else(|| {
                    let known = BAUD_RATES.map(|(rate, _)| rate.to_string()).join(", ");
                    format!("found a rate of `{baud}` baud, expected one of {known}")
                })?;
                Ok(Endpoint::Serial { path: path.to_owned(), baud })
            }
            _ => Err(expected()),
        }
    }
}

impl TryFrom<String> for Endpoint {
    type Error = String;
    fn try_from(text: String) -> Result<Endpoint, String> {
        text.parse()
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Endpoint::UdpIn(address) => write!(f, "udpin:{address}"),
            Endpoint::TcpOut(address) => write!(f, "tcpout:{address}"),
            Endpoint::Serial { path, baud } => write!(f, "serial:{path}:{baud}"),
        }
    }
}

const BAUD_RATES: [(u32, BaudRate); 8] = [
    (57_600, BaudRate::B57600),
    (115_200, BaudRate::B115200),
    (230_400, BaudRate::B230400),
    (460_800, BaudRate::B460800),
    (500_000, BaudRate::B500000),
    (921_600, BaudRate::B921600),
    (1_000_000, BaudRate::B1000000),
    (1_500_000, BaudRate::B1500000),
];

fn baud_rate(rate: u32) -> Option<BaudRate> {
    BAUD_RATES.iter().find(|(known, _)| *known == rate).map(|(_, it)| *it)
}

/// The way to an autopilot.
#[derive(Debug)]
pub struct Socket {
    incoming: Receiver<Piece>,
    outgoing: SyncSender<Vec<u8>>,
    is_datagram: bool,
    /// Who sent the datagram that was received last, and when it was taken in.
    last: Option<(SocketAddr, Time)>,
    peer: Shared,
}

/// What has arrived, and of a datagram from where.
type Piece = (Option<SocketAddr>, Vec<u8>);

/// Pieces in the queue of what has arrived, and frames in that of what is sent: a second of full rates.
const QUEUE: usize = 512;
/// As long a connection is waited for before it is tried again.
const RECONNECT: Duration = Duration::from_secs(1);
/// After this silence another address may be the autopilot's.
const PEER_GONE: Duration = Duration::from_secs(5);

impl Socket {
    /// Opens it; `wake` is called whenever something has arrived.
    ///
    /// # Errors
    /// If the address cannot be listened on, or the device not be opened. An address to connect to is tried again and again.
    pub fn open(endpoint: &Endpoint, wake: impl Fn() + Send + 'static) -> io::Result<Socket> {
        let (sender, incoming) = sync_channel(QUEUE);
        let (outgoing, receiver) = sync_channel(QUEUE);
        let arrived = Arrived { queue: sender, wake: Box::new(wake) };
        let peer = Shared::default();
        let opened = match endpoint {
            Endpoint::UdpIn(address) => {
                UdpSocket::bind(address).and_then(|it| udp(it, arrived, receiver, peer.clone()))
            }
            Endpoint::TcpOut(address) => {
                tcp(*address, arrived, receiver);
                Ok(())
            }
            Endpoint::Serial { path, baud } => serial(path, *baud, arrived, receiver),
        };
        opened.map_err(|error| io::Error::new(error.kind(), format!("{endpoint}: {error}")))?;
        let is_datagram = matches!(endpoint, Endpoint::UdpIn(_));
        Ok(Socket { incoming, outgoing, is_datagram, last: None, peer })
    }
}

impl Link for Socket {
    fn receive(&mut self, now: Time) -> Option<Vec<u8>> {
        let (from, bytes) = self.incoming.try_recv().ok()?;
        self.last = from.map(|it| (it, now));
        Some(bytes)
    }

    fn send(&mut self, frame: &[u8], _now: Time) {
        // A full queue is a link that does not take anything: the frame is lost, and what must arrive is sent again.
        let _ = self.outgoing.try_send(frame.to_vec());
    }

    fn is_datagram(&self) -> bool {
        self.is_datagram
    }

    /// Everybody is listened to; frames go to one, whose place this gives and keeps.
    fn admit(&mut self, voice: Voice) -> bool {
        if let Some((from, at)) = self.last {
            lock(&self.peer).hear(from, voice, at);
        }
        true
    }
}

/// Takes what has arrived to the node's loop.
struct Arrived {
    queue: SyncSender<Piece>,
    wake: Box<dyn Fn() + Send>,
}

impl Arrived {
    /// Whether somebody still listens.
    fn take(&self, from: Option<SocketAddr>, bytes: &[u8]) -> bool {
        let is_heard = !matches!(self.queue.try_send((from, bytes.to_vec())), Err(TrySendError::Disconnected(_)));
        (self.wake)();
        is_heard
    }
}

/// The address that the autopilot speaks from: frames to it go there.
#[derive(Debug, Default)]
struct Peer(Option<Place>);

type Shared = Arc<Mutex<Peer>>;

#[derive(Debug, Clone, Copy)]
struct Place {
    address: SocketAddr,
    heard: Time,
    /// Otherwise it was only let in to hear, since nobody was there: one that is behind has to hear the time that it has to sign with.
    is_believed: bool,
}

impl Peer {
    /// What arrived from an address shows this voice of an autopilot. The place is given and kept by what is believed alone.
    fn hear(&mut self, from: SocketAddr, voice: Voice, now: Time) {
        let gives_place = match (self.0, voice) {
            (_, Voice::Unknown) => false,
            (None, _) => true,
            (Some(_), Voice::Late) => false,
            (Some(it), Voice::Believed) => it.address == from || !it.is_believed || PEER_GONE <= now - it.heard,
        };
        if gives_place {
            self.0 = Some(Place { address: from, heard: now, is_believed: voice == Voice::Believed });
        }
    }
}

fn udp(socket: UdpSocket, arrived: Arrived, outgoing: Receiver<Vec<u8>>, peer: Shared) -> io::Result<()> {
    let sender = socket.try_clone()?;
    thread::spawn(move || {
        // What is longer fills it, and is dropped.
        let mut buffer = [0; LONGEST_DATAGRAM + 1];
        loop {
            // An error is that of a former send: nobody listens there, which the silence shows.
            let Ok((length, from)) = socket.recv_from(&mut buffer) else { continue };
            if length <= LONGEST_DATAGRAM && !arrived.take(Some(from), &buffer[..length]) {
                return;
            }
        }
    });
    thread::spawn(move || {
        for frame in outgoing {
            let to = lock(&peer).0;
            if let Some(place) = to {
                let _ = sender.send_to(&frame, place.address);
            }
        }
    });
    Ok(())
}

fn tcp(address: SocketAddr, arrived: Arrived, outgoing: Receiver<Vec<u8>>) {
    let connection = Arc::new(Mutex::new(None::<TcpStream>));
    let writer = connection.clone();
    thread::spawn(move || {
        loop {
            match TcpStream::connect_timeout(&address, RECONNECT).and_then(|it| it.set_nodelay(true).map(|()| it)) {
                Ok(stream) => {
                    *lock(&connection) = stream.try_clone().ok();
                    let is_heard = read(stream, &arrived);
                    *lock(&connection) = None;
                    if !is_heard {
                        return;
                    }
                }
                Err(error) => tracing::warn!("{address}: {error}"),
            }
            wait();
        }
    });
    thread::spawn(move || {
        for frame in outgoing {
            // Not under the lock: a write may wait.
            let stream = lock(&writer).as_ref().and_then(|it| it.try_clone().ok());
            if let Some(mut stream) = stream {
                let _ = stream.write_all(&frame);
            }
        }
    });
}

fn serial(path: &str, baud: u32, arrived: Arrived, outgoing: Receiver<Vec<u8>>) -> io::Result<()> {
    let line = open_serial(path, baud)?;
    let writer = Arc::new(Mutex::new(Some(line.try_clone()?)));
    let (reader_line, path) = (writer.clone(), path.to_owned());
    thread::spawn(move || {
        let mut line = Some(line);
        loop {
            if let Some(line) = line.take()
                && !read(line, &arrived)
            {
                return;
            }
            *lock(&reader_line) = None;
            wait();
            // An adapter that was unplugged comes back.
            line = open_serial(&path, baud).ok();
            *lock(&reader_line) = line.as_ref().and_then(|it| it.try_clone().ok());
        }
    });
    thread::spawn(move || {
        loop {
            match outgoing.recv_timeout(RECONNECT) {
                Ok(frame) => {
                    let line = lock(&writer).as_ref().and_then(|it| it.try_clone().ok());
                    if let Some(mut line) = line {
                        let _ = line.write_all(&frame);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    });
    Ok(())
}

fn open_serial(path: &str, baud: u32) -> io::Result<File> {
    let rate =
        baud_rate(baud).ok_or_else(|| io::Error::other(format!("{baud} baud is not a rate of a serial line")))?;
    // It must not become the terminal that can end this process.
    let line = OpenOptions::new().read(true).write(true).custom_flags(nix::libc::O_NOCTTY).open(path)?;
    let mut settings = tcgetattr(&line)?;
    cfmakeraw(&mut settings);
    cfsetspeed(&mut settings, rate)?;
    tcsetattr(&line, SetArg::TCSANOW, &settings)?;
    Ok(line)
}

/// Reads until the stream ends; whether somebody still listens.
fn read(mut stream: impl Read, arrived: &Arrived) -> bool {
    let mut buffer = [0; 4_096];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return true,
            Ok(length) if !arrived.take(None, &buffer[..length]) => return false,
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => {
                tracing::warn!("the link to the autopilot: {error}");
                return true;
            }
        }
    }
}

#[expect(clippy::disallowed_methods, reason = "a thread of a socket, which nobody waits for")]
fn wait() {
    thread::sleep(RECONNECT);
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::autopilot_voice;
    use crate::frame::{Frame, Framer};
    use crate::signing::{Key, SignedLink, Signing};

    const UTC_MS: i64 = 1_767_225_600_000;

    /// Who has the place after these voices: seconds, port, voice.
    #[track_caller]
    fn check(voices: &[(u64, u16, Voice)], expected: Option<u16>) {
        let mut peer = Peer::default();
        for (second, port, voice) in voices {
            peer.hear(([127, 0, 0, 1], *port).into(), *voice, Time::after(Duration::from_secs(*second)));
        }
        assert_eq!(peer.0.map(|it| it.address.port()), expected, "{voices:?}");
    }

    #[test]
    fn frames_go_to_who_is_believed_and_after_a_silence_to_no_other() {
        use Voice::{Believed, Late, Unknown};
        check(&[(0, 1, Unknown)], None);
        check(&[(0, 1, Believed), (1, 2, Believed)], Some(1));
        check(&[(0, 1, Believed), (6, 2, Unknown)], Some(1));
        // It repeats what was signed before.
        check(&[(0, 1, Believed), (6, 2, Late), (90, 2, Late)], Some(1));
        check(&[(0, 1, Believed), (6, 2, Believed)], Some(2));
        check(&[(0, 1, Believed), (4, 1, Believed), (6, 2, Believed)], Some(1));
        // What is not believed keeps no place.
        check(&[(0, 1, Believed), (4, 1, Unknown), (6, 2, Believed)], Some(2));
        // One that is behind hears the time, until one is believed.
        check(&[(0, 1, Late)], Some(1));
        check(&[(0, 1, Late), (0, 2, Late), (0, 3, Believed), (1, 1, Late)], Some(3));
    }

    #[test]
    fn a_stranger_without_the_key_gets_no_frame_after_a_silence() {
        let bind = || UdpSocket::bind("127.0.0.1:0").unwrap();
        let here = bind().local_addr().unwrap();
        let (woken, wakes) = sync_channel(8);
        let socket = Socket::open(&Endpoint::UdpIn(here), move || _ = woken.try_send(())).unwrap();
        let key: Key = "11".repeat(32).parse().unwrap();
        let mut link = SignedLink::new(socket, Signing::new(key.clone(), 0), || UTC_MS);
        let (autopilot, stranger) = (bind(), bind());
        let heartbeat = || Frame::new(1, 1, 1, 0, &[0, 0, 0, 0, 2, 3, 0, 3, 3]);
        let signed = Signing::new(key, 0).sign(heartbeat(), UTC_MS);
        for (second, from, frame) in [(0, &autopilot, signed), (6, &stranger, heartbeat())] {
            from.send_to(frame.bytes(), here).unwrap();
            wakes.recv_timeout(Duration::from_secs(60)).expect("a datagram");
            let bytes = link.receive(Time::after(Duration::from_secs(second))).unwrap();
            link.admit(autopilot_voice(&Framer::datagram(&bytes)));
        }
        link.send(heartbeat().bytes(), Time::after(Duration::from_secs(6)));
        autopilot.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        autopilot.recv(&mut [0; 280]).expect("the frame");
        stranger.set_nonblocking(true).unwrap();
        stranger.recv(&mut [0; 280]).expect_err("it went to the autopilot");
    }

    #[test]
    fn an_endpoint_is_read_and_written() {
        for text in ["udpin:127.0.0.1:14540", "tcpout:127.0.0.1:5760", "serial:/dev/ttyACM0:921600"] {
            assert_eq!(text.parse::<Endpoint>().map(|it| it.to_string()), Ok(text.to_owned()));
        }
        for text in
            ["", "udpin", "udpin:14540", "udpout:127.0.0.1:1", "serial:/dev/ttyACM0", "serial:/dev/ttyACM0:1234"]
        {
            let error = text.parse::<Endpoint>().expect_err(text);
            assert!(error.contains("expected"), "{error}");
        }
    }
}
