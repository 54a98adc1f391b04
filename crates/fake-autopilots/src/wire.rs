//! A link between an autopilot and the bridge, on a clock of its own: it delays, loses, doubles, reorders and cuts what it carries, from
//! a seed.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

use domain::time::Time;
use mavlink_bridge::link::Link;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What the link does to what it carries.
#[derive(Debug, Clone, Copy, Default)]
pub struct Faults {
    /// A piece is on its way for a random time up to this, so that pieces overtake each other.
    pub longest_delay: Duration,
    /// The share that is lost.
    pub loss: f64,
    /// The share that arrives twice.
    pub doubled: f64,
    /// The share whose end is missing.
    pub cut: f64,
    /// The share that comes with a frame of somebody else, or of a message that nobody knows.
    pub foreign: f64,
    /// The share after which nothing arrives for a fifth of a second: a burst of losses.
    pub bursts: f64,
}

impl Faults {
    /// A radio link at its limit.
    pub const LOSSY: Faults = Faults {
        longest_delay: Duration::from_millis(80),
        loss: 0.05,
        doubled: 0.05,
        cut: 0.02,
        foreign: 0.05,
        bursts: 0.002,
    };
}

const BURST: Duration = Duration::from_millis(200);

/// The link; its clones are the same one.
#[derive(Debug, Clone)]
pub struct Wire(Rc<RefCell<State>>);

#[derive(Debug)]
struct State {
    faults: Faults,
    random: ChaCha8Rng,
    to_bridge: Direction,
    to_autopilot: Direction,
    /// Nothing passes until then.
    gap_until: Time,
}

#[derive(Debug, Default)]
struct Direction {
    /// By arrival, then in the order of sending.
    under_way: BTreeMap<(Time, u64), Vec<u8>>,
    sent: u64,
    burst_until: Time,
}

impl Wire {
    /// A link with these faults.
    pub fn new(faults: Faults, seed: u64) -> Wire {
        Wire(Rc::new(RefCell::new(State {
            faults,
            random: ChaCha8Rng::seed_from_u64(seed),
            to_bridge: Direction::default(),
            to_autopilot: Direction::default(),
            gap_until: Time::ZERO,
        })))
    }

    /// Nothing passes until then, in either direction.
    pub fn cut_until(&self, until: Time) {
        self.0.borrow_mut().gap_until = until;
    }

    /// What has arrived at the bridge is heard by nobody.
    pub(crate) fn drop_arrived(&self, now: Time) {
        while self.0.borrow_mut().to_bridge.receive(now).is_some() {}
    }

    /// The autopilot, or somebody on its side, sends.
    pub fn send_to_bridge(&self, bytes: &[u8], now: Time) {
        let State { faults, random, to_bridge, gap_until, .. } = &mut *self.0.borrow_mut();
        to_bridge.send(bytes, *faults, random, *gap_until, now);
    }

    /// The next piece that has arrived at the autopilot.
    pub fn receive_at_autopilot(&self, now: Time) -> Option<Vec<u8>> {
        self.0.borrow_mut().to_autopilot.receive(now)
    }

    /// When the next piece arrives at the autopilot.
    pub fn arrival_at_autopilot(&self) -> Option<Time> {
        self.0.borrow().to_autopilot.arrival()
    }
}

impl Link for Wire {
    fn receive(&mut self, now: Time) -> Option<Vec<u8>> {
        self.0.borrow_mut().to_bridge.receive(now)
    }

    fn send(&mut self, frame: &[u8], now: Time) {
        let State { faults, random, to_autopilot, gap_until, .. } = &mut *self.0.borrow_mut();
        // What is foreign comes from the autopilot's side.
        to_autopilot.send(frame, Faults { foreign: 0.0, ..*faults }, random, *gap_until, now);
    }

    fn is_datagram(&self) -> bool {
        true
    }

    fn arrival(&self) -> Option<Time> {
        self.0.borrow().to_bridge.arrival()
    }
}

impl Direction {
    fn send(&mut self, bytes: &[u8], faults: Faults, random: &mut ChaCha8Rng, gap_until: Time, now: Time) {
        // Drawn whatever happens, so that one fault does not move the others.
        let [loss, doubled, cut, foreign, burst]: [f64; 5] = std::array::from_fn(|_| random.random());
        if burst < faults.bursts {
            self.burst_until = now + BURST;
        }
        if now < gap_until || now < self.burst_until || loss < faults.loss {
            return;
        }
        let bytes = match cut < faults.cut {
            true => &bytes[..bytes.len() / 2],
            false => bytes,
        };
        let copies = if doubled < faults.doubled { 2 } else { 1 };
        for _ in 0..copies {
            let delay = faults.longest_delay.mul_f64(random.random());
            self.insert(now + delay, bytes.to_vec());
        }
        if foreign < faults.foreign {
            let other = foreign_frames();
            self.insert(now + faults.longest_delay, other[self.sent as usize % other.len()].clone());
        }
    }

    fn insert(&mut self, at: Time, bytes: Vec<u8>) {
        self.sent += 1;
        self.under_way.insert((at, self.sent), bytes);
    }

    fn receive(&mut self, now: Time) -> Option<Vec<u8>> {
        let (key, _) = self.under_way.first_key_value().filter(|((at, _), _)| *at <= now)?;
        let key = *key;
        self.under_way.remove(&key)
    }

    fn arrival(&self) -> Option<Time> {
        self.under_way.first_key_value().map(|((at, _), _)| *at)
    }
}

/// A ground station's heartbeat, a gimbal's, an unknown message that looks like the start of a long one, noise, and an
/// acknowledgement of a command of somebody else.
fn foreign_frames() -> Vec<Vec<u8>> {
    use mavlink_bridge::frame::Frame;
    let mut ack = vec![0x90, 0x01, 4, 0, 0, 0, 0, 0, 255];
    ack.push(190);
    vec![
        Frame::new(0, 255, 190, 0, &[0, 0, 0, 0, 6, 8, 0, 0, 3]).bytes().to_vec(),
        Frame::new(0, 1, 154, 0, &[0, 0, 0, 0, 26, 8, 0, 4, 3]).bytes().to_vec(),
        vec![0xFD, 4, 0, 0, 9, 1, 1, 0xF0, 0xFF, 0x0F, 0xFD, 255, 0, 0, 0xAA, 0xBB],
        vec![0xFD, 0xFE, 0x00, 0x11],
        Frame::new(0, 1, 1, 77, &ack).bytes().to_vec(),
    ]
}
