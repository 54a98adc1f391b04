//! A link with faults: a TCP proxy in user space with a rate, a delay, losses and cuts. For tests, measurements and campaigns
//! only: it never flies.
//!
//! A lost packet has the effect that it has with TCP: everything behind it waits for the retransmission. Bytes
//! are never lost, as on a real link; during a cut they wait. A sender is held back as by a
//! modem with a small buffer, so what is not sent yet stays with the sender, which may have more
//! urgent messages.

#![expect(clippy::disallowed_methods, reason = "a link takes time")]

use std::collections::{BTreeSet, VecDeque};
use std::fmt;
use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use nix::sys::socket::{setsockopt, sockopt};
use rand::{Rng, SeedableRng, rngs::StdRng};
use socket2::SockRef;

/// A packet's payload without headers, as is usual on a slow link (RFC 9293: 536 fits any).
const PACKET: usize = 536;
/// The bytes that the modem takes at once: a few packets.
const RECEIVE_BYTES: usize = 2048;
/// The bytes that the modem holds, in addition to those on their way.
const MODEM_BYTES: usize = 1500;
/// The shortest that TCP waits for an acknowledgement beyond the round trip (Linux: 200 ms).
const LEAST_RETRY: Duration = Duration::from_millis(200);

/// The state of the link, both ways.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Bits per second; `None`: without a limit.
    pub bits_per_s: Option<f64>,
    /// Delay one way.
    pub delay: Duration,
    /// Share of lost packets, 0 to 1.
    pub loss: f64,
}

/// Without any fault.
pub const CLEAR: Shape = Shape { bits_per_s: None, delay: Duration::ZERO, loss: 0.0 };

/// A direction of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the caller to the called: from the aircraft to the ground.
    Down,
    /// The other direction.
    Up,
}

/// The proxy; it ends with the value, and every connection through it.
pub struct Proxy {
    /// Where to call.
    pub address: SocketAddr,
    /// Where everything is passed on to.
    pub target: SocketAddr,
    state: Arc<State>,
}

struct State {
    shape: Mutex<Shape>,
    cut: [AtomicBool; 2],
    /// Connections, counted from the first, over which nothing passes in either direction.
    stuck: Mutex<BTreeSet<u64>>,
    ended: AtomicBool,
    bytes: [AtomicU64; 2],
    /// When the modem will have sent what it holds, each way: all connections share it.
    left: [Mutex<Instant>; 2],
    connections: Mutex<Vec<TcpStream>>,
    seed: u64,
    opened: AtomicU64,
    changed: (Mutex<()>, Condvar),
}

impl Proxy {
    /// Passes everything on to `target`. The seed determines the losses.
    pub fn to(target: SocketAddr, seed: u64) -> Proxy {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        // Inherited by accepted connections: otherwise the kernel would hold seconds of a narrow link, and send in
        // pieces of 64 kB, as it does on the loopback, which fit into no small buffer.
        setsockopt(&listener, sockopt::RcvBuf, &RECEIVE_BYTES).expect("a buffer can be small");
        SockRef::from(&listener).set_tcp_mss(PACKET as u32).expect("packets can be small");
        let address = listener.local_addr().unwrap();
        let state = Arc::new(State {
            shape: Mutex::new(CLEAR),
            cut: [AtomicBool::new(false), AtomicBool::new(false)],
            stuck: Mutex::default(),
            ended: AtomicBool::new(false),
            bytes: [AtomicU64::new(0), AtomicU64::new(0)],
            left: [Mutex::new(Instant::now()), Mutex::new(Instant::now())],
            connections: Mutex::default(),
            seed,
            opened: AtomicU64::new(0),
            changed: Default::default(),
        });
        let shared = state.clone();
        std::thread::spawn(move || {
            for caller in listener.incoming().map_while(Result::ok) {
                if shared.ended.load(Ordering::SeqCst) {
                    return;
                }
                // The ground does not listen: the caller's connection is closed.
                if let Ok(called) = TcpStream::connect(target) {
                    shared.join(caller, called);
                }
            }
        });
        Proxy { address, target, state }
    }

    /// From now on it is like this.
    pub fn shape(&self, shape: Shape) {
        *self.state.shape.lock().unwrap() = shape;
    }

    /// Nothing passes in this direction until the link is healed.
    pub fn cut(&self, ways: &[Direction]) {
        ways.iter().for_each(|&way| self.state.cut[way as usize].store(true, Ordering::SeqCst));
    }

    /// Connections that were made so far.
    pub fn connections(&self) -> u64 {
        self.state.opened.load(Ordering::SeqCst)
    }

    /// Nothing passes over this connection, counted from 0, until the link is healed.
    pub fn hold(&self, connection: u64) {
        self.state.stuck.lock().unwrap().insert(connection);
    }

    /// Everything passes again.
    pub fn heal(&self) {
        self.state.stuck.lock().unwrap().clear();
        self.state.cut.iter().for_each(|it| it.store(false, Ordering::SeqCst));
        self.state.changed.1.notify_all();
    }

    /// Bytes received in this direction so far, encryption included.
    pub fn bytes(&self, way: Direction) -> u64 {
        self.state.bytes[way as usize].load(Ordering::SeqCst)
    }
}

impl fmt::Debug for Proxy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Proxy({} to {})", self.address, self.target)
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.state.ended.store(true, Ordering::SeqCst);
        self.heal();
        for it in self.state.connections.lock().unwrap().drain(..) {
            let _ = it.shutdown(Shutdown::Both);
        }
        // Wakes the listener.
        let _ = TcpStream::connect(self.address);
    }
}

impl State {
    fn join(self: &Arc<State>, caller: TcpStream, called: TcpStream) {
        let number = self.opened.fetch_add(1, Ordering::SeqCst);
        for (way, from, to) in [(Direction::Down, &caller, &called), (Direction::Up, &called, &caller)] {
            let _ = setsockopt(from, sockopt::RcvBuf, &RECEIVE_BYTES);
            let _ = to.set_nodelay(true);
            let pipe = Arc::new(Pipe::default());
            let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
            let (state, out) = (self.clone(), pipe.clone());
            std::thread::spawn(move || state.take_in(way, number, from, &pipe));
            let state = self.clone();
            std::thread::spawn(move || state.pass_on(way, number, to, &out));
        }
        self.connections.lock().unwrap().extend([caller, called]);
    }

    fn take_in(&self, way: Direction, number: u64, mut from: TcpStream, pipe: &Pipe) {
        let mut chance = StdRng::seed_from_u64(self.seed ^ (2 * number + way as u64));
        // When the last packet arrives: packets of a connection never overtake each other.
        let mut arrives = Instant::now();
        loop {
            self.wait_while_cut(way, number);
            let shape = *self.shape.lock().unwrap();
            let seconds = |bytes: usize| shape.bits_per_s.map_or(0.0, |rate| bytes as f64 * 8.0 / rate);
            let full_until = || self.left(way).checked_sub(Duration::from_secs_f64(seconds(MODEM_BYTES)));
            while let Some(full) = full_until().and_then(|it| it.checked_duration_since(Instant::now())) {
                std::thread::sleep(full);
            }
            let mut packet = vec![0; PACKET];
            let length = from.read(&mut packet).unwrap_or(0);
            packet.truncate(length);
            self.bytes[way as usize].fetch_add(length as u64, Ordering::SeqCst);
            let left = {
                let mut left = self.left(way);
                *left = left.max(Instant::now()) + Duration::from_secs_f64(seconds(length));
                *left
            };
            let retry = if chance.random_bool(shape.loss) { 2 * shape.delay + LEAST_RETRY } else { Duration::ZERO };
            arrives = arrives.max(left + shape.delay + retry);
            pipe.push(arrives, packet);
            if length == 0 {
                return;
            }
        }
    }

    fn pass_on(&self, way: Direction, number: u64, mut to: TcpStream, pipe: &Pipe) {
        loop {
            let (arrives, packet) = pipe.pop();
            if let Some(left) = arrives.checked_duration_since(Instant::now()) {
                std::thread::sleep(left);
            }
            self.wait_while_cut(way, number);
            // An empty packet is the end of the stream.
            if packet.is_empty() || to.write_all(&packet).is_err() {
                let _ = to.shutdown(Shutdown::Both);
                return;
            }
        }
    }

    fn left(&self, way: Direction) -> MutexGuard<'_, Instant> {
        self.left[way as usize].lock().unwrap()
    }

    fn wait_while_cut(&self, way: Direction, number: u64) {
        let mut guard = self.changed.0.lock().unwrap();
        let cut = || self.cut[way as usize].load(Ordering::SeqCst) || self.stuck.lock().unwrap().contains(&number);
        while cut() && !self.ended.load(Ordering::SeqCst) {
            guard = self.changed.1.wait_timeout(guard, Duration::from_millis(50)).unwrap().0;
        }
    }
}

/// Packets on their way.
#[derive(Default)]
struct Pipe(Mutex<VecDeque<(Instant, Vec<u8>)>>, Condvar);

impl Pipe {
    fn push(&self, arrives: Instant, packet: Vec<u8>) {
        self.0.lock().unwrap().push_back((arrives, packet));
        self.1.notify_one();
    }

    fn pop(&self) -> (Instant, Vec<u8>) {
        let mut queue = self.0.lock().unwrap();
        loop {
            if let Some(it) = queue.pop_front() {
                return it;
            }
            queue = self.1.wait(queue).unwrap();
        }
    }
}
