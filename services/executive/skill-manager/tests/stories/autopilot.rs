//! What the autopilot does by itself, and data that are missing, old or invalid.

use domain::geometry::{Ned, NedVelocity};
use domain::skill::Goal;
use kittiwake_proto::v1::{
    self, FlightMode,
    SkillOutcome::{self, *},
};

use crate::stories::support::autopilot::Reaction::*;
use crate::stories::support::autopilot::{Autopilot, Source};
use crate::stories::support::rig::{Rig, fly_to};

#[test]
fn a_pre_empted_skill_ends_and_so_does_its_stream() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(100.0));
    rig.run(5.0).autopilot.failsafe = Some(FlightMode::Return);
    assert_eq!(rig.outcome(position), Preempted);
    assert_eq!(rig.reason(position), "the autopilot flies return instead of offboard");
    rig.forget().run(5.0).check("");
    assert_eq!(rig.setpoints, [], "or the autopilot would resume offboard by itself");
}

#[test]
fn an_autopilot_that_holds_for_want_of_setpoints_alone_pre_empts_nothing() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(100.0));
    let autopilot = &mut rig.run(5.0).autopilot;
    (autopilot.failsafe, autopilot.waits_for_setpoints) = (Some(FlightMode::Loiter), true);
    rig.run(1.0);
    // The mission manager answers that it is held. Once it is not, the leg is flown on.
    rig.autopilot.failsafe = None;
    assert_eq!(rig.outcome(position), Succeeded);
}

#[test]
fn a_mode_that_somebody_else_has_set_pre_empts() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(100.0));
    rig.run(5.0).autopilot.intended = FlightMode::Land;
    assert_eq!(rig.outcome(position), Preempted);
    assert_eq!(rig.reason(position), "somebody else flies: the mode is not the one that was commanded: land");
    rig.run(5.0);
    assert_eq!(rig.autopilot.commands.len(), 1, "the vehicle is left to the other");
}

#[test]
fn a_mode_that_was_accepted_and_never_flown_is_a_failure() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.expect([Lie]).start(fly_to(1000.0));
    assert_eq!(rig.outcome(position), Failed);
    assert_eq!(rig.reason(position), "accepted, but the actual mode is loiter, not offboard");
}

#[test]
fn a_vehicle_that_is_disarmed_by_somebody_else_pre_empts_the_skill() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(100.0));
    rig.run(5.0).autopilot.armed = false;
    assert_eq!(rig.outcome(position), Preempted);
    assert_eq!(rig.reason(position), "the vehicle was disarmed");
}

#[test]
fn a_command_that_is_not_acknowledged_is_sent_once_more() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.expect([Lose]).start(fly_to(100.0));
    rig.run(2.0).check("offboard 1 process_request\ncommand offboard\ncommand offboard\noffboard 1 execute");
    assert_eq!(rig.outcome(position), Succeeded);
}

#[test]
fn a_second_missing_acknowledgement_ends_the_request() {
    let mut rig = Rig::new(Autopilot::flying());
    let before = rig.now;
    let position = rig.expect([Lose, Lose]).start(fly_to(100.0));
    assert_eq!(rig.outcome(position), Rejected);
    assert_eq!(rig.reason(position), "start: offboard not acknowledged");
    assert_eq!((rig.now - before).as_secs_f64(), 2.0);
}

#[test]
fn a_command_that_was_obeyed_but_not_acknowledged_counts_by_what_the_vehicle_flies() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.expect([ObeySilently]).start(fly_to(20.0));
    assert_eq!(rig.outcome(position), Succeeded);
    assert_eq!((rig.autopilot.intended, rig.autopilot.failsafe), (FlightMode::Offboard, None));
}

#[test]
fn a_second_acknowledgement_means_nothing() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.expect([AckTwice]).start(fly_to(20.0));
    assert_eq!(rig.outcome(position), Succeeded);
}

#[test]
fn nothing_is_decided_on_old_data() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(20.0));
    rig.run(2.0).autopilot.frozen.push(Source::Position);
    rig.run(10.0);
    assert!(rig.ending(position).is_none(), "it is there, but the data are too old to show it");
    rig.autopilot.frozen.clear();
    assert_eq!(rig.outcome(position), Succeeded);
}

#[test]
fn a_takeoff_waits_for_the_height_it_is_relative_to() {
    let mut rig = Rig::silent(Autopilot::default());
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.autopilot.commands, []);
    assert_eq!(rig.outcome(takeoff), Succeeded);
}

#[test]
fn a_takeoff_without_data_fails_after_a_while() {
    let mut rig = Rig::silent(Autopilot::default().silent_about(Source::Position));
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Failed);
    assert_eq!(rig.reason(takeoff), "no recent height from the vehicle");
    assert_eq!(rig.autopilot.commands, []);
}

#[test]
fn a_silent_land_detector_keeps_no_vehicle_from_landing() {
    #[track_caller]
    fn check(goal: Goal, commands: usize) {
        let mut rig = Rig::silent(Autopilot::flying().silent_about(Source::Landed));
        rig.run(1.0).start(goal);
        rig.run(2.0);
        assert_eq!(rig.autopilot.commands.len(), commands);
    }
    // Its height shows that it flies, and it loiters already.
    check(Goal::Stop, 0);
    check(Goal::Land, 1);
}

#[test]
fn a_flight_without_a_known_position_ends() {
    let mut rig = Rig::silent(Autopilot::flying().silent_about(Source::Position));
    rig.run(1.0);
    let position = rig.start(fly_to(50.0));
    // 1.5 s for the data, the 30 s after which it is judged, and 1.5 s for the data again.
    rig.run(32.0);
    assert!(rig.ending(position).is_none());
    rig.run(2.0);
    assert_eq!(rig.outcome(position), TimedOut);
    assert_eq!(rig.reason(position), "the vehicle's position is not known");
}

/// What the autopilot still says is what it said before the command.
#[test]
fn a_status_that_is_repeated_with_its_time_is_none() {
    #[track_caller]
    fn check(timestamp_us: u64, expected: SkillOutcome) {
        let mut rig = Rig::new(Autopilot::flying());
        rig.autopilot.frozen.push(Source::Status);
        let hover = v1::FlightMode::Loiter as i32;
        let status = v1::VehicleStatus {
            armed: true,
            intended_mode: hover,
            actual_mode: hover,
            timestamp_us,
            ..Default::default()
        };
        rig.deliver(status.clone().into());
        let landing = rig.start(Goal::Land);
        for _ in 0..120 {
            rig.run(0.5);
            // What the backend knows by itself may be new.
            rig.deliver(v1::VehicleStatus { reason: format!("at {:?}", rig.now), ..status.clone() }.into());
        }
        assert_eq!(rig.outcome(landing), expected, "{}", rig.reason(landing));
    }
    check(7_000_000, Succeeded);
    // Of one that tells no time nobody knows: it has not taken the mode up.
    check(0, Failed);
}

#[test]
fn a_position_that_the_estimator_does_not_vouch_for_does_not_count() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(50.0));
    rig.run(3.0).autopilot.frozen.push(Source::Position);
    let mut doubtful = v1::VehicleLocalPosition {
        position: Some(Ned::new(50.0, 0.0, -10.0).into()),
        velocity: Some(NedVelocity::default().into()),
        horizontal_valid: false,
        vertical_valid: true,
        ..v1::VehicleLocalPosition::default()
    };
    rig.deliver(doubtful.into());
    assert!(rig.ending(position).is_none());
    doubtful.horizontal_valid = true;
    rig.deliver(doubtful.into());
    assert_eq!(rig.ending(position).map(|it| it.outcome()), Some(Succeeded), "while this message is handled");
}

#[test]
fn an_invalid_message_changes_nothing_and_is_reported() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(50.0));
    rig.run(1.0).autopilot.frozen.push(Source::Position);
    let nan = v1::Ned { north_m: f64::NAN, east_m: 0.0, down_m: 0.0 };
    rig.deliver(v1::VehicleLocalPosition { position: Some(nan), ..v1::VehicleLocalPosition::default() }.into());
    rig.deliver(v1::VehicleCommandAck::default().into());
    rig.run(1.0);
    assert!(rig.ending(position).is_none());
    assert_eq!(
        rig.refused,
        [
            "fmu/out/vehicle_local_position: `position` is north NaN, east 0.0, down 0.0, \
             expected metres within 1,000 km",
            "fmu/out/vehicle_command_ack: `result` is missing",
        ]
    );
}
