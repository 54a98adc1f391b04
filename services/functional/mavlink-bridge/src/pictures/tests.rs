//! Frames as the dialect writes them, and the pictures that are published of them.

use mavlink::dialects::ardupilotmega::{
    CAMERA_FEEDBACK_DATA, CAMERA_IMAGE_CAPTURED_DATA, CAMERA_TRIGGER_DATA, CameraFeedbackFlags,
    GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavAutopilot, MavBool, MavMessage, MavType,
};
use mavlink::{MavlinkVersion, Message as _};

use super::*;
use crate::bridge::Bridge;
use crate::frame::Frame;
use kittiwake_proto::topics::Message;

const CONFIG: &str = "connect = \"udpin:127.0.0.1:14540\"\nsystem = 0\nsilence_s = 2.5\nretry_s = 0.3\ntries = 3
    effect_limit_s = 3.0\nsetpoint_age_limit_s = 0.5\ncruise_m_s = 10.0\nclimb_m_s = 3.0\ndescent_m_s = 1.5\nacceleration_m_s2 = 3.0\nvertical_acceleration_m_s2 = 1.5\nunflown_s = 3.0\njump_m = 5.0";
const UTC_MS: i64 = 1_767_225_600_000;
const AUTOPILOT: u8 = 1;
const CAMERA: u8 = 100;

fn frame(component: u8, message: &MavMessage) -> Frame {
    let mut payload = [0; 255];
    let length = message.ser(MavlinkVersion::V2, &mut payload);
    Frame::new(0, 1, component, message.message_id(), &payload[..length])
}

fn captured(number: i32) -> MavMessage {
    MavMessage::CAMERA_IMAGE_CAPTURED(CAMERA_IMAGE_CAPTURED_DATA {
        image_index: number,
        capture_result: MavBool::MAV_BOOL_TRUE,
        ..Default::default()
    })
}

fn feedback(number: u16) -> MavMessage {
    MavMessage::CAMERA_FEEDBACK(CAMERA_FEEDBACK_DATA { img_idx: number, ..Default::default() })
}

fn trigger(number: u32) -> MavMessage {
    MavMessage::CAMERA_TRIGGER(CAMERA_TRIGGER_DATA { time_usec: 5_000_000, seq: number })
}

/// What is published of these messages, each with the milliseconds at which a component of the vehicle says it.
fn published(said: Vec<(u64, u8, MavMessage)>) -> Vec<v1::Picture> {
    let mut bridge = Bridge::new(&toml::from_str(CONFIG).unwrap());
    let mut effects = Vec::new();
    let at = |ms: u64| Now { time: Time::after(Duration::from_millis(ms)), utc_ms: UTC_MS + ms as i64 };
    let autopilot = HEARTBEAT_DATA {
        mavtype: MavType::MAV_TYPE_QUADROTOR,
        autopilot: MavAutopilot::MAV_AUTOPILOT_PX4,
        ..Default::default()
    };
    bridge.take_in(&frame(AUTOPILOT, &MavMessage::HEARTBEAT(autopilot)), at(0), &mut effects);
    for ms in (0..20_000).step_by(100) {
        for (_, component, message) in said.iter().filter(|it| it.0 == ms) {
            bridge.take_in(&frame(*component, message), at(ms), &mut effects);
        }
        bridge.act(at(ms), &mut effects);
    }
    let picture = |effect| match effect {
        Effect::Publish { message: Message::Picture(it), .. } => Some(it),
        _ => None,
    };
    effects.into_iter().filter_map(picture).collect()
}

#[test]
fn a_picture_counts_once_whoever_reports_it() {
    #[track_caller]
    fn check(said: Vec<(u64, u8, MavMessage)>, expected: &[u32]) {
        assert_eq!(published(said).iter().map(|it| it.number).collect::<Vec<_>>(), expected);
    }
    check(vec![(500, AUTOPILOT, feedback(3)), (1_000, AUTOPILOT, feedback(4))], &[3, 4]);
    check(vec![(500, AUTOPILOT, feedback(3)), (600, AUTOPILOT, feedback(3))], &[3]);
    // PX4 says when it triggers, and then where.
    let px4 = |ms, number| [(ms, AUTOPILOT, trigger(number)), (ms + 100, AUTOPILOT, captured(number as i32))];
    check([px4(500, 7), px4(1_500, 8)].concat(), &[7, 8]);
    check(vec![(500, AUTOPILOT, trigger(7)), (2_500, AUTOPILOT, trigger(8))], &[7, 8]);
    // A camera counts by itself, and reports what it has stored.
    let stored = |ms, number| (ms, CAMERA, captured(number));
    check([&px4(500, 7)[..], &[stored(2_000, 0)], &px4(6_000, 8), &[stored(7_500, 1)]].concat(), &[0, 1]);
    // The report of the camera is lost.
    check([&px4(500, 7)[..], &[stored(2_000, 0)], &px4(6_000, 8)].concat(), &[0, 8]);
    check(vec![(500, CAMERA, captured(3)), (500, CAMERA + 1, captured(3))], &[3, 3]);
}

#[test]
fn what_is_no_picture_does_not_count() {
    let failed = MavMessage::CAMERA_IMAGE_CAPTURED(CAMERA_IMAGE_CAPTURED_DATA { image_index: 1, ..Default::default() });
    let flags = CameraFeedbackFlags::CAMERA_FEEDBACK_VIDEO;
    let video = MavMessage::CAMERA_FEEDBACK(CAMERA_FEEDBACK_DATA { flags, ..Default::default() });
    let gimbal = 154;
    assert_eq!(published(vec![(500, CAMERA, failed), (500, AUTOPILOT, video), (500, gimbal, captured(2))]), []);
}

#[test]
fn a_picture_has_its_place_its_time_and_how_the_camera_was_turned() {
    #[track_caller]
    fn check(said: Vec<(u64, u8, MavMessage)>, place: Option<[f64; 3]>, utc_ms: i64, degrees: Option<[f64; 3]>) {
        let found = published(said);
        let [picture] = found.as_slice() else { panic!("{found:?}") };
        let near = |it: [f64; 3], expected: [f64; 3]| it.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-4);
        let found = picture.place.map(|it| [it.latitude_deg, it.longitude_deg, it.altitude_amsl_m]);
        assert!(found.zip(place).map_or(found == place, |(it, expected)| near(it, expected)), "{found:?}");
        let turned = picture.attitude.map(|it| [it.roll_rad, it.pitch_rad, it.yaw_rad].map(f64::to_degrees));
        assert!(turned.zip(degrees).map_or(turned == degrees, |(it, expected)| near(it, expected)), "{turned:?}");
        assert_eq!(picture.utc_ms, utc_ms);
    }
    let (lat, lon) = (-338_765_432, 184_123_456);
    let place = |altitude_m| Some([-33.876_543_2, 18.412_345_6, altitude_m]);
    // A yaw of 90 degrees.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let it = CAMERA_IMAGE_CAPTURED_DATA {
        time_utc: 1_767_225_601_234_567,
        lat,
        lon,
        alt: 123_400,
        q: [half, 0.0, 0.0, half],
        capture_result: MavBool::MAV_BOOL_TRUE,
        ..Default::default()
    };
    let yawed = vec![(500, CAMERA, MavMessage::CAMERA_IMAGE_CAPTURED(it.clone()))];
    check(yawed, place(123.4), UTC_MS + 1_234, Some([0.0, 0.0, 90.0]));
    let unknown = CAMERA_IMAGE_CAPTURED_DATA { q: [f32::NAN; 4], time_utc: 0, ..it.clone() };
    check(vec![(500, CAMERA, MavMessage::CAMERA_IMAGE_CAPTURED(unknown))], place(123.4), UTC_MS + 500, None);
    let turned = CAMERA_FEEDBACK_DATA {
        time_usec: 9_000_000,
        lat,
        lng: lon,
        alt_msl: 50.5,
        roll: -3.0,
        pitch: 4.0,
        yaw: 270.0,
        ..Default::default()
    };
    let turned = vec![(500, AUTOPILOT, MavMessage::CAMERA_FEEDBACK(turned))];
    check(turned, place(50.5), UTC_MS + 500, Some([-3.0, 4.0, 270.0]));
    check(vec![(500, AUTOPILOT, trigger(1))], None, UTC_MS + 500, None);
    let vehicle = GLOBAL_POSITION_INT_DATA { lat, lon, alt: 77_000, ..Default::default() };
    let vehicle = (400, AUTOPILOT, MavMessage::GLOBAL_POSITION_INT(vehicle));
    check(vec![vehicle, (500, AUTOPILOT, trigger(1))], place(77.0), UTC_MS + 500, None);
}
