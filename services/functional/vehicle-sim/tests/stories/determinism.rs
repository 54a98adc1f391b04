use domain::geometry::Ned;

use crate::stories::support::{Flight, arm, land, offboard, takeoff};

#[test]
fn the_same_seed_and_inputs_give_the_same_outputs_and_another_seed_others() {
    let fly = |seed| {
        let mut flight = Flight::at_speed(1.0, seed);
        flight.record = Some(Vec::new());
        flight.fault("wind 2 -3 1");
        flight.accepted(arm());
        flight.accepted(takeoff(10.0));
        flight.pass(15.0);
        flight.stream_position(Ned::new(20.0, 30.0, -12.0), Some(6.0));
        flight.pass(0.1);
        flight.accepted(offboard());
        flight.pass(5.0);
        flight.fault("gnss_loss");
        flight.pass(7.0);
        flight.fault("clear");
        flight.accepted(land());
        flight.pass(20.0);
        flight.record.unwrap()
    };
    let first = fly(5);
    assert!(first.len() > 10_000);
    assert!(first == fly(5), "two runs with one seed differ");
    assert!(first != fly(6), "the seed has no effect");
}
