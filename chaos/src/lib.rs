//! Random troubles for real systems: `kittiwake-chaos`.
//!
//! It starts a system again and again, with one router or as it is deployed, with two. It troubles processes, link and
//! clocks by a schedule drawn from a seed, and judges by where the simulated vehicle is. None of this flies. Drawing,
//! judging and counting are pure; `system`, `perform`, `link`, `clock`, `disk` and `soak` meet the machine.

#![expect(
    clippy::disallowed_methods,
    reason = "it troubles real processes on the wall clock, and waits for them up to a limit"
)]

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use control_tower::policy::Policy;
use domain::area::{Area, AreaKind};
use kittiwake::check_inputs;
use kittiwake::output;
use kittiwake::run::end;
use kittiwake::run::run_file::RunFolder;
use kittiwake::settings::Settings;

use crate::args::Args;
use crate::clock::Clocks;
use crate::disk::Disk;
use crate::figures::Loss;
pub use crate::means::Means;
use crate::oracle::Oracle;
use crate::run::Run;
use crate::schedule::Schedule;
use crate::system::Setup;
use crate::trouble::{Kind, Layout};

pub mod args;
mod clock;
pub mod disk;
pub mod figures;
mod flood;
mod link;
mod means;
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

/// Flies the campaign, or the soak, and prints the result; returns the exit code.
pub fn run(args: &Args) -> u8 {
    // So that no system is left running.
    let interrupted = Arc::new(AtomicBool::new(false));
    let signal = interrupted.clone();
    let watched = end::on_signal(move || signal.store(true, Ordering::Relaxed)).map_err(|it| it.to_string());
    let result = watched.and_then(|()| match args.soak {
        Some(minutes) => soak(args, minutes.get(), &interrupted),
        None if args.list => Ok(list(args)),
        None => campaign(args, &interrupted),
    });
    result.unwrap_or_else(|cause| {
        output::error_line(format_args!("chaos: {cause}"));
        NOT_FLOWN
    })
}

fn list(args: &Args) -> u8 {
    for run in listed(args) {
        output::line(run);
    }
    OK
}

/// A line for each run of the campaign.
fn listed(args: &Args) -> impl Iterator<Item = String> {
    let schedules = (0..args.runs.get()).map(|number| Schedule::of(args.seed.wrapping_add(number.into())));
    schedules.map(|schedule| format!("seed {}  [{schedule}]", schedule.seed))
}

fn soak(args: &Args, minutes: u32, interrupted: &AtomicBool) -> Result<u8, String> {
    let folder = RunFolder::create("soak").map_err(|it| it.to_string())?;
    let program = program(args)?;
    let setup = setup(args, &program, &calm(args.seed), (folder.0.clone(), &[]), None, false);
    let soaked = soak::soak(&Arc::new(setup), minutes, interrupted)?;
    output::line(soaked.table);
    match soaked.ended_early {
        None => Ok(OK),
        Some(last_words) => {
            output::error_line(format_args!("chaos: the system ended early: {last_words}"));
            Ok(VIOLATIONS)
        }
    }
}

/// No trouble at all.
fn calm(seed: u64) -> Schedule {
    Schedule { seed, layout: Layout::OneRouter, permissions: Policy::Grant, troubles: Vec::new() }
}

fn campaign(args: &Args, interrupted: &AtomicBool) -> Result<u8, String> {
    let means = Means::find(args, &program(args)?)?;
    let (next, runs) = (AtomicU32::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..args.jobs.get().min(args.runs.get() as usize) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if args.runs.get() <= number || interrupted.load(Ordering::Relaxed) {
                        return;
                    }
                    let seed = args.seed.wrapping_add(number.into());
                    let flown = one(args, seed, &means, interrupted);
                    say(number + 1, seed, &flown, args);
                    // A thread that panicked has printed why.
                    runs.lock().unwrap_or_else(|it| it.into_inner()).push(flown);
                }
            });
        }
    });
    let runs = runs.into_inner().unwrap_or_else(|it| it.into_inner());
    Ok(summary(&runs))
}

/// Flies the run of a seed with the means that there are.
///
/// # Errors
/// If the system does not come up. A run that was `interrupted` is flown as far as it is.
pub fn one(args: &Args, seed: u64, means: &Means, interrupted: &AtomicBool) -> Result<Run, String> {
    let folder = RunFolder::create(&format!("chaos-{seed}")).map_err(|it| it.to_string())?;
    let (schedule, program) = (Schedule::of(seed), program(args)?);
    // Only where a clock is set: in other runs nothing lies between the processes and the machine's clock.
    let is_set = schedule.troubles.iter().any(|it| it.1.kind() == Kind::ClockStep);
    let library = means.clock.clone().filter(|_| is_set);
    let clocks = library.map(|it| Clocks::new(it, folder.0.clone())).transpose().map_err(|it| it.to_string())?;
    let areas = areas(args)?;
    let setup = Arc::new(setup(args, &program, &schedule, (folder.0.clone(), &areas), clocks, true));
    std::fs::create_dir(setup.state()).map_err(|it| format!("{}: {it}", setup.state().display()))?;
    let _disk = means.has_disk.then(|| Disk::mount(&setup.state()));
    let interruption = args.interruption() + schedule.companion_off();
    let oracle = Oracle::new(args.speed.pace(), interruption, areas);
    run::fly(&setup, oracle, schedule, |kind| means.allow(kind), interrupted)
}

/// Of the mission that is flown, as its file has them.
fn areas(args: &Args) -> Result<Vec<Area>, String> {
    check_inputs::read(&Settings::of_file(&args.config)).map(|it| it.mission.areas).map_err(|it| it.to_string())
}

/// The program that is troubled.
fn program(args: &Args) -> Result<PathBuf, String> {
    let beside = || std::env::current_exe().map(|own| own.with_file_name(TROUBLED));
    let program = args.program.clone().map_or_else(beside, Ok).map_err(|it| it.to_string())?;
    match program.is_file() {
        true => Ok(program),
        false => Err(format!("{} is missing: build it, or name another with --program", program.display())),
    }
}

fn setup(
    args: &Args,
    program: &Path,
    schedule: &Schedule,
    (scratch, areas): (PathBuf, &[Area]),
    clocks: Option<Clocks>,
    ends: bool,
) -> Setup {
    Setup {
        program: program.to_owned(),
        config: args.config.clone(),
        speed: args.speed.to_string(),
        seed: schedule.seed,
        layout: schedule.layout,
        permissions: schedule.permissions,
        permission_areas: areas.iter().filter(|it| it.kind == AreaKind::Permission).map(|it| it.name.clone()).collect(),
        scratch,
        ends,
        clocks,
        link: OnceLock::new(),
    }
}

/// A run's line, and its story if there is something against it.
fn say(number: u32, seed: u64, flown: &Result<Run, String>, args: &Args) {
    let again = format!("    again: {}", args.again(seed));
    let run = match flown {
        Ok(run) => run,
        Err(cause) => {
            return output::error_line(format_args!("run {number}  seed {seed}  not flown: {cause}\n{again}"));
        }
    };
    let verdict = match (run.violations.is_empty(), run.is_interrupted) {
        (false, _) => "VIOLATION",
        (true, true) => "not flown to its end",
        (true, false) => "ok",
    };
    let wall_s = run.wall.as_secs();
    output::line(format_args!("run {number}  seed {seed}  {wall_s} s  {verdict}  {}  [{}]", run.outcome, run.schedule));
    if !run.violations.is_empty() || args.stories {
        run.story.iter().for_each(|(at_s, text)| output::line(format_args!("    {at_s:7.1} s  {text}")));
        run.violations.iter().for_each(|it| output::line(format_args!("    violation: {it}")));
        output::line(again);
    }
}

fn summary(runs: &[Result<Run, String>]) -> u8 {
    let seen: Vec<&Run> = runs.iter().filter_map(|it| it.as_ref().ok()).collect();
    let flown = seen.iter().filter(|it| !it.is_interrupted).count();
    // Also in a run that was interrupted.
    let violating = seen.iter().filter(|it| !it.violations.is_empty()).count();
    let losses: Vec<Loss> = seen.iter().flat_map(|it| it.losses.iter().copied()).collect();
    output::line(format_args!("\n{flown} of {} runs flown, {violating} with violations", runs.len()));
    output::line("median / p90 / greatest; wall seconds, metres at the speed of the campaign\n");
    output::line(figures::table(&losses));
    exit_code(runs.len(), flown, violating)
}

/// A violation counts more than a run that could not be flown.
fn exit_code(runs: usize, flown: usize, violating: usize) -> u8 {
    match (flown < runs, violating) {
        (_, 1..) => VIOLATIONS,
        (true, 0) => NOT_FLOWN,
        (false, 0) => OK,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser as _;

    fn args(given: &[&str]) -> Result<Args, String> {
        Args::try_parse_from([&["chaos"], given].concat()).map_err(|it| it.to_string())
    }

    #[test]
    fn a_campaign_that_cannot_be_flown_is_no_success_and_one_can_be_listed() {
        let nowhere = args(&["--runs", "1", "--program", "nowhere"]).unwrap();
        let missing = "nowhere is missing: build it, or name another with --program";
        assert_eq!(campaign(&nowhere, &AtomicBool::new(false)), Err(missing.to_owned()));
        assert_eq!(soak(&nowhere, 1, &AtomicBool::new(false)), Err(missing.to_owned()));
        let lines: Vec<_> = listed(&args(&["--list", "--runs", "2", "--seed", "7"]).unwrap()).collect();
        assert!(lines.len() == 2 && lines[1].starts_with("seed 8  ["), "{lines:?}");
    }

    #[test]
    fn arguments_out_of_range_are_refused() {
        assert!(args(&["--runs", "0"]).unwrap_err().contains("--runs"));
        assert!(args(&["--speed", "101"]).unwrap_err().contains("0.1 to 100"));
    }

    #[test]
    fn a_violation_counts_more_than_a_run_that_could_not_be_flown() {
        assert_eq!(exit_code(3, 3, 0), OK);
        assert_eq!(exit_code(3, 2, 0), NOT_FLOWN);
        assert_eq!(exit_code(3, 3, 1), VIOLATIONS);
        assert_eq!(exit_code(3, 2, 1), VIOLATIONS);
    }
}
