//! PX4 absent, half there, of another version, not ready, or sending NaN: clear words, nothing made up, no takeoff.

use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use kittiwake_proto::v1::vehicle_command::Command;
use px4_bridge::port::Arrival;

use crate::stories::rig::{Rig, output, token};

const ARM: Command = Command::Arm(v1::Arm {});

fn command(id: u64, command: Command) -> v1::VehicleCommand {
    v1::VehicleCommand { id, command: Some(command) }
}

/// The reason with which a command is refused at once.
#[track_caller]
fn refusal(rig: &mut Rig, it: Command) -> String {
    let answers = rig.told(command(7, it));
    let [Message::VehicleCommandAck(ack)] = answers.as_slice() else { panic!("{answers:?}") };
    assert_eq!((ack.id, ack.result()), (7, v1::CommandResult::Rejected));
    assert_eq!(rig.sent(&[]), [], "PX4 is not even asked");
    ack.reason.clone()
}

/// PX4 in Hold on the ground, everything there and well.
fn ready(rig: &mut Rig) {
    rig.listens();
    attitude(rig);
    rig.sample("vehicle_local_position", &POSITION, &POSITION_FLAGS);
    rig.sample("vehicle_land_detected", &[], &["landed", "ground_contact"]);
    rig.sample("battery_status", &[("voltage_v", 16.0), ("remaining", 0.9), ("current_a", -1.0)], &["connected"]);
    rig.sample("failsafe_flags", &[], &["gcs_connection_lost"]);
    status(rig, 4, 1, true);
}

fn attitude(rig: &mut Rig) {
    rig.sample("vehicle_attitude", &[("q", 1.0)], &[]);
}

const POSITION: [(&str, f64); 4] =
    [("ref_lat", 47.4), ("ref_lon", 8.5), ("ref_alt", 490.0), ("ref_timestamp", 768_000.0)];
const POSITION_FLAGS: [&str; 6] = ["xy_valid", "z_valid", "v_xy_valid", "v_z_valid", "xy_global", "z_global"];

fn status(rig: &mut Rig, mode: u8, arming: u8, passes: bool) -> Vec<Message> {
    status_of(rig, 0.0, mode, arming, passes)
}

/// A status with this timestamp of PX4; 0 stands for no timestamp.
fn status_of(rig: &mut Rig, timestamp_us: f64, mode: u8, arming: u8, passes: bool) -> Vec<Message> {
    let mode = f64::from(mode);
    let numbers = [("arming_state", f64::from(arming)), ("nav_state", mode), ("nav_state_user_intention", mode)];
    let numbers = [&numbers[..], &[("system_id", 1.0), ("component_id", 1.0), ("timestamp", timestamp_us)]].concat();
    rig.sample("vehicle_status", &numbers, if passes { &["pre_flight_checks_pass"] } else { &[] })
}

#[track_caller]
fn last_status(messages: &[Message]) -> v1::VehicleStatus {
    match messages.last() {
        Some(Message::VehicleStatus(it)) => it.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn without_a_px4_nothing_is_commanded_and_nothing_is_said() {
    let mut rig = Rig::new();
    assert_eq!(refusal(&mut rig, ARM), "no PX4 is heard at tcp/127.0.0.1:7447");
    let land = Command::Land(v1::LandCommand::default());
    assert_eq!(refusal(&mut rig, land), "no PX4 is heard at tcp/127.0.0.1:7447");
    // One that was there, and is silent now.
    ready(&mut rig);
    rig.at_ms(2000);
    assert_eq!(refusal(&mut rig, ARM), "no PX4 is heard at tcp/127.0.0.1:7447");
}

#[test]
fn a_px4_that_is_ready_is_asked() {
    let mut rig = Rig::new();
    ready(&mut rig);
    assert_eq!(rig.told(command(7, ARM)), [], "the answer is PX4's");
    assert_eq!(
        rig.sent(&["command", "param1", "target_system", "source_component"]),
        [("vehicle_command".to_owned(), vec![400.0, 1.0, 1.0, 191.0])]
    );
    let numbers = [("command", 400.0), ("result", 1.0), ("target_system", 1.0), ("target_component", 191.0)];
    let answers = rig.sample("vehicle_command_ack", &numbers, &[]);
    let [Message::VehicleCommandAck(ack)] = answers.as_slice() else { panic!("{answers:?}") };
    assert_eq!(
        (ack.id, ack.result(), ack.reason.as_str()),
        (7, v1::CommandResult::Rejected, "PX4 refused arm, not now")
    );
    assert_eq!(last_status(&status(&mut rig, 4, 1, true)).reason, "PX4 refused arm, not now");
}

#[test]
fn the_answer_to_another_component_is_none_of_ours() {
    let mut rig = Rig::new();
    ready(&mut rig);
    rig.told(command(7, ARM));
    let others = [("command", 400.0), ("target_system", 255.0), ("target_component", 190.0)];
    assert_eq!(rig.sample("vehicle_command_ack", &others, &[]), []);
    let in_progress = [("command", 400.0), ("result", 5.0), ("target_component", 191.0)];
    assert_eq!(rig.sample("vehicle_command_ack", &in_progress, &[]), []);
    let ours = [("command", 400.0), ("target_component", 191.0)];
    assert_eq!(rig.sample("vehicle_command_ack", &ours, &[]).len(), 1);
}

#[test]
fn a_takeoff_is_to_a_height_above_the_origin() {
    let mut rig = Rig::new();
    ready(&mut rig);
    rig.told(command(8, Command::Takeoff(v1::TakeoffCommand { altitude_m: 12.0 })));
    assert_eq!(rig.sent(&["command", "param7"]), [("vehicle_command".to_owned(), vec![22.0, 502.0])]);
}

#[test]
fn a_status_that_px4_repeats_with_its_time_is_no_sign_of_life() {
    #[track_caller]
    fn check(second_us: f64, messages: usize, expected: Option<&str>) {
        let mut rig = Rig::new();
        ready(&mut rig);
        assert_eq!(status_of(&mut rig, 1e6, 4, 1, true).len(), 1);
        rig.at_ms(2000);
        attitude(&mut rig);
        for topic in ["vehicle_land_detected", "battery_status"] {
            rig.sample(topic, &[("timestamp", 2e6)], &[]);
        }
        rig.sample("failsafe_flags", &[], &["gcs_connection_lost"]);
        rig.sample("vehicle_local_position", &POSITION, &POSITION_FLAGS);
        assert_eq!(status_of(&mut rig, second_us, 4, 1, true).len(), messages);
        match expected {
            Some(expected) => assert_eq!(refusal(&mut rig, ARM), expected),
            None => assert_eq!(rig.told(command(7, ARM)), [], "the answer is PX4's"),
        }
    }
    check(1e6, 0, Some("no PX4 is heard at tcp/127.0.0.1:7447"));
    check(2e6, 1, None);
}

#[test]
fn half_of_the_topics_do_for_no_takeoff() {
    for missing in ["vehicle_attitude", "vehicle_land_detected", "battery_status", "failsafe_flags"] {
        let mut rig = Rig::new();
        ready(&mut rig);
        rig.at_ms(2000);
        // Everything goes on but one.
        for topic in ["vehicle_attitude", "vehicle_land_detected", "battery_status", "failsafe_flags"] {
            if topic != missing {
                rig.sample(topic, &[("timestamp", 2e6)], &[]);
            }
        }
        rig.sample("vehicle_local_position", &POSITION, &POSITION_FLAGS);
        let status = last_status(&status(&mut rig, 4, 1, true));
        let expected = format!("PX4 has not sent `{missing}` for 2.0 s");
        assert_eq!((status.can_arm, status.reason.as_str()), (Some(false), expected.as_str()));
        assert_eq!(refusal(&mut rig, ARM), expected);
    }
}

#[test]
fn an_estimator_that_is_not_ready_arms_nothing() {
    let mut rig = Rig::new();
    ready(&mut rig);
    rig.sample("vehicle_local_position", &POSITION, &["z_valid", "v_z_valid"]);
    assert_eq!(refusal(&mut rig, ARM), "PX4's position estimate is not valid yet");
    let unknown = [("ref_lat", f64::NAN), ("ref_lon", f64::NAN), ("ref_alt", f64::NAN)];
    rig.sample("vehicle_local_position", &unknown, &POSITION_FLAGS);
    assert_eq!(refusal(&mut rig, ARM), "PX4 does not know where its origin is yet");
}

#[test]
fn an_unknown_version_is_named_once_and_not_read() {
    let mut rig = Rig::new();
    ready(&mut rig);
    let key = output("battery_status", "BatteryStatus", &"ab".repeat(32));
    for _ in 0..3 {
        assert_eq!(rig.arrives(Arrival::Sample { key: key.clone(), payload: vec![0, 1, 0, 0] }), []);
    }
    let [why] = rig.refused.as_slice() else { panic!("{:?}", rig.refused) };
    for part in ["version of `battery_status`", "BatteryStatus with hash abababababab", "expected 92fd1f3af414"] {
        assert!(why.contains(part), "{why}");
    }
    let why = why.clone();
    assert_eq!(refusal(&mut rig, ARM), why);
    // And for what PX4 listens to.
    let mut rig = Rig::new();
    ready(&mut rig);
    rig.arrives(Arrival::Token { key: token("vehicle_command", "VehicleCommand", &"cd".repeat(32)), alive: true });
    assert!(refusal(&mut rig, ARM).contains("version of `vehicle_command`"));
    // A build without hashes.
    let mut rig = Rig::new();
    ready(&mut rig);
    let key = output("vehicle_attitude", "VehicleAttitude", "").replace("RIHS01_", "TypeHashNotSupported");
    rig.arrives(Arrival::Sample { key, payload: Vec::new() });
    assert!(refusal(&mut rig, ARM).contains("CONFIG_ZENOH_KEY_TYPE_HASH=y"));
}

#[test]
fn what_is_no_number_does_not_come_through() {
    let mut rig = Rig::new();
    ready(&mut rig);
    for field in ["x", "vz", "heading", "eph"] {
        let numbers = [&POSITION[..], &[(field, f64::NAN)]].concat();
        assert_eq!(rig.sample("vehicle_local_position", &numbers, &POSITION_FLAGS), [], "{field}");
    }
    assert_eq!(rig.sample("battery_status", &[("voltage_v", 16.0), ("remaining", -1.0)], &["connected"]), []);
    assert_eq!(rig.sample("battery_status", &[("voltage_v", 16.0), ("remaining", 0.5)], &[]), [], "not connected");
    let global = [("lat", 47.0), ("lon", 8.0), ("alt", f64::INFINITY)];
    assert_eq!(rig.sample("vehicle_global_position", &global, &["lat_lon_valid", "alt_valid"]), []);
}

#[test]
fn a_sample_that_is_cut_off_is_refused_and_not_counted_as_heard() {
    let mut rig = Rig::new();
    ready(&mut rig);
    rig.at_ms(2000);
    let hash = "92fd1f3af4149312736945b5a3537b61e5268fca090d27abbb3b8ba243a5df8e";
    let key = output("battery_status", "BatteryStatus", hash);
    assert_eq!(rig.arrives(Arrival::Sample { key, payload: vec![0, 1, 0, 0, 9, 9] }), []);
    assert!(rig.refused[0].contains("it ends within `timestamp`"), "{:?}", rig.refused);
}

#[test]
fn setpoints_go_through_once_each_and_a_limited_one_moves() {
    let mut rig = Rig::new();
    ready(&mut rig);
    let position = Some(v1::Ned { north_m: 0.0, east_m: 100.0, down_m: -10.0 });
    rig.told(v1::OffboardControlMode { control: v1::OffboardControl::Position.into() });
    rig.told(v1::TrajectorySetpoint { position, ..Default::default() });
    let sent = rig.sent(&["position"]);
    assert_eq!(sent.len(), 2, "{sent:?}");
    assert_eq!(sent[0].0, "offboard_control_mode");
    // Due east of us is not quite due east of PX4, whose Earth is a sphere.
    assert!(sent[1].0 == "trajectory_setpoint" && sent[1].1[0].abs() < 0.01, "{sent:?}");
    let setpoint = v1::TrajectorySetpoint { position, speed_limit_m_s: Some(2.0), ..Default::default() };
    let mut east = Vec::new();
    for ms in [50, 100, 150] {
        rig.at_ms(ms);
        rig.told(setpoint);
        east.extend(rig.sent_east());
    }
    assert!(east.windows(2).all(|it| it[0] < it[1]) && east.iter().all(|it| *it < 1.0), "{east:?}");
    // Without a position nothing says where the target should begin.
    rig.at_ms(5000);
    rig.told(setpoint);
    assert_eq!(rig.sent(&[]), []);
}
