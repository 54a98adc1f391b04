//! The captured flight through the bridge: what the system above would have seen.

use domain::fmu::Status;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use px4_bridge::keys;
use px4_bridge::port::Arrival;

use crate::stories::data;
use crate::stories::rig::Rig;

/// Everything that the bridge publishes, with the time in milliseconds.
fn replayed() -> Vec<(u64, Message)> {
    let flight = data::flight();
    let mut rig = Rig::new();
    for key in flight.tokens {
        rig.arrives(Arrival::Token { key, alive: true });
    }
    let mut heard = Vec::new();
    for sample in flight.samples {
        if keys::read(&sample.key, 0).is_some_and(|it| it.is_output) {
            let at_ms = sample.at_us / 1000;
            let published = rig.at_ms(at_ms).arrives(Arrival::Sample { key: sample.key, payload: sample.payload });
            heard.extend(published.into_iter().map(|it| (at_ms, it)));
        }
    }
    assert_eq!(rig.refused, Vec::<String>::new());
    assert_eq!(rig.sent(&[]), [], "it was not ours to set anything");
    heard
}

fn statuses() -> Vec<(u64, Status)> {
    let status = |(at, message)| match message {
        Message::VehicleStatus(it) => Some((at, Status::from(it))),
        _ => None,
    };
    replayed().into_iter().filter_map(status).collect()
}

/// A status in a line, without its reason.
fn line(status: &Status) -> String {
    let mode = |it: Option<domain::fmu::FlightMode>| it.map_or("?".to_owned(), |it| it.to_string());
    let mut line = format!(
        "{} {}/{}",
        if status.armed { "armed" } else { "disarmed" },
        mode(status.intended),
        mode(status.actual)
    );
    for (holds, word) in [(status.failsafe, " failsafe"), (status.commanded_by_other, " by another")] {
        if holds {
            line += word;
        }
    }
    line
}

#[test]
fn the_modes_are_those_of_the_flight() {
    let mut story: Vec<String> = statuses().iter().map(|(_, it)| line(it)).collect();
    story.dedup();
    // Who flew was not Kittiwake: from the arming on it is somebody else's flight.
    assert_eq!(
        story,
        [
            "disarmed loiter/loiter",
            "disarmed offboard/offboard",
            "armed offboard/offboard by another",
            "armed offboard/return failsafe by another",
            "armed offboard/offboard by another",
            "armed land/land by another",
            "disarmed offboard/offboard by another",
        ]
    );
}

#[test]
fn the_failsafe_has_its_reason_and_its_failure() {
    let failsafes: Vec<_> = statuses().into_iter().filter(|(_, it)| it.failsafe).collect();
    let (first, last) = (failsafes.first().expect("one").0, failsafes.last().expect("one").0);
    assert!((26_100..26_200).contains(&first) && last < 28_300, "{first} to {last} ms");
    for (at, status) in failsafes {
        assert_eq!(status.reason, "Return instead of Offboard: there are no fresh offboard setpoints");
        // The flags clear a moment before the mode.
        let lost = status.failures.contains(&domain::fmu::Failure::OffboardSignalLost);
        assert!(lost || 28_150 < at, "at {at} ms: {:?}", status.failures);
    }
}

#[test]
fn it_can_arm_once_its_checks_pass_and_knows_its_origin() {
    let statuses = statuses();
    let (first_ms, first) = statuses.first().expect("one");
    assert_eq!((first.can_arm, first.origin, first.frame_epoch), (Some(false), None, 0), "at {first_ms} ms");
    assert!(!first.reason.is_empty());
    let at_5_s = statuses.iter().rfind(|(at, _)| *at < 5000).map(|(_, it)| it).expect("one");
    assert_eq!(at_5_s.can_arm, Some(true), "{}", at_5_s.reason);
    assert_eq!(at_5_s.reason, "");
    let origin = at_5_s.origin.expect("an origin");
    assert!((origin.place.latitude_deg() - 47.397_742_6).abs() < 1e-6, "{origin:?}");
    assert!(origin.altitude_m.is_some_and(|it| (it - 490.14).abs() < 0.01), "{origin:?}");
    let epochs: std::collections::BTreeSet<_> =
        statuses.iter().filter(|(at, _)| 3500 < *at).map(|(_, it)| it.frame_epoch).collect();
    assert_eq!(epochs.len(), 1, "the frame did not move in flight: {epochs:?}");
}

#[test]
fn no_ground_station_was_there_that_could_be_lost() {
    for (at, status) in statuses() {
        assert!(!status.failures.contains(&domain::fmu::Failure::GroundLinkLost), "at {at} ms");
    }
}

#[test]
fn the_land_detector_goes_through_its_stages() {
    let mut stages: Vec<(bool, bool)> = replayed()
        .into_iter()
        .filter_map(|(_, it)| match it {
            Message::VehicleLandDetected(v1::VehicleLandDetected { landed, ground_contact, .. }) => {
                Some((landed, ground_contact))
            }
            _ => None,
        })
        .collect();
    stages.dedup();
    assert_eq!(stages, [(true, true), (false, true), (false, false), (false, true), (true, true)]);
}

#[test]
fn position_attitude_and_battery_are_those_of_the_flight() {
    let heard = replayed();
    let (mut highest_m, mut farthest_m, mut fastest_rad_s) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut batteries = 0;
    for (at, message) in heard {
        match message {
            Message::VehicleLocalPosition(it) => {
                let position = it.position.expect("a position");
                assert_eq!(it.horizontal_valid && it.vertical_valid, 2690 < at || it.horizontal_valid, "at {at} ms");
                highest_m = highest_m.max(-position.down_m);
                farthest_m = farthest_m.max(position.east_m);
            }
            Message::VehicleAttitude(it) => {
                let length = it.q_w * it.q_w + it.q_x * it.q_x + it.q_y * it.q_y + it.q_z * it.q_z;
                assert!((length - 1.0).abs() < 1e-3, "at {at} ms");
                fastest_rad_s = fastest_rad_s.max(it.roll_rate_rad_s.abs()).max(it.pitch_rate_rad_s.abs());
            }
            Message::BatteryStatus(it) => {
                // In SITL neither is measured: nothing is made up.
                assert_eq!((it.current_a, it.temperature_c), (None, None));
                assert!((15.0..17.0).contains(&it.voltage_v) && (0.3..=1.0).contains(&it.remaining), "{it:?}");
                batteries += 1;
            }
            _ => {}
        }
    }
    assert!((9.9..12.5).contains(&highest_m), "{highest_m}");
    assert!((51.0..53.0).contains(&farthest_m), "{farthest_m}");
    assert!((0.3..10.0).contains(&fastest_rad_s), "{fastest_rad_s}");
    assert!(90 < batteries, "{batteries}");
}
