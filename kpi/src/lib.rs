//! The reference's measurements on the real system, beside the reference's figures: `kittiwake-kpi`.
//!
//! It starts the processes that `kittiwake up` starts, of the executable `kittiwake`, looks on from outside and puts the
//! stamps that messages carry together: nothing is added to a message, and no process does more than it does in flight
//! but for the mission manager, which publishes a record of its own in the few wakes in which something happens, after
//! everything else has left.

use std::path::{Path, PathBuf};
use std::time::Duration;

use bus::{Stop, Tapped};
use control_tower::policy::Policy;
use kittiwake::outcome::Outcome;
use kittiwake::settings::Settings;
use kittiwake::{check_inputs, output, telemetry};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1::{SkillKind, SkillState};
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand::seq::SliceRandom;
use serde::Serialize;

use crate::analysis::{Class, Samples, analyse};
use crate::args::Args;
use crate::disturbed::Disturbance;
use crate::injector::Injector;
use crate::system::{System, await_skill, is_report};
use crate::variant::{Folder, Variant};

pub mod analysis;
pub mod args;
mod audience;
mod cost;
mod disturbed;
pub mod floor;
mod injector;
pub mod link;
mod load;
mod operator;
mod plot;
mod rates;
mod real_time;
mod reference;
mod statistics;
mod system;
mod table;
mod targets;
mod variant;

/// A flight at ten times real time takes half a minute; one that takes this long has gone wrong.
const FLIGHT: Duration = Duration::from_secs(300);
/// A class that is still short of samples after this many flights stays short, and the table says so.
const MOST_FLIGHTS: u32 = 40;
/// The reference's number of flags.
const FLAGS: usize = 16;
/// The program that is measured; it lies beside this one.
const MEASURED: &str = "kittiwake";

/// Everything that was measured.
#[derive(Debug, Serialize)]
struct Measured {
    machine: String,
    load_before: f64,
    load_after: f64,
    speed: f64,
    /// The nodes that had one process.
    onboard: Option<String>,
    ticks: Vec<Tick>,
    floor: Option<Samples>,
    load: Option<real_time::RealTime>,
    reference: reference::Reference,
}

/// At one tick period.
#[derive(Debug, Serialize)]
struct Tick {
    tick_ms: u32,
    mission: Samples,
    flat: Samples,
    nested: Samples,
}

/// Measures, and prints the tables.
pub fn run(args: &Args) -> Outcome {
    let inputs = match check_inputs::read_or_tell(&Settings::of_file(&args.config)) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    let program = match measured_program(args) {
        Ok(program) => program,
        Err(cause) => {
            output::error_line(format_args!("kpi: {cause}"));
            return Outcome::Unavailable;
        }
    };
    let vehicle = inputs.config.vehicle.as_str();
    let telemetry = telemetry::start("kpi", vehicle, &inputs.config.telemetry);
    let result = match (args.operator, args.link, args.disturbed) {
        (true, ..) => operator::measure(&program, &args.config, vehicle).and_then(|it| {
            output::line(operator::text(&it));
            write_json(args, &it)
        }),
        (_, true, _) => link::measure(&program, &args.config, vehicle).and_then(|it| {
            output::line(link::text(&it));
            write_json(args, &it)
        }),
        (.., true) => disturbed(&program, args, vehicle).and_then(|it| {
            output::line(disturbed::text(&it));
            write_json(args, &it)
        }),
        (false, false, false) => measure(&program, args, vehicle).and_then(|it| publish(args, &it)),
    };
    telemetry.end();
    told(result)
}

/// The executable that is measured: the one that the arguments name, else the one beside this program.
fn measured_program(args: &Args) -> Result<PathBuf, String> {
    let beside = || std::env::current_exe().map(|own| own.with_file_name(MEASURED));
    let program = args.program.clone().map_or_else(beside, Ok).map_err(|cause| cause.to_string())?;
    match program.is_file() {
        true => Ok(program),
        false => Err(format!(
            "{} is missing: build it with `cargo build --release`, or name another with --program",
            program.display()
        )),
    }
}

fn told(result: Result<(), String>) -> Outcome {
    match result {
        Ok(()) => Outcome::Success,
        Err(cause) => {
            output::error_line(format_args!("kpi: {cause}"));
            Outcome::NotKeptUp
        }
    }
}

fn publish(args: &Args, measured: &Measured) -> Result<(), String> {
    output::line(table::text(measured));
    write_json(args, measured)?;
    if let Some(folder) = &args.plots {
        plot::draw(measured, folder).map_err(|it| format!("{}: {it}", folder.display()))?;
    }
    Ok(())
}

fn write_json(args: &Args, measured: &impl Serialize) -> Result<(), String> {
    let Some(path) = &args.json else { return Ok(()) };
    let json = serde_json::to_vec_pretty(measured).map_err(|it| it.to_string())?;
    regular_file::write(path, json).map_err(|it| format!("{}: {it}", path.display()))
}

fn measure(program: &Path, args: &Args, vehicle: &str) -> Result<Measured, String> {
    let folder = Folder::new().map_err(|it| it.to_string())?;
    let load_before = load::load_average();
    let flights = Flights { program, args, vehicle, folder: &folder };
    let mut floor = args.floor.then(Samples::default);
    let mut ticks = Vec::new();
    for tick_ms in &args.tick_ms {
        // As close in time as can be to what is compared with it: the machine may have others to serve.
        if let Some(floor) = &mut floor {
            say("floor: two bare processes");
            floor.add(floor::measure(program, &args.config)?);
        }
        ticks.push(flights.at(*tick_ms)?);
    }
    let load = match args.load {
        Some(seconds) => {
            let hover = Duration::from_secs(seconds.into());
            let processes = system::processes(args.onboard);
            Some(real_time::measure(program, &args.config, vehicle, &processes, hover, |it| {
                say(&format!("real time: {it}"));
            })?)
        }
        None => None,
    };
    let (machine, load_after) = (load::machine(), load::load_average());
    Ok(Measured {
        machine,
        load_before,
        load_after,
        speed: args.speed.pace().speed(),
        onboard: args.onboard.map(|it| it.to_string()),
        ticks,
        floor,
        load,
        reference: reference::ALL,
    })
}

fn disturbed(program: &Path, args: &Args, vehicle: &str) -> Result<disturbed::Disturbed, String> {
    let folder = Folder::new().map_err(|it| it.to_string())?;
    disturbed::measure(&Flights { program, args, vehicle, folder: &folder })
}

/// Flies the mission with the executable `program` until each class of transitions has the samples that `args` wants.
///
/// # Errors
/// If a process cannot be started or ends early, or a flight does not end.
pub fn transitions(program: &Path, args: &Args, vehicle: &str, tick_ms: u32) -> Result<Samples, String> {
    let folder = Folder::new().map_err(|cause| cause.to_string())?;
    Flights { program, args, vehicle, folder: &folder }.missions(tick_ms)
}

struct Flights<'a> {
    program: &'a Path,
    args: &'a Args,
    vehicle: &'a str,
    folder: &'a Folder,
}

impl Flights<'_> {
    /// Everything at one tick period.
    fn at(&self, tick_ms: u32) -> Result<Tick, String> {
        Ok(Tick {
            tick_ms,
            mission: self.missions(tick_ms)?,
            flat: self.contingencies(tick_ms, "flat.toml", Disturbance::Nothing)?,
            nested: self.contingencies(tick_ms, "nested.toml", Disturbance::Nothing)?,
        })
    }

    /// Flies until every class has its samples.
    fn missions(&self, tick_ms: u32) -> Result<Samples, String> {
        let variant = Variant { tick_ms: Some(tick_ms), ..Variant::default() };
        let config = self.folder.write(&self.args.config, &variant)?;
        let mut samples = Samples::default();
        for flight in 1..=MOST_FLIGHTS {
            // One in three is not answered at all.
            let permissions = if flight % 3 == 0 { Policy::Silent } else { Policy::Random };
            let settings = self.settings(&config, permissions, flight.into());
            let system = System::start(self.program, &settings, self.vehicle, &system::processes(self.args.onboard))?;
            let mut heard = Vec::new();
            if !system.listen(FLIGHT, &mut heard, is_report)? {
                return Err(format!("flight {flight} at {tick_ms} ms did not end"));
            }
            drop(system);
            let ending = heard.last().and_then(outcome).unwrap_or_default();
            samples.add(analyse(&heard));
            let counts = [Class::N2N, Class::N2T, Class::T2N].map(|it| samples.of_class(it).len());
            let [n2n, n2t, t2n] = counts;
            say(&format!(
                "{tick_ms} ms: flight {flight}, permissions {permissions}, {ending}: N2N {n2n}, N2T {n2t}, T2N {t2n}"
            ));
            if self.args.runs <= flight && counts.iter().all(|it| self.args.samples <= *it) {
                break;
            }
        }
        Ok(samples)
    }

    /// Flies until every flag was raised, and acted on, so often.
    fn contingencies(&self, tick_ms: u32, table: &'static str, meanwhile: Disturbance) -> Result<Samples, String> {
        let variant = Variant { tick_ms: Some(tick_ms), contingencies: Some(table), mission: Some("mission.toml") };
        let config = self.folder.write(&self.args.config, &variant)?;
        let mut samples = Samples::default();
        for flight in 1..=MOST_FLIGHTS {
            let missing = self.missing(&samples, flight.into());
            let settings = self.settings(&config, Policy::Grant, flight.into());
            let system = System::start(self.program, &settings, self.vehicle, &system::processes(self.args.onboard))?;
            let mut heard = Vec::new();
            await_skill(&system, SkillKind::Takeoff, SkillState::Ended, &mut heard)?;
            let disturbance = meanwhile.begin(&system)?;
            let injector = system.join(Injector::new(missing.clone(), flight.into()));
            let mut answered = 0;
            let ended = system.listen(FLIGHT, &mut heard, |it| {
                // Lowered once it is answered.
                answered += usize::from(matches!(&it.message, Message::FlagEvent(flag) if !flag.raised));
                missing.len() <= answered || is_report(it)
            });
            injector.stop();
            disturbance.iter().for_each(Stop::stop);
            drop(system);
            if !ended? {
                return Err(format!("contingency flight {flight} at {tick_ms} ms did not end"));
            }
            samples.add(analyse(&heard));
            let (raised, wanted) = (samples.reactions.len(), FLAGS * self.args.raises);
            say(&format!("{tick_ms} ms: {table}, flight {flight}: {raised} of {wanted} flags answered"));
            if self.missing(&samples, 0).is_empty() {
                break;
            }
        }
        Ok(samples)
    }

    /// The flags that are still to be raised, in an order drawn from the seed.
    fn missing(&self, samples: &Samples, seed: u64) -> Vec<String> {
        let name = |number: usize| format!("flag_{number:02}");
        let so_far = |flag: &str| samples.reactions.iter().filter(|it| it.flag == flag).count();
        let left = |flag: String| {
            let count = self.args.raises.saturating_sub(so_far(&flag));
            std::iter::repeat_n(flag, count)
        };
        let mut missing: Vec<String> = (0..FLAGS).map(name).flat_map(left).collect();
        missing.shuffle(&mut StdRng::seed_from_u64(seed));
        missing
    }

    fn settings(&self, config: &Path, permissions: Policy, seed: u64) -> Settings {
        let mut settings = Settings::of_file(config);
        settings.speed = Some(self.args.speed);
        settings.permissions = Some(permissions);
        settings.seed = Some(seed);
        settings.http = Some(([127, 0, 0, 1], 0).into());
        settings
    }
}

/// How the mission ended.
fn outcome(last: &Tapped) -> Option<String> {
    let Message::McmStatus(status) = &last.message else { return None };
    let report = status.report.as_ref()?;
    Some(format!("{} after {:.0} s", report.reason, report.duration_s))
}

/// How far it has come; the tables alone are on standard output.
fn say(text: &str) {
    output::error_line(text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Cli;
    use clap::Parser as _;

    #[test]
    fn a_missing_program_and_arguments_that_exclude_each_other_are_refused() {
        let parsed = |given: &[&str]| Cli::try_parse_from([&["kpi"], given].concat()).map_err(|it| it.to_string());
        let nowhere = parsed(&["--link", "--program", "nowhere"]).unwrap().args;
        let missing = measured_program(&nowhere).unwrap_err();
        assert!(missing.starts_with("nowhere is missing: build it with `cargo build --release`"), "{missing}");
        assert!(parsed(&["--link", "--operator"]).unwrap_err().contains("cannot be used with"));
    }
}
