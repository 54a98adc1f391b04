//! With any areas: no plan enters an area that it may not enter.

use std::collections::BTreeSet;

use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::mission::Objective;
use geo::ConvexHull;
use proptest::prelude::*;

use super::*;
use crate::actions::Action;
use crate::mission_planner::{Answer, MissionPlanner, Question};
use crate::plan::{action, flight_time};
use domain::airspace::{Grants, stays};
use domain::plan::Step;
use domain::plan::{Denial, DenialKind, Failure};
use domain::state::State;

fn spot() -> impl Strategy<Value = Ned> {
    (-300.0..300.0, -300.0..300.0).prop_map(|(north, east)| Ned::new(north, east, 0.0))
}

/// Convex, of random size, place, kind and heights.
fn area_like(index: usize) -> impl Strategy<Value = Area> {
    let corners = proptest::collection::vec((-150.0..150.0, -150.0..150.0), 3..8);
    let band = prop_oneof![Just(None), (0.0..40.0, 5.0..40.0).prop_map(Some)];
    let keep_out = proptest::bool::weighted(0.2);
    let any_area = (spot(), corners, keep_out, band).prop_map(move |(centre, corners, keep_out, band)| {
        let points: geo::MultiPoint = corners.into_iter().collect();
        let hull = points.convex_hull();
        let corner = |it: &geo::Coord| Ned::new(centre.north_m + it.y, centre.east_m + it.x, 0.0);
        let kind = if keep_out { AreaKind::KeepOut } else { AreaKind::Permission };
        Area {
            floor_m: band.map(|(floor, _)| floor),
            ceiling_m: band.map(|(floor, thickness)| floor + thickness),
            ..Area::new(format!("area {index}"), kind, hull.exterior().coords().skip(1).map(corner).collect())
        }
    });
    any_area.prop_filter("not an area", Area::is_simple)
}

fn areas() -> impl Strategy<Value = Vec<Area>> {
    (0..5usize).prop_flat_map(|count| (0..count).map(area_like).collect::<Vec<_>>())
}

fn mission_among(areas: &[Area], goal: Ned) -> Mission {
    let objectives = vec![Objective {
        name: "there".into(),
        position: goal,
        flying: false,
        terms: Default::default(),
        survey: None,
    }];
    let (areas, sites) = (areas.to_vec(), Vec::new());
    Mission {
        name: "random".into(),
        objectives,
        areas,
        order: Default::default(),
        sites,
        origin: None,
        feeds: Vec::new(),
    }
}

fn planner(areas: &[Area], goal: Ned) -> MissionPlanner {
    // Hardly any wait is expected, so that areas are asked for rather than flown round.
    let rules = Rules::of(Config { expected_wait_s: 0.01.try_into().unwrap(), ..Config::for_tests() });
    MissionPlanner::new(&rules, mission_among(areas, goal), Pace::REAL_TIME)
}

fn from(position: Ned, held: &BTreeSet<String>) -> Question {
    let state = State { permissions: held.clone(), ..State::new(position, position.down_m != 0.0) };
    Question { state, grants: Grants::new(), failed: None, denials: Vec::new() }
}

/// No step enters an area that is neither held nor asked for in an earlier step, or a keep-out
/// area; only what the vehicle started in may be left, by at most a climb and a leg.
fn assert_allowed(steps: &[Step], areas: &[Area], held: &BTreeSet<String>) -> Result<(), TestCaseError> {
    let margin_m = Rules::for_tests().aircraft.flight.vertical_margin_m.get();
    let start = steps[0].way().0;
    let is_allowed =
        |area: &Area, allowed: &BTreeSet<String>| area.kind == AreaKind::Permission && allowed.contains(&area.name);
    let is_inside = |area: &Area, at: Ned| !stays(area, at, at, margin_m).is_empty();
    let airborne = action(&steps[0]) != Action::Takeoff && start.down_m != 0.0;
    let trespassed: Vec<&Area> =
        areas.iter().filter(|it| airborne && !is_allowed(it, held) && is_inside(it, start)).collect();
    let mut allowed = held.clone();
    let mut is_leaving = !trespassed.is_empty();
    for (index, step) in steps.iter().enumerate() {
        let (from, to) = step.way();
        for area in areas.iter().filter(|it| !is_allowed(it, &allowed)) {
            let is_left = is_leaving && trespassed.iter().any(|it| it.name == area.name);
            let entered = stays(area, from, to, margin_m).into_iter().find(|stay| !is_left || stay.enters > 0.0);
            let waits_below = action(step) == Action::Stop && from.down_m == 0.0;
            prop_assert!(waits_below || entered.is_none(), "{step:?} enters {area:?}");
        }
        is_leaving &= trespassed.iter().any(|it| is_inside(it, to));
        prop_assert!(!is_leaving || index == 0, "{step:?} does not lead out of {trespassed:?}");
        allowed.extend(step.ask.iter().map(|need| need.area.clone()));
    }
    Ok(())
}

/// What is asked for ahead is what a later step needs, at the lead time before its border, and no step before asks for: that is what coming back
/// needs, which is asked for before the takeoff, and for long enough.
fn assert_asked_ahead(steps: &[Step]) -> Result<(), TestCaseError> {
    let lasts = |step: &Step, area: &str| Some(step.ask.iter().find(|it| it.area == area)?.lasts);
    let rules = Rules::for_tests();
    let mut begins = vec![Duration::ZERO];
    for step in steps {
        begins.push(begins[begins.len() - 1] + flight_time(step, &rules));
    }
    let lead = rules.config.ask_ahead_s.seconds();
    let mut ahead = BTreeSet::new();
    for (during, step) in steps.iter().enumerate() {
        for it in &step.ask_ahead {
            prop_assert!(ahead.insert(it.need.area.clone()), "twice: {steps:?}");
            let needs = |step: &Step| step.ask.iter().find(|need| need.area == it.need.area).cloned();
            let later = steps.iter().enumerate().find_map(|(index, step)| Some((index, needs(step)?)));
            prop_assert!(later.is_some(), "asked for by no step: {steps:?}");
            let Some((later, need)) = later else { continue };
            let asked = begins[during] + it.after;
            prop_assert!(during < later && asked < begins[during + 1], "{steps:?}");
            prop_assert!(asked.is_zero() || asked + lead == begins[later + 1], "too early or too late: {steps:?}");
            prop_assert_eq!(it.need.lasts, need.lasts + (begins[later] - asked));
        }
    }
    for (later, step) in steps.iter().enumerate().filter(|(later, _)| !begins[*later].is_zero()) {
        let is_near = begins[later + 1] - begins[later] < lead;
        for need in &step.ask {
            let asked =
                std::iter::zip(&begins, &steps[..later]).find_map(|(at, it)| Some(*at + lasts(it, &need.area)?));
            prop_assert_eq!(ahead.contains(&need.area), is_near && asked.is_none(), "{:?}", steps);
            prop_assert!(asked.is_none_or(|until| begins[later] + need.lasts <= until), "asked for again: {steps:?}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_plan_enters_what_it_may_not(
        areas in areas(),
        start in spot(),
        goal in spot(),
        height_m in prop_oneof![Just(0.0), 5.0..50.0],
        over_goal in proptest::bool::weighted(0.1),
        held in any::<u8>(),
        denied in any::<u8>(),
    ) {
        let goal = if over_goal { start } else { goal };
        let chosen = |bits: u8| areas.iter().enumerate().filter(move |(it, _)| bits >> it & 1 == 1);
        let held: BTreeSet<String> = chosen(held).map(|(_, it)| it.name.clone()).collect();
        let denials = chosen(denied).map(|(_, it)| Denial { area: it.name.clone(), kind: DenialKind::Silent, reason: String::new() });
        let request = Question {
            denials: denials.filter(|it| !held.contains(&it.area)).collect(),
            ..from(start.at_height(height_m), &held)
        };
        let answer = planner(&areas, goal).replan(request.clone(), Now::default());
        prop_assert_eq!(&answer, &planner(&areas, goal).replan(request, Now::default()));
        if let Answer::Plan(steps) = answer {
            prop_assert!(!steps.is_empty());
            assert_allowed(&steps, &areas, &held)?;
            let rules = Rules::for_tests();
            let (least_m, highest_m) = (height_m.min(rules.aircraft.flight.least_height_m.get()), height_m.max(rules.aircraft.flight.highest_m.get()));
            for step in steps.iter().filter(|it| action(it) == Action::Position) {
                let to_m = step.way().1.height_m();
                prop_assert!((least_m..=highest_m).contains(&to_m), "{step:?}");
            }
        }
    }

    #[test]
    fn what_is_asked_for_ahead_is_what_a_later_step_needs_within_the_lead_time(
        areas in areas(),
        start in spot(),
        goal in spot(),
        height_m in prop_oneof![Just(0.0), 5.0..50.0],
        held in any::<u8>(),
    ) {
        let chosen = areas.iter().enumerate().filter(|(it, _)| held >> it & 1 == 1);
        let held: BTreeSet<String> = chosen.map(|(_, it)| it.name.clone()).collect();
        let request = from(start.at_height(height_m), &held);
        let Answer::Plan(steps) = planner(&areas, goal).replan(request, Now::default()) else { return Ok(()) };
        assert_asked_ahead(&steps)?;
    }

    #[test]
    fn no_mended_plan_enters_what_it_may_not(
        areas in areas(),
        start in spot(),
        goal in spot(),
        failing in any::<prop::sample::Index>(),
        progress in 0.0..1.0,
        answers in any::<u8>(),
    ) {
        let mut planner = planner(&areas, goal);
        let mut held = BTreeSet::new();
        let Answer::Plan(steps) = planner.replan(from(start, &held), Now::default()) else { return Ok(()) };
        let failing = failing.index(steps.len());
        for step in &steps[..failing] {
            held.extend(step.ask.iter().map(|need| need.area.clone()));
            planner.flown(step, false, &step.reaches, Now::default());
        }
        let failed = &steps[failing];
        let position = failed.way().0.towards(failed.way().1, progress);
        // Each asked area is granted, or denied, or was lost; one that was held may have been lost too.
        let bit = |index: usize| answers >> (index % 8) & 1 == 1;
        held = held.into_iter().enumerate().filter(|(it, _)| bit(*it)).map(|(_, it)| it).collect();
        let denied = failed.ask.iter().enumerate().filter(|(it, _)| bit(it + 4)).map(|(_, need)| &need.area);
        let denials = denied.map(|it| Denial { area: it.clone(), kind: if bit(2) { DenialKind::Silent } else { DenialKind::Refused }, reason: "busy".into() }).collect();
        planner.drop_first(failing);
        let failure = Failure { reason: String::new(), interrupted: false };
        let request = Question { failed: Some(failure), denials, ..from(position, &held) };
        if let Answer::Plan(steps) = planner.replan(request, Now::default()) {
            assert_allowed(&steps, &areas, &held)?;
        }
    }

    #[test]
    fn a_planner_that_has_planned_before_plans_as_a_new_one(
        areas in areas(),
        goal in spot(),
        height_m in prop_oneof![Just(0.0), 5.0..50.0],
        plans in proptest::collection::vec((spot(), any::<prop::sample::Index>(), area_like(0)), 1..5),
    ) {
        let mut areas = areas;
        let mut kept = planner(&areas, goal);
        for (start, index, changed) in plans {
            let request = from(start.at_height(height_m), &BTreeSet::new());
            let what = |answer: Answer| match answer {
                Answer::Plan(steps) => Ok(steps.iter().map(|it| (it.way(), (it.ask.clone(), it.ask_ahead.clone(), it.auxiliary))).collect::<Vec<_>>()),
                other => Err(other),
            };
            let new = what(planner(&areas, goal).replan(request.clone(), Now::default()));
            prop_assert_eq!(what(kept.replan(request, Now::default())), new);
            if !areas.is_empty() {
                let index = index.index(areas.len());
                areas[index] = Area { name: areas[index].name.clone(), ..changed };
            }
            kept.take_over(mission_among(&areas, goal));
        }
    }
}

/// Home is closed, so that coming back takes the area at the end, whose border is a few seconds from the start.
#[test]
fn what_is_asked_for_before_the_takeoff_is_not_asked_for_ahead() {
    let square = |name: &str, kind, (west, east)| {
        let corners = [(-50.0, west), (50.0, west), (50.0, east), (-50.0, east)];
        Area::new(name, kind, corners.map(|(north, east)| Ned::new(north, east, 0.0)).to_vec())
    };
    let areas = [square("home", AreaKind::KeepOut, (-50.0, 50.0)), square("end", AreaKind::Permission, (130.0, 230.0))];
    let (start, goal) = (Ned::new(0.0, 80.0, 0.0), Ned::new(0.0, 180.0, 0.0));
    let answer = planner(&areas, goal).replan(from(start, &BTreeSet::new()), Now::default());
    let Answer::Plan(steps) = answer else { panic!("{answer:?}") };
    let asks: Vec<Action> = steps.iter().filter(|it| it.asks_for("end")).map(action).collect();
    assert_eq!(asks, [Action::Stop, Action::Position]);
    assert_asked_ahead(&steps).unwrap();
}
