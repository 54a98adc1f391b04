use kittiwake_proto::topics::Topic;

use crate::stories::support::Flight;

/// Table 4.1 of the reference, in wall time, at every speed.
#[test]
fn each_topic_keeps_to_its_rate() {
    for speed in [1.0, 20.0, 50.0] {
        let mut flight = Flight::at_speed(speed, 1);
        flight.pass(1.0 * speed);
        flight.counts.clear();
        flight.pass(10.0 * speed);
        for (topic, rate) in [
            (Topic::VehicleStatus, 2.0),
            (Topic::VehicleAttitude, 240.0),
            (Topic::VehicleLocalPosition, 123.0),
            (Topic::VehicleGlobalPosition, 123.0),
            (Topic::VehicleLandDetected, 1.0),
            (Topic::BatteryStatus, 99.0),
        ] {
            let seen = flight.counts[&topic] as f64;
            // One sample more or less depends on where the window begins.
            let tolerance = f64::max(1.0, 0.01 * 10.0 * rate);
            assert!((seen - 10.0 * rate).abs() <= tolerance, "{topic:?}: {seen} in 10 s at {speed}x");
        }
    }
}
