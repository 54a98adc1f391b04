//! A pilot or another ground station flies; the autopilot gives its reasons, or is started again.

use domain::geometry::{Ned, NedVelocity};
use domain::skill::Goal;
use kittiwake_proto::v1::{self, FlightMode, SkillOutcome::*, WhenBusy};

use crate::stories::support::autopilot::Autopilot;
use crate::stories::support::autopilot::Reaction::*;
use crate::stories::support::rig::{Rig, fly_to};

/// Somebody else sets a mode, as the backend notices.
fn take_over(rig: &mut Rig, mode: FlightMode) {
    (rig.autopilot.intended, rig.autopilot.other) = (mode, true);
}

/// Nothing is commanded nor streamed for a long time.
#[track_caller]
fn is_quiet(rig: &mut Rig) {
    rig.run(0.1).forget().run(60.0).check("");
    assert_eq!((rig.autopilot.commands.len(), rig.setpoints.len()), (0, 0));
}

#[test]
fn whatever_is_flown_ends_at_once_when_somebody_else_flies_and_nothing_follows() {
    #[track_caller]
    fn check(goal: Goal, autopilot: Autopilot, after_s: f64, mode: FlightMode) {
        let mut rig = Rig::new(autopilot);
        let skill = rig.start(goal.clone());
        rig.run(after_s);
        take_over(&mut rig, mode);
        assert_eq!(rig.outcome(skill), Preempted, "{goal:?}");
        assert!(rig.reason(skill).starts_with("somebody else flies: "), "{}", rig.reason(skill));
        assert!(rig.ending(skill).is_some_and(|it| it.flown_by_other));
        is_quiet(&mut rig);
    }
    let far = Goal::Velocity { velocity: NedVelocity::new(1.0, 0.0, 0.0), yaw_rate_rad_s: None, timeout_s: None };
    // Also in a mode that is the skill's own, by somebody else's command.
    for mode in [FlightMode::Unspecified, FlightMode::Return, FlightMode::Loiter, FlightMode::Offboard] {
        check(fly_to(500.0), Autopilot::flying(), 3.0, mode);
        check(far.clone(), Autopilot::flying(), 3.0, mode);
        check(Goal::Takeoff { climb_m: 30.0 }, Autopilot::default(), 4.0, mode);
        check(Goal::Land, Autopilot::flying(), 2.0, mode);
    }
}

#[test]
fn a_mode_without_a_name_is_not_ours_whatever_the_backend_says() {
    let mut rig = Rig::new(Autopilot::flying());
    let skill = rig.start(fly_to(500.0));
    rig.run(3.0).autopilot.intended = FlightMode::Unspecified;
    assert_eq!(rig.outcome(skill), Preempted);
    assert!(rig.refused.is_empty(), "{:?}", rig.refused);
    is_quiet(&mut rig);
}

#[test]
fn a_vehicle_that_loiters_by_itself_is_left_to_somebody_else_too() {
    let mut rig = Rig::new(Autopilot::flying());
    let skill = rig.start(fly_to(10.0));
    assert_eq!(rig.outcome(skill), Succeeded);
    take_over(&mut rig, FlightMode::Unspecified);
    // Before the loiter that follows a skill is due.
    rig.run(0.05);
    is_quiet(&mut rig);
}

#[test]
fn requests_are_refused_until_an_operator_takes_control_back() {
    let mut rig = Rig::new(Autopilot::flying());
    let skill = rig.start(fly_to(500.0));
    rig.run(3.0);
    take_over(&mut rig, FlightMode::Unspecified);
    rig.outcome(skill);
    for goal in [fly_to(10.0), Goal::Stop, Goal::Land] {
        let reply = rig.ask(goal, WhenBusy::Replace, 0);
        assert!(reply.refusal.contains("until an operator orders"), "{reply:?}");
    }
    assert_eq!(rig.other, "somebody else has chosen the mode: one without a name here");
    // A backend that was started again does not know any more: nothing changes.
    (rig.autopilot.other, rig.autopilot.intended) = (false, FlightMode::Loiter);
    rig.run(5.0);
    assert!(!rig.other.is_empty() && rig.ask(Goal::Stop, WhenBusy::Replace, 0).skill_id == 0);
    take_over(&mut rig, FlightMode::Unspecified);
    rig.run(1.0);
    let stop = rig.take_back(Goal::Stop);
    assert_eq!(rig.other, "");
    assert_eq!(rig.outcome(stop), Succeeded);
    let onwards = rig.start(fly_to(20.0));
    assert_eq!(rig.outcome(onwards), Succeeded);
}

#[test]
fn who_takes_the_vehicle_again_has_it_again() {
    let mut rig = Rig::new(Autopilot::flying());
    take_over(&mut rig, FlightMode::Unspecified);
    rig.run(1.0);
    let skill = rig.take_back(fly_to(500.0));
    rig.run(3.0);
    take_over(&mut rig, FlightMode::Unspecified);
    assert_eq!(rig.outcome(skill), Preempted);
    is_quiet(&mut rig);
}

/// Two commands on their way at once could be obeyed in either order.
#[test]
fn an_order_waits_for_the_answer_to_a_command_that_was_abandoned_meanwhile() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.run(1.0).expect([Lose]);
    rig.start(fly_to(500.0));
    rig.run(0.1);
    take_over(&mut rig, FlightMode::Unspecified);
    rig.run(0.1).forget();
    let stop = rig.take_back(Goal::Stop);
    rig.run(0.5);
    assert_eq!(rig.autopilot.commands.len(), 0, "the first is not answered");
    assert_eq!(rig.outcome(stop), Succeeded);
}

#[test]
fn a_loiter_that_somebody_else_has_chosen_is_commanded_when_it_is_taken_back() {
    let mut rig = Rig::new(Autopilot::flying());
    take_over(&mut rig, FlightMode::Loiter);
    rig.run(1.0);
    let stop = rig.take_back(Goal::Stop);
    assert_eq!(rig.outcome(stop), Succeeded);
    assert_eq!((rig.autopilot.commands.len(), rig.autopilot.other), (1, false), "it is ours now");
}

#[test]
fn a_command_on_its_way_is_not_repeated_after_somebody_else_has_taken_over() {
    let mut rig = Rig::new(Autopilot::flying());
    let skill = rig.expect([Lose]).start(fly_to(100.0));
    rig.run(0.3);
    take_over(&mut rig, FlightMode::Unspecified);
    assert_eq!(rig.outcome(skill), Preempted);
    is_quiet(&mut rig);
}

#[test]
fn once_the_motors_are_off_on_the_ground_nobody_flies() {
    let mut rig = Rig::new(Autopilot::default().armed());
    take_over(&mut rig, FlightMode::Unspecified);
    rig.run(1.0);
    assert_eq!(rig.ask(Goal::Takeoff { climb_m: 10.0 }, WhenBusy::Replace, 0).skill_id, 0);
    rig.autopilot.armed = false;
    rig.run(1.0);
    assert_eq!(rig.other, "");
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Succeeded);
}

#[test]
fn a_pre_empted_skill_ends_with_the_autopilots_own_words() {
    let mut rig = Rig::new(Autopilot::flying());
    let skill = rig.start(fly_to(500.0));
    rig.run(3.0).autopilot.reason = "geofence breached";
    rig.autopilot.failsafe = Some(FlightMode::Return);
    assert_eq!(rig.outcome(skill), Preempted);
    assert_eq!(rig.reason(skill), "the autopilot flies return instead of offboard: geofence breached");
    assert!(rig.ending(skill).is_some_and(|it| !it.flown_by_other));
}

/// It may have begun while nobody heard it: this process or its caller was just started again.
#[test]
fn a_failsafe_of_the_autopilots_own_is_ended_by_a_landing_and_by_an_operators_order_alone() {
    let in_failsafe = || {
        let mut rig = Rig::new(Autopilot::flying());
        rig.autopilot.failsafe = Some(FlightMode::Return);
        rig.autopilot.reason = "geofence breached";
        rig.run(1.0);
        rig
    };
    let velocity = NedVelocity::new(1.0, 0.0, 0.0);
    for goal in [fly_to(50.0), Goal::Stop, Goal::Velocity { velocity, yaw_rate_rad_s: None, timeout_s: Some(1.0) }] {
        let mut rig = in_failsafe();
        let skill = rig.start(goal.clone());
        assert_eq!(rig.outcome(skill), Preempted, "{goal:?}");
        assert!(rig.ending(skill).is_some_and(|it| !it.flown_by_other));
        let reason = "the autopilot flies return by a failsafe of its own: geofence breached";
        assert_eq!(rig.reason(skill), reason);
        is_quiet(&mut rig);
        let ordered = rig.take_back(goal.clone());
        rig.run(3.0);
        assert_eq!(rig.autopilot.failsafe, None, "{goal:?}");
        rig.outcome(ordered);
    }
    // Asked for before anything was heard.
    let mut rig = Rig::silent(Autopilot::flying());
    rig.autopilot.failsafe = Some(FlightMode::Return);
    let hold = rig.start(Goal::Velocity { velocity, yaw_rate_rad_s: None, timeout_s: None });
    assert_eq!(rig.outcome(hold), Preempted);
    is_quiet(&mut rig);
    let mut rig = in_failsafe();
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(land), Succeeded);
}

/// Loiter, by which a skill is cancelled, and a command that is sent once more would end it.
#[test]
fn what_is_cancelled_or_was_not_heard_when_a_failsafe_began_commands_nothing() {
    let begins = |rig: &mut Rig, mode| {
        rig.autopilot.failsafe = Some(mode);
        rig.autopilot.reason = "geofence breached";
        rig.run(0.1);
    };
    for mode in [FlightMode::Loiter, FlightMode::Return, FlightMode::Land] {
        // A stop flies the mode that the failsafe may fly, too: nothing else shows that it is over.
        let mut rig = Rig::new(Autopilot::flying());
        rig.start(fly_to(500.0));
        rig.run(3.0);
        let stop = rig.start(Goal::Stop);
        rig.run(0.2);
        begins(&mut rig, mode);
        // It may have ended by then.
        let _ = rig.cancel(stop);
        rig.outcome(stop);
        is_quiet(&mut rig);
        assert_eq!(rig.autopilot.failsafe, Some(mode));

        let mut rig = Rig::new(Autopilot::flying());
        rig.run(1.0).expect([Lose]);
        let lost = rig.start(fly_to(500.0));
        rig.run(0.1);
        begins(&mut rig, mode);
        rig.forget();
        rig.outcome(lost);
        // Nor is it a reason to loiter that the autopilot may have heard it.
        rig.run(0.5);
        assert_eq!(rig.autopilot.commands.len(), 0, "{mode:?}");
        is_quiet(&mut rig);
        assert_eq!(rig.autopilot.failsafe, Some(mode));
    }
}

#[test]
fn a_vehicle_that_was_armed_is_not_lifted_off_once_a_failsafe_has_begun() {
    let mut rig = Rig::new(Autopilot::default());
    rig.run(1.0).expect([ObeySilently]);
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    rig.run(0.3);
    assert!(rig.autopilot.armed);
    rig.autopilot.failsafe = Some(FlightMode::Loiter);
    assert_eq!(rig.outcome(takeoff), Preempted);
    rig.run(1.0);
    assert!(rig.autopilot.landed && !rig.autopilot.armed, "{:?}", rig.autopilot.commands);
}

/// A failsafe flies, which has pre-empted a takeoff on the ground; nothing was commanded since.
#[track_caller]
fn pre_empted_on_the_ground() -> Rig {
    let mut rig = Rig::new(Autopilot::default());
    rig.run(1.0);
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    rig.run(0.3);
    // It spools up still.
    rig.autopilot.position.down_m = 0.0;
    rig.autopilot.failsafe = Some(FlightMode::Loiter);
    rig.run(0.5);
    let _ = rig.cancel(takeoff);
    assert_eq!(rig.outcome(takeoff), Preempted);
    rig.autopilot.commands.clear();
    rig.run(1.0);
    assert!(rig.autopilot.armed && rig.autopilot.commands.is_empty(), "{:?}", rig.autopilot.commands);
    rig
}

/// The autopilot would go on with it as soon as the failsafe is over.
#[test]
fn a_takeoff_that_a_failsafe_has_pre_empted_on_the_ground_is_disarmed_once_that_is_over() {
    let mut rig = pre_empted_on_the_ground();
    rig.autopilot.failsafe = None;
    rig.run(0.5);
    // This one is up at once, and refuses it; a real one spools up first.
    assert_eq!(rig.autopilot.commands, [v1::vehicle_command::Command::Disarm(v1::Disarm {})]);
}

/// A land detector that reports the air for a moment has seen no liftoff.
#[test]
fn a_pre_empted_takeoff_is_disarmed_after_a_bounce_of_the_land_detector_and_not_after_a_flight() {
    /// The vehicle is so high for a moment, by the land detector in the air.
    #[track_caller]
    fn check(height_m: f64, disarmings: usize) {
        let mut rig = pre_empted_on_the_ground();
        rig.autopilot.position.down_m = -height_m;
        rig.run(0.3);
        assert!(!rig.autopilot.landed);
        rig.autopilot.position.down_m = 0.0;
        rig.run(0.5);
        assert_eq!(rig.autopilot.commands, [], "{height_m} m: the failsafe lasts");
        rig.autopilot.failsafe = None;
        rig.run(0.5);
        let disarm = v1::vehicle_command::Command::Disarm(v1::Disarm {});
        assert_eq!(rig.autopilot.commands, vec![disarm; disarmings], "{height_m} m");
    }
    check(0.05, 1);
    check(0.8, 1);
    check(2.0, 0);
}

/// What it has begun may go on: to disarm is for the ground.
#[test]
fn a_pre_empted_takeoff_is_not_disarmed_while_the_land_detector_reports_the_air() {
    let mut rig = pre_empted_on_the_ground();
    rig.autopilot.position.down_m = -0.05;
    rig.run(0.3).autopilot.failsafe = None;
    rig.run(2.0);
    assert_eq!(rig.autopilot.commands, []);
}

#[test]
fn an_autopilot_that_only_misses_setpoints_obeys_the_next_skill() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.autopilot.intended = FlightMode::Offboard;
    rig.run(1.0);
    assert_eq!(rig.autopilot.failsafe, Some(FlightMode::Loiter));
    let skill = rig.start(fly_to(50.0));
    assert_eq!(rig.outcome(skill), Succeeded);
}

#[test]
fn nothing_takes_off_while_the_autopilot_would_not_arm() {
    let mut rig = Rig::new(Autopilot::default());
    rig.autopilot.can_arm = Some(false);
    rig.run(1.0);
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    assert_eq!(rig.outcome(takeoff), Failed);
    assert_eq!(rig.reason(takeoff), "the autopilot would not arm");
    assert!(rig.autopilot.commands.is_empty());
}

#[test]
fn what_flies_to_a_place_ends_when_the_frame_moves_and_what_does_not_goes_on() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(500.0));
    rig.run(3.0).autopilot.frame_epoch += 1;
    rig.autopilot.position = Ned::new(900.0, 50.0, -10.0);
    assert_eq!(rig.outcome(position), Failed);
    assert!(rig.reason(position).contains("local frame moved"), "{}", rig.reason(position));
    rig.run(0.1).forget().run(5.0);
    assert_eq!((rig.setpoints.len(), rig.autopilot.intended), (0, FlightMode::Loiter));
    let land = rig.start(Goal::Land);
    rig.run(1.0).autopilot.frame_epoch += 1;
    assert_eq!(rig.outcome(land), Succeeded);
}
