//! The release of a load, which nothing undoes.

use domain::geometry::{Ned, NedVelocity};
use domain::skill::Goal;
use kittiwake_proto::v1::{Gripper, SkillOutcome::*};

use crate::stories::support::autopilot::Autopilot;
use crate::stories::support::autopilot::Reaction::*;
use crate::stories::support::rig::Rig;

/// North of where the vehicle hovers.
fn release(north_m: f64) -> Goal {
    Goal::Release { over: Ned::new(north_m, 0.0, -10.0) }
}

/// Long enough that no release of an earlier skill manager is waited for.
fn hovering(gripper: Gripper) -> Rig {
    let mut rig = started_in_flight(gripper);
    rig.run(5.0);
    rig
}

/// The skill manager has heard the vehicle for a second.
fn started_in_flight(gripper: Gripper) -> Rig {
    let mut autopilot = Autopilot::flying();
    autopilot.gripper = gripper;
    Rig::new(autopilot)
}

#[test]
fn it_ends_when_the_load_is_seen_released() {
    let mut rig = hovering(Gripper::Holding);
    let (skill, started) = (rig.start(release(0.0)), rig.now);
    assert_eq!(rig.outcome(skill), Succeeded);
    let took_s = (rig.now - started).as_secs_f64();
    assert!((0.9..1.6).contains(&took_s), "an acknowledgement says nothing yet: {took_s} s");
    rig.run(3.0).check("release 1 process_request\ncommand release\nrelease 1 execute\nrelease 1 succeeded");
    assert_eq!(rig.setpoints, []);
}

#[test]
fn a_load_that_is_gone_is_not_released_again() {
    let mut rig = hovering(Gripper::Released);
    let skill = rig.start(release(0.0));
    assert_eq!(rig.ending(skill).map(|it| it.outcome()), Some(Succeeded), "at once");
    rig.run(3.0);
    assert_eq!(rig.autopilot.commands, []);
}

#[test]
fn nothing_is_commanded_where_a_release_would_be_wrong_or_could_not_be_seen() {
    #[track_caller]
    fn check(rig: &mut Rig, goal: Goal, reason: &str) {
        rig.forget();
        let skill = rig.start(goal);
        assert_eq!(rig.outcome(skill), Failed);
        assert_eq!(rig.reason(skill), reason);
        assert_eq!(rig.autopilot.commands, []);
    }
    check(&mut hovering(Gripper::Unspecified), release(0.0), "the autopilot reports no gripper");
    check(&mut hovering(Gripper::Holding), release(6.0), "the vehicle is 6.0 m from the place");
    let mut blown_away = hovering(Gripper::Holding);
    blown_away.autopilot.wind = NedVelocity::new(0.0, 1.0, 0.0);
    blown_away.run(0.5);
    check(&mut blown_away, release(0.0), "the vehicle still moves at 1.0 m/s");
    let mut flies = hovering(Gripper::Holding);
    let velocity = NedVelocity::new(0.0, 1.0, 0.0);
    flies.start(Goal::Velocity { velocity, yaw_rate_rad_s: None, timeout_s: None });
    flies.run(2.0);
    check(&mut flies, release(0.0), "the vehicle does not hover: its mode is offboard");
}

#[test]
fn a_gripper_that_does_not_open_times_out() {
    let mut rig = hovering(Gripper::Holding);
    rig.autopilot.gripper_stuck = true;
    let skill = rig.start(release(0.0));
    let started = rig.now;
    assert_eq!(rig.outcome(skill), TimedOut);
    assert_eq!(rig.reason(skill), "release accepted, but the gripper holds its load");
    assert_eq!((rig.now - started).as_secs_f64().round(), 5.0);
    // Freed, it opens; asked again, the skill sees that.
    rig.autopilot.gripper_stuck = false;
    rig.run(1.0);
    let skill = rig.start(release(0.0));
    assert_eq!(rig.outcome(skill), Succeeded);
}

#[test]
fn a_release_that_the_autopilot_rejects_is_rejected() {
    let mut rig = hovering(Gripper::Holding);
    let skill = rig.expect([Reject]).start(release(0.0));
    assert_eq!(rig.outcome(skill), Rejected);
    assert_eq!(rig.reason(skill), "start: release rejected: not now");
    rig.run(3.0);
    assert_eq!((rig.autopilot.commands.len(), rig.autopilot.gripper), (1, Gripper::Holding));
    // It opens nothing, so the next one need not wait for it.
    let skill = rig.start(release(0.0));
    assert_eq!(rig.outcome(skill), Succeeded);
}

#[test]
fn a_release_whose_acknowledgement_is_lost_succeeds() {
    let mut rig = hovering(Gripper::Holding);
    let skill = rig.expect([ObeySilently]).start(release(0.0));
    assert_eq!(rig.outcome(skill), Succeeded);
    assert_eq!(rig.autopilot.gripper, Gripper::Released);
}

#[test]
fn cancelled_it_still_ends_with_what_happened() {
    let mut rig = hovering(Gripper::Holding);
    let skill = rig.start(release(0.0));
    rig.run(0.2);
    rig.cancel(skill).unwrap();
    assert_eq!(rig.outcome(skill), Succeeded);
    rig.run(3.0).check(
        "release 1 process_request
         command release
         release 1 execute
         release 1 cancel
         command loiter
         release 1 succeeded",
    );

    let mut rig = hovering(Gripper::Holding);
    rig.autopilot.gripper_stuck = true;
    let skill = rig.start(release(0.0));
    rig.run(0.2);
    rig.cancel(skill).unwrap();
    assert_eq!(rig.outcome(skill), TimedOut);
    assert_eq!(rig.reason(skill), "release accepted, but the gripper holds its load");
}

/// Where there are several loads, another command could drop the next one.
#[test]
fn a_release_that_was_interrupted_is_not_commanded_again_while_the_gripper_may_yet_open() {
    let interrupted = || {
        let mut rig = hovering(Gripper::Holding);
        rig.autopilot.gripper_stuck = true;
        rig.start(release(0.0));
        rig.run(0.2);
        let again = rig.start(release(0.0));
        rig.run(4.0);
        assert_eq!(rig.autopilot.commands.len(), 1, "4.2 s after the command, of 5 s");
        (rig, again)
    };
    let (mut rig, again) = interrupted();
    rig.autopilot.gripper_stuck = false;
    assert_eq!(rig.outcome(again), Succeeded);
    assert_eq!(rig.autopilot.commands.len(), 1, "it has opened late");

    let (mut rig, again) = interrupted();
    assert_eq!(rig.outcome(again), TimedOut);
    assert_eq!(rig.autopilot.commands.len(), 2, "it has not opened, and gets the command once more");
}

/// The one before it may have sent a release, and been killed while the gripper opened.
#[test]
fn a_skill_manager_that_is_started_in_flight_waits_once_for_a_release_that_it_does_not_know_of() {
    /// How many releases are commanded within `until_s` of the first status (the wait takes 5 s), and until the skill
    /// has succeeded.
    #[track_caller]
    fn check(rig: &mut Rig, until_s: f64, before: usize, after: usize) {
        rig.forget();
        let skill = rig.start(release(0.0));
        rig.run(until_s - rig.now.since_start().as_secs_f64());
        assert_eq!(rig.autopilot.commands.len(), before, "at {until_s} s");
        assert_eq!(rig.outcome(skill), Succeeded);
        assert_eq!(rig.autopilot.commands.len(), after);
    }
    check(&mut started_in_flight(Gripper::Holding), 4.9, 0, 1);
    check(&mut started_in_flight(Gripper::Released), 4.9, 0, 0);
    // It waits once.
    check(&mut hovering(Gripper::Holding), 6.1, 1, 1);

    let mut opens = started_in_flight(Gripper::Holding);
    let skill = opens.start(release(0.0));
    opens.run(2.0).autopilot.gripper = Gripper::Released;
    opens.run(0.1);
    assert_eq!(opens.ending(skill).map(|it| it.outcome()), Some(Succeeded), "seen released, it waits no longer");
    assert_eq!(opens.autopilot.commands, []);

    // On the ground nobody has released anything: this flight is its own.
    let mut own = Rig::new(Autopilot::default());
    let takeoff = own.start(Goal::Takeoff { climb_m: 3.0 });
    assert_eq!(own.outcome(takeoff), Succeeded);
    check(&mut own, 4.5, 1, 1);
}

#[test]
fn replaced_it_gives_way_and_the_load_falls_nevertheless() {
    let mut rig = hovering(Gripper::Holding);
    let skill = rig.start(release(0.0));
    rig.run(0.2);
    let land = rig.start(Goal::Land);
    assert_eq!(rig.outcome(skill), Aborted);
    assert_eq!(rig.outcome(land), Succeeded);
    assert_eq!(rig.autopilot.gripper, Gripper::Released);
}
