use super::*;
use crate::frame::{Found, Frame, Framer};
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
fn strangers_do_not_keep_out_a_station_that_signs() {
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
fn a_station_whose_clock_is_behind_hears_the_time_and_is_believed_then() {
    let key: Key = "11".repeat(32).parse().unwrap();
    let (mut ground, bridge, wake) = listening(Some(&key));
    let (station, behind_ms) = (station(), UTC_MS - 120_000);
    let mut signing = Signing::new(key, 0);
    station.send_to(signing.sign(heartbeat(1), behind_ms).bytes(), bridge).unwrap();
    wake.recv_timeout(PATIENCE).unwrap();
    assert_eq!(ground.take_from_ground(Some(1), Time::ZERO), []);
    assert_eq!(
        ground.tell_refused().as_deref(),
        Some(
            "a ground station is not believed: frames arrive with signatures of a time that has passed: they are repeated, or a \
             clock is wrong"
        )
    );
    assert_eq!(ground.tell_refused(), None, "once");
    ground.act(Some(1), Time::ZERO);
    let mut buffer = [0; 300];
    let (length, _) = station.recv_from(&mut buffer).unwrap();
    let found = Framer::datagram(&buffer[..length]);
    let [Found::Frame(beat)] = &found[..] else { panic!("{found:?}") };
    assert_eq!((beat.id(), signing.check(beat, behind_ms)), (0, Ok(())));
    let signed = signing.sign(heartbeat(2), behind_ms);
    station.send_to(signed.bytes(), bridge).unwrap();
    assert_eq!(onward(&mut ground, &wake), [signed]);
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
