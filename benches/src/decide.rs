//! What one decision of the mission manager costs, by the shipped table. `cargo bench -p benchmarks --bench decide` measures it.
//!
//! The decision's file is compiled here alone, which holds it to what it claims: it is a function, and knows nothing of the manager.

#[path = "../../services/deliberation/mcm/src/decide.rs"]
#[allow(dead_code)]
mod decide;
#[path = "../../services/deliberation/mcm/tests/rig/mod.rs"]
#[allow(dead_code)]
mod rig;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use decide::{Inputs, PlanStage, Progress, Stage};
use domain::contingency::{Moment, Phase, Raised, Severity};
use domain::situation::Situation;

fn deciding(criterion: &mut Criterion) {
    let (_, table) = rig::shipped_table();
    let rows = table.rows();
    let number = |flag| rows.iter().position(|it| it.flag == flag).expect("it has a row");
    let (obstacle, ordered) = (number("obstacle"), number("operator_return"));
    let moment = Moment { situation: Situation::Flying, phase: Phase::Cruise };
    let progress = Progress { stage: Stage::Begun, plan: PlanStage::Flown, order: None };
    let up = |row| Raised { row, overrides: false, is_overridden: false, under_way: None };
    let known = |row| Raised { overrides: row == ordered, is_overridden: true, ..up(row) };
    let cases: [(&str, Vec<Raised>); 6] = [
        ("no flag", Vec::new()),
        ("one flag", vec![up(obstacle)]),
        ("one that is answered", vec![Raised { under_way: Some(Severity::Hold), ..up(obstacle) }]),
        ("every eighth flag", (0..rows.len()).step_by(8).map(up).collect()),
        ("every flag", (0..rows.len()).map(up).collect()),
        ("every flag, and an order with override", (0..rows.len()).map(known).collect()),
    ];
    for (name, raised) in cases {
        let inputs = Inputs { raised, moment, progress };
        criterion.bench_function(&format!("decide: {name}"), |bench| {
            bench.iter(|| decide::decide(black_box(&inputs), black_box(rows)));
        });
    }
}

criterion_group!(benches, deciding);
criterion_main!(benches);
