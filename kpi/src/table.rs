//! The tables as text.

use std::fmt::Write;

use crate::analysis::{Class, Samples, Way};
use crate::reference::{self, Row};
use crate::statistics::{Statistics, at_rank};
use crate::{Measured, Tick, cost, targets};

/// A row of tables 5.1 and 5.2: its name, the reference's figures, and how ours are picked.
type Kind = (&'static str, Row, fn(&Samples) -> Vec<f64>);

const MS: f64 = 1e3;
const US: f64 = 1e6;

/// Everything that was measured.
pub(crate) fn text(it: &Measured) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "\n{}; load average {:.1} before and {:.1} after; flights at {} times real time:\n\
         mission time is sped up, tick period, transport and processing are not.",
        it.machine, it.load_before, it.load_after, it.speed
    );
    if let Some(nodes) = &it.onboard {
        let _ = writeln!(out, "In one process: {nodes}.");
    }
    transitions(it, &mut out);
    table_5_3(it, &mut out);
    felt(it, &mut out);
    ways(it, &mut out);
    out.push_str(&cost::text(it));
    out.push_str(&targets::text(it));
    out
}

fn transitions(it: &Measured, out: &mut String) {
    let by_class: [Kind; 3] = [
        ("N2N", reference::N2N, |it| it.of_class(Class::N2N)),
        ("N2T", reference::N2T, |it| it.of_class(Class::N2T)),
        ("T2N", reference::T2N, |it| it.of_class(Class::T2N)),
    ];
    let by_kind: [Kind; 4] = [
        ("P2P", reference::P2P, |it| it.between(true, true)),
        ("P2O", reference::P2O, |it| it.between(true, false)),
        ("O2P", reference::O2P, |it| it.between(false, true)),
        ("O2O", reference::O2O, |it| it.between(false, false)),
    ];
    heading("Table 5.1: transitions inside the mission manager, in milliseconds", out);
    by_class.iter().for_each(|row| rows(it, row, out));
    heading("Table 5.2: the same by the kinds of action: position control, other", out);
    by_kind.iter().for_each(|row| rows(it, row, out));
}

fn heading(title: &str, out: &mut String) {
    let _ = writeln!(out, "\n{title}\n{:<10}{HEAD}   reference: mean     max  times faster", "  tick");
}

const HEAD: &str = "     n      max      min     mean  std dev      p50      p99";

fn rows(it: &Measured, (name, reference, samples): &Kind, out: &mut String) {
    for tick in &it.ticks {
        let label = format!("{name} {:>2} ms", tick.tick_ms);
        let Some(ours) = Statistics::of(&samples(&tick.mission)) else {
            let _ = writeln!(out, "{label:<10}     0");
            continue;
        };
        let _ = write!(out, "{label:<10}{}", figures(&ours, MS));
        if let Some(column) = reference::column(tick.tick_ms) {
            let (mean, max) = (reference.mean[column], reference.max[column]);
            let _ = write!(out, "   {mean:>15.1} {max:>7.1} {:>13.0}", mean / (ours.mean * MS));
        }
        out.push('\n');
    }
}

fn figures(it: &Statistics, unit: f64) -> String {
    let [max, min, mean, std_dev, p50, p99] = [it.max, it.min, it.mean, it.std_dev, it.p50, it.p99].map(|it| it * unit);
    format!("{:>6} {max:>8.3} {min:>8.3} {mean:>8.3} {std_dev:>8.3} {p50:>8.3} {p99:>8.3}", it.count)
}

fn table_5_3(it: &Measured, out: &mut String) {
    let _ = writeln!(
        out,
        "\nTable 5.3: flag to action inside the mission manager, in microseconds\n{:<14}{HEAD}   reference: mean  times faster",
        "  tick"
    );
    for tick in &it.ticks {
        for (name, samples, reference) in
            [("flat", &tick.flat, reference::FLAT), ("nested", &tick.nested, reference::NESTED)]
        {
            let took: Vec<f64> = samples.reactions.iter().map(|it| it.tick_to_action_s).collect();
            let label = format!("{name:<6} {:>2} ms", tick.tick_ms);
            let Some(ours) = Statistics::of(&took) else { continue };
            let _ = write!(out, "{label:<14}{}", figures(&ours, US));
            if let Some(column) = reference::column(tick.tick_ms) {
                let mean = reference[column] * 1e3;
                let _ = write!(out, "   {mean:>15.0} {:>13.0}", mean / (ours.mean * US));
            }
            out.push('\n');
        }
    }
}

fn felt(it: &Measured, out: &mut String) {
    let floor = it.floor.as_ref().and_then(|it| Statistics::of(&totals(&it.felt_transitions)));
    let _ = writeln!(
        out,
        "\nFelt, in milliseconds: skill result published -> next command received by the vehicle;\n\
         flag published by the monitor -> loiter command received by the vehicle\n{:<20}{HEAD}   p50 / floor",
        "  tick"
    );
    let row = |label: String, samples: &[f64], out: &mut String| {
        let Some(ours) = Statistics::of(samples) else { return };
        let ratio = floor.map(|floor| format!("{:>14.2}", ours.p50 / floor.p50)).unwrap_or_default();
        let _ = writeln!(out, "{label:<20}{}{ratio}", figures(&ours, MS));
    };
    for tick in &it.ticks {
        row(format!("transition     {:>2} ms", tick.tick_ms), &totals(&tick.mission.felt_transitions), out);
        row(format!("react. flat    {:>2} ms", tick.tick_ms), &totals(&reaction_ways(&tick.flat)), out);
        row(format!("react. nested  {:>2} ms", tick.tick_ms), &totals(&reaction_ways(&tick.nested)), out);
    }
    if let Some(floor) = &it.floor {
        row("floor".into(), &totals(&floor.felt_transitions), out);
    }
    for Tick { tick_ms, mission, .. } in &it.ticks {
        let _ = writeln!(
            out,
            "at {tick_ms} ms, {} further transitions were begun by a permission or needed no command",
            mission.transitions_without_command
        );
    }
}

fn ways(it: &Measured, out: &mut String) {
    let _ = writeln!(
        out,
        "\nWhere the time went, in microseconds: event -> manager, deciding, request -> command, command -> vehicle"
    );
    let row = |label: &str, share: f64, ways: &[Way], out: &mut String| {
        let Some(way) = at_rank(ways, share, Way::total_s) else { return };
        let [a, b, c, d, sum] =
            [way.to_manager_s, way.deciding_s, way.to_command_s, way.to_vehicle_s, way.total_s()].map(|it| it * US);
        let _ =
            writeln!(out, "{label:<22} p{:<3.0} {a:>8.0} + {b:>6.0} + {c:>8.0} + {d:>8.0} = {sum:>8.0}", share * 100.0);
    };
    for share in [0.5, 0.99] {
        for tick in &it.ticks {
            row(&format!("transition    {:>2} ms", tick.tick_ms), share, &tick.mission.felt_transitions, out);
            row(&format!("react. flat   {:>2} ms", tick.tick_ms), share, &reaction_ways(&tick.flat), out);
            row(&format!("react. nested {:>2} ms", tick.tick_ms), share, &reaction_ways(&tick.nested), out);
        }
        if let Some(floor) = &it.floor {
            row("floor", share, &floor.felt_transitions, out);
        }
    }
}

/// From the first stamp to the last.
pub(crate) fn totals(ways: &[Way]) -> Vec<f64> {
    ways.iter().map(Way::total_s).collect()
}

/// The ways of the flags that needed a command.
pub(crate) fn reaction_ways(samples: &Samples) -> Vec<Way> {
    samples.reactions.iter().filter_map(|it| it.felt).collect()
}
