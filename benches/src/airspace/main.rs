//! What a plan costs among many areas, from the request to the reply: as areas and corners grow, as areas have floors and ceilings,
//! and after one area has changed; what the mission manager's way home costs, and a plain A* beside it. `cargo bench -p benchmarks --bench airspace`
//! measures it.

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, BenchmarkId, Criterion, criterion_group, criterion_main};
use domain::area_map::AreaMap;
use kittiwake_proto::v1::ReplanRequest;

mod plain_a_star;
mod world;

use world::{Heights, World, denied, first_request, plan, way_home, with_area_moved};

fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    group
}

fn name_of(world: World) -> BenchmarkId {
    let World { areas, corners, shape, .. } = world;
    BenchmarkId::from_parameter(format!("{areas} {} of {corners} corners", format!("{shape:?}").to_lowercase()))
}

fn bench_first_plan(group: &mut BenchmarkGroup<WallTime>, id: BenchmarkId, world: World) {
    let request = first_request(world);
    group.bench_function(id, |bencher| {
        let search = |planner: &mut _| black_box(plan(planner, request.clone()));
        bencher.iter_batched_ref(|| world.planner(), search, BatchSize::LargeInput);
    });
}

fn first_plans(criterion: &mut Criterion) {
    let mut group = group(criterion, "first plan");
    let circles = [(10, 20), (35, 20), (100, 20), (300, 20), (1000, 20), (10, 100), (35, 100), (100, 100), (300, 100)];
    let stars = [(35, 20), (100, 20)];
    let circles = circles.map(|(areas, corners)| World::circles(areas, corners));
    let stars = stars.map(|(areas, corners)| World::stars(areas, corners));
    for world in circles.into_iter().chain(stars).chain([World::LARGEST]) {
        bench_first_plan(&mut group, name_of(world), world);
    }
}

fn floors_and_ceilings(criterion: &mut Criterion) {
    let mut group = group(criterion, "floors and ceilings");
    for world in [World::circles(35, 20), World::circles(100, 20), World::circles(100, 100), World::circles(1000, 20)] {
        for heights in [Heights::All, Heights::Ceilings, Heights::Floors, Heights::Bands] {
            let World { areas, corners, .. } = world;
            let id = BenchmarkId::new(format!("{heights:?}").to_lowercase(), format!("{areas} of {corners} corners"));
            bench_first_plan(&mut group, id, World { heights, ..world });
        }
    }
}

/// The vehicle has come to the border of the first area that it asks for, and is denied it for good.
fn replans(criterion: &mut Criterion) {
    let mut group = group(criterion, "replan");
    for world in [World::circles(35, 20), World::circles(100, 20), World::circles(1000, 20), World::circles(100, 100)] {
        let has_planned = || {
            let mut planner = world.planner();
            let steps = plan(&mut planner, first_request(world));
            (planner, denied(world, &steps))
        };
        group.bench_function(name_of(world), |bencher| {
            let search = |(planner, request): &mut (_, _)| black_box(plan(planner, std::mem::take(request)));
            bencher.iter_batched_ref(has_planned, search, BatchSize::LargeInput);
        });
    }
}

/// The same request again, with nothing changed.
fn repeated_plans(criterion: &mut Criterion) {
    let mut group = group(criterion, "repeated plan");
    for world in [World::circles(35, 20), World::circles(100, 20), World::circles(1000, 20), World::circles(100, 100)] {
        let mut planner = world.planner();
        let mut ids = 0..u64::MAX;
        group.bench_function(name_of(world), |bencher| {
            bencher.iter(|| {
                let request_id = ids.next().map(|it| it.to_string()).unwrap_or_default();
                black_box(plan(&mut planner, ReplanRequest { request_id, ..first_request(world) }))
            });
        });
    }
}

/// One area in the middle has moved by a metre since the plan before, which began at the same place.
fn changed_areas(criterion: &mut Criterion) {
    let mut group = group(criterion, "one area changed");
    let circles = [(10, 20), (35, 20), (100, 20), (300, 20), (1000, 20), (10, 100), (35, 100), (100, 100), (300, 100)];
    let stars = [World::stars(35, 20), World::stars(100, 20)];
    let circles = circles.map(|(areas, corners)| World::circles(areas, corners));
    for world in circles.into_iter().chain(stars).chain([World::LARGEST]) {
        let request = with_area_moved(world);
        let has_planned = || {
            let mut planner = world.planner();
            plan(&mut planner, first_request(world));
            planner
        };
        group.bench_function(name_of(world), |bencher| {
            let search = |planner: &mut _| black_box(plan(planner, request.clone()));
            bencher.iter_batched_ref(has_planned, search, BatchSize::LargeInput);
        });
    }
}

/// The way of a response, among areas that were not seen before, and again.
fn ways_home(criterion: &mut Criterion) {
    let mut group = group(criterion, "way home");
    for world in [World::circles(35, 20), World::circles(100, 20), World::circles(1000, 20), World::circles(100, 100)] {
        let areas = world.all_areas();
        let first = |map: &mut AreaMap| black_box(way_home(world, &areas, map));
        group.bench_function(name_of(world), |bencher| {
            bencher.iter_batched_ref(|| AreaMap::new(&areas), first, BatchSize::LargeInput);
        });
        let map = AreaMap::new(&areas);
        let id = format!("again, {} of {} corners", world.areas, world.corners);
        group.bench_function(id, |bencher| bencher.iter(|| black_box(way_home(world, &areas, &map))));
    }
}

/// Home lies in a fence that is closed all round: the search ends with its effort, in the loop that answers flags.
fn no_way_home(criterion: &mut Criterion) {
    let mut group = group(criterion, "no way home");
    group.sample_size(10);
    for world in [World::circles(100, 20), World::circles(1000, 20), World::circles(100, 100)] {
        let mut areas = world.all_areas();
        areas.push(world.fence());
        let search = |map: &mut AreaMap| assert!(black_box(way_home(world, &areas, map)).is_none());
        group.bench_function(name_of(world), |bencher| {
            bencher.iter_batched_ref(|| AreaMap::new(&areas), search, BatchSize::LargeInput);
        });
    }
}

fn plain_a_star(criterion: &mut Criterion) {
    let mut group = group(criterion, "plain A*");
    group.sample_size(10);
    for world in [World::circles(10, 20), World::circles(35, 20), World::circles(100, 20)] {
        let areas = world.all_areas();
        group.bench_function(name_of(world), |bencher| bencher.iter(|| black_box(plain_a_star::legs(world, &areas))));
    }
}

criterion_group!(
    benches,
    first_plans,
    floors_and_ceilings,
    replans,
    changed_areas,
    repeated_plans,
    ways_home,
    no_way_home,
    plain_a_star
);
criterion_main!(benches);
