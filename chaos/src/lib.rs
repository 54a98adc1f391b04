//! Random troubles for real systems: `kittiwake-chaos`.
//!
//! It starts `kittiwake up` again and again, does to its processes what a schedule drawn from a seed says, and judges by where
//! the simulated vehicle is. Nothing of it is part of what flies. What is drawn, judged and counted is pure; `system`,
//! `perform`, `disk` and `soak` meet the machine.

#![expect(
    clippy::disallowed_methods,
    reason = "it troubles real processes on the wall clock, and waits for them up to a limit"
)]

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use control_tower::policy::Policy;
use kittiwake::output;
use kittiwake::run::end;
use kittiwake::run::run_file::RunFolder;

use crate::args::Args;
use crate::disk::Disk;
use crate::figures::Loss;
use crate::run::Run;
use crate::schedule::Schedule;
use crate::system::Setup;
use crate::trouble::Kind;

pub mod args;
pub mod disk;
pub mod figures;
mod flood;
pub mod oracle;
mod perform;
pub mod run;
pub mod schedule;
mod soak;
mod system;
pub mod trouble;

/// The program that is troubled; it lies beside this one.
const TROUBLED: &str = "kittiwake";
const OK: u8 = 0;
const NOT_FLOWN: u8 = 1;
const VIOLATIONS: u8 = 3;

/// Flies the campaign, or the soak, and prints what came of it; the exit code.
pub fn run(args: &Args) -> u8 {
    // So that no system is left running.
    let interrupted = Arc::new(AtomicBool::new(false));
    let signal = interrupted.clone();
    let watched = end::on_signal(move || signal.store(true, Ordering::Relaxed)).map_err(|it| it.to_string());
    let result = watched.and_then(|()| match args.soak {
        Some(minutes) => soak(args, minutes.get(), &interrupted),
        None => campaign(args, &interrupted),
    });
    result.unwrap_or_else(|cause| {
        output::error_line(format_args!("chaos: {cause}"));
        NOT_FLOWN
    })
}

fn soak(args: &Args, minutes: u32, interrupted: &AtomicBool) -> Result<u8, String> {
    let folder = RunFolder::create("soak").map_err(|it| it.to_string())?;
    let setup = Setup { ends: false, ..setup(args, args.seed, Policy::Grant, folder.0.clone())? };
    let soaked = soak::soak(&setup, minutes, interrupted)?;
    output::line(soaked.table);
    match soaked.ended_early {
        None => Ok(OK),
        Some(last_words) => {
            output::error_line(format_args!("chaos: the system ended early: {last_words}"));
            Ok(VIOLATIONS)
        }
    }
}

fn campaign(args: &Args, interrupted: &AtomicBool) -> Result<u8, String> {
    let probe = RunFolder::create("disk").map_err(|it| it.to_string())?;
    let has_disk = args.own_mounts && Disk::mount(&probe.0).is_some();
    if !has_disk {
        output::error_line("chaos: full disk: not possible here: needs root; left out");
    }
    let (next, runs) = (AtomicU32::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..args.jobs.get().min(args.runs.get() as usize) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if args.runs.get() <= number || interrupted.load(Ordering::Relaxed) {
                        return;
                    }
                    let flown = one(args, args.seed.wrapping_add(number.into()), has_disk, interrupted);
                    say(number + 1, &flown, args.stories);
                    // A thread that panicked has printed why.
                    runs.lock().unwrap_or_else(|it| it.into_inner()).push(flown);
                }
            });
        }
    });
    let runs = runs.into_inner().unwrap_or_else(|it| it.into_inner());
    Ok(summary(&runs))
}

/// Flies the run of a seed; `has_disk`: the state is on a small disk of its own, which can be full.
///
/// # Errors
/// If the system cannot be started, or the run was `interrupted`.
pub fn one(args: &Args, seed: u64, has_disk: bool, interrupted: &AtomicBool) -> Result<Run, String> {
    let folder = RunFolder::create(&format!("chaos-{seed}")).map_err(|it| it.to_string())?;
    let schedule = Schedule::of(seed);
    let setup = setup(args, seed, schedule.permissions, folder.0.clone())?;
    std::fs::create_dir(setup.state()).map_err(|it| format!("{}: {it}", setup.state().display()))?;
    let _disk = has_disk.then(|| Disk::mount(&setup.state()));
    let possible = |kind| kind != Kind::FullDisk || has_disk;
    run::fly(&setup, args.speed.pace(), schedule, possible, interrupted)
}

fn setup(args: &Args, seed: u64, permissions: Policy, scratch: PathBuf) -> Result<Setup, String> {
    let beside = || std::env::current_exe().map(|own| own.with_file_name(TROUBLED));
    let program = args.program.clone().map_or_else(beside, Ok).map_err(|it| it.to_string())?;
    if !program.is_file() {
        return Err(format!("{} is missing: build it, or name another with --program", program.display()));
    }
    let (config, speed) = (args.config.clone(), args.speed.to_string());
    Ok(Setup { program, config, speed, seed, permissions, scratch, ends: true })
}

/// A run's line, and its story if there is something against it.
fn say(number: u32, flown: &Result<Run, String>, always: bool) {
    let run = match flown {
        Ok(run) => run,
        Err(cause) => return output::error_line(format_args!("run {number}: not flown: {cause}")),
    };
    let verdict = if run.violations.is_empty() { "ok" } else { "VIOLATION" };
    let (seed, wall_s) = (run.schedule.seed, run.wall.as_secs());
    output::line(format_args!("run {number}  seed {seed}  {wall_s} s  {verdict}  {}  [{}]", run.outcome, run.schedule));
    if !run.violations.is_empty() || always {
        run.story.iter().for_each(|(at_s, text)| output::line(format_args!("    {at_s:7.1} s  {text}")));
        run.violations.iter().for_each(|it| output::line(format_args!("    violation: {it}")));
        output::line(format_args!("    again: kittiwake chaos --runs 1 --seed {seed}"));
    }
}

fn summary(runs: &[Result<Run, String>]) -> u8 {
    let flown: Vec<&Run> = runs.iter().filter_map(|it| it.as_ref().ok()).collect();
    let violating = flown.iter().filter(|it| !it.violations.is_empty()).count();
    let losses: Vec<Loss> = flown.iter().flat_map(|it| it.losses.iter().copied()).collect();
    output::line(format_args!("\n{} of {} runs flown, {violating} with violations", flown.len(), runs.len()));
    output::line("median / p90 / greatest; wall seconds, metres at the speed of the campaign\n");
    output::line(figures::table(&losses));
    match (flown.len() < runs.len(), violating) {
        (true, _) => NOT_FLOWN,
        (false, 0) => OK,
        (false, _) => VIOLATIONS,
    }
}
