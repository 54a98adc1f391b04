//! The tables of what the system costs: ticks, processor time, memory, rates.

use std::collections::BTreeSet;
use std::fmt::Write;

use crate::real_time::{Loads, RealTime};
use crate::{Measured, Tick};

/// Ticks and, if they were measured, loads and rates.
pub(crate) fn text(it: &Measured) -> String {
    let mut out = String::new();
    ticks(it, &mut out);
    if let Some(load) = &it.load {
        loads(load, &mut out);
        rates(load, &mut out);
    }
    out
}

fn ticks(it: &Measured, out: &mut String) {
    let _ = writeln!(out, "\nTicks of the mission manager by their duration, over the missions");
    for Tick { tick_ms, mission, .. } in &it.ticks {
        let from = |exponent: usize| format!("from {:.1} us", 2f64.powi(exponent as i32) / 1e3);
        histogram(*tick_ms, &mission.tick_histogram, from, out);
    }
}

fn histogram(tick_ms: u32, counts: &[u64], from: impl Fn(usize) -> String, out: &mut String) {
    let all: u64 = counts.iter().sum();
    let _ = write!(out, "{tick_ms:>2} ms: {all} ticks;");
    for (element, count) in counts.iter().enumerate().filter(|(_, count)| 0 < **count) {
        let _ = write!(out, "  {}: {:.2} %", from(element), 100.0 * *count as f64 / all as f64);
    }
    out.push('\n');
}

fn loads(it: &RealTime, out: &mut String) {
    let phases: [&Loads; 4] = [&it.hover, &it.mission, &it.landed, &it.silent];
    let _ = writeln!(
        out,
        "\nLoad at real time: percent of one core, megabytes resident; silent: landed, without vehicle and monitor\n\
         {:<16}{:>14}{:>18}{:>18}{:>18}",
        "", "hover", "mission", "landed", "silent"
    );
    let names: BTreeSet<_> = phases.iter().flat_map(|it| it.keys()).collect();
    for name in names {
        let _ = write!(out, "{name:<16}");
        for phase in phases {
            let _ = match phase.get(*name) {
                Some(load) => write!(out, "{:>7.1} %{:>6.1} MB ", load.cpu_percent, load.rss_mb),
                None => write!(out, "{:>17} ", "-"),
            };
        }
        out.push('\n');
    }
}

fn rates(it: &RealTime, out: &mut String) {
    let _ = writeln!(
        out,
        "\nRates at real time\n{:<32}{:>9}{:>10}{:>12}{:>12}{:>6}",
        "topic", "wanted", "achieved", "jitter p50", "p99", "lost"
    );
    for rate in &it.rates {
        let _ = writeln!(
            out,
            "{:<32}{:>6.0} Hz{:>7.2} Hz{:>9.2} ms{:>9.2} ms{:>6}",
            rate.topic, rate.wanted_hz, rate.achieved_hz, rate.jitter_p50_ms, rate.jitter_p99_ms, rate.lost
        );
    }
}
