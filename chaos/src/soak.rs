//! A soak: one system stays up, and what its processes hold is fitted by a line.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use crate::figures::slope;
use crate::run::heard::Heard;
use crate::system::Setup;

/// Period of the samples.
const PERIOD: Duration = Duration::from_secs(10);
/// What processes take on in this share of the time is their start, and not part of the slope.
const WARM_UP: f64 = 0.2;
/// Lines of the launcher that wait.
const QUEUE: usize = 1000;

/// What a process holds at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Held {
    rss_kb: f64,
    threads: f64,
    descriptors: f64,
}

/// Samples of a process, each with its wall seconds.
type Samples = BTreeMap<String, Vec<(f64, Held)>>;

/// What came of a soak.
pub(crate) struct Soaked {
    /// The table of slopes.
    pub(crate) table: String,
    /// What was said last, if the system ended early.
    pub(crate) ended_early: Option<String>,
}

/// Keeps a system up for that many minutes, until it is interrupted, or until it ends by itself, which it must not.
///
/// # Errors
/// If it cannot be started.
pub(crate) fn soak(setup: &Arc<Setup>, minutes: u32, interrupted: &AtomicBool) -> Result<Soaked, String> {
    let (sender, heard) = sync_channel(QUEUE);
    let system = setup.start(&sender)?;
    let (begin, whole) = (Instant::now(), Duration::from_secs(u64::from(minutes) * 60));
    let (mut samples, mut files) = (Samples::new(), Vec::new());
    let (mut last_words, mut ended_early) = (String::new(), None);
    while begin.elapsed() < whole && !interrupted.load(Ordering::Relaxed) {
        if !is_up_after(PERIOD, &heard, &mut last_words) {
            ended_early = Some(last_words);
            break;
        }
        let at_s = begin.elapsed().as_secs_f64();
        let itself = ("launcher".to_owned(), system.id());
        for (name, id) in system.processes().list().into_iter().chain([itself]) {
            if let Some(held) = look_at(id) {
                samples.entry(name).or_default().push((at_s, held));
            }
        }
        files.push((at_s, count_files(&setup.scratch) as f64));
    }
    // A soak that was interrupted or ended early still reports what it measured.
    Ok(Soaked { table: table(&samples, &files, begin.elapsed().as_secs_f64() * WARM_UP), ended_early })
}

/// Lets time pass while the launcher speaks; whether it is still there.
fn is_up_after(time: Duration, heard: &Receiver<Heard>, last_words: &mut String) -> bool {
    let until = Instant::now() + time;
    loop {
        match heard.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(Heard::Line(_, line)) => *last_words = line,
            Ok(Heard::Ended(_)) | Err(RecvTimeoutError::Disconnected) => return false,
            Ok(_) => {}
            Err(RecvTimeoutError::Timeout) => return true,
        }
    }
}

fn look_at(id: u32) -> Option<Held> {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let value = |key: &str| status.lines().find_map(|it| it.strip_prefix(key)?.split_whitespace().next()?.parse().ok());
    let descriptors = std::fs::read_dir(format!("/proc/{id}/fd")).ok()?.count() as f64;
    Some(Held { rss_kb: value("VmRSS:")?, threads: value("Threads:")?, descriptors })
}

fn count_files(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|it| if it.path().is_dir() { count_files(&it.path()) } else { 1 }).sum()
}

fn table(samples: &Samples, files: &[(f64, f64)], from_s: f64) -> String {
    let per_hour = |of: Vec<(f64, f64)>| {
        let warm: Vec<(f64, f64)> = of.into_iter().filter(|it| from_s <= it.0).collect();
        slope(&warm).map_or("-".to_owned(), |it| format!("{:+.2}", it * 3600.0))
    };
    let mut text = String::from(
        "| process | memory at the end, MB | memory, MB/h | threads | threads/h | descriptors | descriptors/h |\n|---|---|---|---|---|---|---|\n",
    );
    for (name, samples) in samples {
        let series = |of: fn(&Held) -> f64| samples.iter().map(|(at, held)| (*at, of(held))).collect::<Vec<_>>();
        let Some((_, last)) = samples.last() else { continue };
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| {name} | {:.1} | {} | {} | {} | {} | {} |",
            last.rss_kb / 1024.0,
            per_hour(series(|it| it.rss_kb / 1024.0)),
            last.threads,
            per_hour(series(|it| it.threads)),
            last.descriptors,
            per_hour(series(|it| it.descriptors)),
        );
    }
    let last = files.last().map_or(0.0, |it| it.1);
    let _ = writeln!(text, "\nfiles of state and recordings: {last} at the end, {} an hour", per_hour(files.to_vec()));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_after_the_start_is_told_by_the_hour() {
        let held = |s: u32| Held { rss_kb: 1024.0 * f64::from(10 + s / 36), threads: 12.0, descriptors: 30.0 };
        let samples = (0..100u32).map(|it| (f64::from(it * 36), held(it * 36))).collect();
        let samples = Samples::from([("mcm".to_owned(), samples)]);
        let told = table(&samples, &[(0.0, 3.0), (3600.0, 5.0)], 0.0);
        assert!(told.contains("| mcm | 109.0 | +100.00 | 12 | +0.00 | 30 | +0.00 |"), "{told}");
        assert!(told.contains("recordings: 5 at the end, +2.00 an hour"), "{told}");
    }

    #[test]
    fn a_process_is_looked_at_as_the_kernel_sees_it() {
        let held = look_at(std::process::id()).expect("this process is there");
        assert!(1024.0 < held.rss_kb && 1.0 <= held.threads && 3.0 <= held.descriptors, "{held:?}");
    }
}
