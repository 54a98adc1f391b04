//! What a plan costs among many areas: the first one, from the request to the reply, as areas and corners grow.
//!
//! The areas stand in rows, as polygons between which there is room to fly; the mission leads across them all, at an
//! angle, so that no row is open. `cargo bench -p planner`.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use domain::area::{Area, AreaKind};
use domain::energy::EnergyModel;
use domain::geometry::Ned;
use domain::mission::{Mission, Objective};
use domain::time::{Now, Pace};
use kittiwake_proto::topics::{Request, Response};
use kittiwake_proto::v1;
use node::{Effect, Event, Node, Token};
use planner::Planner;
use planner::config::Config;

/// Metres from one area to the next.
const APART_M: f64 = 300.0;
/// Metres from an area's centre to its farthest corners.
const RADIUS_M: f64 = 120.0;

#[derive(serde::Deserialize)]
struct Shipped {
    planner: Config,
    energy: EnergyModel,
}

fn config() -> Shipped {
    let text = include_str!("../../../../config/kittiwake.toml");
    toml::from_str::<Shipped>(text).expect("the shipped configuration is one")
}

/// Every fifth area asks for a permission; the others are closed.
fn area(index: usize, columns: usize, corners: usize, star: bool) -> Area {
    let (row, column) = (index / columns, index % columns);
    let shift_m = if row.is_multiple_of(2) { 0.0 } else { APART_M / 2.0 };
    let corner = |corner: usize| {
        let angle = TAU * corner as f64 / corners as f64;
        // A star has corners that a way may touch from many sides, a circle none.
        let distance_m = RADIUS_M * if star && corner.is_multiple_of(2) { 0.9 } else { 1.0 };
        let (north, east) = (APART_M * row as f64, APART_M * column as f64 + shift_m);
        Ned::new(north + distance_m * angle.cos(), east + distance_m * angle.sin(), 0.0)
    };
    Area {
        name: format!("area {index}"),
        kind: if index.is_multiple_of(5) { AreaKind::Permission } else { AreaKind::KeepOut },
        corners: (0..corners).map(corner).collect(),
        floor_m: None,
        ceiling_m: None,
        from_utc_ms: None,
        until_utc_ms: None,
    }
}

/// A planner for a mission from one end of the areas to the other.
fn planner(config: &Shipped, areas: usize, corners: usize, star: bool) -> Planner {
    let columns = (areas as f64).sqrt().ceil() as usize;
    let end_m = APART_M * columns as f64 - 100.0;
    let there = Objective {
        name: "there".into(),
        position: Ned::new(end_m, end_m * 0.8, 0.0),
        flying: false,
        terms: Default::default(),
        survey: None,
    };
    let areas = (0..areas).map(|it| area(it, columns, corners, star)).collect();
    let mission = Mission { name: "across".into(), objectives: vec![there], areas, order: Default::default() };
    Planner::new(&config.planner, &config.energy, mission, Pace::REAL_TIME)
}

/// The steps of the plan that the planner makes for a vehicle before the first area.
fn plan(planner: &mut Planner, id: usize) -> usize {
    let position = Some(v1::Ned { north_m: -200.0, east_m: -200.0, down_m: 0.0 });
    let state = Some(v1::PlanningState { position, ..Default::default() });
    let request = v1::ReplanRequest { request_id: id.to_string(), state, ..Default::default() };
    let event = Event::Request { vehicle: "uav1".into(), token: Token(1), request: Request::Replan(request) };
    let mut effects = Vec::new();
    planner.on(Now::default(), event, &mut effects);
    let steps = effects.into_iter().find_map(|it| match it {
        Effect::Reply { response: Response::Replan(reply), .. } => match reply.reply {
            Some(v1::replan_reply::Reply::Plan(plan)) => Some(plan.steps.len()),
            other => panic!("{other:?}"),
        },
        _ => None,
    });
    steps.filter(|it| 3 < *it).expect("a plan with turns")
}

fn first_plans(criterion: &mut Criterion) {
    let config = config();
    let mut group = criterion.benchmark_group("first plan");
    group.sample_size(10).warm_up_time(Duration::from_millis(500));
    let circles = [(10, 20), (35, 20), (100, 20), (300, 20), (1000, 20), (10, 100), (100, 100)];
    let stars = [(35, 20), (100, 20)];
    let worlds = circles.map(|it| (it, false)).into_iter().chain(stars.map(|it| (it, true)));
    for ((areas, corners), star) in worlds {
        let shape = if star { "stars" } else { "circles" };
        group.bench_function(BenchmarkId::from_parameter(format!("{areas} {shape} of {corners} corners")), |bencher| {
            bencher.iter_batched_ref(
                || planner(&config, areas, corners, star),
                |planner| black_box(plan(planner, 0)),
                criterion::BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, first_plans);
criterion_main!(benches);
