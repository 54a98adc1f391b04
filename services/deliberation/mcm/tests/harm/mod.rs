//! Where a flight ends with the least harm, what an order says of that, and what is entered for it without permission.

use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Loiter, Offboard};
use kittiwake_proto::v1::GroundKind::{People, Water};
use kittiwake_proto::v1::SkillOutcome::Succeeded;
use v1::operator_command::Verb;

use super::under_way;
use crate::stories::rig::Rig;

fn abort(overrides: bool) -> Verb {
    Verb::Abort(v1::AbortMission { overrides })
}

fn square(half_m: f64) -> Vec<v1::Ned> {
    [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)]
        .map(|(north_m, east_m)| v1::Ned { north_m, east_m, down_m: 0.0 })
        .to_vec()
}

/// Everywhere but 20 m around home.
fn below(ground: v1::GroundKind) -> v1::Area {
    v1::Area {
        name: "below".into(),
        kind: v1::AreaKind::KeepOut as i32,
        corners: square(5000.0),
        holes: vec![v1::Ring { corners: square(20.0) }],
        ceiling_m: Some(3.0),
        ground: ground as i32,
        ..Default::default()
    }
}

/// Home is in it.
fn harbour() -> v1::Area {
    let kind = v1::AreaKind::Permission as i32;
    v1::Area { name: "harbour".into(), kind, corners: square(60.0), ..Default::default() }
}

/// In the air 900 m from home, more than a minute of flight, among these areas.
fn far_out(areas: Vec<v1::Area>) -> Rig {
    let (mut rig, _) = under_way();
    rig.vehicle(true, Offboard, (0.0, 900.0, 20.0));
    rig.mission(v1::MissionStatus { areas, ..Default::default() });
    rig.story();
    rig
}

#[test]
fn an_order_to_land_says_where_it_ends_and_a_pilot_may_insist_on_here() {
    const WATER: &str =
        "here it would come down where the aircraft is lost; order it with override to land here all the same";
    const PEOPLE: &str = "here it would come down among people; order it with override to land here all the same";
    #[track_caller]
    fn check(areas: Vec<v1::Area>, overrides: bool, expected: &str, story: &str) {
        let mut rig = far_out(areas);
        assert_eq!(rig.command(abort(overrides)).text, expected);
        assert_eq!(rig.story(), story);
    }
    let lands = "start land, giving up 1";
    check(vec![], false, "lands here and ends the mission", lands);
    let home = format!("flies to home, 900 m away, lands there and ends the mission: {WATER}");
    check(vec![below(Water)], false, &home, "start fly 0 0 20, giving up 1");
    check(vec![below(Water)], true, "lands here, where the aircraft is lost, and ends the mission", lands);
    // An area without permission is worse than a lost aircraft, and people below are worse than both.
    let sea = "lands here, where the aircraft is lost, and ends the mission";
    check(vec![below(Water), harbour()], false, sea, lands);
    let through = format!(
        "flies to home, 900 m away, entering harbour without permission, lands there and ends the mission: {PEOPLE}"
    );
    check(vec![below(People), harbour()], false, &through, "ask harbour\nstart fly 0 0 20, giving up 1");
    check(vec![below(People), harbour()], true, "lands here, among people, and ends the mission", lands);
}

#[test]
fn what_is_entered_without_permission_is_told_and_lands_there() {
    let mut rig = far_out(vec![below(People), harbour()]);
    rig.command(abort(false));
    rig.wait(1.0);
    assert_eq!(rig.status().entered_without_permission, ["harbour"]);
    let said = "enters area harbour without permission: to land at home, where else it would come down among people";
    assert!(rig.decisions.iter().any(|it| it.contains(said)), "{:#?}", rig.decisions);
    rig.execute();
    rig.story();
    rig.vehicle(true, Offboard, (0.0, 0.0, 20.0));
    rig.end_present(Succeeded);
    assert!(rig.story().contains("start land"));
    // It stays what was chosen on the way.
    assert_eq!(rig.status().entered_without_permission, ["harbour"]);
}

#[test]
fn a_pilot_may_send_it_home_through_an_area_without_permission() {
    let order = |overrides| {
        let mut rig = far_out(vec![below(Water), harbour()]);
        let text = rig.command(Verb::Return(v1::ReturnHome { overrides })).text;
        (text, rig.story())
    };
    let (text, story) = order(false);
    let asks = "flies home, lands and ends the mission; asks for harbour first, which the only way leads through; if refused: \
                land_elsewhere, else land; order it with override to enter without permission";
    assert_eq!((text.as_str(), story.as_str()), (asks, "ask harbour\nstart stop, giving up 1"));
    let (text, story) = order(true);
    let enters =
        "flies home, lands and ends the mission; enters harbour without permission, which the only way leads through";
    assert_eq!((text.as_str(), story.as_str()), (enters, "ask harbour\nstart fly 0 0 20, giving up 1"));
}

#[test]
fn by_a_position_that_jumped_no_area_is_left_before_it_is_believed_again() {
    let closed = v1::Area { kind: v1::AreaKind::KeepOut as i32, ..harbour() };
    let (mut rig, _) = under_way();
    rig.vehicle(true, Offboard, (0.0, 100.0, 10.0));
    rig.mission(v1::MissionStatus { areas: vec![closed], ..Default::default() });
    rig.wait(2.0);
    rig.story();
    // The breach is seen first, or the jump.
    for jumps_first in [true, false] {
        rig.flag("position_jumped", jumps_first);
        rig.vehicle(true, Offboard, (0.0, 30.0, 10.0));
        rig.flag("position_jumped", true);
        rig.wait(5.0);
        let story = rig.story();
        assert!(story.ends_with("start stop") || story.contains("start stop, giving up"), "{story}");
        assert_eq!(rig.status().acting, "position_jumped", "{story}");
        while rig.open().any(|it| matches!(it, Request::Skill(_))) {
            rig.execute();
        }
        rig.end_present(Succeeded);
        rig.flag("position_jumped", false);
        rig.wait(2.0);
        assert_eq!(rig.status().acting, "area_breached", "{} {:#?}", rig.story(), rig.decisions);
        assert!(rig.story().contains("start fly"), "now it is left");
        rig.vehicle(true, Offboard, (0.0, 200.0, 10.0));
        rig.wait(2.0);
        rig.story();
    }
}

#[test]
fn who_was_carried_since_it_was_powered_on_does_not_take_off_before_an_operator_says_so() {
    let mut rig = Rig::new();
    rig.vehicle(false, Loiter, (0.0, 200.0, 0.0));
    rig.wait(1.0);
    let told = rig.status().contingencies.remove(0);
    assert_eq!(told.flag, "frame_moved");
    assert!(told.reason.starts_with("it stands 200 m from the take-off point of its local frame"), "{}", told.reason);
    rig.story();
    rig.wait(30.0);
    assert_eq!(rig.status().acting, "frame_moved");
    assert!(rig.command(Verb::Resume(v1::ResumeMission {})).done);
    rig.wait(1.0);
    assert_eq!(rig.status().acting, "");
    // A position in doubt says nothing about where it stands.
    let mut rig = Rig::new();
    rig.flag("position_uncertain", true);
    rig.vehicle(false, Loiter, (0.0, 200.0, 0.0));
    rig.wait(1.0);
    let up: Vec<_> = rig.status().contingencies.into_iter().map(|it| it.flag).collect();
    assert_eq!(up, ["position_uncertain"]);
    // A flight may end elsewhere, and what it wanders by in a gust is no reason.
    let (mut rig, _) = under_way();
    rig.vehicle(false, Loiter, (0.0, 55.0, 0.0));
    rig.wait(1.0);
    assert!(rig.status().contingencies.iter().all(|it| it.flag != "frame_moved"));
    let mut rig = rig.started_again();
    rig.vehicle(false, Loiter, (0.0, 55.0, 0.0));
    rig.wait(1.0);
    assert!(rig.status().contingencies.iter().all(|it| it.flag != "frame_moved"));
}
