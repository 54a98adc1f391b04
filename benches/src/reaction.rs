//! From a flag to the request that answers it, in one process: the time that the manager itself takes.
//! `cargo bench -p benchmarks --bench reaction` measures it.

#[path = "../../services/deliberation/mcm/tests/rig/mod.rs"]
#[allow(dead_code)]
mod rig;

use std::hint::black_box;
use std::time::Duration;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use domain::geometry::Ned;
use domain::skill::Goal;
use kittiwake_proto::v1::FlightMode::Offboard;
use kittiwake_proto::v1::{LeafChange, NodeStatus};
use rig::{Rig, plan, step};

fn fly(east_m: f64) -> Goal {
    Goal::Position { target: Ned::new(0.0, east_m, -10.0), speed_limit_m_s: 10.0, yaw_rad: None, hold_at_target: false }
}

/// In flight with the first of two steps; the second one is fetched.
fn under_way() -> Rig {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(100.0), &[]), step(2, Goal::Land, &[])]));
    rig.execute();
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig
}

/// From the beginning of the tick that sees the flag to the start of its action, by the manager's own record.
fn tick_to_action(rig: &mut Rig) -> Duration {
    rig.flag("obstacle", true);
    let started = |change: &&LeafChange| change.kind == "Stop" && change.after() == NodeStatus::Running;
    let action = rig.timing.changes.iter().find(started).expect("the flag is answered");
    Duration::from_nanos(action.at_ns - rig.timing.ticked_ns)
}

fn reaction(criterion: &mut Criterion) {
    criterion.bench_function("a wake with nothing new", |bench| {
        let mut rig = under_way();
        bench.iter(|| rig.vehicle(true, Offboard, (0.0, 50.0, 10.0)));
    });
    criterion.bench_function("a flag, answered with a stop", |bench| {
        bench.iter_batched_ref(under_way, |rig| rig.flag("obstacle", true), BatchSize::SmallInput);
    });
    criterion.bench_function("beginning of the tick to action", |bench| {
        bench.iter_custom(|rounds| (0..rounds).map(|_| tick_to_action(&mut under_way())).sum());
    });
    // In flight, other processes use the caches between two wakes.
    let others = vec![1u8; 64 << 20];
    let mut group = criterion.benchmark_group("out of the caches");
    group.sample_size(20).measurement_time(Duration::from_secs(5));
    group.bench_function("beginning of the tick to action", |bench| {
        bench.iter_custom(|rounds| {
            let once = |_| {
                let mut rig = under_way();
                black_box(others.iter().step_by(64).map(|it| u64::from(*it)).sum::<u64>());
                tick_to_action(&mut rig)
            };
            (0..rounds).map(once).sum()
        });
    });
    group.finish();
}

criterion_group!(benches, reaction);
criterion_main!(benches);
