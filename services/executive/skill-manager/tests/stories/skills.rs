//! Each skill alone, from its request to its outcome.

use domain::geometry::{Ned, NedVelocity};
use domain::skill::Goal;
use kittiwake_proto::v1::{FlightMode, SkillOutcome::*};

use crate::stories::support::autopilot::Reaction::*;
use crate::stories::support::autopilot::{Autopilot, Source};
use crate::stories::support::rig::Rig;

fn fly_to(north_m: f64, hold_at_target: bool) -> Goal {
    Goal::Position { target: Ned::new(north_m, 0.0, -10.0), speed_limit_m_s: 10.0, yaw_rad: None, hold_at_target }
}

fn drift(timeout_s: Option<f64>) -> Goal {
    Goal::Velocity { velocity: NedVelocity::new(2.0, 0.0, 0.0), yaw_rate_rad_s: None, timeout_s }
}

#[test]
fn takeoff_arms_climbs_and_loiters() {
    let mut rig = Rig::new(Autopilot::default());
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Succeeded);
    rig.run(1.0).check(
        "takeoff 1 process_request
         command arm
         command takeoff 10.0
         takeoff 1 execute
         takeoff 1 succeeded",
    );
    let height_m = -rig.ending(takeoff).unwrap().position.unwrap().down_m;
    assert!((height_m - 10.0).abs() < 0.5, "ended at {height_m} m");
}

#[test]
fn takeoff_climbs_relative_to_where_the_vehicle_is_and_does_not_arm_twice() {
    let mut rig = Rig::new(Autopilot::flying());
    let takeoff = rig.start(Goal::Takeoff { climb_m: 3.0 });
    assert_eq!(rig.outcome(takeoff), Succeeded);
    rig.check("takeoff 1 process_request\ncommand takeoff 13.0\ntakeoff 1 execute\ntakeoff 1 succeeded");
}

#[test]
fn a_takeoff_that_is_rejected_after_arming_disarms() {
    let mut rig = Rig::new(Autopilot::default());
    let takeoff = rig.expect([Obey, Reject]).start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Rejected);
    rig.run(3.0).check(
        "takeoff 1 process_request
         command arm
         command takeoff 10.0
         takeoff 1 rejected: start: takeoff to 10.0 m rejected: not now
         command disarm",
    );
    assert!(!rig.autopilot.armed);
}

#[test]
fn a_takeoff_whose_arming_is_rejected_commands_nothing_else() {
    let mut rig = Rig::new(Autopilot::default());
    let takeoff = rig.expect([Reject]).start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Rejected);
    rig.run(3.0);
    assert_eq!(rig.autopilot.commands.len(), 1);
}

#[test]
fn an_offboard_command_that_overtakes_its_first_setpoint_is_sent_once_more() {
    let mut rig = Rig::new(Autopilot::flying());
    let flight = rig.expect([Reject]).start(fly_to(5.0, false));
    assert_eq!(rig.outcome(flight), Succeeded);
    rig.check(
        "offboard 1 process_request
         command offboard
         command offboard
         offboard 1 execute
         offboard 1 succeeded",
    );
}

#[test]
fn an_autopilot_that_refuses_offboard_with_setpoints_is_believed() {
    let mut rig = Rig::new(Autopilot::flying());
    let flight = rig.expect([Reject, Reject]).start(fly_to(5.0, false));
    assert_eq!(rig.outcome(flight), Rejected);
    rig.run(3.0);
    assert_eq!(rig.autopilot.commands.len(), 2);
    assert!(!rig.autopilot.is_fed(rig.now), "nothing is streamed for a skill that does not fly");
}

/// In the tenth of a second between the two commands.
#[test]
fn a_flight_that_asks_for_its_mode_once_more_gives_way_at_once() {
    let refused = || {
        let mut rig = Rig::new(Autopilot::flying());
        let flight = rig.expect([Reject]).start(fly_to(50.0, false));
        rig.run(0.02);
        assert_eq!(rig.autopilot.commands.len(), 1);
        (rig, flight)
    };
    let (mut rig, flight) = refused();
    rig.start(Goal::Land);
    assert_eq!(rig.ending(flight).map(|it| it.outcome()), Some(Aborted), "at once");
    rig.run(0.02);
    assert_eq!(rig.autopilot.intended, FlightMode::Land);

    let (mut rig, flight) = refused();
    rig.cancel(flight).unwrap();
    assert_eq!(rig.ending(flight).map(|it| it.outcome()), Some(Cancelled), "at once");
    rig.run(2.0);
    assert_eq!(rig.autopilot.commands.len(), 1);
    assert!(!rig.autopilot.is_fed(rig.now), "nothing is streamed for a skill that does not fly");
}

/// It was armed when the takeoff was asked for, and disarmed itself before the command came.
#[test]
fn a_takeoff_of_a_vehicle_that_has_just_disarmed_itself_arms_it() {
    let mut rig = Rig::new(Autopilot::default().armed());
    rig.autopilot.armed = false;
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Succeeded);
    rig.check(
        "takeoff 1 process_request
         command takeoff 10.0
         command arm
         command takeoff 10.0
         takeoff 1 execute
         takeoff 1 succeeded",
    );
}

#[test]
fn a_takeoff_that_is_refused_while_armed_is_commanded_twice() {
    let mut rig = Rig::new(Autopilot::default().armed());
    let takeoff = rig.expect([Reject, Reject]).start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Rejected);
    rig.run(3.0).check(
        "takeoff 1 process_request
         command takeoff 10.0
         command takeoff 10.0
         takeoff 1 rejected: start: takeoff to 10.0 m rejected: not now",
    );
}

#[test]
fn a_takeoff_that_levels_off_too_low_fails() {
    let mut rig = Rig::new(Autopilot::default());
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    rig.run(2.0).autopilot.intended = FlightMode::Loiter;
    assert_eq!(rig.outcome(takeoff), Failed);
    assert!(rig.reason(takeoff).starts_with("the climb to 10.0 m ended at "), "{}", rig.reason(takeoff));
}

#[test]
fn land_ends_when_the_land_detector_says_so() {
    let mut rig = Rig::new(Autopilot::flying());
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
    assert!(rig.autopilot.landed);
    rig.run(3.0).check("land 1 process_request\ncommand land\nland 1 execute\nland 1 succeeded");
}

#[test]
fn a_goal_that_is_already_reached_succeeds_without_a_command() {
    #[track_caller]
    fn check(autopilot: Autopilot, goal: Goal) {
        let mut rig = Rig::new(autopilot);
        let skill = rig.start(goal);
        assert_eq!(rig.ending(skill).map(|it| it.outcome()), Some(Succeeded), "at once");
        rig.run(3.0);
        assert_eq!(rig.autopilot.commands, []);
        assert_eq!(rig.setpoints, []);
    }
    check(Autopilot::default(), Goal::Land);
    check(Autopilot::default(), Goal::Stop);
    check(Autopilot::default().armed(), Goal::Stop);
    check(Autopilot::flying(), Goal::Stop);
    check(Autopilot::flying(), fly_to(0.0, false));
}

#[test]
fn a_vehicle_that_is_about_to_lift_off_does_not_count_as_landed() {
    let mut rig = Rig::new(Autopilot::default());
    rig.start(Goal::Takeoff { climb_m: 10.0 });
    rig.run(0.012);
    assert!(rig.autopilot.landed && rig.autopilot.intended == FlightMode::Takeoff);
    let land = rig.start(Goal::Land);
    rig.outcome(land);
    assert!(
        rig.autopilot.commands.iter().any(|it| matches!(it, kittiwake_proto::v1::vehicle_command::Command::Land(_)))
    );
}

#[test]
fn a_landing_of_a_vehicle_that_stands_armed_disarms_it() {
    let mut rig = Rig::new(Autopilot::default().armed());
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
    assert!(!rig.autopilot.armed);
    rig.run(3.0).check("land 1 process_request\ncommand disarm\nland 1 execute\nland 1 succeeded");
}

#[test]
fn a_disarming_that_no_status_shows_times_out() {
    let mut rig = Rig::new(Autopilot::default().armed());
    rig.run(0.1);
    rig.autopilot.frozen = vec![Source::Status];
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), TimedOut);
    assert_eq!(rig.reason(land), "was disarmed, and is still reported as armed");
}

/// From before the takeoff to the end of the landing.
#[test]
fn a_land_detector_that_never_notices_the_flight_hides_neither_takeoff_nor_landing() {
    let mut rig = Rig::new(Autopilot::default());
    rig.run(0.1);
    rig.autopilot.frozen = vec![Source::Landed];
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Succeeded);
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
    assert!(!rig.autopilot.armed && rig.autopilot.landed);
}

#[test]
fn stop_ends_when_the_vehicle_is_slow() {
    let mut rig = Rig::new(Autopilot::flying());
    let velocity = rig.start(drift(None));
    rig.run(5.0).forget();
    let stop = rig.start(Goal::Stop);
    assert_eq!(rig.outcome(stop), Succeeded);
    assert_eq!(rig.outcome(velocity), Aborted);
    rig.run(2.0).check(
        "stop 2 process_request
         command loiter
         offboard 1 abort: overwritten by skill 2
         offboard 1 aborted: overwritten by skill 2
         stop 2 execute
         stop 2 succeeded",
    );
}

#[test]
fn position_streams_before_the_mode_command_and_until_loiter_is_accepted() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(50.0, false));
    assert_eq!(rig.setpoints.len(), 1, "one before the command");
    assert_eq!(rig.outcome(position), Succeeded);
    let ended = rig.now;
    rig.run(2.0).check(
        "offboard 1 process_request
         command offboard
         offboard 1 execute
         offboard 1 succeeded
         command loiter",
    );
    let last = *rig.setpoints.last().unwrap();
    assert!((0.15..0.30).contains(&(last - ended).as_secs_f64()), "kept alive until loiter: {:?}", last - ended);
    let gap = rig.setpoints.windows(2).map(|it| it[1] - it[0]).max().unwrap();
    assert!(gap.as_millis() <= 50, "20 Hz: {gap:?}");
    assert_eq!(rig.autopilot.failsafe, None);
    let result = rig.ending(position).unwrap();
    assert!((result.position.unwrap().north_m - 50.0).abs() < 1.0);
    assert!(result.velocity.is_some());
}

#[test]
fn a_position_skill_that_does_not_reach_its_target_times_out() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.autopilot.position.north_m = -100.0;
    rig.run(0.1);
    let position = rig.start(Goal::Position {
        target: Ned::new(0.0, 0.0, -10.0),
        speed_limit_m_s: 10.0,
        yaw_rad: None,
        hold_at_target: false,
    });
    let started = rig.now;
    // The wind blows it back as fast as it flies.
    while rig.ending(position).is_none() {
        rig.autopilot.position.north_m = -60.0;
        rig.run(0.1);
    }
    assert_eq!(rig.outcome(position), TimedOut);
    assert!(rig.reason(position).starts_with("comes no nearer: still 59"), "{}", rig.reason(position));
    assert_eq!((rig.now - started).as_secs_f64().round(), 60.0, "it came nearer at first");
}

#[test]
fn a_position_skill_that_is_slow_and_comes_nearer_reaches_its_target() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.run(0.1);
    let position = rig.start(fly_to(200.0, false));
    let started = rig.now;
    // A tenth of the speed that was asked for: by a clock of twice its time and 20 s it would have ended after 60 s.
    while rig.ending(position).is_none() {
        let flown_m = 1.0 * (rig.now - started).as_secs_f64();
        rig.autopilot.position.north_m = flown_m.min(200.0);
        rig.run(0.1);
    }
    assert_eq!(rig.outcome(position), Succeeded);
    assert!(190.0 < (rig.now - started).as_secs_f64(), "{:?}", rig.now);
}

/// Flies `goal` while something keeps the vehicle at a height, up to its outcome; how long that took, in seconds.
fn kept_at(height_m: f64, autopilot: Autopilot, goal: Goal, speed: u32) -> (Rig, u64, f64) {
    let mut rig = Rig::at_speed(speed, autopilot);
    rig.run(f64::from(speed));
    let skill = rig.start(goal);
    let started = rig.now;
    while rig.ending(skill).is_none() {
        rig.autopilot.position.down_m = -height_m;
        rig.run(0.1);
    }
    let took_s = (rig.now - started).as_secs_f64();
    (rig, skill, took_s)
}

#[test]
fn a_landing_that_does_not_come_down_times_out() {
    #[track_caller]
    fn check(speed: u32, limit_s: f64) {
        let (mut rig, land, took_s) = kept_at(2.0, Autopilot::flying(), Goal::Land, speed);
        assert_eq!(rig.outcome(land), TimedOut);
        assert!(rig.reason(land).starts_with("did not come down: still at a height of 2.0"), "{}", rig.reason(land));
        assert!((limit_s..limit_s + 1.0).contains(&took_s), "at speed {speed}: {took_s}");
        for _ in 0..speed * 10 {
            rig.autopilot.position.down_m = -2.0;
            rig.run(0.1);
        }
        assert_eq!(rig.autopilot.actual(), FlightMode::Loiter, "nothing else flies it");
    }
    check(1, 10.0);
    check(10, 10.0);
    check(20, 20.0);
}

#[test]
fn a_landing_that_comes_down_has_all_the_time_that_it_needs() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.autopilot.position.down_m = -300.0;
    rig.run(0.1);
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
    assert!(200.0 < rig.now.as_secs_f64(), "{:?}", rig.now);
}

#[test]
fn a_landing_does_not_believe_a_height_that_repeats_itself() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.autopilot.position.down_m = -60.0;
    rig.run(0.1);
    rig.autopilot.repeats = Some((rig.autopilot.position, rig.autopilot.velocity));
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
    assert!(30.0 < rig.now.as_secs_f64(), "{:?}", rig.now);
}

#[test]
fn a_landing_ends_by_the_motors_where_the_land_detector_is_silent() {
    let mut rig = Rig::new(Autopilot::flying().silent_about(Source::Landed));
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
    assert!(!rig.autopilot.armed);
}

#[test]
fn a_takeoff_that_does_not_climb_times_out() {
    let (mut rig, takeoff, took_s) = kept_at(0.0, Autopilot::default(), Goal::Takeoff { climb_m: 9.0 }, 1);
    assert_eq!(rig.outcome(takeoff), TimedOut);
    assert!(rig.reason(takeoff).starts_with("did not climb to 9.0 m: still at 0."), "{}", rig.reason(takeoff));
    assert_eq!(took_s.round(), 30.0, "one stretch");
}

#[test]
fn a_stop_that_does_not_come_to_rest_times_out() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.autopilot.wind = NedVelocity::new(3.0, 0.0, 0.0);
    rig.run(0.1);
    let started = rig.now;
    let stop = rig.start(Goal::Stop);
    assert_eq!(rig.outcome(stop), TimedOut);
    assert_eq!(rig.reason(stop), "not at rest: still 3.0 m/s");
    assert_eq!((rig.now - started).as_secs_f64().round(), 10.0);
    rig.autopilot.wind = NedVelocity::default();
    let stop = rig.start(Goal::Stop);
    assert_eq!(rig.outcome(stop), Succeeded);
}

#[test]
fn a_position_skill_that_holds_its_target_goes_on_until_it_is_replaced() {
    let mut rig = Rig::new(Autopilot::flying());
    let held = rig.start(fly_to(20.0, true));
    rig.run(300.0);
    assert!(rig.ending(held).is_none());
    assert!(rig.autopilot.is_fed(rig.now));
    let next = rig.start(fly_to(40.0, false));
    assert_eq!(rig.outcome(next), Succeeded);
    assert_eq!(rig.outcome(held), Aborted);
}

#[test]
fn velocity_ends_with_its_timeout_and_then_loiters() {
    let mut rig = Rig::new(Autopilot::flying());
    let velocity = rig.start(drift(Some(5.0)));
    assert_eq!(rig.outcome(velocity), Succeeded);
    rig.run(2.0).check(
        "offboard 1 process_request
         command offboard
         offboard 1 execute
         offboard 1 succeeded
         command loiter",
    );
    assert!((10.0..11.0).contains(&rig.autopilot.position.north_m), "{:?}", rig.autopilot.position);
}

#[test]
fn velocity_without_timeout_goes_on() {
    let mut rig = Rig::new(Autopilot::flying());
    let velocity = rig.start(drift(None));
    rig.run(500.0);
    assert!(rig.ending(velocity).is_none());
}

#[test]
fn feedback_comes_ten_times_per_second_and_never_from_old_data() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.start(fly_to(1000.0, false));
    rig.run(10.0);
    assert!((99..=101).contains(&rig.feedback.len()), "{}", rig.feedback.len());
    assert!((900.0..=901.0).contains(&rig.feedback.last().unwrap().distance_left_m));
    rig.autopilot.frozen.push(Source::Position);
    rig.run(1.0).forget().run(5.0);
    assert_eq!(rig.feedback, []);
}

#[test]
fn it_flies_at_twenty_times_real_time() {
    let mut rig = Rig::at_speed(20, Autopilot::default());
    rig.run(20.0);
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Succeeded);
    let position = rig.start(fly_to(300.0, false));
    assert_eq!(rig.outcome(position), Succeeded);
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
    rig.run(60.0).check(
        "takeoff 1 process_request
         command arm
         command takeoff 10.0
         takeoff 1 execute
         takeoff 1 succeeded
         offboard 2 process_request
         command offboard
         offboard 2 execute
         offboard 2 succeeded
         land 3 process_request
         command land
         land 3 execute
         land 3 succeeded",
    );
}
