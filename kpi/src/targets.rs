//! What was found against what is wanted, the worst tick period speaking for all: 10 ms has to be as
//! good as 1 ms.

use std::fmt::Write;

use kittiwake::composition::ONBOARD;

use crate::analysis::{Class, Samples};
use crate::real_time::Loads;
use crate::statistics::Statistics;
use crate::table::{reaction_ways, totals};
use crate::{Measured, Tick};

/// Found at each tick period, or once.
struct Row {
    name: &'static str,
    unit: &'static str,
    found: Vec<f64>,
    at_most: f64,
}

/// The table; only of what was measured.
pub(crate) fn text(it: &Measured) -> String {
    let mut out = format!("\nAgainst the targets\n{:<52}{:>10}{:>22}\n", "", "target", "found (range)");
    for Row { name, unit, found, at_most } in rows(it).iter().filter(|it| !it.found.is_empty()) {
        let least = found.iter().copied().fold(f64::INFINITY, f64::min);
        let most = found.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let range = if least == most { format!("{most:.3}") } else { format!("{least:.3} to {most:.3}") };
        let verdict = if most <= *at_most { "met" } else { "MISSED" };
        let _ = writeln!(out, "{name:<52}{:>10}{range:>22} {unit:<3}{verdict:>7}", format!("<= {at_most}"));
    }
    out
}

fn rows(it: &Measured) -> Vec<Row> {
    let row = |name, unit, at_most, found| Row { name, unit, found, at_most };
    let classes = figures(it, |tick| [Class::N2N, Class::N2T, Class::T2N].map(|it| tick.mission.of_class(it)).to_vec());
    let actions = figures(it, |tick| [&tick.flat, &tick.nested].map(tick_to_action).to_vec());
    let transitions = figures(it, |tick| vec![totals(&tick.mission.felt_transitions)]);
    let reactions = figures(it, |tick| [&tick.flat, &tick.nested].map(|it| totals(&reaction_ways(it))).to_vec());
    let all = |figures: &[Statistics], pick: fn(&Statistics) -> f64| figures.iter().map(pick).collect::<Vec<f64>>();
    let floor = it.floor.as_ref().and_then(|it| Statistics::of(&totals(&it.felt_transitions)));
    let to_floor = |figures: &[Statistics]| match &floor {
        Some(floor) => figures.iter().map(|it| it.p50 / floor.p50).collect(),
        None => Vec::new(),
    };
    let mut rows = vec![
        row("N2N, N2T, T2N, mean", "ms", 0.5, all(&classes, |it| it.mean * 1e3)),
        row("the same, max", "ms", 5.0, all(&classes, |it| it.max * 1e3)),
        row("transition, felt, median", "ms", 1.0, all(&transitions, |it| it.p50 * 1e3)),
        row("transition, felt, p99", "ms", 5.0, all(&transitions, |it| it.p99 * 1e3)),
        row("transition, felt, median / floor's median", "", 2.0, to_floor(&transitions)),
        row("flag -> action inside the manager, mean", "us", 5.0, all(&actions, |it| it.mean * 1e6)),
        row("reaction, felt, median", "ms", 0.6, all(&reactions, |it| it.p50 * 1e3)),
        row("reaction, felt, p99", "ms", 3.0, all(&reactions, |it| it.p99 * 1e3)),
        row("reaction, felt, median / floor's median", "", 2.0, to_floor(&reactions)),
    ];
    let Some(load) = &it.load else { return rows };
    let introspection = load.rates.iter().filter(|it| it.topic == "monitor/introspection");
    let off = introspection.clone().map(|it| (it.achieved_hz / it.wanted_hz - 1.0).abs() * 100.0).collect();
    let jitter = introspection.map(|it| it.jitter_p99_ms).collect();
    let (cpu, rss) = [&load.hover, &load.mission].into_iter().filter_map(onboard).unzip();
    let idle: f64 = load.silent.values().map(|it| it.cpu_percent).sum();
    let idle = Some(idle).filter(|_| !load.silent.is_empty()).into_iter().collect();
    rows.extend([
        row("introspection, off its 100 Hz", "%", 1.0, off),
        row("introspection, jitter, p99", "ms", 2.0, jitter),
        row("mcm, planner, skill-manager, monitor and router", "%", 30.0, cpu),
        row("the same, resident", "MB", 120.0, rss),
        row("landed, without topics of fixed rates: all", "%", 3.0, idle),
    ]);
    rows
}

/// The figures of each set of samples at each tick period; none of an empty one.
fn figures(it: &Measured, samples: impl Fn(&Tick) -> Vec<Vec<f64>>) -> Vec<Statistics> {
    it.ticks.iter().flat_map(samples).filter_map(|it| Statistics::of(&it)).collect()
}

fn tick_to_action(samples: &Samples) -> Vec<f64> {
    samples.reactions.iter().map(|it| it.tick_to_action_s).collect()
}

/// Processor time and memory of what flies along, without the simulator. Those that run in one process count once.
fn onboard(loads: &Loads) -> Option<(f64, f64)> {
    let flown = ["mcm", "planner", "skill-manager", "monitor", ONBOARD];
    let loads: Vec<_> = [loads.get("router")?].into_iter().chain(flown.iter().filter_map(|it| loads.get(it))).collect();
    Some((loads.iter().map(|it| it.cpu_percent).sum(), loads.iter().map(|it| it.rss_mb).sum()))
}
