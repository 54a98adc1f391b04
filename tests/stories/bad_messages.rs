//! Any process on the bus may send anything: invalid messages are counted and dropped, and the mission continues.

use kittiwake_proto::topics::{Service, Topic};
use kittiwake_proto::v1::{FlagEvent, Ned, OffboardControlMode, TrajectorySetpoint};
use prost::Message;
use serde_json::Value;
use zenoh::qos::CongestionControl;
use zenoh::{Config, Session, Wait};

use crate::support::{System, wait_for};

/// Larger than any of our messages, and smaller than what the transport itself refuses.
const OVERSIZED: usize = 512 * 1024;

/// A stranger on the bus.
pub fn stranger(locator: &str) -> Session {
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"client\"".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("connect/endpoints", format!("[\"{locator}\"]")),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    zenoh::open(config).wait().unwrap()
}

/// Raises or lowers a flag of uav1 by hand, from here: a process of its own starts late on a busy machine.
pub fn say_flag(session: &Session, name: &str, raised: bool) {
    let event = FlagEvent { name: name.into(), raised, reason: "by hand".into(), ..Default::default() };
    let key = format!("kw/uav1/{}", Topic::FlagEvent.key());
    session.put(key, event.encode_to_vec()).congestion_control(CongestionControl::Block).wait().unwrap();
}

/// Service, instance and messages refused, of every process that has them.
fn processes(status: &Value) -> Vec<(String, String, u64)> {
    let text = |it: &Value| it.as_str().unwrap_or_default().to_owned();
    let row = |it: &Value| {
        let refused = text(&it["heartbeat"]["malformed"]).parse().unwrap_or_default();
        (text(&it["service"]), text(&it["instance"]), refused)
    };
    status["processes"].as_array().into_iter().flatten().map(row).collect()
}

#[test]
fn garbage_on_every_key_is_counted_and_dropped() {
    // Slow enough to be still under way on a crowded machine when all has been sent.
    let system = System::on_long_leg("4");
    let before = processes(&system.status());
    let session = stranger(&system.locator());
    for payload in [vec![0xff; 7], vec![0xff; OVERSIZED]] {
        for topic in Topic::ALL {
            session.put(format!("kw/uav1/{}", topic.key()), payload.clone()).wait().unwrap();
        }
        for service in Service::ALL {
            let replies = session.get(format!("kw/uav1/{}", service.key())).payload(payload.clone()).wait().unwrap();
            // An answer, if any, is an error; the process that serves it must survive.
            assert!(replies.into_iter().all(|it| it.result().is_err()), "{}", service.key());
        }
    }
    // All but the gateway, which reports the others.
    for service in ["vehicle-sim", "skill-manager", "monitor", "planner", "mcm", "control-tower"] {
        wait_for(&format!("{service} to count what it refused"), || {
            processes(&system.status()).into_iter().find(|(name, _, refused)| name == service && 2 <= *refused)
        });
    }
    // The same instances as before: no process died.
    let instances = |rows: Vec<(String, String, u64)>| {
        let mut rows: Vec<_> = rows.into_iter().map(|(service, instance, _)| (service, instance)).collect();
        rows.sort();
        rows.retain(|(service, _)| service != "injector");
        rows
    };
    assert_eq!(instances(processes(&system.status())), instances(before));
    system.end().expect(0, &["SUCCESS"]);
}

#[test]
fn numbers_that_are_none_never_reach_the_vehicle() {
    let system = System::on_long_leg("10");
    let session = stranger(&system.locator());
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let position = Some(Ned { north_m: number, east_m: 0.0, down_m: number });
        let setpoint = TrajectorySetpoint { position, yaw_rad: Some(number), ..Default::default() };
        session
            .put("kw/uav1/fmu/in/offboard_control_mode", OffboardControlMode { control: 1 }.encode_to_vec())
            .wait()
            .unwrap();
        session.put("kw/uav1/fmu/in/trajectory_setpoint", setpoint.encode_to_vec()).wait().unwrap();
    }
    let ending = system.end();
    ending.expect(0, &["SUCCESS"]);
}
