//! Events at a bad moment: late answers, lost messages, flags between two steps, permissions that end.

use domain::skill::Goal;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::{Failed, Rejected, Succeeded};
use kittiwake_proto::v1::operator_command::Verb;
use node::CallError;

use crate::stories::rig::{Rig, plan, step};
use crate::stories::{fly, under_way};

fn area_a() -> v1::Area {
    let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
    v1::Area {
        name: "A".into(),
        kind: v1::AreaKind::Permission as i32,
        corners: [(-90.0, 100.0), (90.0, 100.0), (90.0, 300.0), (-90.0, 300.0)].map(corner).to_vec(),
        ..Default::default()
    }
}

fn ledger(state: v1::PermissionState, valid_for_s: f64, decision: u64) -> v1::PermissionLedger {
    let entry = v1::Permission { area: "A".into(), state: state as i32, valid_for_s, decision, ..Default::default() };
    v1::PermissionLedger { permissions: vec![entry], ..Default::default() }
}

/// A transition through area A is flown, with the permission; the planner has not answered yet.
fn in_transition() -> Rig {
    let (mut rig, skill) = under_way_to(500.0);
    rig.together(|rig| {
        rig.mission(v1::MissionStatus { areas: vec![area_a()], ..Default::default() });
        rig.say(ledger(v1::PermissionState::Granted, 900.0, 1));
    });
    rig.end(&skill, Failed, "x");
    assert_eq!(rig.story(), "replan after 1 (failed: x) []\nstart fly 0 500 10");
    rig.execute();
    rig
}

/// On the ground, where a takeoff has begun.
fn taking_off() -> (Rig, String) {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &[])]));
    let skill = rig.execute();
    (rig, skill)
}

fn under_way_to(east_m: f64) -> (Rig, String) {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(east_m), &[])]));
    let skill = rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.story();
    (rig, skill)
}

#[test]
fn an_order_or_a_hold_that_interrupts_a_step_is_no_failure_of_it() {
    #[track_caller]
    fn check((mut rig, _): (Rig, String), interrupt: fn(&mut Rig), is_failure: bool) {
        interrupt(&mut rig);
        let stop = rig.execute();
        rig.end(&stop, Succeeded, "");
        rig.command(Verb::Resume(v1::ResumeMission {}));
        rig.wait(0.2);
        let told = rig.open().find_map(|it| if let Request::Replan(it) = it { Some(it.clone()) } else { None });
        let told = told.expect("a plan is asked for");
        assert_eq!((told.failed, told.interrupted), (true, !is_failure), "{}", told.failure);
    }
    check(under_way(), |rig| assert!(rig.command(Verb::Pause(v1::PauseMission { overrides: false })).done), false);
    check(under_way(), |rig| rig.flag("obstacle", true), false);
    check(taking_off(), |rig| assert!(rig.command(Verb::Pause(v1::PauseMission { overrides: false })).done), false);
    // Nothing else ends its repetition.
    check(taking_off(), |rig| rig.flag("obstacle", true), true);
}

#[test]
fn an_answer_to_an_older_request_for_a_plan_is_not_flown() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    rig.execute();
    rig.flag("obstacle", true);
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    rig.execute();
    rig.story();
    // Both requests are open; the first one is answered first.
    rig.plan(plan(&[step(7, fly(70.0), &[])]));
    assert_eq!(rig.story(), "", "an answer for a state that no longer is");
    rig.plan(plan(&[step(8, fly(80.0), &[])]));
    assert!(rig.story().starts_with("start fly 0 80 10"));
}

#[test]
fn a_plan_that_arrives_together_with_a_flag_is_asked_for_again_after_it() {
    let (mut rig, skill) = under_way();
    rig.end(&skill, Failed, "x");
    rig.execute();
    rig.story();
    rig.together(|rig| {
        rig.flag("obstacle", true);
        rig.plan(plan(&[step(7, fly(100.0), &[])]));
    });
    assert_eq!(rig.story(), "start stop, giving up 2");
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    let story = rig.story();
    assert!(story.starts_with("replan after"), "{story}");
}

#[test]
fn without_a_plan_it_rests() {
    let hold =
        || v1::replan_reply::Reply::Hold(v1::HoldUntil { wait_s: 500.0, reason: "later".into(), planned: false });
    let mut rig = in_transition();
    rig.plan(hold());
    assert_eq!(rig.story(), "start stop, giving up 2");
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    // A new question, half a kilometre before the old goal, moves it no more: the stop goes on.
    rig.vehicle(true, Loiter, (0.0, 60.0, 10.0));
    rig.say(ledger(v1::PermissionState::Revoked, 0.0, 2));
    assert_eq!(rig.story(), "replan after 0 () []");
}

#[test]
fn a_transition_is_chosen_again_when_its_permission_is_revoked() {
    let mut rig = in_transition();
    rig.story();
    rig.say(ledger(v1::PermissionState::Revoked, 0.0, 2));
    let story = rig.story();
    assert!(story.contains("start fly 0 80 10, giving up 2"), "{story}");
}

#[test]
fn a_transition_is_chosen_again_when_its_permission_is_about_to_expire() {
    let (mut rig, skill) = under_way_to(500.0);
    rig.mission(v1::MissionStatus { areas: vec![area_a()], ..Default::default() });
    rig.say(ledger(v1::PermissionState::Granted, 40.0, 1));
    rig.end(&skill, Failed, "x");
    rig.execute();
    rig.story();
    rig.wait(9.0);
    assert_eq!(rig.story(), "");
    rig.wait(2.0);
    let story = rig.story();
    assert!(story.contains("start fly 0 80 10, giving up 2"), "{story}");
}

#[test]
fn a_grant_that_comes_during_a_hold_ends_it() {
    let (mut rig, skill) = under_way_to(500.0);
    rig.mission(v1::MissionStatus { areas: vec![area_a()], ..Default::default() });
    rig.end(&skill, Failed, "x");
    rig.plan(v1::replan_reply::Reply::Hold(v1::HoldUntil { wait_s: 500.0, reason: "later".into(), planned: false }));
    rig.execute();
    rig.story();
    rig.say(ledger(v1::PermissionState::Granted, 900.0, 1));
    let story = rig.story();
    assert!(story.contains("replan after 0"), "{story}");
}

#[test]
fn a_plan_without_steps_is_no_plan() {
    let mut rig = Rig::new();
    rig.plan(plan(&[]));
    assert_eq!(
        rig.story(),
        "replan after 0 () []\nplanner/replan refused: `steps` is missing",
        "not asked again in the same moment"
    );
    rig.wait(1.1);
    assert_eq!(rig.story(), "replan after 0 () []");
}

/// On the ground; a takeoff was requested, and then the tower denies its area.
fn denied_takeoff(is_taken: bool) -> Rig {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, Goal::Takeoff { climb_m: 10.0 }, &["A"])]));
    if is_taken {
        rig.execute();
    }
    rig.story();
    rig.say(ledger(v1::PermissionState::Denied, 0.0, 1));
    rig
}

fn is_unanswered(rig: &mut Rig, wanted: fn(&Request) -> bool) {
    rig.answer(|it| wanted(it).then_some(Err(CallError::Unanswered)));
}

#[test]
fn a_cancellation_that_got_lost_is_sent_again() {
    let mut rig = denied_takeoff(true);
    assert!(rig.story().contains("cancel skill 1"));
    is_unanswered(&mut rig, |it| matches!(it, Request::SkillCancel(_)));
    rig.wait(0.6);
    assert_eq!(rig.story(), "cancel skill 1");
}

/// An autopilot whose battery is nearly empty refuses to hover, however often that is commanded.
#[test]
fn a_cancellation_that_is_refused_is_sent_again_after_a_pause_and_not_at_once() {
    let mut rig = denied_takeoff(true);
    assert!(rig.story().contains("cancel skill 1"));
    let says = |state: v1::SkillState| v1::SkillEvent {
        skill_id: 1,
        request_id: "mcm-1-1".into(),
        kind: v1::SkillKind::Takeoff as i32,
        state: state as i32,
        ..Default::default()
    };
    for _ in 0..3 {
        rig.say(says(v1::SkillState::Cancel));
        rig.say(says(v1::SkillState::Execute));
        rig.wait(0.3);
        assert_eq!(rig.story(), "");
        rig.wait(0.3);
        assert_eq!(rig.story(), "cancel skill 1");
    }
}

#[test]
fn a_skill_that_flies_although_its_answer_got_lost_is_cancelled() {
    let mut rig = denied_takeoff(false);
    is_unanswered(&mut rig, |it| matches!(it, Request::Skill(_)));
    rig.story();
    rig.say(v1::SkillEvent {
        skill_id: 5,
        request_id: "mcm-1-1".into(),
        kind: v1::SkillKind::Offboard as i32,
        state: v1::SkillState::Execute as i32,
        ..Default::default()
    });
    assert_eq!(rig.story(), "cancel skill 5");
}

#[test]
fn a_flag_is_up_while_an_introspection_lists_it() {
    let (mut rig, _) = under_way();
    rig.listed_flags(&["local_position_stale"]);
    rig.wait(0.1);
    assert_eq!(rig.story(), "start stop, giving up 1");
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    rig.wait(1.0);
    assert_eq!(rig.story(), "", "held until the condition is gone");
    rig.listed_flags(&[]);
    rig.wait(0.1);
    let story = rig.story();
    assert!(story.starts_with("replan after 1"), "{story}");
}

#[test]
fn what_is_listed_since_before_the_takeoff_and_counts_only_in_the_air_counts_there() {
    let mut rig = Rig::new();
    rig.wait(5.0);
    rig.listed_flags(&["battery_hot"]);
    rig.wait(5.0);
    let flags = |rig: &mut Rig| rig.status().contingencies.into_iter().map(|it| it.flag).collect::<Vec<_>>();
    assert_eq!(flags(&mut rig), [""; 0], "it says nothing of a vehicle at rest");
    rig.plan(plan(&[step(1, fly(100.0), &[]), step(2, Goal::Land, &[])]));
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.wait(0.3);
    assert_eq!(flags(&mut rig), ["battery_hot"]);
    assert_eq!(rig.status().acting, "battery_hot");
}

#[test]
fn a_flag_of_which_a_restarted_monitor_knows_nothing_yet_stays_up_until_it_does() {
    let (mut rig, _) = under_way();
    rig.flag("local_position_stale", true);
    let stop = rig.execute();
    rig.wait(0.1);
    rig.end(&stop, Succeeded, "");
    rig.story();
    rig.listed_flags(&[]);
    rig.undecided_flags(&["local_position_stale"]);
    rig.monitor_started();
    rig.wait(60.0);
    assert_eq!(rig.story(), "");
    rig.undecided_flags(&[]);
    rig.wait(0.1);
    let story = rig.story();
    assert!(story.starts_with("replan after 1"), "{story}");
}

#[test]
fn a_pause_by_hand_goes_on_until_it_is_lowered() {
    let (mut rig, _) = under_way();
    rig.flag("operator_pause", true);
    let stop = rig.execute();
    rig.end(&stop, Succeeded, "");
    rig.story();
    rig.wait(1.0);
    assert_eq!(rig.story(), "");
    rig.flag("operator_pause", false);
    assert!(rig.story().starts_with("replan after 1"));
}

#[test]
fn the_mission_does_not_end_on_the_ground_as_long_as_nobody_says_that_it_is_there() {
    let mut rig = Rig::without_vehicle();
    rig.flag("operator_abort", true);
    for _ in 0..2 {
        let land = rig.execute();
        rig.end(&land, Rejected, "no");
    }
    assert_eq!(rig.story(), "start land\nstart land");
    rig.vehicle(true, Loiter, (0.0, 40.0, 10.0));
    rig.wait(0.6);
    assert_eq!(rig.story(), "start fly 0 40 15");
}

/// The vehicle is in the middle of area A, with a grant of the tower that began first.
fn inside_a(decision: u64) -> Rig {
    let (mut rig, _) = under_way_to(500.0);
    rig.together(|rig| {
        rig.mission(v1::MissionStatus { areas: vec![area_a()], ..Default::default() });
        rig.say(v1::PermissionLedger { tower_start: 1, ..ledger(v1::PermissionState::Granted, 900.0, decision) });
    });
    rig.vehicle(true, Offboard, (0.0, 200.0, 10.0));
    // What comes from now on is newer.
    rig.wait(0.1);
    rig.story();
    rig
}

#[test]
fn another_tower_is_asked_once_again_for_what_the_vehicle_flies_in() {
    #[track_caller]
    fn check(tower_start: u64, permissions: Vec<v1::Permission>, expected: &str) {
        let mut rig = inside_a(5);
        for _ in 0..2 {
            rig.say(v1::PermissionLedger { tower_start, permissions: permissions.clone(), ..Default::default() });
            rig.wait(0.5);
        }
        assert_eq!(rig.story(), expected);
    }
    let known = ledger(v1::PermissionState::Granted, 850.0, 5).permissions;
    check(1, known.clone(), "");
    check(2, known, "ask A");
    // It has lost everything: what was granted holds until it expires or is decided about.
    check(2, Vec::new(), "ask A");
    check(2, ledger(v1::PermissionState::Requested, 0.0, 0).permissions, "ask A");
}

/// The manager was restarted inside the area, perhaps twice, and the tower perhaps as well, which then knows nothing.
#[test]
fn after_a_restart_the_vehicle_stays_by_what_was_granted_and_asks_about_it() {
    #[track_caller]
    fn check(restarts: u32, tower_start: u64, permissions: Vec<v1::Permission>) {
        let mut rig = inside_a(5);
        for _ in 0..restarts {
            rig = rig.started_again();
        }
        rig.vehicle(true, Loiter, (0.0, 200.0, 10.0));
        rig.decisions.clear();
        let mut story = String::new();
        for _ in 0..40 {
            rig.say(v1::PermissionLedger { tower_start, permissions: permissions.clone(), ..Default::default() });
            rig.wait(0.2);
            story += &rig.story();
        }
        assert_eq!((story.matches("ask A").count(), rig.status().contingencies), (1, Vec::new()), "{story}");
        let said = |it: &&String| it.contains("asking for area A") && it.contains("granted before the start");
        assert_eq!(rig.decisions.iter().filter(said).count(), 1, "{:?}", rig.decisions);
        // Only a new decision is enough to go on by.
        let grant = ledger(v1::PermissionState::Granted, 850.0, 6).permissions;
        rig.say(v1::PermissionLedger { tower_start, permissions: grant, ..Default::default() });
        rig.wait(20.0);
        assert_eq!((rig.story().matches("ask A").count(), rig.status().contingencies), (0, Vec::new()));
    }
    let repeated = ledger(v1::PermissionState::Granted, 850.0, 5).permissions;
    for restarts in [1, 2] {
        for tower_start in [1, 2] {
            check(restarts, tower_start, repeated.clone());
            check(restarts, tower_start, Vec::new());
        }
    }
}

#[test]
fn a_revocation_counts_at_once_after_a_restart_also_in_a_part_of_the_ledger() {
    for through_area in ["", "A"] {
        let mut rig = inside_a(5).started_again();
        rig.vehicle(true, Loiter, (0.0, 200.0, 10.0));
        let revoked = ledger(v1::PermissionState::Revoked, 0.0, 6);
        rig.say(v1::PermissionLedger { tower_start: 1, through_area: through_area.into(), ..revoked });
        rig.wait(0.2);
        let up: Vec<String> = rig.status().contingencies.into_iter().map(|it| it.flag).collect();
        assert_eq!(up, ["area_breached"], "through {through_area:?}");
    }
}

#[test]
fn an_older_decision_changes_nothing_and_a_repeated_one_prolongs_nothing() {
    #[track_caller]
    fn check(lines: &[(v1::PermissionState, f64, u64)], is_held_after_a_minute: bool) {
        let mut rig = inside_a(5);
        for (state, valid_for_s, decision) in lines {
            rig.say(v1::PermissionLedger { tower_start: 1, ..ledger(*state, *valid_for_s, *decision) });
        }
        rig.wait(60.0);
        let is_held = rig.status().contingencies.is_empty();
        assert_eq!(is_held, is_held_after_a_minute, "{lines:?}");
    }
    use v1::PermissionState::{Denied, Expired, Granted, Revoked};
    check(&[(Revoked, 0.0, 6)], false);
    check(&[(Revoked, 0.0, 6), (Granted, 900.0, 5)], false);
    check(&[(Revoked, 0.0, 6), (Granted, 900.0, 7)], true);
    check(&[(Denied, 0.0, 4), (Revoked, 0.0, 3)], true);
    check(&[(Granted, 30.0, 5), (Granted, 900.0, 5)], false);
    check(&[(Expired, 0.0, 5), (Granted, 900.0, 5)], false);
}
