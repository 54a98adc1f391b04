//! From a flag to the request that answers it, in one process: what the manager itself costs.

#[path = "../tests/rig/mod.rs"]
#[allow(dead_code)]
mod rig;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use domain::geometry::Ned;
use domain::skill::Goal;
use kittiwake_proto::v1::FlightMode::Offboard;
use rig::{Rig, plan, step};

fn fly(east_m: f64) -> Goal {
    Goal::Position { target: Ned::new(0.0, east_m, -10.0), speed_limit_m_s: 10.0, yaw_rad: None, hold_at_target: false }
}

/// Flying the first of two steps, the second one fetched.
fn under_way() -> Rig {
    let mut rig = Rig::new();
    rig.plan(plan(&[step(1, fly(100.0), &[]), step(2, Goal::Land, &[])]));
    rig.execute();
    rig.next(Some(step(2, Goal::Land, &[])));
    rig.vehicle(true, Offboard, (0.0, 50.0, 10.0));
    rig
}

fn reaction(criterion: &mut Criterion) {
    criterion.bench_function("a wake with nothing new", |bench| {
        let mut rig = under_way();
        bench.iter(|| rig.vehicle(true, Offboard, (0.0, 50.0, 10.0)));
    });
    criterion.bench_function("a flag, answered with a stop", |bench| {
        bench.iter_batched_ref(under_way, |rig| rig.flag("obstacle", true), BatchSize::SmallInput);
    });
}

criterion_group!(benches, reaction);
criterion_main!(benches);
