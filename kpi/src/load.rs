//! What the processes use: processor time and memory, as the operating system tells.

#![expect(clippy::disallowed_methods, reason = "the load is measured over wall time")]

use std::collections::BTreeMap;
use std::time::Instant;

use kittiwake::up::supervise::Child;
use serde::Serialize;

use crate::system::System;

/// Processor time that a process had used at a moment, and its memory.
#[derive(Debug, Clone, Copy)]
struct Use {
    ticks: u64,
    rss_kb: u64,
}

/// What a process used over a while.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Load {
    /// Of one core, 0 to 100 and more.
    pub cpu_percent: f64,
    /// Resident at the end, in megabytes.
    pub rss_mb: f64,
}

/// A while that is being measured.
pub(crate) struct Watch {
    start: Instant,
    before: BTreeMap<Child, (u32, Use)>,
}

impl Watch {
    /// Begins.
    pub(crate) fn begin(system: &System) -> Watch {
        let before = system.processes().into_iter().filter_map(|(child, pid)| Some((child, (pid, read(pid)?))));
        Watch { start: Instant::now(), before: before.collect() }
    }

    /// What each process that still runs has used since.
    pub(crate) fn end(&self) -> BTreeMap<&'static str, Load> {
        let wall = self.start.elapsed().as_secs_f64();
        let load = |(child, (pid, before)): (&Child, &(u32, Use))| {
            let after = read(*pid)?;
            let used = after.ticks.saturating_sub(before.ticks) as f64 / TICKS_PER_SECOND;
            Some((child.name(), Load { cpu_percent: 100.0 * used / wall, rss_mb: after.rss_kb as f64 / 1024.0 }))
        };
        self.before.iter().filter_map(load).collect()
    }
}

/// The kernel counts processor time in hundredths of a second on every architecture we fly.
const TICKS_PER_SECOND: f64 = 100.0;

fn read(pid: u32) -> Option<Use> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name, in parentheses, may hold anything; user and system time are the 12th and 13th field after it.
    let mut fields = stat.rsplit_once(") ")?.1.split(' ').skip(11);
    let ticks = fields.next()?.parse::<u64>().ok()? + fields.next()?.parse::<u64>().ok()?;
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let rss = status.lines().find_map(|it| it.strip_prefix("VmRSS:"))?;
    Some(Use { ticks, rss_kb: rss.trim().trim_end_matches(" kB").parse().ok()? })
}

/// Processes that run or wait to, averaged over the last minute.
pub(crate) fn load_average() -> f64 {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().and_then(|it| it.parse().ok()).unwrap_or(f64::NAN)
}

/// The machine in a few words.
pub(crate) fn machine() -> String {
    let cores = std::thread::available_parallelism().map_or(1, |it| it.get());
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|it| it.strip_prefix("model name")?.split_once(": ").map(|it| it.1));
    format!("{cores} cores, {}", model.unwrap_or("unknown processor"))
}
