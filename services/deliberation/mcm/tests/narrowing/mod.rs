//! What flags narrow while they are up: the step goes on, slower or no farther than they allow; and actions that are impossible.

use domain::skill::Goal;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Land, Loiter, Offboard};
use kittiwake_proto::v1::SkillOutcome::Succeeded;
use kittiwake_proto::v1::operator_command::Verb;

use crate::stories::fly;
use crate::stories::rig::{Rig, plan, step};

/// A row that is raised by hand.
fn row(flag: &str, priority: u32, keys: &str) -> String {
    format!("[[contingency]]\nflag = \"{flag}\"\npriority = {priority}\n{keys}\n")
}

const HOLDS: &str = "actions = [\"stop\"]\nemergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"";

/// A row that responds on the ground only, and narrows the flight.
fn caution(flag: &str, priority: u32, narrows: &str) -> String {
    row(flag, priority, &format!("narrows = [\"{narrows}\"]\nphases = [\"on-ground\"]\n{HOLDS}"))
}

fn slows() -> String {
    let keys = "actions = [\"slow\"]\nemergency = \"slow\"\nclears = \"with-condition\"\nthen = \"resume\"\n\
        phases = [\"cruise\", \"inside-area\"]";
    row("gusty", 500, keys)
}

/// In the air, 50 m to the east, in a step that flies `goal`.
fn flying(rows: &str, goal: Goal) -> Rig {
    let mut rig = Rig::with_rows(rows);
    let mode = if goal == Goal::Land { Land } else { Offboard };
    rig.plan(plan(&[step(1, goal, &[])]));
    rig.execute();
    rig.vehicle(true, mode, (0.0, 50.0, 10.0));
    rig.story();
    rig
}

/// In the way of every step.
const AHEAD: (f64, f64) = (100.0, 300.0);

/// Area A between these places to the east, with its permission.
fn with_area(mut rig: Rig, (west_m, east_m): (f64, f64)) -> Rig {
    let corner = |(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 };
    let area = v1::Area {
        name: "A".into(),
        kind: v1::AreaKind::Permission as i32,
        corners: [(-90.0, west_m), (90.0, west_m), (90.0, east_m), (-90.0, east_m)].map(corner).to_vec(),
        ..Default::default()
    };
    let granted = v1::PermissionState::Granted as i32;
    let entry =
        v1::Permission { area: "A".into(), state: granted, valid_for_s: 900.0, decision: 1, ..Default::default() };
    rig.together(|rig| {
        rig.mission(v1::MissionStatus { areas: vec![area], ..Default::default() });
        rig.say(v1::PermissionLedger { permissions: vec![entry], ..Default::default() });
    });
    rig.wait(0.5);
    rig.story();
    rig
}

/// The position goal that was asked for last: how far east, at which speed, and whether it is held there.
#[track_caller]
fn wanted(rig: &Rig) -> (f64, f64, bool) {
    let goals = rig.open().filter_map(|it| match it {
        Request::Skill(skill) => skill.goal.as_ref()?.goal.as_ref(),
        _ => None,
    });
    match goals.last() {
        Some(v1::skill_goal::Goal::Position(it)) => {
            let east_m = it.target.unwrap().east_m;
            ((east_m * 1000.0).round() / 1000.0, it.speed_limit_m_s, it.hold_at_target)
        }
        other => panic!("no position is asked for, but {other:?}"),
    }
}

#[test]
fn a_row_that_slows_interrupts_nothing_and_ends_with_its_condition() {
    let mut rig = flying(&slows(), fly(400.0));
    rig.flag("gusty", true);
    assert_eq!(rig.story(), "start fly 0 400 10, giving up 1");
    assert_eq!(wanted(&rig), (400.0, 5.0, false));
    assert!(rig.decisions.iter().any(|it| it == "`gusty`: slow, no faster than 5.0 m/s"), "{:?}", rig.decisions);
    rig.execute();
    rig.wait(1.0);
    assert_eq!((rig.story(), rig.status().acting), (String::new(), String::new()), "no response is under way");
    rig.flag("gusty", false);
    assert_eq!(rig.story(), "start fly 0 400 10, giving up 2");
    assert_eq!(wanted(&rig), (400.0, 10.0, false));
    assert!(!rig.decisions.iter().any(|it| it.starts_with("step 1 failed")), "{:?}", rig.decisions);
}

#[test]
fn a_response_is_flown_slower_too() {
    let mut rig = flying(&slows(), fly(400.0));
    rig.flag("gusty", true);
    rig.execute();
    rig.command(Verb::Return(v1::ReturnHome { overrides: false }));
    rig.story();
    assert_eq!(wanted(&rig).1, 5.0);
    let answered = rig.records.iter().rev().find(|it| it.flag == "operator_return" && !it.response.is_empty());
    assert!(
        answered.is_some_and(|it| it.rejected.is_empty()),
        "what is in force beside it is not rejected: {answered:?}"
    );
}

#[test]
fn no_new_area_is_entered_while_a_caution_forbids_it_and_the_step_goes_on_after_it() {
    let mut rig = with_area(flying(&caution("doubt", 500, "no-new-area"), fly(500.0)), AHEAD);
    rig.flag("doubt", true);
    assert!(rig.story().ends_with("giving up 1"));
    // 20 m before the border.
    assert_eq!(wanted(&rig), (80.0, 10.0, true));
    assert!(rig.decisions.iter().any(|it| it == "holds before area A while `doubt` is up"), "{:?}", rig.decisions);
    rig.execute();
    rig.wait(5.0);
    assert_eq!(rig.story(), "", "it holds");
    // It came too late to stop in time: it stays out all the same.
    rig.vehicle(true, Offboard, (0.0, 105.0, 10.0));
    rig.wait(5.0);
    assert_eq!(rig.story(), "");
    rig.vehicle(true, Offboard, (0.0, 80.0, 10.0));
    rig.flag("doubt", false);
    assert_eq!(rig.story(), "start fly 0 500 10, giving up 2");
    assert!(rig.decisions.iter().any(|it| it == "goes on: no flag forbids it any more"), "{:?}", rig.decisions);
}

#[test]
fn an_area_that_the_vehicle_is_in_is_none_to_be_entered() {
    let mut rig = with_area(flying(&caution("doubt", 500, "no-new-area"), fly(500.0)), AHEAD);
    rig.vehicle(true, Offboard, (0.0, 150.0, 10.0));
    rig.wait(0.5);
    rig.flag("doubt", true);
    rig.wait(2.0);
    assert_eq!(rig.story(), "");
}

#[test]
fn the_narrowing_of_every_flag_applies_beside_the_response_of_one() {
    let rows = [slows(), caution("doubt", 501, "no-new-area")].concat();
    let mut rig = with_area(flying(&rows, fly(500.0)), AHEAD);
    rig.flag("gusty", true);
    rig.execute();
    rig.story();
    rig.flag("doubt", true);
    assert_eq!(wanted(&rig), (80.0, 5.0, true));
    rig.execute();
    rig.story();
    // A hold comes before the step; both are in force after it.
    rig.flag("obstacle", true);
    assert_eq!(rig.story(), "start stop, giving up 3");
    assert_eq!(rig.status().acting, "obstacle");
}

#[test]
fn no_landing_begins_where_one_is_forbidden_and_it_begins_when_the_flag_has_fallen() {
    let mut rig = flying(&caution("deck_blocked", 500, "no-landing-here"), Goal::Land);
    rig.flag("deck_blocked", true);
    assert_eq!(rig.story(), "start fly 0 50 10, giving up 1");
    assert_eq!(wanted(&rig), (50.0, 10.0, true));
    rig.execute();
    // Seen in the mode of the hold, which is not that of the step.
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.wait(2.0);
    assert_eq!(rig.story(), "");
    rig.flag("deck_blocked", false);
    assert_eq!(rig.story(), "start land, giving up 2");
}

#[test]
fn no_landing_begins_where_one_was_forbidden_before_a_restart() {
    let mut rig = flying(&caution("deck_blocked", 500, "no-landing-here"), Goal::Land);
    rig.flag("deck_blocked", true);
    for _ in 0..2 {
        rig = rig.started_again();
    }
    rig.wait(1.0);
    rig.plan(plan(&[step(2, Goal::Land, &[])]));
    let story = rig.story();
    assert!(story.contains("start fly 0 50 10") && !story.contains("start land"), "{story}");
}

/// Home lies in area A, which a flag forbids to enter: the way down may, and a plan that is made after it may not.
#[test]
fn what_only_a_way_down_may_enter_is_not_counted_on_after_the_landing() {
    let keys = "narrows = [\"no-new-area\"]\nphases = [\"on-ground\", \"takeoff\"]\nsituations = [\"flying\"]";
    let homing = "actions = [\"return_home\"]\nemergency = \"land\"\nclears = \"after-action\"\nthen = \"resume\"";
    let rows = row("doubt", 500, &format!("{keys}\n{HOLDS}")) + &row("homing", 501, homing);
    let mut rig = flying(&rows, fly(500.0));
    rig.vehicle(true, Offboard, (0.0, 400.0, 10.0));
    let mut rig = with_area(rig, (-90.0, 300.0));
    rig.flag("doubt", true);
    rig.flag("homing", true);
    assert!(rig.decisions.iter().any(|it| it.starts_with("area A may be entered although")), "{:?}", rig.decisions);
    // It comes down before it is there.
    rig.execute();
    rig.vehicle(false, Loiter, (0.0, 350.0, 0.0));
    rig.flag("homing", false);
    rig.end_present(Succeeded);
    rig.execute();
    rig.end_present(Succeeded);
    rig.wait(5.0);
    assert!(rig.command(Verb::Resume(v1::ResumeMission {})).done);
    rig.wait(0.1);
    let asked = rig.open().find_map(|it| if let Request::Replan(it) = it { Some(it.clone()) } else { None });
    let asked = asked.unwrap_or_else(|| panic!("a plan is asked for: {:?}", rig.decisions));
    assert!(asked.held.is_empty(), "{:?}", asked.held);
}

/// The reasons for which actions of this row were skipped, with the action.
fn skipped(rig: &Rig, flag: &str) -> Vec<(String, String)> {
    let skips = rig.records.iter().filter(|it| it.flag == flag && it.kind() == v1::DecisionKind::ResponseSkipped);
    skips.flat_map(|it| &it.rejected).map(|it| (it.what.clone(), it.why.clone())).collect()
}

#[test]
fn where_no_landing_is_allowed_a_response_lands_elsewhere() {
    let mut rig = flying(&caution("deck_blocked", 500, "no-landing-here"), fly(400.0));
    rig.flag("deck_blocked", true);
    rig.flag("battery_critical", true);
    rig.wait(1.0);
    let why = "no landing here while `deck_blocked` is up".to_owned();
    assert_eq!(skipped(&rig, "battery_critical"), [("land".to_owned(), why)]);
    assert!(rig.decisions.iter().any(|it| it == "flies to home to land"), "home is 50 m away: {:?}", rig.decisions);
}

#[test]
fn what_needs_a_position_is_skipped_without_one_and_the_emergency_action_never() {
    let mut rig = flying("", fly(400.0));
    rig.flag("local_position_stale", true);
    rig.execute();
    rig.flag("battery_low", true);
    rig.wait(5.0);
    let why = "it needs a position, and `local_position_stale` is up".to_owned();
    let expected = [("divert".to_owned(), why.clone()), ("land_elsewhere".to_owned(), why)];
    assert_eq!(skipped(&rig, "battery_low"), expected);
    assert!(rig.story().contains("start land"), "{:?}", rig.decisions);
}

#[test]
fn a_climb_climbs_and_then_holds() {
    let keys = "actions = [\"climb\", \"stop\"]\nemergency = \"stop\"\nclears = \"with-condition\"\nthen = \"resume\"";
    let mut rig = flying(&row("boat_below", 500, keys), fly(400.0));
    rig.flag("boat_below", true);
    assert_eq!(rig.story(), "start fly 0 50 30, giving up 1");
    let climb = rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 30.0));
    rig.end(&climb, Succeeded, "");
    assert_eq!(rig.story(), "start stop");
    let stop = rig.execute();
    rig.vehicle(true, Loiter, (0.0, 50.0, 30.0));
    rig.end(&stop, Succeeded, "");
    rig.wait(1.0);
    assert_eq!((rig.story(), rig.status().acting), (String::new(), "boat_below".to_owned()));
}

#[test]
fn no_vehicle_is_ditched_while_a_landing_can_be_reached() {
    let keys = "actions = [\"ditch\"]\nemergency = \"land_now\"\nclears = \"never\"\nthen = \"end-mission\"";
    let mut rig = flying(&row("given_up", 500, keys), fly(400.0));
    let position = Some(v1::Ned { north_m: 20.0, east_m: 50.0, down_m: 0.0 });
    let pond = v1::Site { name: "pond".into(), position, kind: v1::SiteKind::Ditch as i32 };
    rig.mission(v1::MissionStatus { sites: vec![pond], ..Default::default() });
    rig.wait(0.5);
    rig.story();
    rig.flag("given_up", true);
    rig.wait(1.0);
    assert_eq!(skipped(&rig, "given_up"), [("ditch".to_owned(), "a landing can be reached: home".to_owned())]);
    assert!(rig.story().contains("start land"), "{:?}", rig.decisions);
}

#[test]
fn a_step_holds_before_what_a_flag_forbids_for_a_minute_and_the_rest_is_planned_without_it() {
    let mut rig = with_area(flying(&caution("doubt", 500, "no-new-area"), fly(500.0)), AHEAD);
    rig.flag("doubt", true);
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 80.0, 10.0));
    rig.wait(59.0);
    assert!(!rig.decisions.iter().any(|it| it.contains("failed")), "{:?}", rig.decisions);
    rig.wait(2.0);
    let failed = "step 1 failed: area A is not entered: `doubt` is up, for 60 s";
    assert!(rig.decisions.iter().any(|it| it == failed), "{:?}", rig.decisions);
    let asked = rig.open().find_map(|it| if let Request::Replan(it) = it { Some(it.clone()) } else { None });
    let asked = asked.expect("a plan is asked for");
    assert!(asked.denials.iter().any(|it| it.area == "A" && it.withheld), "{:?}", asked.denials);
    assert!(asked.held.is_empty(), "the permission is not used: {:?}", asked.held);
}
