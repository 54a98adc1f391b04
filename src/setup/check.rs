//! `kittiwake check`: reads and checks what `kittiwake up` and the routers read, and starts nothing.

use std::path::{Path, PathBuf};

use bus::crossing::Crossing;
use domain::file::{Mistakes, Source};

use crate::check_inputs::{self, Inputs};
use crate::cli::CheckArgs;
use crate::outcome::Outcome;
use crate::{output, plan};

/// The link table, beside the configuration file.
const LINK: &str = "zenoh/link.toml";

/// A link table that was read.
struct LinkTable {
    path: PathBuf,
    crossing: Crossing,
}

/// Says what was read, a line for each file, or prints the contingency tree. Every mistake in any of the files is
/// printed on standard error, with its place.
pub fn check(args: &CheckArgs) -> Outcome {
    let (inputs, link) = match (check_inputs::read(&args.settings), link_table(args)) {
        (Ok(inputs), Ok(link)) => (inputs, link),
        (inputs, link) => {
            let mistakes = [inputs.err(), link.err()].into_iter().flatten().flat_map(|of_a_file| of_a_file.0);
            return check_inputs::tell(&Mistakes(mistakes.collect()));
        }
    };
    if let Err(outcome) = check_inputs::read_tls(&inputs.config) {
        return outcome;
    }
    match plan::forecast(&inputs, None) {
        Err(mistakes) => return check_inputs::tell(&mistakes),
        Ok(reply) => {
            if let Some(shortfall) = reply.energy.map(|it| it.shortfall).filter(|it| !it.is_empty()) {
                let path = inputs.config.mission.display();
                output::error_line(format_args!(
                    "{path}: the mission {shortfall}\n  help: `kittiwake plan {path}` prints what each part takes"
                ));
                return Outcome::BadInput;
            }
        }
    }
    if args.print_tree {
        output::line(mcm::contingency_xml(&inputs.contingencies).trim_end());
    } else {
        for line in summary(&args.settings.config, &inputs, link.as_ref()) {
            output::line(line);
        }
    }
    Outcome::Success
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
    ];
    lines.extend(inputs.notes());
    lines.extend(link.map(|link| ok(&link.path, format_args!("the link to {}", link.crossing.ground))));
    lines
}

fn ok(path: &Path, what: std::fmt::Arguments<'_>) -> String {
    format!("ok: {}: {what}", path.display())
}
