//! Recorded flights of real autopilots with failsafes, take-overs and restarts, replayed: what they were commanded by the recorder's
//! companion is commanded through the bridge, and what they said then is heard by it. The telemetry is thinned.

use std::time::Duration;

use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{self, FlightMode, vehicle_command::Command};
use mavlink_bridge::MavlinkBridge;
use mavlink_bridge::frame::Frame;
use node::{Event, Node};

use crate::stories::mavlink_bridge::captured::{Recorded, log};
use crate::stories::mavlink_bridge::rig::{ARM, LAND, LOITER, OFFBOARD, Published, at, config};

/// PX4's OFFBOARD, as DO_SET_MODE names it.
const PX4_OFFBOARD: f32 = 6.0;

/// What the layers above would have published for a frame of the recorder's companion.
fn above(frame: &Frame, id: u64) -> Vec<Message> {
    let mut bytes = frame.payload().to_vec();
    bytes.resize(64, 0);
    let float = |at: usize| f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    if frame.id() == 84 {
        let [north_m, east_m, down_m] = [4, 8, 12].map(|at| f64::from(float(at)));
        let setpoint =
            v1::TrajectorySetpoint { position: Some(v1::Ned { north_m, east_m, down_m }), ..Default::default() };
        let control = v1::OffboardControl::Position as i32;
        return vec![v1::OffboardControlMode { control }.into(), setpoint.into()];
    }
    if frame.id() != 76 {
        return Vec::new();
    }
    let command = match (u16::from_le_bytes([bytes[28], bytes[29]]), float(0), float(4)) {
        (400, 1.0, _) => ARM,
        (22, ..) => Command::Takeoff(v1::TakeoffCommand { altitude_m: 10.0 }),
        (21, ..) => LAND,
        (176, _, PX4_OFFBOARD) => OFFBOARD,
        (176, ..) => LOITER,
        _ => return Vec::new(),
    };
    vec![v1::VehicleCommand { id, command: Some(command) }.into()]
}

/// The statuses of a replay.
fn replay(name: &str) -> Published {
    let log = log(name);
    let end = log.last().map_or(Duration::ZERO, |(time, _)| *time);
    let (own, autopilots) = log.into_iter().partition::<Vec<_>, _>(|(_, it)| it.component() == 191);
    let mut bridge = MavlinkBridge::new(&config(), Recorded(autopilots));
    let (mut published, mut own) = (Published::default(), own.into_iter().peekable());
    let (mut now, mut id) = (Duration::ZERO, 0);
    while now <= end {
        let mut effects = Vec::new();
        while let Some((_, frame)) = own.next_if(|(time, _)| *time <= now) {
            id += 1;
            for message in above(&frame, id) {
                bridge.on(at(now), Event::Message { vehicle: "uav1".into(), message }, &mut effects);
            }
        }
        bridge.act(at(now), &mut effects);
        published.take_in(effects, now);
        now += Duration::from_millis(10);
    }
    published
}

/// What was said last at this second of the recording, whose first record is at `start_s`.
#[track_caller]
fn status_at(published: &Published, start_s: f64, second: f64) -> v1::VehicleStatus {
    let time = Duration::from_secs_f64(second - start_s);
    let found = published.statuses.iter().rev().find(|(at, _)| *at <= time);
    found.unwrap_or_else(|| panic!("a status at {second} s")).1.clone()
}

/// The log's first record comes when the recorder first hears a heartbeat or sends its own.
fn start_s(name: &str) -> f64 {
    crate::stories::mavlink_bridge::captured::start(name).as_secs_f64()
}

#[test]
fn a_pilot_who_moves_the_mode_switch_of_a_real_ardupilot_is_somebody_else() {
    let name = "ap_pilot_switch.tlog.gz";
    let (published, start) = (replay(name), start_s(name));
    let at = |second| status_at(&published, start, second);
    assert!(!at(57.0).commanded_by_other, "{:?}", at(57.0));
    let lands = at(60.0);
    assert!(lands.commanded_by_other && !lands.failsafe && lands.reason.contains("LAND"), "{lands:?}");
    assert!(!at(61.9).commanded_by_other, "taken back: {:?}", at(61.9));
    // The recorder's setpoints go on. This bridge, which has stopped the vehicle, did not send them: they are somebody else's, too.
    assert!(at(63.0).reason.contains("a setpoint that is not ours"), "{:?}", at(63.0));
    assert!(at(67.0).commanded_by_other, "{:?}", at(67.0));
    assert!(at(73.0).commanded_by_other && at(73.0).actual_mode() == FlightMode::Unspecified, "{:?}", at(73.0));
}

#[test]
fn a_lost_ground_station_of_a_real_ardupilot_is_its_failsafe() {
    let name = "ap_gcs_loss.tlog.gz";
    let (published, start) = (replay(name), start_s(name));
    let at = |second| status_at(&published, start, second);
    assert!(!at(61.0).failsafe && !at(61.0).commanded_by_other, "{:?}", at(61.0));
    let lost = at(64.0);
    assert!(lost.failsafe && !lost.commanded_by_other && lost.reason.contains("GCS Failsafe"), "{lost:?}");
    assert_eq!(
        (lost.intended_mode() == FlightMode::Return, lost.actual_mode()),
        (false, FlightMode::Return),
        "{lost:?}"
    );
}

#[test]
fn a_real_ardupilot_that_is_killed_in_flight_comes_back_disarmed_in_another_frame() {
    let published = replay("ap_restart.tlog.gz");
    let armed = published.statuses.iter().position(|(_, it)| it.armed).expect("a flight");
    let back = published.statuses[armed..].iter().find(|(_, it)| !it.armed).expect("it comes back");
    let later = published.statuses.iter().rev().find(|(_, it)| !it.armed).expect("a status");
    assert!(!back.1.failsafe, "{back:?}");
    assert_ne!(published.statuses[armed].1.frame_epoch, later.1.frame_epoch);
}

#[test]
fn failsafes_of_a_real_px4_pre_empt_what_was_intended() {
    let name = "px4_failsafes.tlog.gz";
    let (published, start) = (replay(name), start_s(name));
    let at = |second| status_at(&published, start, second);
    let modes = |it: &v1::VehicleStatus| (it.intended_mode(), it.actual_mode(), it.failsafe);
    assert_eq!(modes(&at(15.0)), (FlightMode::Takeoff, FlightMode::Takeoff, false), "{:?}", at(15.0));
    assert_eq!(modes(&at(24.0)), (FlightMode::Offboard, FlightMode::Offboard, false), "{:?}", at(24.0));
    assert_eq!(modes(&at(28.0)), (FlightMode::Offboard, FlightMode::Loiter, true), "the fence: {:?}", at(28.0));
    assert_eq!(modes(&at(31.0)), (FlightMode::Offboard, FlightMode::Offboard, false), "asked back: {:?}", at(31.0));
    assert_eq!(modes(&at(52.5)), (FlightMode::Offboard, FlightMode::Loiter, true), "no ground: {:?}", at(52.5));
    // Positions on the globe are not in the recording, so that the bridge sends no takeoff of its own: that one is somebody else's to it.
    let others = published.statuses.iter().filter(|(at, it)| 21.5 < at.as_secs_f64() + start && it.commanded_by_other);
    let others = others.map(|(at, it)| (at.as_secs_f64() + start, it.reason.clone())).collect::<Vec<_>>();
    assert_eq!(others, []);
}
