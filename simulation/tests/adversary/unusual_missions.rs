//! Missions at the border of what a mission is.

use super::*;

#[test]
fn an_objective_at_home_on_the_ground_is_reached_without_a_flight() {
    let mut simulation = mission("at-home", &[ground("home", 0.0, 0.0)], Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Success);
    assert_eq!(count(&simulation, "takeoff"), 0, "{}", brief(&simulation));
}

#[test]
fn objectives_three_metres_apart_over_home_are_all_flown_to() {
    let mut parts = vec![air("up", 0.0, 0.0, 10.0)];
    for (number, (north, east)) in [(3.0, 0.0), (3.0, 3.0), (0.0, 3.0), (0.0, 0.0)].into_iter().enumerate() {
        parts.push(air(&format!("{number}"), north, east, 10.0));
    }
    parts.push(air("higher", 0.0, 0.0, 13.0));
    parts.push(air("near-ground", 0.0, 0.0, 1.0));
    parts.push(ground("home", 0.0, 0.0));
    let mut simulation = mission("close", &parts, Policy::Grant);
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn forty_objectives_end_by_the_battery_or_by_the_last() {
    let parts: Vec<String> = (0..40)
        .map(|it| {
            let (north, east) = (f64::from(it % 5) * 12.0, f64::from(it / 5) * 12.0 + 12.0);
            if it % 4 == 3 { ground(&format!("{it}"), north, east) } else { air(&format!("{it}"), north, east, 12.0) }
        })
        .collect();
    let mut simulation = mission("forty", &with(parts, ground("home", 0.0, 0.0)), Policy::Grant);
    ends(&mut simulation);
    assert!(is_home(&simulation), "{}", brief(&simulation));
}

#[test]
fn a_battery_that_is_low_from_the_start_is_not_flown() {
    for charge in ["0.2", "0.09", "0.0"] {
        for after_ms in [0, 1_000] {
            let mut simulation = mission("empty", &out_and_back(), Policy::Grant);
            simulation.pass(Duration::from_millis(after_ms));
            simulation.inject_fault("battery", &[charge]);
            simulation.pass(s(120));
            assert!(simulation.position().is_some_and(|it| -it.down_m < 1.0), "{charge}: {}", brief(&simulation));
            assert_eq!(count(&simulation, "step 1 succeeded"), 0, "{charge}: {}", brief(&simulation));
            ends_as(&mut simulation, MissionOutcome::Emergency);
        }
    }
}

#[test]
fn a_vehicle_that_does_not_arm_is_given_up_after_eight_tries() {
    for (rejected, expected) in [("4", MissionOutcome::Success), ("100000", MissionOutcome::Failure)] {
        let mut simulation = mission("rejected", &out_and_back(), Policy::Grant);
        simulation.inject_fault("reject_acks", &[rejected]);
        ends_as(&mut simulation, expected);
        assert!(count(&simulation, "step 1 failed") <= 8, "{}", brief(&simulation));
    }
}
