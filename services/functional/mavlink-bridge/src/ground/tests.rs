use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use kittiwake_proto::v1::DecisionKind;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MavlinkVersion, Message as _};

use super::*;
use crate::frame::Framer;

/// The ground station's end of a link.
#[derive(Debug, Default, Clone)]
struct Station {
    said: Rc<RefCell<VecDeque<Vec<u8>>>>,
    heard: Rc<RefCell<Vec<u8>>>,
}

impl Link for Station {
    fn receive(&mut self, _now: Time) -> Option<Vec<u8>> {
        self.said.borrow_mut().pop_front()
    }
    fn send(&mut self, frame: &[u8], _now: Time) {
        self.heard.borrow_mut().extend_from_slice(frame);
    }
    fn is_datagram(&self) -> bool {
        true
    }
}

impl Station {
    fn says(&self, frame: &Frame) {
        self.said.borrow_mut().push_back(frame.bytes().to_vec());
    }

    fn heard(&self) -> Vec<Frame> {
        let bytes = self.heard.take();
        let frame = |it| if let Found::Frame(frame) = it { Some(frame) } else { None };
        Framer::datagram(&bytes).into_iter().filter_map(frame).collect()
    }
}

fn rig() -> (Station, Ground) {
    let station = Station::default();
    (station.clone(), Ground::new(Box::new(station)))
}

const SYSTEM: Option<u8> = Some(1);

/// A command of the ground station (255, 190) for this component.
fn command(system: u8, component: u8) -> Frame {
    let mut payload = vec![0; 28];
    payload.extend([176, 0, system, component, 0]);
    Frame::new(1, 255, 190, words::COMMAND_LONG, &payload)
}

fn heartbeat(system: u8, component: u8) -> Frame {
    Frame::new(1, system, component, 0, &[0, 0, 0, 0, 2, 3, 81, 3, 3])
}

#[test]
fn frames_go_on_as_they_came_and_never_back() {
    let (station, mut ground) = rig();
    ground.forward_to_ground(&heartbeat(1, 1), Time::ZERO);
    ground.forward_to_ground(&heartbeat(1, 154), Time::ZERO);
    assert_eq!(station.heard(), [heartbeat(1, 1), heartbeat(1, 154)]);
    for frame in [heartbeat(255, 190), command(1, 1), command(1, 154), command(0, 0)] {
        station.says(&frame);
        assert_eq!(ground.take_from_ground(SYSTEM, Time::ZERO), [frame]);
    }
    // Whose frame has come round is not sent round again: the autopilot's, ours, the ground station's.
    for frame in [heartbeat(1, 1), heartbeat(1, OUR_COMPONENT)] {
        station.says(&frame);
        assert_eq!(ground.take_from_ground(SYSTEM, Time::ZERO), []);
    }
    ground.forward_to_ground(&heartbeat(255, 190), Time::ZERO);
    assert_eq!(station.heard(), []);
}

#[test]
fn what_needs_no_signature_keeps_nobody_out() {
    let (station, mut ground) = rig();
    // A stranger on the vehicle's side in the name of the ground station.
    ground.forward_to_ground(&Frame::new(1, 255, 190, RADIO_STATUS, &[1; 9]), Time::ZERO);
    station.says(&heartbeat(255, 190));
    assert_eq!(ground.take_from_ground(SYSTEM, Time::ZERO), [heartbeat(255, 190)]);
}

#[test]
fn what_is_for_us_goes_no_further_and_a_command_is_answered() {
    let (station, mut ground) = rig();
    station.says(&command(1, OUR_COMPONENT));
    assert_eq!(ground.take_from_ground(SYSTEM, Time::ZERO), []);
    let heard = station.heard();
    let [ack] = &heard[..] else { panic!("{heard:?}") };
    let MavMessage::COMMAND_ACK(it) = MavMessage::parse(MavlinkVersion::V2, ack.id(), ack.payload()).unwrap() else {
        panic!("{ack:?}")
    };
    assert_eq!((it.command as u32, it.result as u32), (176, 3));
    assert_eq!((it.target_system, it.target_component), (255, 190));
    // The autopilot's answer to a command of ours concerns nobody else.
    let answer = Frame::new(1, 1, 1, words::COMMAND_ACK, &[176, 0, 0, 0, 0, 0, 0, 0, 1, OUR_COMPONENT]);
    ground.forward_to_ground(&answer, Time::ZERO);
    assert_eq!(station.heard(), []);
}

/// The texts that a ground station puts together, with their severities.
fn told(decisions: &[(DecisionKind, &str)]) -> Vec<(u8, String)> {
    let (station, mut ground) = rig();
    let mut texts: Vec<(u8, String)> = Vec::new();
    for (kind, text) in decisions {
        let decision = DecisionRecord { text: (*text).to_owned(), kind: *kind as i32, ..DecisionRecord::default() };
        ground.tell(&decision, SYSTEM, Time::ZERO);
        for frame in station.heard() {
            let MavMessage::STATUSTEXT(it) =
                MavMessage::parse(MavlinkVersion::V2, frame.id(), frame.payload()).unwrap()
            else {
                panic!("{frame:?}")
            };
            let part = it.text.to_str().unwrap().to_owned();
            match texts.last_mut().filter(|_| 0 < it.chunk_seq) {
                Some((_, text)) => text.push_str(&part),
                None => texts.push((it.severity as u8, part)),
            }
        }
    }
    texts
}

#[test]
fn decisions_are_told_whole_and_by_how_much_they_matter() {
    let long = "step 3 of 5: fly to (0, 360, 10) through A, asking B, which is needed until 1:54";
    let fills = "x".repeat(100);
    let expected = [
        (6, "step 1 of 5: takeoff by 10 m".to_owned()),
        (4, "battery_low: divert".to_owned()),
        (6, long.to_owned()),
        (6, fills.clone()),
        (5, "no way at 40?".to_owned()),
    ];
    let decisions = [
        (DecisionKind::Unspecified, "step 1 of 5: takeoff by 10 m"),
        (DecisionKind::ContingencyAnswered, "`battery_low`: divert"),
        (DecisionKind::Unspecified, long),
        (DecisionKind::Unspecified, &fills),
        (DecisionKind::PlanHold, "no way at 40°"),
    ];
    assert_eq!(told(&decisions), expected);
    assert_eq!(told(&[(DecisionKind::Unspecified, &"y".repeat(9000))])[0].1.len(), 249);
}

#[test]
fn it_says_once_a_second_that_it_is_there_once_an_autopilot_is() {
    let (station, mut ground) = rig();
    ground.act(None, Time::ZERO);
    assert_eq!(station.heard(), []);
    for tenths in 10..=30 {
        ground.act(SYSTEM, Time::after(Duration::from_millis(100 * tenths)));
    }
    let heard = station.heard();
    assert_eq!(heard.iter().map(|it| (it.id(), it.component())).collect::<Vec<_>>(), [(0, OUR_COMPONENT); 3]);
}
