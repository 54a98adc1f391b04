//! What the manager tells for rules of the contingency table: the leg, the time that it takes, and who is waited for.

use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::Failed;
use kittiwake_proto::v1::operator_command::Verb;

use crate::stories::rig::Rig;
use crate::stories::under_way;

fn told(rig: &mut Rig) -> v1::FlightProgress {
    rig.wait(1.0);
    rig.status().progress.expect("it flies")
}

#[test]
fn a_vehicle_beside_its_leg_is_told_with_its_distance() {
    let (mut rig, _) = under_way();
    assert_eq!(told(&mut rig).path_deviation_m, Some(0.0));
    rig.vehicle(true, Offboard, (25.0, 60.0, 10.0));
    assert_eq!(told(&mut rig).path_deviation_m, Some(25.0));
    rig.vehicle(true, Offboard, (0.0, 70.0, 40.0));
    assert_eq!(told(&mut rig).path_deviation_m, Some(0.0), "a climb is not a deviation");
}

#[test]
fn who_flies_at_a_quarter_of_its_speed_is_told() {
    let (mut rig, _) = under_way();
    assert_eq!(told(&mut rig).pace, None, "it has just begun");
    // A quarter of the 10 m/s that are asked for, on a leg of 450 m.
    for second in 0..60 {
        rig.vehicle(true, Offboard, (-400.0 + 2.5 * f64::from(second), 50.0, 10.0));
        rig.wait(1.0);
    }
    let pace = told(&mut rig).pace.expect("a leg is flown");
    assert!((0.2..0.3).contains(&pace), "{pace}");
}

#[test]
fn whoever_holds_in_the_air_is_counted_and_who_waits_for_a_plan_too() {
    let (mut rig, skill) = under_way();
    let waits = |it: v1::FlightProgress| (10.0 < it.plan_s, 10.0 < it.operator_s);
    assert_eq!(waits(told(&mut rig)), (false, false));
    rig.end(&skill, Failed, "it did not get there");
    rig.wait(12.0);
    assert_eq!(waits(told(&mut rig)), (true, true));
    assert!(rig.command(Verb::Pause(v1::PauseMission { overrides: false })).done);
    rig.wait(12.0);
    assert_eq!(waits(told(&mut rig)), (false, true));
    assert!(rig.command(Verb::Resume(v1::ResumeMission {})).done);
    rig.flag("gnss_lost", true);
    rig.wait(12.0);
    assert_eq!(waits(told(&mut rig)), (false, true));
    rig.vehicle(false, Loiter, (0.0, 50.0, 0.0));
    rig.wait(1.0);
    assert_eq!(rig.status().progress, None, "nothing flies");
}

/// Where the vehicle is in the new frame says nothing about whether it moved.
#[test]
fn a_frame_that_moves_does_not_begin_the_count_again() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "it did not get there");
    rig.wait(12.0);
    let waited_s = told(&mut rig).operator_s;
    rig.frame = (1, 60.0);
    rig.vehicle(true, Loiter, (60.0, 50.0, 10.0));
    rig.wait(5.0);
    assert!(rig.status().contingencies.iter().any(|it| it.flag == "frame_moved"));
    assert!(waited_s + 5.0 < told(&mut rig).operator_s, "{waited_s}");
}

#[test]
fn how_far_the_battery_suffices_is_told_in_the_wind_as_it_is() {
    let (mut rig, _) = under_way();
    rig.vehicle(true, Offboard, (0.0, 3000.0, 10.0));
    rig.wait(1.0);
    let told = rig.status().energy.expect("it flies");
    let home = told.home.expect("a way home");
    // 3 km at 10 m/s, 10 m down at 1.5 m/s, and what a landing takes.
    assert!((300.0..330.0).contains(&home.time_s) && (60.0..90.0).contains(&home.energy_wh), "{home:?}");
    assert!((home.margin_wh - (225.0 - home.energy_wh)).abs() < 1e-6 && told.wind.is_none(), "{home:?}");
    // A storm from home: the way back is slower and takes more.
    rig.wind = Some(v1::WindEstimate { north_m_s: 0.0, east_m_s: 9.0 });
    rig.wait(2.0);
    let told = rig.status().energy.expect("it flies");
    let against = told.home.clone().expect("a way home");
    assert!(told.wind.is_some() && 480.0 < against.time_s && 1.5 * home.energy_wh < against.energy_wh, "{against:?}");
    assert!(told.turn_home_s.is_some_and(|it| it < 600.0), "{told:?}");
}
