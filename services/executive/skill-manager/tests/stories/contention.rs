//! Several skills and one vehicle: overwriting, refusing, giving up, waiting, cancelling.

use domain::skill::Goal;
use kittiwake_proto::v1::{self, FlightMode, SkillOutcome::*, SkillState, WhenBusy::Refuse, WhenBusy::Replace};

use crate::stories::support::autopilot::Autopilot;
use crate::stories::support::autopilot::Reaction::{self, *};
use crate::stories::support::rig::{Rig, fly_to};

/// Skill 1 flies to a distant position.
fn under_way() -> Rig {
    let mut rig = Rig::new(Autopilot::flying());
    rig.start(fly_to(1000.0));
    rig.run(5.0).forget();
    rig
}

#[test]
fn a_skill_may_overwrite_one_of_its_own_kind() {
    let mut rig = under_way();
    let second = rig.start(fly_to(50.0));
    assert_eq!(rig.outcome(second), Succeeded);
    rig.check(
        "offboard 2 process_request
         command offboard
         offboard 1 abort: overwritten by skill 2
         offboard 1 aborted: overwritten by skill 2
         offboard 2 execute
         offboard 2 succeeded",
    );
    assert_eq!(rig.autopilot.failsafe, None);
}

#[test]
fn a_rejected_skill_leaves_the_running_one_untouched() {
    let mut rig = under_way();
    let second = rig.expect([Reject]).start(Goal::Land);
    assert_eq!(rig.outcome(second), Rejected);
    rig.run(5.0).check("land 2 process_request\ncommand land\nland 2 rejected: start: land rejected: not now");
    assert_eq!(rig.autopilot.actual(), FlightMode::Offboard);
    assert!((49.0..52.0).contains(&rig.autopilot.position.north_m), "flies on: {:?}", rig.autopilot.position);
}

#[test]
fn a_rejected_skill_cancels_the_skill_that_was_given_up() {
    let mut rig = under_way();
    rig.expect([Reject]).ask(Goal::Land, Replace, 1);
    assert_eq!(rig.outcome(1), Cancelled);
    rig.run(2.0).check(
        "land 2 process_request
         command land
         land 2 rejected: start: land rejected: not now
         offboard 1 cancel
         command loiter
         offboard 1 cancelled: cancelled by the caller",
    );
}

#[test]
fn a_refused_request_cancels_the_skill_that_was_given_up() {
    let mut rig = under_way();
    let reply = rig.ask(Goal::Stop, Refuse, 1);
    assert_eq!((reply.skill_id, reply.refusal.as_str()), (0, "busy with offboard (skill 1)"));
    assert_eq!(rig.outcome(1), Cancelled);
}

#[test]
fn a_request_that_does_not_replace_is_refused_while_busy_and_accepted_when_free() {
    let mut rig = under_way();
    assert_eq!(rig.ask(Goal::Stop, Refuse, 0).refusal, "busy with offboard (skill 1)");
    rig.cancel(1).unwrap();
    rig.run(1.0);
    assert_ne!(rig.ask(Goal::Stop, Refuse, 0).skill_id, 0);
}

#[test]
fn a_repeated_request_gets_the_first_answer_and_climbs_once() {
    let mut rig = Rig::new(Autopilot::default());
    let request = v1::SkillRequest {
        request_id: "once".into(),
        goal: Some(Goal::Takeoff { climb_m: 10.0 }.into()),
        when_busy: Replace as i32,
        gave_up_skill_id: 0,
        ..Default::default()
    };
    let first = rig.request(request.clone());
    assert_eq!(rig.request(request.clone()), first);
    assert_eq!(rig.outcome(first.skill_id), Succeeded);
    assert_eq!(rig.request(request), first);
    rig.run(20.0);
    assert_eq!(rig.autopilot.position.height_m().round(), 10.0);
    assert_eq!(rig.table().len(), 1);
}

#[test]
fn an_invalid_request_is_refused_with_the_reason() {
    #[track_caller]
    fn check(change: impl Fn(&mut v1::SkillRequest), refusal: &str) {
        let mut rig = Rig::new(Autopilot::flying());
        let mut request = v1::SkillRequest {
            request_id: "r".into(),
            goal: Some(fly_to(10.0).into()),
            when_busy: Replace as i32,
            gave_up_skill_id: 0,
            ..Default::default()
        };
        change(&mut request);
        let reply = rig.request(request);
        assert_eq!((reply.skill_id, reply.refusal.as_str()), (0, refusal));
        assert_eq!(rig.refused, [format!("skill/request: {refusal}")]);
        rig.run(2.0).check("");
        assert_eq!(rig.setpoints, []);
    }
    check(|it| it.goal = None, "`goal` is missing");
    check(|it| it.request_id.clear(), "`request_id` is missing");
    check(|it| it.when_busy = 0, "`when_busy` is missing");
    let nan = Goal::Takeoff { climb_m: f64::NAN };
    check(move |it| it.goal = Some(nan.clone().into()), "`climb_m` is NaN, expected more than zero");
}

#[test]
fn a_second_request_waits_for_the_acknowledgement_of_the_first() {
    let mut rig = Rig::new(Autopilot::flying());
    let first = rig.start(fly_to(100.0));
    let second = rig.start(Goal::Land);
    assert_eq!(rig.outcome(second), Succeeded);
    assert_eq!(rig.outcome(first), Aborted);
    rig.check(
        "offboard 1 process_request
         command offboard
         land 2 process_request
         offboard 1 execute
         command land
         offboard 1 abort: overwritten by skill 2
         offboard 1 aborted: overwritten by skill 2
         land 2 execute
         land 2 succeeded",
    );
}

#[test]
fn the_request_that_waits_replaces_a_given_up_skill_without_a_loiter_in_between() {
    let mut rig = under_way();
    rig.expect([Reject]).ask(fly_to(50.0), Replace, 1);
    rig.start(Goal::Land);
    assert_eq!(rig.outcome(1), Aborted);
    rig.check(
        "offboard 2 process_request
         command offboard
         land 3 process_request
         offboard 2 rejected: start: offboard rejected: not now
         command land
         offboard 1 abort: overwritten by skill 3
         offboard 1 aborted: overwritten by skill 3
         land 3 execute",
    );
}

#[test]
fn a_third_request_replaces_the_one_that_waits() {
    let mut rig = Rig::new(Autopilot::flying());
    let first = rig.start(fly_to(100.0));
    let second = rig.start(Goal::Land);
    let third = rig.start(Goal::Stop);
    assert_eq!(rig.outcome(third), Succeeded);
    assert_eq!((rig.outcome(first), rig.outcome(second)), (Aborted, Aborted));
    assert!(!rig.autopilot.landed);
    assert_eq!(rig.reason(second), "overwritten by skill 3");
}

#[test]
fn a_cancelled_skill_ends_when_the_autopilot_loiters() {
    let mut rig = under_way();
    rig.cancel(1).unwrap();
    rig.cancel(1).unwrap();
    assert_eq!(rig.outcome(1), Cancelled);
    rig.run(2.0).check("offboard 1 cancel\ncommand loiter\noffboard 1 cancelled: cancelled by the caller");
    assert!(!rig.autopilot.is_fed(rig.now), "the stream has ended");
    assert_eq!(rig.cancel(1), Err("skill 1 has ended: cancelled".into()));
    assert_eq!(rig.cancel(7), Err("there is no skill 7".into()));
}

#[test]
fn a_cancellation_that_is_rejected_or_not_acknowledged_leaves_the_skill_flying() {
    #[track_caller]
    fn check(reactions: &[Reaction], commands: &str, reason: &str) {
        let mut rig = under_way();
        rig.expect(reactions.iter().copied()).cancel(1).unwrap();
        rig.run(5.0).check(&format!("offboard 1 cancel\n{commands}\noffboard 1 execute: {reason}"));
        assert_eq!(rig.autopilot.actual(), FlightMode::Offboard);
        rig.cancel(1).unwrap();
        assert_eq!(rig.outcome(1), Cancelled, "the second time it works");
    }
    check(&[Reject], "command loiter", "cancel: loiter rejected: not now");
    check(&[Lose, Lose], "command loiter\ncommand loiter", "cancel: loiter not acknowledged");
}

#[test]
fn completion_while_being_cancelled_is_success() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(10.0));
    rig.run(1.9);
    rig.expect([Lose]).cancel(position).unwrap();
    assert_eq!(rig.outcome(position), Succeeded);
}

#[test]
fn cancelled_while_its_request_is_processed_a_skill_awaits_the_acknowledgement_first() {
    let mut rig = Rig::new(Autopilot::flying());
    let position = rig.start(fly_to(100.0));
    rig.cancel(position).unwrap();
    assert_eq!(rig.outcome(position), Cancelled);
    rig.run(2.0).check(
        "offboard 1 process_request
         command offboard
         offboard 1 cancel
         command loiter
         offboard 1 cancelled: cancelled by the caller",
    );
}

#[test]
fn cancelled_between_arming_and_takeoff_the_vehicle_is_disarmed() {
    let mut rig = Rig::new(Autopilot::default());
    let takeoff = rig.start(Goal::Takeoff { climb_m: 10.0 });
    rig.cancel(takeoff).unwrap();
    assert_eq!(rig.outcome(takeoff), Cancelled);
    rig.run(2.0).check(
        "takeoff 1 process_request
         command arm
         takeoff 1 cancel
         command disarm
         takeoff 1 cancelled: cancelled by the caller",
    );
}

/// A takeoff that waits for the acknowledgement of its first command, and is to be replaced by `goal` then.
#[track_caller]
fn replaced_while_it_arms(reaction: Reaction, goal: Goal, story: &str) -> Rig {
    let mut rig = Rig::new(Autopilot::default());
    let takeoff = rig.expect([reaction]).start(Goal::Takeoff { climb_m: 10.0 });
    let next = rig.ask(goal, Replace, takeoff).skill_id;
    assert_eq!(rig.outcome(next), Succeeded);
    rig.check(story);
    rig
}

#[test]
fn replaced_between_arming_and_takeoff_the_vehicle_is_disarmed_and_stays_on_the_ground() {
    for goal in [Goal::Land, Goal::Stop] {
        let name = if goal == Goal::Land { "land" } else { "stop" };
        let story = format!(
            "takeoff 1 process_request
             command arm
             {name} 2 process_request
             takeoff 1 abort: overwritten by skill 2
             takeoff 1 aborted: overwritten by skill 2
             command disarm
             {name} 2 execute
             {name} 2 succeeded"
        );
        let rig = replaced_while_it_arms(Obey, goal, &story);
        assert!(!rig.autopilot.armed && rig.autopilot.landed);
    }
}

#[test]
fn armed_without_an_acknowledgement_and_replaced_the_vehicle_is_disarmed() {
    let story = "takeoff 1 process_request
                 command arm
                 land 2 process_request
                 takeoff 1 abort: overwritten by skill 2
                 takeoff 1 aborted: overwritten by skill 2
                 command disarm
                 land 2 execute
                 land 2 succeeded";
    let rig = replaced_while_it_arms(ObeySilently, Goal::Land, story);
    assert!(!rig.autopilot.armed && rig.autopilot.landed);
}

#[test]
fn a_takeoff_that_replaces_one_that_has_only_armed_begins_anew() {
    let story = "takeoff 1 process_request
                 command arm
                 takeoff 2 process_request
                 takeoff 1 abort: overwritten by skill 2
                 takeoff 1 aborted: overwritten by skill 2
                 command disarm
                 command arm
                 command takeoff 20.0
                 takeoff 2 execute
                 takeoff 2 succeeded";
    let rig = replaced_while_it_arms(Obey, Goal::Takeoff { climb_m: 20.0 }, story);
    assert_eq!(rig.autopilot.position.height_m().round(), 20.0);
}

#[test]
fn a_refused_takeoff_is_not_tried_again_once_another_request_waits() {
    let mut rig = Rig::new(Autopilot::default().armed());
    let takeoff = rig.expect([Reject]).start(Goal::Takeoff { climb_m: 10.0 });
    let land = rig.ask(Goal::Land, Replace, takeoff).skill_id;
    assert_eq!((rig.outcome(takeoff), rig.outcome(land)), (Rejected, Succeeded));
    let takeoffs = rig.autopilot.commands.iter().filter(|it| format!("{it:?}").contains("Takeoff"));
    assert_eq!(takeoffs.count(), 1);
    assert!(rig.autopilot.landed);
}

#[test]
fn a_request_that_waits_is_cancelled_at_once() {
    let mut rig = Rig::new(Autopilot::flying());
    rig.start(fly_to(100.0));
    let second = rig.start(Goal::Land);
    rig.cancel(second).unwrap();
    assert_eq!(rig.ending(second).map(|it| it.outcome()), Some(Cancelled));
    rig.run(5.0);
    assert_eq!(rig.autopilot.commands.len(), 1);
}

#[test]
fn a_successor_within_200_ms_is_flown_without_a_loiter_in_between() {
    let mut rig = Rig::new(Autopilot::flying());
    let first = rig.start(fly_to(20.0));
    rig.outcome(first);
    rig.run(0.19);
    let second = rig.start(fly_to(40.0));
    assert_eq!(rig.outcome(second), Succeeded);
    let modes: Vec<_> = rig.autopilot.commands.iter().map(|it| format!("{it:?}")).collect();
    assert_eq!(modes.len(), 2, "{modes:?}");
    assert_eq!(rig.autopilot.failsafe, None);
}

#[test]
fn a_successor_that_is_rejected_leaves_the_vehicle_to_loiter() {
    let mut rig = Rig::new(Autopilot::flying());
    let first = rig.start(fly_to(20.0));
    rig.outcome(first);
    rig.run(0.1).forget();
    let land = rig.expect([Reject]).start(Goal::Land);
    rig.outcome(land);
    rig.run(1.0).check(
        "land 2 process_request
         command land
         land 2 rejected: start: land rejected: not now
         command loiter",
    );
}

#[test]
fn loiter_is_tried_a_few_times() {
    let mut rig = Rig::new(Autopilot::flying());
    let first = rig.start(fly_to(20.0));
    rig.outcome(first);
    rig.expect([Lose, Reject, Obey]).forget().run(5.0).check("command loiter\ncommand loiter\ncommand loiter");
}

#[test]
fn the_table_holds_skills_that_run_and_that_have_ended() {
    let mut rig = under_way();
    rig.start(Goal::Stop);
    rig.run(1.0);
    rig.start(fly_to(500.0));
    rig.run(1.0);
    let table: Vec<_> = rig.table().iter().map(|it| (it.skill_id, it.state(), it.outcome())).collect();
    use SkillState::{Ended, Execute};
    assert_eq!(table, [(1, Ended, Aborted), (2, Ended, Succeeded), (3, Execute, Unspecified)]);
    rig.run(301.0);
    let ids: Vec<_> = rig.table().iter().map(|it| it.skill_id).collect();
    assert_eq!(ids, [3]);
}
