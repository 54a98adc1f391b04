//! `kittiwake-kpi --disturbed`: how fast a flag is answered while a process of the ground hangs, and during a flood of flags.
//!
//! The contingency flights of the tables, at one tick period, with a disturbance that begins when the vehicle is first on its way
//! and lasts until the end. One that hangs is stopped by a signal, so that its sockets stay open and fill up.

use std::fmt::Write;

use bus::Stop;
use kittiwake::flood::Flood;
use kittiwake::service::Service;
use kittiwake::up::supervise::Child;
use kittiwake_proto::v1::FlagEvent;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde::Serialize;

use crate::analysis::Samples;
use crate::statistics::Statistics;
use crate::system::System;
use crate::table::{reaction_ways, totals};
use crate::{Flights, load, say};

/// The shipped one.
const TICK_MS: u32 = 10;
/// Events of the flood a second.
const FLOOD_HZ: u32 = 1000;

/// What goes on besides the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Disturbance {
    Nothing,
    /// This process stands still.
    Hangs(Service),
    /// Flags that nobody knows are raised, a thousand a second.
    Flood,
}

const ALL: [Disturbance; 4] = [
    Disturbance::Nothing,
    Disturbance::Hangs(Service::Gateway),
    Disturbance::Hangs(Service::ControlTower),
    Disturbance::Flood,
];

impl Disturbance {
    fn name(self) -> String {
        match self {
            Disturbance::Nothing => "nothing".into(),
            Disturbance::Hangs(service) => format!("the {} hangs", service.name()),
            Disturbance::Flood => format!("{FLOOD_HZ} unknown flags/s"),
        }
    }

    /// Lasts for as long as the value; processes that hang are killed with the system.
    pub(crate) fn begin(self, system: &System) -> Result<Option<Stop>, String> {
        match self {
            Disturbance::Nothing => Ok(None),
            Disturbance::Flood => Ok(Some(system.join(Flood::new(FLOOD_HZ, u64::MAX, unknown_flag)))),
            Disturbance::Hangs(service) => {
                let processes = system.processes();
                let found = processes.into_iter().find(|it| it.0 == Child::Service(service)).map(|it| it.1);
                let id = found.and_then(|it| i32::try_from(it).ok()).ok_or_else(|| format!("no {}", service.name()))?;
                kill(Pid::from_raw(id), Signal::SIGSTOP).map_err(|it| format!("{}: {it}", service.name()))?;
                Ok(None)
            }
        }
    }
}

/// What was measured.
#[derive(Debug, Serialize)]
pub(crate) struct Disturbed {
    machine: String,
    load_before: f64,
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    disturbance: String,
    /// From the injector to the vehicle, in seconds.
    felt: Option<Statistics>,
    /// From the beginning of the tick to the action, in seconds.
    tick_to_action: Option<Statistics>,
    /// The tick that 99 of 100 are no longer than, in seconds: the upper end of its power of two.
    tick_p99_s: Option<f64>,
}

pub(crate) fn measure(flights: &Flights<'_>) -> Result<Disturbed, String> {
    let load_before = load::load_average();
    let row = |disturbance: Disturbance| {
        let name = disturbance.name();
        say(&format!("meanwhile: {name}"));
        let samples = flights.contingencies(TICK_MS, "flat.toml", disturbance)?;
        Ok(row(name, &samples))
    };
    let rows = ALL.into_iter().map(row).collect::<Result<_, String>>()?;
    Ok(Disturbed { machine: load::machine(), load_before, rows })
}

fn row(disturbance: String, samples: &Samples) -> Row {
    let actions: Vec<f64> = samples.reactions.iter().map(|it| it.tick_to_action_s).collect();
    Row {
        disturbance,
        felt: Statistics::of(&totals(&reaction_ways(samples))),
        tick_to_action: Statistics::of(&actions),
        tick_p99_s: rank_of_histogram(&samples.tick_histogram, 0.99),
    }
}

/// The upper end of the bucket in which this share of all is reached, in seconds; bucket n begins at 2^n ns.
fn rank_of_histogram(counts: &[u64], share: f64) -> Option<f64> {
    let wanted = counts.iter().sum::<u64>() as f64 * share;
    let mut so_far = 0;
    let bucket = counts.iter().position(|it| {
        so_far += it;
        0 < so_far && wanted <= so_far as f64
    })?;
    Some(2f64.powi(bucket as i32 + 1) * 1e-9)
}

pub(crate) fn text(it: &Disturbed) -> String {
    let mut out = format!(
        "\n{}; load average {:.1} before; tick period {TICK_MS} ms\n\n\
         From the flag, published by the monitor, to the loiter command, received by the vehicle, in milliseconds; a tick, in\n\
         microseconds, at most\n{:<28}{:>6}{:>9}{:>9}{:>9}{:>12}\n",
        it.machine, it.load_before, "  meanwhile", "n", "p50", "p99", "max", "tick p99"
    );
    for Row { disturbance, felt, tick_p99_s, .. } in &it.rows {
        let Some(felt) = felt else {
            let _ = writeln!(out, "{disturbance:<28}     0");
            continue;
        };
        let tick = tick_p99_s.map_or("-".into(), |it| format!("{:.0}", it * 1e6));
        let [p50, p99, max] = [felt.p50, felt.p99, felt.max].map(|it| it * 1e3);
        let _ = writeln!(out, "{disturbance:<28}{:>6}{p50:>9.2}{p99:>9.2}{max:>9.2}{tick:>12}", felt.count);
    }
    out
}

/// One of a few flags that are in no contingency table.
fn unknown_flag(number: u64) -> FlagEvent {
    let name = format!("unheard_of_{}", number % 10);
    FlagEvent { name, raised: true, reason: "measurement".to_owned(), ..Default::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_99th_of_100_ticks_is_in_the_bucket_that_holds_it() {
        #[track_caller]
        fn check(counts: &[u64], expected_ns: Option<f64>) {
            assert_eq!(rank_of_histogram(counts, 0.99).map(|it| (it * 1e9).round()), expected_ns, "{counts:?}");
        }
        check(&[], None);
        check(&[0, 0], None);
        check(&[0, 0, 5], Some(8.0));
        check(&[0, 98, 1, 1], Some(8.0));
        check(&[0, 98, 0, 2], Some(16.0));
    }
}
