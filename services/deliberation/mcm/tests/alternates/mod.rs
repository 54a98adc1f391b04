//! The places where a flight may end early, as the manager tells them.

use kittiwake_proto::v1;
use kittiwake_proto::v1::FlightMode::{Loiter, Offboard};

use crate::stories::rig::Rig;
use crate::stories::under_way;

fn site(name: &str, north_m: f64, kind: v1::SiteKind) -> v1::Site {
    let position = Some(v1::Ned { north_m, east_m: 50.0, down_m: 0.0 });
    v1::Site { name: name.into(), position, kind: kind as i32 }
}

fn status(sites: Vec<v1::Site>) -> v1::MissionStatus {
    v1::MissionStatus { sites, ..Default::default() }
}

fn told(rig: &mut Rig) -> Vec<String> {
    rig.status().alternates.into_iter().map(|it| it.name).collect()
}

#[test]
fn they_are_told_in_the_air_best_first_and_without_the_planner() {
    let (mut rig, _) = under_way();
    rig.mission(status(vec![site("pond", 1.0, v1::SiteKind::Ditch), site("field", 20.0, v1::SiteKind::Landing)]));
    rig.wait(1.0);
    assert_eq!(told(&mut rig), ["field", "home", "pond"]);
    // Half a minute later the vehicle is elsewhere.
    rig.vehicle(true, Offboard, (0.0, 5.0, 10.0));
    rig.wait(30.0);
    assert_eq!(told(&mut rig), ["home", "field", "pond"]);
    rig.vehicle(false, Loiter, (0.0, 5.0, 0.0));
    rig.wait(1.0);
    assert_eq!(told(&mut rig), Vec::<String>::new());
}

#[test]
fn a_manager_that_is_started_again_knows_the_sites() {
    let (mut rig, _) = under_way();
    rig.mission(status(vec![site("field", 20.0, v1::SiteKind::Landing)]));
    rig.wait(1.0);
    let mut rig = rig.started_again();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig.wait(1.0);
    assert_eq!(told(&mut rig), ["field", "home"]);
    // Another mission has taken its place meanwhile.
    rig.mission(status(vec![site("yard", 20.0, v1::SiteKind::Landing)]));
    rig.wait(1.0);
    assert_eq!(told(&mut rig), ["yard", "home"]);
}

#[test]
fn more_sites_than_a_mission_may_have_are_neither_looked_at_nor_told() {
    let (mut rig, _) = under_way();
    // The nearest are beyond the limit.
    let far_first = |index: u16| site(&index.to_string(), f64::from(500 - index), v1::SiteKind::Landing);
    rig.mission(status((0..400).map(far_first).collect()));
    rig.wait(2.0);
    assert_eq!(told(&mut rig), ["home", "31", "30", "29", "28", "27", "26", "25"]);
}
