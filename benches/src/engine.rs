//! The engine compared with BehaviorTree.CPP 4.10, on the tree of a mission manager.
//!
//! The table printed at the end uses the method of the figures for BehaviorTree.CPP: the median of a round, and of twenty
//! rounds the least median, which is repeatable on a machine that has other load.
//!
//! The written figures of BehaviorTree.CPP come from another machine, and which commit of 4.10 they were measured with is
//! not recorded: they give an order of magnitude. Where `BTCPP_BENCH` names a program that is linked with BehaviorTree.CPP
//! and prints lines of a row's name, a tab and microseconds, the table has its figures, measured on this machine in the
//! same minute. `cargo bench -p benchmarks --bench engine` runs it.

#![expect(clippy::disallowed_methods, reason = "a bench measures time")]

#[path = "../../crates/behavior-tree/tests/it/reference.rs"]
mod reference;

use std::collections::HashMap;
use std::hint::black_box;
use std::process::Command;
use std::time::{Duration, Instant};

use behavior_tree::{Library, Status};
use criterion::Criterion;

use reference::{World, conditions_xml, flying, goal, mission_xml, react, registry, step_xml, template};

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    reactions(&mut criterion);
    steps(&mut criterion);
    ticks(&mut criterion);
    loading(&mut criterion);
    criterion.final_summary();
    table();
}

fn reactions(criterion: &mut Criterion) {
    for (name, nested) in [("reaction/16 flags flat", false), ("reaction/4 groups of 4", true)] {
        criterion.bench_function(name, |bencher| {
            bencher.iter_custom(|iterations| {
                let (mut tree, mut world) = flying(nested);
                (0..iterations).map(|number| react(&mut tree, &mut world, number as usize % reference::FLAGS)).sum()
            });
        });
    }
}

fn steps(criterion: &mut Criterion) {
    for (name, with_requests) in [("standalone", false), ("with three requests", true)] {
        let template = template(&step_xml(with_requests), "Step");
        let mut world = World::default();
        criterion.bench_function(&format!("step from template and first tick/{name}"), |bencher| {
            bencher.iter_with_large_drop(|| {
                let mut step = template.instantiate(&[("goal", goal())]).expect("it fits");
                step.tick_once(Duration::ZERO, &mut world);
                step
            });
        });
        let mut step = template.instantiate(&[("goal", goal())]).expect("it fits");
        criterion.bench_function(&format!("halt of a running step/{name}"), |bencher| {
            bencher.iter_custom(|iterations| {
                (0..iterations)
                    .map(|_| {
                        step.tick_once(Duration::ZERO, &mut world);
                        timed(|| step.halt(Duration::ZERO, &mut world))
                    })
                    .sum()
            });
        });
    }
}

fn ticks(criterion: &mut Criterion) {
    let (mut tree, mut world) = flying(false);
    criterion.bench_function("steady nominal tick", |bencher| {
        bencher.iter(|| tree.tick_once(Duration::ZERO, &mut world));
    });
    for count in [1_000, 10_000] {
        let mut tree = template(&conditions_xml(count), "Wide").instantiate(&[]).expect("no parameters");
        criterion.bench_function(&format!("tick of {count} conditions"), |bencher| {
            bencher.iter(|| tree.tick_once(Duration::ZERO, &mut world));
        });
    }
}

fn loading(criterion: &mut Criterion) {
    let registry = registry();
    for count in [1_000, 10_000] {
        let xml = conditions_xml(count);
        criterion.bench_function(&format!("loading {count} nodes"), |bencher| {
            bencher.iter(|| Library::load(&registry, [("wide.xml", xml.as_str())]).map(black_box).is_ok());
        });
    }
    let xml = mission_xml(false);
    criterion.bench_function("loading the mission manager's tree", |bencher| {
        bencher.iter(|| Library::load(&registry, [("mission.xml", xml.as_str())]).map(black_box).is_ok());
    });
}

fn timed(action: impl FnOnce()) -> Duration {
    let start = Instant::now();
    action();
    start.elapsed()
}

/// The least median of twenty rounds, in microseconds.
fn least_median(samples: usize, mut sample: impl FnMut() -> Duration) -> f64 {
    let mut medians: Vec<Duration> = (0..20)
        .map(|_| {
            let mut round: Vec<Duration> = (0..samples).map(|_| sample()).collect();
            round.sort();
            round[samples / 2]
        })
        .collect();
    medians.sort();
    medians[0].as_secs_f64() * 1e6
}

/// The mean over the flags, and the slowest flag.
fn reaction_times(nested: bool) -> (f64, f64) {
    let (mut tree, mut world) = flying(nested);
    let of_flags: Vec<f64> =
        (0..reference::FLAGS).map(|flag| least_median(200, || react(&mut tree, &mut world, flag))).collect();
    (of_flags.iter().sum::<f64>() / of_flags.len() as f64, of_flags.iter().copied().fold(0.0, f64::max))
}

fn building_time(with_requests: bool, from_text: bool) -> f64 {
    let (registry, xml) = (registry(), step_xml(with_requests));
    let parsed = template(&xml, "Step");
    let mut world = World::default();
    least_median(500, || {
        let start = Instant::now();
        let loaded = from_text.then(|| Library::load(&registry, [("step.xml", xml.as_str())]).expect("it loads"));
        let template = loaded.and_then(|library| library.template("Step")).unwrap_or_else(|| parsed.clone());
        let mut step = template.instantiate(&[("goal", goal())]).expect("it fits");
        assert_eq!(step.tick_once(Duration::ZERO, &mut world), Status::Running);
        start.elapsed()
    })
}

fn halting_time(with_requests: bool) -> f64 {
    let mut world = World::default();
    let mut step = template(&step_xml(with_requests), "Step").instantiate(&[("goal", goal())]).expect("it fits");
    least_median(1000, || {
        step.tick_once(Duration::ZERO, &mut world);
        timed(|| step.halt(Duration::ZERO, &mut world))
    })
}

/// Many ticks in each sample, because one is shorter than a reading of the clock.
fn steady_time() -> f64 {
    let (mut tree, mut world) = flying(false);
    let many = 100;
    least_median(100, || {
        timed(|| {
            for _ in 0..many {
                black_box(tree.tick_once(Duration::ZERO, &mut world));
            }
        }) / many
    })
}

fn wide_time(count: usize) -> f64 {
    let mut tree = template(&conditions_xml(count), "Wide").instantiate(&[]).expect("no parameters");
    let mut world = World::default();
    least_median(50, || {
        timed(|| {
            black_box(tree.tick_once(Duration::ZERO, &mut world));
        })
    })
}

fn loading_time(count: usize) -> f64 {
    let (registry, xml) = (registry(), conditions_xml(count));
    least_median(3, || timed(|| drop(black_box(Library::load(&registry, [("wide.xml", xml.as_str())])))))
}

/// The figures that the program in `BTCPP_BENCH` prints, by row.
fn measured_reference() -> Option<HashMap<String, String>> {
    let program = std::env::var_os("BTCPP_BENCH")?;
    let output = Command::new(&program).output();
    let output = output.unwrap_or_else(|error| panic!("BTCPP_BENCH: {} cannot be run: {error}", program.display()));
    assert!(output.status.success(), "BTCPP_BENCH: {} ended with {}", program.display(), output.status);
    let lines = String::from_utf8_lossy(&output.stdout);
    let figures = lines.lines().filter_map(|line| line.split_once('\t'));
    Some(figures.map(|(name, micros)| (name.to_owned(), micros.trim().to_owned())).collect())
}

fn table() {
    let (flat, nested) = (reaction_times(false), reaction_times(true));
    let rows = [
        ("reaction, 16 flags flat: mean", "8.3", flat.0, "1.5"),
        ("reaction, 16 flags flat: worst flag", "12.3", flat.1, ""),
        ("reaction, 4 groups of 4: mean", "6.4", nested.0, "1.0"),
        ("reaction, 4 groups of 4: worst flag", "8.0", nested.1, ""),
        ("step from XML text + first tick: standalone", "42", building_time(false, true), ""),
        ("step from XML text + first tick: three requests", "66", building_time(true, true), ""),
        ("step from template + first tick: standalone", "17", building_time(false, false), "2"),
        ("step from template + first tick: three requests", "28", building_time(true, false), "4"),
        ("halt of a running step: standalone", "1.0", halting_time(false), "0.2"),
        ("halt of a running step: three requests", "2.6", halting_time(true), "0.2"),
        ("steady nominal tick", "3.6", steady_time(), "0.7"),
        ("tick of 1,000 conditions", "318", wide_time(1_000), "30"),
        ("tick of 10,000 conditions", "8770", wide_time(10_000), "500"),
        ("loading 1,000 nodes", "", loading_time(1_000), ""),
        ("loading 10,000 nodes", "", loading_time(10_000), "640"),
    ];
    let measured = measured_reference();
    let source = if measured.is_some() { "on this machine" } else { "4.10, other machine" };
    println!("\nBehaviorTree.CPP: {source}");
    println!("{:<50} {:>20} {:>12} {:>10}", "microseconds", "BehaviorTree.CPP", "this engine", "target");
    for (name, written, ours, target) in rows {
        let theirs = match &measured {
            Some(figures) => figures.get(name).map_or("", String::as_str),
            None => written,
        };
        println!("{name:<50} {theirs:>20} {ours:>12.2} {target:>10}");
    }
}
