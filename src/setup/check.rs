//! `kittiwake check`: reads and checks what `kittiwake up` and the routers read, and proves in flights in virtual time that the
//! contingency table answers everything. Nothing is started.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use bus::crossing::Crossing;
use domain::contingency::hazard::{HAZARDS, Waiver};
use domain::contingency::label::Label;
use domain::contingency::listing;
use domain::file::{Mistakes, Source};
use gateway::tls::Demand;

use crate::backend::Backend;
use crate::check_inputs::{self, Inputs};
use crate::cli::CheckArgs;
use crate::config::Config;
use crate::outcome::Outcome;
use crate::{output, plan};

mod matrix;
mod proof;

use matrix::Matrix;
use proof::Proof;

/// The link table, beside the configuration file.
const LINK: &str = "zenoh/link.toml";

/// Flights with a breach, and sets that are answered against the order, that are printed with their story.
const MOST_TOLD: usize = 20;

/// A link table that was read.
struct LinkTable {
    path: PathBuf,
    crossing: Crossing,
}

/// Says what was read, a line for each file, or prints the contingency tree or table; then what there is against the mission and the
/// table. Every mistake in any of the files is printed on standard error, with its place.
pub fn check(args: &CheckArgs) -> Outcome {
    let (inputs, link) = match (check_inputs::read(&args.settings), link_table(args)) {
        (Ok(inputs), Ok(link)) => (inputs, link),
        (inputs, link) => {
            let mistakes = [inputs.err(), link.err()].into_iter().flatten().flat_map(|of_a_file| of_a_file.0);
            return check_inputs::tell(&Mistakes(mistakes.collect()));
        }
    };
    if let Err(mistakes) = inputs.suits(Backend::Sim) {
        return check_inputs::tell(&mistakes);
    }
    if let Err(outcome) = check_tls(&inputs.config, args.files_only) {
        return outcome;
    }
    let reply = match plan::forecast(&inputs, None) {
        Err(mistakes) => return check_inputs::tell(&mistakes),
        Ok(reply) => reply,
    };
    let path = inputs.config.mission.display();
    if let Some(shortfall) = reply.energy.as_ref().map(|it| &it.shortfall).filter(|it| !it.is_empty()) {
        output::error_line(format_args!(
            "{path}: the mission {shortfall}\n  help: `kittiwake plan {path}` prints what each part takes"
        ));
        return Outcome::BadInput;
    }
    if args.print_tree {
        output::line(mcm::contingency_xml(&inputs.contingencies).trim_end());
        return Outcome::Success;
    }
    if args.print_contingencies {
        output::line(listing::markdown(&inputs.contingencies));
        output::line(listing::lattice_markdown().trim_end());
        return Outcome::Success;
    }
    for line in summary(&args.settings.config, &inputs, link.as_ref()) {
        output::line(line);
    }
    if args.files_only {
        return Outcome::Success;
    }
    output::line(plan::in_words(&reply).trim_end());
    if !reply.accepted {
        output::error_line(format_args!("{path}: the mission cannot be flown as it is; the lines above say why"));
        return Outcome::NotFlyable;
    }
    proven(args, &inputs)
}

/// Whether the gateway's connections can be encrypted, if they are to be. Files alone are checked when a machine starts, also in flight,
/// and before its clock is right: a wrong date is reported then, and keeps nobody away.
#[expect(clippy::disallowed_methods, reason = "certificates expire by UTC")]
fn check_tls(config: &Config, files_only: bool) -> Result<(), Outcome> {
    let demand = if files_only { Demand::Usable } else { Demand::Valid };
    let encryption = check_inputs::read_tls(config, demand)?;
    if let Some(out_of_date) = encryption.and_then(|it| it.shown.out_of_date(SystemTime::now())) {
        output::error_line(format_args!("note: {out_of_date}"));
    }
    Ok(())
}

/// Proves the table, and prints what was found.
fn proven(args: &CheckArgs, inputs: &Inputs) -> Outcome {
    let (config, table) = (&inputs.config, &inputs.contingencies);
    let jobs = args.jobs.map_or_else(|| std::thread::available_parallelism().map_or(1, Into::into), Into::into);
    let proof = match proof::prove(
        &args.settings.config,
        &config.contingencies,
        table,
        inputs.skills.all().len(),
        args.quick,
        jobs,
    ) {
        Ok(proof) => proof,
        Err(mistakes) => return check_inputs::tell(&mistakes),
    };
    let matrix = Matrix::of(table, &proof);
    if !proof.flown.is_empty() {
        output::line(matrix.text().trim_end());
    }
    for line in conclusion(args, inputs, &proof) {
        output::line(line);
    }
    if let Some(path) = &args.html {
        let is_picture = path.extension().is_some_and(|it| it == "svg");
        let page = if is_picture { matrix.picture(false) } else { matrix.page() };
        if let Err(error) = regular_file::write(path, page) {
            output::error_line(format_args!("{}: cannot be written: {error}", path.display()));
            return Outcome::BadInput;
        }
    }
    let told = config.contingencies.display();
    if !proof.remarks.is_empty() {
        output::error_line(Mistakes(proof.remarks.clone()));
    }
    for wrong in proof.sets.wrong.iter().take(MOST_TOLD) {
        output::error_line(format_args!("{told}: {wrong}"));
    }
    for flown in proof.faulty().take(MOST_TOLD) {
        let (case, story) = (proof::case(table, &flown.case), flown.story.join("\n    "));
        let faults = flown.faults.join("; ");
        output::error_line(format_args!("{told}: {case}: {faults}\n    {story}"));
    }
    for flown in proof.faulty_by_fault().take(MOST_TOLD) {
        let (faults, story) = (flown.faults.join("; "), flown.story.join("\n    "));
        output::error_line(format_args!("{told}: {}: {faults}\n    {story}", flown.name));
    }
    if proof.holds() { Outcome::Success } else { Outcome::Breached }
}

/// What was tried, and how much.
fn conclusion(args: &CheckArgs, inputs: &Inputs, proof: &Proof) -> Vec<String> {
    let table = &inputs.contingencies;
    let rows = table.rows();
    let (comfort, rows) = (rows.iter().filter(|it| it.label == Label::Comfort).count(), rows.len());
    let flown = proof.flown.iter().map(|it| it.flown).chain(proof.with_faults.iter().map(|it| it.flown));
    let flown_h = flown.sum::<std::time::Duration>().as_secs_f64() / 3600.0;
    let sampled: String =
        proof.sets.sampled.iter().map(|(group, rows)| format!(", {group} ({rows} rows) in part")).collect();
    let sample = if args.quick {
        " (--quick: each kind alone on the way, and two pairs of each in turn through the phases)"
    } else {
        ""
    };
    let mut lines = vec![
        format!(
            "table: {rows} rows of {} kinds, {comfort} of them comfort, {} faults of rows or hazards without an answer",
            proof.kinds,
            proof.remarks.len()
        ),
        format!("hazards: {}, {} waived in whole or in part", HAZARDS.len(), table.waivers().len()),
        format!(
            "sets: {} sets of flags of a group in a phase{sampled}, {} answered against the order",
            proof.sets.tried,
            proof.sets.wrong.len()
        ),
        format!(
            "flights: {}{sample}, {} with a breach; with faults: {}, {} with a breach; {flown_h:.1} h flown in {:.1} s",
            proof.flown.len(),
            proof.faulty().count(),
            proof.with_faults.len(),
            proof.faulty_by_fault().count(),
            proof.took.as_secs_f64()
        ),
    ];
    lines.splice(2..2, table.waivers().iter().map(waived));
    lines
}

/// `waived: battery-low (battery.charge_percent 15.00 %) on the ground: the reason`.
fn waived(waiver: &Waiver) -> String {
    let phases = waiver.phases.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    format!("waived: {} ({}) {phases}: {}", waiver.hazard.name, waiver.hazard.sign, waiver.reason)
}

/// The table that the arguments name, which must be there, or the one beside the configuration, which need not: where no
/// router has a link, nothing crosses one.
fn link_table(args: &CheckArgs) -> Result<Option<LinkTable>, Mistakes> {
    let beside = args.settings.config.with_file_name(LINK);
    let path = match &args.link {
        Some(named) => named.clone(),
        None if beside.exists() => beside,
        None => return Ok(None),
    };
    let crossing = Crossing::read(&Source::read(&path)?)?;
    Ok(Some(LinkTable { path, crossing }))
}

fn summary(config: &Path, inputs: &Inputs, link: Option<&LinkTable>) -> Vec<String> {
    let Inputs { config: read, mission, contingencies, .. } = inputs;
    let mut lines = vec![
        ok(config, format_args!("vehicle {}", read.vehicle)),
        ok(
            &read.mission,
            format_args!(
                "mission {}, objectives: {}, areas: {}",
                mission.name,
                mission.objectives.len(),
                mission.areas.len()
            ),
        ),
        ok(&read.trees, format_args!("the mission's tree, a step's and those of the actions")),
        ok(&read.contingencies, format_args!("contingencies: {}", contingencies.rows().len())),
        ok(&read.skills, format_args!("declared skills: {}", inputs.skills.all().len())),
    ];
    lines.extend(inputs.notes());
    lines.extend(link.map(|link| ok(&link.path, format_args!("the link to {}", link.crossing.ground))));
    lines
}

fn ok(path: &Path, what: std::fmt::Arguments<'_>) -> String {
    format!("ok: {}: {what}", path.display())
}
