use proptest::prelude::*;

use super::*;

const HEARTBEAT: [u8; 9] = [4, 0, 0, 0, 2, 3, 81, 3, 3];
/// 2026-01-01.
const NOW_MS: i64 = 1_767_225_600_000;

fn key(byte: u8) -> Key {
    Key([byte; 32])
}

fn heartbeat(sequence: u8) -> Frame {
    Frame::new(sequence, 1, 1, 0, &HEARTBEAT)
}

fn found(bytes: &[u8]) -> Frame {
    match Framer::datagram(bytes).as_slice() {
        [Found::Frame(frame)] => frame.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_key_is_sixty_four_digits_and_is_not_printed() {
    let read: Key = format!(" {}\n", "0aF1".repeat(16)).parse().unwrap();
    assert_eq!(read.0[..4], [0x0a, 0xf1, 0x0a, 0xf1]);
    assert_eq!(format!("{read:?}"), "Key");
    for (text, expected) in
        [("", "found 0 characters"), (&"0".repeat(63)[..], "found 63"), (&"g".repeat(64)[..], "another character")]
    {
        let error = text.parse::<Key>().unwrap_err();
        assert!(error.contains(expected) && error.contains("openssl rand -hex 32"), "{error}");
    }
}

#[test]
fn a_signed_frame_is_a_frame_with_the_same_content() {
    let mut signing = Signing::new(key(7), 3);
    let signed = signing.sign(heartbeat(9), NOW_MS);
    let read = found(signed.bytes());
    assert!(read.is_signed() && read.payload() == heartbeat(9).payload() && read.sequence() == 9);
    assert_eq!(Signing::new(key(7), 0).check(&read, NOW_MS), Ok(()));
    assert_eq!(Signing::new(key(8), 0).check(&read, NOW_MS), Err(Refused::Wrong));
    assert_eq!(Signing::new(key(7), 0).check(&heartbeat(9), NOW_MS), Err(Refused::Unsigned));
    let radio = Frame::new(0, 51, 68, RADIO_STATUS, &[1; 9]);
    assert_eq!(Signing::new(key(7), 0).check(&radio, NOW_MS), Ok(()), "a radio has no key");
}

#[test]
fn another_implementation_signs_the_same() {
    // pymavlink 2.4, the same key, link, sequence and time.
    let theirs = "fd0901000901010000000400000002035103034d040300e03cd6921f658a84d21f7d";
    let signed = Signing::new(key(7), 3).sign(heartbeat(9), NOW_MS);
    let ours: String = signed.bytes().iter().map(|it| format!("{it:02x}")).collect();
    assert_eq!(ours, theirs);
}

#[test]
fn what_was_heard_before_and_a_stream_that_is_far_behind_are_refused() {
    let (mut sender, mut hearer) = (Signing::new(key(7), 0), Signing::new(key(7), 1));
    let [first, second] = [1, 2].map(|it| sender.sign(heartbeat(it), NOW_MS));
    assert_eq!(hearer.check(&second, NOW_MS), Ok(()));
    assert_eq!(hearer.check(&second, NOW_MS), Err(Refused::Old), "it is repeated");
    assert_eq!(hearer.check(&first, NOW_MS), Err(Refused::Old), "one after it was heard");
    let behind = |by_ms: i64| Signing::new(key(7), 9).sign(heartbeat(1), NOW_MS - by_ms);
    assert_eq!(hearer.check(&behind(61_000), NOW_MS), Err(Refused::Old));
    assert_eq!(hearer.check(&behind(59_000), NOW_MS), Ok(()));
}

#[test]
fn a_clock_that_is_set_back_is_no_reason_to_be_refused() {
    let (mut ours, mut autopilot) = (Signing::new(key(7), 0), Signing::new(key(7), 1));
    assert_eq!(autopilot.check(&ours.sign(heartbeat(1), NOW_MS), NOW_MS), Ok(()));
    assert_eq!(autopilot.check(&ours.sign(heartbeat(2), 0), NOW_MS), Ok(()), "the same process");
    // Started again in a year in which there were no signatures, it hears the autopilot first.
    let mut ours = Signing::new(key(7), 0);
    assert_eq!(ours.check(&autopilot.sign(heartbeat(3), NOW_MS), 0), Ok(()));
    assert_eq!(autopilot.check(&ours.sign(heartbeat(4), 0), NOW_MS), Ok(()));
}

/// Pieces that were handed over, and what was sent.
#[derive(Debug, Default)]
struct Pipe(Vec<Vec<u8>>, Vec<Vec<u8>>);

impl Link for Pipe {
    fn receive(&mut self, _: Time) -> Option<Vec<u8>> {
        (!self.0.is_empty()).then(|| self.0.remove(0))
    }
    fn send(&mut self, frame: &[u8], _: Time) {
        self.1.push(frame.to_vec());
    }
    fn is_datagram(&self) -> bool {
        false
    }
}

#[test]
fn a_link_hands_on_what_is_signed_and_says_why_it_does_not() {
    let mut autopilot = Signing::new(key(7), 1);
    let signed = autopilot.sign(heartbeat(1), NOW_MS);
    let (head, tail) = signed.bytes().split_at(11);
    let pieces = vec![heartbeat(0).bytes().to_vec(), head.to_vec(), tail.to_vec(), signed.bytes().to_vec()];
    let mut link = SignedLink::new(Pipe(pieces, Vec::new()), Signing::new(key(7), 0), || NOW_MS);
    // One piece a call, also where nothing in it is believed.
    let mut receive = || {
        let bytes = link.receive(Time::ZERO)?;
        Some((bytes, link.not_believed()))
    };
    let nothing_of = |piece: &[u8]| Some((Vec::new(), piece.len()));
    assert_eq!(receive(), nothing_of(heartbeat(0).bytes()));
    assert_eq!(receive(), nothing_of(head));
    assert_eq!(receive(), Some((signed.bytes().to_vec(), 0)));
    assert_eq!(receive(), nothing_of(signed.bytes()));
    assert_eq!(receive(), None);
    assert!(link.refused().is_some_and(|it| it.contains("of a time that has passed")));
    link.send(heartbeat(3).bytes(), Time::ZERO);
    link.send(signed.bytes(), Time::ZERO);
    let sent: Vec<Frame> = link.link.1.iter().map(|it| found(it)).collect();
    assert!(sent[0].is_signed() && sent[0].payload() == heartbeat(3).payload());
    assert_eq!(sent[1], signed, "what was signed by another one keeps its signature");
}

proptest! {
    /// Any other bytes that are still a frame are refused.
    #[test]
    fn a_frame_that_was_changed_is_refused(at in 0_usize..34, bit in 0_u8..8, sequence in any::<u8>()) {
        let signed = Signing::new(key(7), 0).sign(heartbeat(sequence), NOW_MS);
        let mut bytes = signed.bytes().to_vec();
        let at = at % bytes.len();
        bytes[at] ^= 1 << bit;
        for it in Framer::datagram(&bytes) {
            if let Found::Frame(frame) = it {
                prop_assert!(Signing::new(key(7), 1).check(&frame, NOW_MS).is_err(), "byte {at}");
            }
        }
    }
}
