//! Every rule has a flight that breaks it, and one that does not.

use std::time::Duration;

use domain::fmu::{TrafficKind, TransponderReport};
use domain::geometry::{Ned, NedVelocity};
use domain::testing::ENERGY;
use domain::time::Time;
use vehicle_sim::ground::Surface;

use super::*;

/// A vehicle that flies itself, and what everybody hears.
struct Story {
    rules: Rules,
    second: u64,
    truth: Truth,
    areas: Vec<Area>,
    permissions: BTreeMap<String, v1::Permission>,
    manager: v1::McmStatus,
    against: Vec<Against>,
}

fn energy() -> EnergyModel {
    let file: toml::Table = ENERGY.parse().unwrap();
    file["energy"].clone().try_into().unwrap()
}

impl Story {
    /// Over land, 20 m high, 100 m east of home.
    fn new() -> Story {
        let truth = Truth {
            position: Ned::new(0.0, 100.0, -20.0),
            velocity: NedVelocity::default(),
            standing: false,
            ground_m: 0.0,
            surface: Surface::Land,
            collisions: 0,
            wind: NedVelocity::default(),
            charge: 0.8,
            drain: 1.0,
            holds_load: true,
            traffic: Vec::new(),
        };
        Story {
            rules: Rules::new(energy()),
            second: 0,
            truth,
            areas: Vec::new(),
            permissions: BTreeMap::new(),
            manager: v1::McmStatus::default(),
            against: Vec::new(),
        }
    }

    fn hear(&mut self, message: impl Into<Message>) {
        let now = Time::after(Duration::from_secs(self.second));
        self.against.extend(self.rules.hear(now, &message.into(), &self.permissions));
    }

    fn see(&mut self) {
        self.second += 1;
        let time = Time::after(Duration::from_secs(self.second));
        let Story { truth, areas, permissions, manager, .. } = self;
        let now = Now { time, utc_ms: self.second as i64 * 1000 };
        let heard = Heard { now, flies_itself: !truth.standing, areas, permissions, manager };
        self.against.extend(self.rules.see(truth, heard));
    }

    /// Flies for this many seconds, each of them after `change`.
    fn flies(mut self, seconds: u64, mut change: impl FnMut(&mut Truth)) -> Story {
        for _ in 0..seconds {
            change(&mut self.truth);
            self.see();
        }
        self
    }

    fn lands(mut self) -> Story {
        self.manager.set_skill(v1::SkillKind::Land);
        self.see();
        (self.truth.standing, self.truth.position.down_m) = (true, -self.truth.ground_m);
        self.see();
        self
    }

    #[track_caller]
    fn check(self, expected: &[Rule]) {
        let rules: Vec<Rule> = self.against.iter().map(|(rule, _)| *rule).collect();
        assert_eq!(rules, expected, "{:?}", self.against);
    }
}

#[test]
fn the_ground_of_a_place_is_met_in_a_landing_only() {
    Story::new().flies(9, |it| it.ground_m = 15.0).check(&[]);
    Story::new().flies(9, |_| {}).flies(9, |it| it.collisions = 1).check(&[Rule::Ground]);
    let skims = |speed_m_s: f64| {
        Story::new().flies(9, move |it| {
            (it.ground_m, it.velocity.east_m_s) = (19.5, speed_m_s);
            it.position.east_m += speed_m_s;
        })
    };
    skims(2.0).check(&[]);
    skims(8.0).check(&[Rule::Ground]);
}

fn other(kind: TrafficKind, east_m: f64, east_m_s: f64) -> TransponderReport {
    let velocity = NedVelocity::new(0.0, east_m_s, 0.0);
    TransponderReport { id: "other".into(), position: Ned::new(0.0, east_m, -20.0), velocity, kind }
}

#[test]
fn traffic_that_was_reported_is_kept_away_from() {
    /// It comes from so far away, so fast.
    fn meets(kind: TrafficKind, from_m: f64, speed_m_s: f64) -> Story {
        let mut traffic = other(kind, from_m, -speed_m_s);
        Story::new().flies(120, move |it| {
            traffic.position.east_m -= speed_m_s;
            it.traffic = vec![traffic.clone()];
        })
    }
    meets(TrafficKind::Crewed, 2000.0, 30.0).check(&[Rule::Separation]);
    // Twenty seconds are too few to be elsewhere.
    let late = meets(TrafficKind::Crewed, 700.0, 30.0);
    assert_eq!(late.rules.figures.well_clear_lost, 1);
    late.check(&[]);
    meets(TrafficKind::Uncrewed, 2000.0, 30.0).check(&[]);
    meets(TrafficKind::Crewed, 9000.0, 30.0).check(&[]);
}

#[test]
fn it_takes_off_into_nobodys_way_and_lands_on_nobody() {
    let takes_off_after = |seconds: u64, traffic: TransponderReport| {
        let mut story = Story::new();
        (story.truth.standing, story.truth.traffic) = (true, vec![traffic]);
        let mut story = story.flies(seconds, |_| {});
        story.truth.standing = false;
        story.see();
        story
    };
    let takes_off = |traffic| takes_off_after(6, traffic);
    takes_off(other(TrafficKind::Crewed, 1500.0, -30.0)).check(&[Rule::Separation]);
    // The takeoff had begun.
    takes_off_after(3, other(TrafficKind::Crewed, 1500.0, -30.0)).check(&[]);
    takes_off(other(TrafficKind::Crewed, 1500.0, 30.0)).check(&[]);
    // It is parked beside it.
    let parked = TransponderReport { position: Ned::new(30.0, 100.0, 0.0), ..other(TrafficKind::Crewed, 0.0, 0.0) };
    takes_off(parked.clone()).check(&[]);
    Story::new().flies(90, move |it| it.traffic = vec![parked.clone()]).check(&[]);
    let lands = |east_m: f64| {
        let ship = other(TrafficKind::Vessel, east_m, 0.0);
        Story::new().flies(50, move |it| it.traffic = vec![ship.clone()]).lands()
    };
    lands(110.0).check(&[Rule::Separation]);
    lands(160.0).check(&[]);
    let drone = other(TrafficKind::Uncrewed, 120.0, 0.0);
    Story::new().flies(50, move |it| it.traffic = vec![drone.clone()]).lands().check(&[]);
    let ship = other(TrafficKind::Vessel, 110.0, 0.0);
    let mut falls = Story::new();
    falls.manager.acting = "motor_failure".into();
    falls.flies(50, move |it| it.traffic = vec![ship.clone()]).lands().check(&[]);
}

#[test]
fn a_flag_that_rises_three_times_for_one_cause_is_found_once() {
    let raised = |metres: u32| v1::DecisionRecord {
        kind: v1::DecisionKind::ContingencyRaised as i32,
        flag: "traffic_near".into(),
        text: format!("`traffic_near` raised: {metres} m < 610 m"),
        ..Default::default()
    };
    let step = || v1::DecisionRecord { kind: v1::DecisionKind::StepSucceeded as i32, ..Default::default() };
    let mut story = Story::new();
    [300, 250, 200, 150].map(raised).into_iter().for_each(|it| story.hear(it));
    story.check(&[Rule::Flapping]);
    let mut story = Story::new();
    [raised(300), raised(250), step(), raised(200), raised(150)].into_iter().for_each(|it| story.hear(it));
    story.check(&[]);
    let mut story = Story::new();
    story.rules.losing(Time::after(Duration::from_secs(60)));
    [300, 250, 200].map(raised).into_iter().for_each(|it| story.hear(it));
    let mut story = story.flies(60, |_| {});
    [300, 250, 200].map(raised).into_iter().for_each(|it| story.hear(it));
    story.check(&[Rule::Flapping]);
}

#[test]
fn it_comes_forward_or_says_why_not() {
    Story::new().flies(590, |_| {}).check(&[]);
    Story::new().flies(700, |_| {}).check(&[Rule::Progress]);
    let mut stay = Story::new();
    let position = Some(v1::Ned { north_m: 0.0, east_m: 100.0, down_m: -20.0 });
    let objectives = vec![v1::Objective { position, dwell_s: 300.0, ..Default::default() }];
    stay.hear(v1::MissionStatus { objectives, ..Default::default() });
    stay.flies(850, |_| {}).check(&[]);
    let creeps = |speed_m_s: f64| {
        let mut story = Story::new();
        story.manager.set_skill(v1::SkillKind::Offboard);
        story.manager.distance_left_m = 900.0;
        story.flies(150, move |it| it.position.east_m += speed_m_s)
    };
    creeps(1.5).check(&[Rule::Progress]);
    creeps(4.0).check(&[]);
}

#[test]
fn it_comes_down_in_water_or_among_people_only_where_nothing_else_is_in_reach() {
    let lands = |surface: Surface, charge: f64| {
        Story::new().flies(9, move |it| (it.surface, it.charge) = (surface, charge)).lands()
    };
    lands(Surface::Water, 0.8).check(&[Rule::Landing]);
    lands(Surface::People, 0.8).check(&[Rule::Landing]);
    lands(Surface::Land, 0.8).check(&[]);
    lands(Surface::Water, 0.26).check(&[]);
    // Home is behind an area that is closed.
    let mut closed = Story::new();
    let ring = [(-900.0, 20.0), (900.0, 20.0), (900.0, 60.0), (-900.0, 60.0)];
    let corners = ring.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec();
    closed.areas = vec![Area::new("A", AreaKind::Permission, corners)];
    closed.flies(9, |it| (it.surface, it.charge) = (Surface::Water, 0.34)).lands().check(&[]);
    // What cannot be undone comes last.
    let mut waits = Story::new();
    let keep_out = || vec![Area::new("A", AreaKind::KeepOut, ring.map(|(n, e)| Ned::new(n, e, 0.0)).to_vec())];
    waits.areas = keep_out();
    waits.flies(9, |it| it.surface = Surface::Water).lands().check(&[Rule::Landing]);
    // A hot battery reaches a place that is open, and waits for none.
    let hot = |areas: Vec<Area>| {
        let mut hot = Story { areas, ..Story::new() };
        hot.manager.acting = "battery_hot".into();
        hot.flies(9, |it| it.surface = Surface::People).lands()
    };
    hot(Vec::new()).check(&[Rule::Landing]);
    hot(keep_out()).check(&[]);
    let mut ordered = Story::new();
    ordered.manager.acting = "operator_land".into();
    ordered.flies(9, |it| it.surface = Surface::Water).lands().check(&[]);
    let drops = |surface: Surface| {
        Story::new().flies(9, |_| {}).flies(2, move |it| (it.surface, it.holds_load) = (surface, false))
    };
    drops(Surface::People).check(&[Rule::Landing]);
    drops(Surface::Water).check(&[]);
}

#[test]
fn it_comes_down_with_the_reserve_as_long_as_it_could() {
    let waits = |until: f64| Story::new().flies(60, |_| {}).flies(5, move |it| it.charge = until).lands();
    waits(0.15).check(&[Rule::Reserve]);
    waits(0.24).check(&[]);
    let mut troubled = Story::new().flies(60, |_| {});
    troubled.rules.troubled();
    troubled.flies(5, |it| it.charge = 0.15).lands().check(&[]);
}

#[test]
fn an_upload_opens_nothing_that_the_tower_has_closed() {
    let corners = [(-50.0, 50.0), (50.0, 50.0), (50.0, 150.0), (-50.0, 150.0)];
    let area = Area::new("A", AreaKind::Permission, corners.map(|(n, e)| Ned::new(n, e, 0.0)).to_vec());
    let uploads = |state: v1::PermissionState| {
        let mut story = Story::new();
        let permission = v1::Permission { area: "A".into(), state: state as i32, ..Default::default() };
        story.permissions.insert("A".into(), permission);
        story.hear(v1::MissionStatus { areas: vec![(&area).into()], ..Default::default() });
        story.hear(v1::MissionStatus::default());
        story.flies(9, |_| {})
    };
    uploads(v1::PermissionState::Denied).check(&[Rule::Upload]);
    uploads(v1::PermissionState::Revoked).check(&[Rule::Upload]);
    uploads(v1::PermissionState::Requested).check(&[]);
}
