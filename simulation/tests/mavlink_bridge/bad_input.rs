//! Links on which there is no autopilot to fly, or one that says strange things: a clear state, never a takeoff, never an old value.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use mavlink_bridge::MavlinkBridge;
use mavlink_bridge::frame::Frame;
use mavlink_bridge::link::Link;
use mavlink_bridge::signing::{Key, SignedLink, Signing};
use node::{Event, Node};

use crate::stories::mavlink_bridge::rig::{ARM, Published, UTC_MS, at, config};

/// What the test says, at once; what the bridge says is kept.
#[derive(Clone, Default, Debug)]
struct Script {
    incoming: Rc<RefCell<VecDeque<Vec<u8>>>>,
    outgoing: Rc<RefCell<Vec<Vec<u8>>>>,
}

impl Link for Script {
    fn receive(&mut self, _now: Time) -> Option<Vec<u8>> {
        self.incoming.borrow_mut().pop_front()
    }

    fn send(&mut self, frame: &[u8], _now: Time) {
        self.outgoing.borrow_mut().push(frame.to_vec());
    }

    fn is_datagram(&self) -> bool {
        true
    }
}

struct Rig {
    script: Script,
    bridge: MavlinkBridge<Box<dyn Link>>,
    published: Published,
    now: Duration,
}

impl Rig {
    fn new() -> Rig {
        let script = Script::default();
        Rig::over(Box::new(script.clone()), script)
    }

    /// One that believes only what is signed with this key.
    fn signing_with(key: Key) -> Rig {
        let script = Script::default();
        Rig::over(Box::new(SignedLink::new(script.clone(), Signing::new(key, 0), || UTC_MS)), script)
    }

    fn over(link: Box<dyn Link>, script: Script) -> Rig {
        let bridge = MavlinkBridge::new(&config(), link);
        Rig { script, bridge, published: Published::default(), now: Duration::ZERO }
    }

    fn hear(&mut self, system: u8, component: u8, id: u32, payload: &[u8]) {
        self.raw(Frame::new(0, system, component, id, payload).bytes().to_vec());
    }

    fn raw(&mut self, bytes: Vec<u8>) {
        self.script.incoming.borrow_mut().push_back(bytes);
    }

    fn pass(&mut self, ms: u64) {
        let end = self.now + Duration::from_millis(ms);
        while self.now < end {
            self.now += Duration::from_millis(20);
            let mut effects = Vec::new();
            self.bridge.act(at(self.now), &mut effects);
            self.published.take_in(effects, self.now);
        }
    }

    /// The answer to a command to arm; `None`: no answer in two seconds.
    fn arm(&mut self) -> Option<v1::VehicleCommandAck> {
        let message = Message::from(v1::VehicleCommand { id: 9, command: Some(ARM) });
        let mut effects = Vec::new();
        self.bridge.on(at(self.now), Event::Message { vehicle: "uav1".into(), message }, &mut effects);
        self.published.take_in(effects, self.now);
        self.pass(2_000);
        self.published.acks.first().cloned()
    }

    /// Whether a command to arm went out: COMMAND_LONG with 400.
    fn has_armed(&self) -> bool {
        let outgoing = self.script.outgoing.borrow();
        outgoing.iter().any(|it| it[7] == 76 && it.get(10 + 28..10 + 30) == Some(&[0x90, 0x01]))
    }

    #[track_caller]
    fn assert_no_takeoff(&mut self, expected: &str) {
        let ack = self.arm().expect("an answer");
        assert_eq!(ack.result(), v1::CommandResult::Rejected);
        assert!(ack.reason.contains(expected), "{}", ack.reason);
        assert!(!self.has_armed());
    }
}

/// GPS_GLOBAL_ORIGIN, without which nothing is said of a vehicle for a while.
const ORIGIN: [u8; 12] = [1; 12];

const PX4: [u8; 9] = [0, 0, 4, 3, 2, 12, 0x01, 3, 3];
const ARDUPILOT: [u8; 9] = [4, 0, 0, 0, 2, 3, 0x01, 3, 3];

#[test]
fn an_autopilot_that_does_not_sign_with_our_key_is_not_believed() {
    let [ours, other] = ["11", "22"].map(|it| it.repeat(32).parse::<Key>().unwrap());
    let heartbeat = |sequence| Frame::new(sequence, 1, 1, 0, &PX4);
    let check = |bytes: &[Vec<u8>], expected: &str| {
        let mut rig = Rig::signing_with(ours.clone());
        bytes.iter().for_each(|it| rig.raw(it.clone()));
        rig.pass(1_000);
        rig.assert_no_takeoff(expected);
        assert_eq!(rig.published.status, None);
    };
    check(&[], "no autopilot is heard");
    check(&[heartbeat(1).bytes().to_vec()], "no autopilot is believed: frames arrive without a signature: set the key");
    let foreign = Signing::new(other.clone(), 0).sign(heartbeat(1), UTC_MS);
    check(&[foreign.bytes().to_vec()], "signed with another key than that of `signing_key`");
    let late = Signing::new(ours.clone(), 0).sign(heartbeat(1), UTC_MS - 100_000);
    check(&[late.bytes().to_vec()], "of a time that has passed");
    let mut rig = Rig::signing_with(ours.clone());
    rig.raw(Signing::new(ours, 0).sign(heartbeat(1), UTC_MS).bytes().to_vec());
    rig.pass(1_000);
    let outgoing = rig.script.outgoing.borrow();
    assert!(!outgoing.is_empty() && outgoing.iter().all(|it| it[2] & 1 == 1), "everything that is sent is signed");
}

/// Who always has one more datagram, which is not signed.
#[derive(Debug, Clone, Default)]
struct Flood(Rc<RefCell<usize>>);

impl Link for Flood {
    fn receive(&mut self, _now: Time) -> Option<Vec<u8>> {
        *self.0.borrow_mut() += 1;
        Some(Frame::new(0, 1, 1, 0, &PX4).bytes().to_vec())
    }

    fn send(&mut self, _frame: &[u8], _now: Time) {}

    fn is_datagram(&self) -> bool {
        true
    }
}

#[test]
fn who_sends_without_the_key_faster_than_it_is_checked_does_not_keep_the_loop() {
    let key = || Signing::new("11".repeat(32).parse().unwrap(), 0);
    let (vehicle, ground) = (Flood::default(), Flood::default());
    let mut bridge = MavlinkBridge::new(&config(), SignedLink::new(vehicle.clone(), key(), || UTC_MS))
        .seen_from_the_ground(SignedLink::new(ground.clone(), key(), || UTC_MS));
    for turn in 1..4 {
        bridge.act(at(Duration::ZERO), &mut Vec::new());
        for flood in [&vehicle, &ground] {
            assert_eq!(*flood.0.borrow(), turn * 256);
        }
        assert_eq!(bridge.deadline(), Some(Time::ZERO), "it goes on at once");
    }
}

#[test]
fn behind_a_flood_that_is_not_believed_the_autopilot_is_heard_without_another_datagram() {
    let key: Key = "11".repeat(32).parse().unwrap();
    let check = |flood: &[u8], number: usize, most_turns: usize| {
        let mut rig = Rig::signing_with(key.clone());
        (0..number).for_each(|_| rig.raw(flood.to_vec()));
        rig.raw(Signing::new(key.clone(), 0).sign(Frame::new(1, 1, 1, 0, &PX4), UTC_MS).bytes().to_vec());
        let now = at(Duration::from_millis(20));
        let mut turns = 0;
        while turns == 0 || rig.bridge.deadline().is_some_and(|it| it <= now.time) {
            rig.bridge.act(now, &mut Vec::new());
            turns += 1;
        }
        assert!(1 < turns && turns <= most_turns, "{turns}");
        // What asks the autopilot for its messages.
        assert!(!rig.script.outgoing.borrow().is_empty());
    };
    check(Frame::new(1, 1, 1, 0, &PX4).bytes(), 1_000, 6);
    let foreign = Signing::new("22".repeat(32).parse().unwrap(), 0).sign(Frame::new(1, 1, 1, 0, &PX4), UTC_MS);
    check(foreign.bytes(), 1_000, 6);
    // As many beginnings of long frames as fit a datagram.
    check(&[0xFD, 0xFF, 0, 0].repeat(2_250), 100, 10);
}

#[test]
fn no_autopilot() {
    let mut rig = Rig::new();
    rig.pass(1_000);
    rig.assert_no_takeoff("no autopilot is heard");
    assert_eq!(rig.published.status, None);
}

#[test]
fn heartbeats_of_others_are_no_autopilot() {
    let mut rig = Rig::new();
    rig.hear(255, 190, 0, &[0, 0, 0, 0, 6, 8, 0x80, 0, 3]);
    rig.hear(1, 154, 0, &[0, 0, 0, 0, 26, 8, 0x80, 4, 3]);
    rig.hear(1, 191, 0, &[0, 0, 0, 0, 18, 8, 0x80, 4, 3]);
    rig.pass(1_000);
    rig.assert_no_takeoff("no autopilot is heard");
    assert_eq!(rig.published.status, None);
}

#[test]
fn others_do_not_speak_for_the_vehicle() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &PX4);
    rig.hear(1, 1, 49, &ORIGIN);
    rig.pass(100);
    rig.hear(255, 190, 0, &[0, 0, 0, 0, 6, 8, 0x80, 0, 3]);
    rig.hear(1, 154, 0, &[0, 0, 0, 0, 26, 8, 0x80, 4, 3]);
    rig.hear(2, 154, 245, &[0, 2]);
    rig.pass(100);
    let status = rig.published.status.clone().expect("a status");
    assert!(!status.armed && status.actual_mode() == v1::FlightMode::Loiter, "{status:?}");
    assert_eq!(rig.published.landed, None);
}

#[test]
fn two_autopilots_on_one_link() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &PX4);
    rig.hear(1, 1, 49, &ORIGIN);
    rig.hear(2, 1, 0, &ARDUPILOT);
    rig.pass(500);
    let status = rig.published.status.clone().expect("a status");
    assert_eq!(status.can_arm, Some(false));
    assert!(status.reason.contains("systems 1 and 2") && status.reason.contains("mavlink_bridge.system"), "{status:?}");
    rig.assert_no_takeoff("more than one autopilot");
}

#[test]
fn an_autopilot_that_there_is_no_personality_for() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &[0, 0, 0, 0, 2, 99, 0x01, 3, 3]);
    rig.pass(500);
    rig.assert_no_takeoff("its autopilot is 99");
}

#[test]
fn a_type_that_is_no_multirotor() {
    for kind in [1, 250] {
        let mut rig = Rig::new();
        rig.hear(1, 1, 0, &[0, 0, 0, 0, kind, 3, 0x01, 3, 3]);
        rig.pass(500);
        rig.assert_no_takeoff("expected a multirotor");
    }
}

#[test]
fn an_autopilot_that_ignores_us_is_given_up() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &PX4);
    rig.hear(1, 1, 49, &ORIGIN);
    rig.pass(100);
    let ack = rig.arm().expect("an answer");
    assert_eq!(ack.result(), v1::CommandResult::Rejected);
    assert!(ack.reason.contains("does not answer"), "{}", ack.reason);
}

#[test]
fn silence_is_no_status() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &PX4);
    rig.hear(1, 1, 49, &ORIGIN);
    rig.pass(100);
    let count = rig.published.count;
    rig.pass(10_000);
    assert_eq!(rig.published.count, count);
}

#[test]
fn what_is_not_measured_is_not_said() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &ARDUPILOT);
    rig.hear(1, 1, 49, &ORIGIN);
    rig.pass(100);
    let count = rig.published.count;
    // A charge of -1; a land detector that does not know; a position that is not a number; (0, 0) without a fix.
    let mut battery = vec![0; 36];
    battery[10..30].copy_from_slice(&[0xFF; 20]);
    battery[35] = 0xFF;
    rig.hear(1, 1, 147, &battery);
    rig.hear(1, 1, 245, &[0, 0]);
    rig.hear(1, 1, 245, &[0, 77]);
    rig.hear(1, 1, 32, &[0xFF; 28]);
    rig.hear(1, 1, 33, &[1, 0, 0, 0]);
    rig.pass(100);
    assert_eq!(rig.published.count, count);
}

#[test]
fn noise_unknown_messages_and_mavlink_1_change_nothing() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &PX4);
    rig.hear(1, 1, 49, &ORIGIN);
    rig.raw(vec![0xFD; 300]);
    rig.raw(vec![0xFE, 9, 0, 1, 1, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
    rig.raw(Vec::new());
    rig.hear(1, 1, 0x00FF_FFF0, &[1, 2, 3]);
    // An acknowledgement with a result that nobody knows, for a command that nobody sent.
    rig.hear(1, 1, 77, &[0xFF, 0xFF, 200, 0, 0, 0, 0, 0, 1, 191]);
    rig.pass(100);
    assert_eq!(rig.published.status.as_ref().map(|it| it.armed), Some(false));
}

#[test]
fn an_older_px4_says_its_mode_in_the_heartbeat_alone() {
    let mut rig = Rig::new();
    rig.hear(1, 1, 0, &PX4);
    rig.hear(1, 1, 49, &ORIGIN);
    rig.pass(100);
    assert_eq!(rig.published.status.clone().map(|it| it.actual_mode()), Some(v1::FlightMode::Loiter));
    // POSCTL, armed: somebody else's.
    for _ in 0..3 {
        rig.hear(1, 1, 0, &[0, 0, 3, 0, 2, 12, 0x81, 4, 3]);
        rig.pass(1_000);
    }
    let status = rig.published.status.clone().expect("a status");
    assert!(status.commanded_by_other && status.actual_mode() == v1::FlightMode::Unspecified, "{status:?}");
}
