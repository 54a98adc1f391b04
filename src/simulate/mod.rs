//! `kittiwake simulate`: all services in one thread on a virtual clock, many times faster than real time, with trouble, and judged.

use std::time::{Duration, Instant};

use domain::file::did_you_mean;
use simulation::chaos::fly::{Flight, fly};
use simulation::chaos::shrink::shrink;

use crate::check_inputs::{self, Inputs};
use crate::outcome::Outcome;
use crate::output;
use crate::progress::Progress;
use crate::settings::Settings;

pub mod args;
mod flights;
pub mod replay;
mod report;

use args::SimulateArgs;
use flights::Flights;

/// Flies what the arguments say, and prints what there is against it.
pub fn simulate(args: &SimulateArgs) -> Outcome {
    let settings = Settings { mission: args.mission.clone(), ..Settings::of_file(&args.config) };
    let inputs = match check_inputs::read_or_tell(&settings) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    if let Err(unknown) = check_flags(args, &inputs) {
        output::error_line(unknown);
        return Outcome::BadInput;
    }
    let flights = Flights::of(args, &inputs);
    let result = match args.shrink {
        Some(seed) => shrunk(&flights, seed),
        None => campaign(args, &flights),
    };
    result.unwrap_or_else(|mistakes| check_inputs::tell(&mistakes))
}

/// Refuses a flag that the contingency table does not know.
fn check_flags(args: &SimulateArgs, inputs: &Inputs) -> Result<(), String> {
    let known: Vec<&str> = inputs.contingencies.rows().iter().map(|it| it.flag.as_str()).collect();
    match args.flag.iter().find(|it| !known.contains(&it.name.as_str())) {
        Some(unknown) => {
            Err(format!("--flag: unknown flag `{0}`: {1}", unknown.name, did_you_mean(&unknown.name, &known)))
        }
        None => Ok(()),
    }
}

#[expect(clippy::disallowed_methods, reason = "says how many times faster than real time it flew")]
fn campaign(args: &SimulateArgs, flights: &Flights) -> Result<Outcome, domain::file::Mistakes> {
    let (progress, started) = (Progress::of(args.runs.get().into(), "runs"), Instant::now());
    let told = |flight: &Flight| {
        let said = (!args.json && !flight.findings.is_empty()).then(|| report::breached(flight, args));
        progress.print(|| said.into_iter().for_each(output::line));
        progress.done();
    };
    let flown = match &args.record {
        None => flights.fly(told),
        Some(path) => {
            let (flight, header, entries) = flights.fly_recorded()?;
            told(&flight);
            if let Err(error) = replay::write(path, &header, &entries) {
                output::error_line(format_args!("{}: cannot be written: {error}", path.display()));
                return Ok(Outcome::BadInput);
            }
            Ok(vec![flight])
        }
    };
    let wall = started.elapsed();
    progress.end();
    let flown = flown?;
    match flown.as_slice() {
        _ if args.json => output::line(format_args!("{:#}", report::json(&flown, wall))),
        [one] if one.findings.is_empty() => output::line(format_args!("{}\n{}", report::story(one), report::run(one))),
        _ => {}
    }
    if !args.json {
        output::line(report::summary(&flown, wall));
    }
    Ok(verdict(&flown))
}

fn verdict(flown: &[Flight]) -> Outcome {
    if flown.iter().all(|it| it.findings.is_empty()) { Outcome::Success } else { Outcome::Breached }
}

/// Finds the fewest troubles with which the run of this seed still breaks the same rule, and tells its story.
fn shrunk(flights: &Flights, seed: u64) -> Result<Outcome, domain::file::Mistakes> {
    let script = flights.script(seed);
    let flight = fly(&script, flights.config())?;
    let Some(rule) = flight.findings.first().map(|it| it.rule) else {
        output::line(format_args!("seed {seed} has no breach: there is nothing to shrink\n{}", report::run(&flight)));
        return Ok(Outcome::Success);
    };
    let mut flown: u32 = 1;
    let breaks_it = |flight: Flight| flight.findings.iter().any(|it| it.rule == rule);
    let kept = shrink(&script.troubles, |troubles| {
        flown += 1;
        fly(&script.with(troubles.to_vec()), flights.config()).is_ok_and(breaks_it)
    });
    let (before, after) = (script.troubles.len(), kept.len());
    let shortest = fly(&script.with(kept), flights.config())?;
    output::line(report::breach(&shortest));
    output::line(format_args!("seed {seed}: troubles {before} before, {after} after, {flown} flights"));
    Ok(Outcome::Breached)
}

/// Simulated time for each second of wall time.
fn times_real_time(flown: &[Flight], wall: Duration) -> f64 {
    let flown: Duration = flown.iter().map(|it| it.flown).sum();
    flown.as_secs_f64() / wall.as_secs_f64().max(1e-9)
}
