//! Two things wrong at once.

use super::*;

#[test]
fn satellites_lost_for_seconds_cost_nothing_and_for_longer_the_mission() {
    for (lost_s, expected) in
        [(3, MissionOutcome::Success), (6, MissionOutcome::Emergency), (20, MissionOutcome::Emergency)]
    {
        let mut simulation = mission("gnss", &out_and_back(), Policy::Grant);
        until(&mut simulation, |it| 150.0 < it.east_m);
        for _ in 0..3 {
            simulation.inject_fault("gnss_loss", &["on"]);
            simulation.pass(s(lost_s));
            simulation.inject_fault("gnss_loss", &["off"]);
            simulation.pass(s(5));
        }
        ends_as(&mut simulation, expected);
    }
}

/// Out and back from a home inside an area that needs permission.
fn port() -> Vec<String> {
    with(out_and_back(), area("port", "permission", [-60.0, -60.0], [60.0, 60.0], ""))
}

#[test]
fn a_return_with_home_closed_the_landing_blocked_and_satellites_lost_ends() {
    let mut simulation = mission("three", &port(), Policy::Grant);
    until(&mut simulation, |it| 150.0 < it.east_m);
    simulation.inject_fault("blocked_landing", &["on"]);
    simulation.decide("port", Decision::Revoke);
    simulation.order(RETURN);
    simulation.pass(s(40));
    simulation.inject_fault("gnss_loss", &["on"]);
    simulation.pass(s(30));
    simulation.inject_fault("clear", &[]);
    simulation.decide("port", Decision::Grant);
    ends_as(&mut simulation, MissionOutcome::Emergency);
}

#[test]
fn a_pause_whose_grant_ends_with_a_low_battery_and_home_closed_ends() {
    let parts = with(port(), area("A", "permission", [-100.0, 100.0], [100.0, 250.0], ""));
    let mut simulation = mission("paused-grant", &parts, Policy::Grant);
    until(&mut simulation, |it| 170.0 < it.east_m);
    simulation.order(PAUSE);
    simulation.pass(s(30));
    simulation.decide("port", Decision::Revoke);
    simulation.decide_for("A", Decision::Grant, Some(45.0));
    simulation.freeze("control-tower", s(300));
    simulation.pass(s(60));
    simulation.inject_fault("battery", &["0.2"]);
    ends_as(&mut simulation, MissionOutcome::Emergency);
}

#[test]
fn a_process_that_freezes_in_the_middle_of_a_response_delays_it_and_no_more() {
    for (process, response) in
        sample(each(["mcm", "planner", "skill-manager", "monitor"], ["return", "battery_critical", "revoked"]))
    {
        let mut simulation = simulation(None, Policy::Grant);
        assert!(simulation.fly_until("step 4 of 5", LIMIT));
        until(&mut simulation, |it| 200.0 < it.east_m);
        match response {
            "return" => simulation.order(RETURN),
            "battery_critical" => simulation.inject_fault("battery", &["0.09"]),
            _ => simulation.decide("A", Decision::Revoke),
        }
        simulation.pass(Duration::from_millis(1_500));
        simulation.freeze(process, s(25));
        let report = ends(&mut simulation);
        let expected = if response == "revoked" { MissionOutcome::Success } else { MissionOutcome::Emergency };
        assert_eq!(report.outcome(), expected, "{process} {response}: {}", brief(&simulation));
    }
}

#[test]
fn a_manager_that_hangs_for_a_minute_at_either_end_costs_no_objective() {
    for moment in sample(["spool-up", "climb", "landing", "end-in-air"]) {
        let parts = if moment == "end-in-air" { vec![air("look", 0.0, 300.0, 20.0)] } else { out_and_back() };
        let mut simulation = mission("hang-ends", &parts, Policy::Grant);
        match moment {
            "spool-up" => simulation.pass(s(1)),
            "climb" => until(&mut simulation, |it| 3.0 < -it.down_m),
            "landing" => {
                until(&mut simulation, |it| 200.0 < it.east_m);
                until(&mut simulation, |it| it.east_m < 2.0 && -it.down_m < 3.0);
            }
            _ => until(&mut simulation, |it| 299.0 < it.east_m),
        }
        simulation.freeze("mcm", s(60));
        ends_as(&mut simulation, MissionOutcome::Success);
    }
}

#[test]
fn a_return_is_flown_by_processes_that_hang_together_without_a_link() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    until(&mut simulation, |it| 200.0 < it.east_m);
    simulation.freeze("planner", s(40));
    simulation.freeze("skill-manager", s(15));
    simulation.freeze("gateway", s(30));
    simulation.decide("B", Decision::Revoke);
    simulation.pass(s(10));
    simulation.order(RETURN);
    ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(is_home(&simulation), "{}", brief(&simulation));
}

#[test]
fn a_pause_in_the_takeoff_yields_to_a_critical_battery() {
    for height in sample([0.3, 2.0, 8.0]) {
        let mut simulation = mission("pause-takeoff", &out_and_back(), Policy::Grant);
        until(&mut simulation, |it| height < -it.down_m);
        simulation.order(PAUSE);
        simulation.pass(s(15));
        simulation.inject_fault("battery", &["0.09"]);
        ends_as(&mut simulation, MissionOutcome::Emergency);
    }
}

#[test]
fn a_blocked_landing_has_a_responder_until_it_is_free_again() {
    for verb in sample([None, Some(ABORT), Some(RETURN), Some(PAUSE)]) {
        let mut simulation = mission("blocked", &out_and_back(), Policy::Grant);
        until(&mut simulation, |it| 150.0 < it.east_m);
        simulation.inject_fault("blocked_landing", &["on"]);
        if let Some(verb) = verb {
            simulation.order(verb);
        }
        simulation.pass(s(120));
        simulation.inject_fault("battery", &["0.09"]);
        simulation.pass(s(60));
        assert!(!simulation.responder().is_empty() && !simulation.is_on_ground(), "{}", brief(&simulation));
        simulation.inject_fault("blocked_landing", &["off"]);
        ends(&mut simulation);
    }
}

#[test]
fn a_pause_while_the_motors_spool_up_keeps_it_on_the_ground() {
    for after_ms in sample([300, 1_000, 2_000]) {
        let mut simulation = mission("spool-pause", &out_and_back(), Policy::Grant);
        simulation.pass(Duration::from_millis(after_ms));
        simulation.order(PAUSE);
        simulation.pass(s(60));
        assert!(simulation.is_on_ground(), "{after_ms} ms: {}", brief(&simulation));
        simulation.order(RESUME);
        ends_as(&mut simulation, MissionOutcome::Success);
    }
}

#[test]
fn a_skill_manager_that_hangs_in_the_takeoff_costs_no_objective() {
    for (height, seconds) in sample(each([-1.0, 0.3, 5.0, 19.0], [3, 25])) {
        let mut simulation = mission("hang-takeoff", &out_and_back(), Policy::Grant);
        simulation.pass(s(1));
        until(&mut simulation, |it| height < -it.down_m);
        simulation.freeze("skill-manager", s(seconds));
        ends_as(&mut simulation, MissionOutcome::Success);
    }
}

#[test]
fn a_pause_with_override_does_not_keep_it_in_an_area_that_is_revoked_later() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    until(&mut simulation, |it| 180.0 < it.east_m);
    simulation.order(Verb::Pause(v1::PauseMission { overrides: true }));
    simulation.pass(s(20));
    simulation.decide("A", Decision::Revoke);
    simulation.pass(s(40));
    assert!(
        simulation.position().is_some_and(|it| it.east_m < 110.0 || 290.0 < it.east_m || 90.0 < it.north_m.abs()),
        "{}",
        brief(&simulation)
    );
    simulation.order(RESUME);
    ends_as(&mut simulation, MissionOutcome::Success);
}

#[test]
fn orders_do_not_hold_up_a_critical_battery_in_a_revoked_area() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    until(&mut simulation, |it| 180.0 < it.east_m);
    simulation.decide("A", Decision::Revoke);
    simulation.pass(s(1));
    simulation.inject_fault("battery", &["0.2"]);
    simulation.pass(s(4));
    simulation.order(RETURN);
    simulation.pass(s(4));
    simulation.inject_fault("battery", &["0.09"]);
    simulation.pass(s(4));
    simulation.order(RETURN);
    simulation.order(PAUSE);
    let report = ends_as(&mut simulation, MissionOutcome::Emergency);
    assert!(report.reason.contains("battery_critical"), "{report:?}\n{}", brief(&simulation));
}

#[test]
fn a_revocation_in_the_last_metres_of_a_landing_costs_no_objective() {
    for height in sample([5.0, 2.0, 1.0, 0.5, 0.2, 0.1]) {
        let mut simulation = simulation(None, Policy::Grant);
        until(&mut simulation, |it| 498.0 < it.east_m && -it.down_m < height);
        simulation.decide("B", Decision::Revoke);
        simulation.pass(s(25));
        simulation.decide("B", Decision::Grant);
        ends_as(&mut simulation, MissionOutcome::Success);
    }
}

#[test]
fn a_link_that_flaps_for_minutes_costs_no_objective() {
    let mut simulation = simulation(None, Policy::Grant);
    assert!(simulation.fly_until("step 4 of 5", LIMIT));
    for _ in 0..12 {
        simulation.freeze("gateway", s(14));
        simulation.pass(s(16));
    }
    ends_as(&mut simulation, MissionOutcome::Success);
}
