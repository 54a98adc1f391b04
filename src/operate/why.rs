//! `kittiwake why`: the decisions of a flight as sentences, each under the one that led to it.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use domain::decision::DecisionRecord;
use domain::decision::chain::chain;
use domain::wire::decision::{list, told};
use gateway::recorded;
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1;

use super::report_failure;
use crate::operate::args::{GatewayArgs, WhyArgs};
use crate::operate::failure::Failure;
use crate::operate::gateway::Gateway;
use crate::outcome::Outcome;
use crate::output;
use crate::output::visible;
use crate::run::state_folder;

/// `kittiwake why`.
pub fn why(args: &WhyArgs) -> Outcome {
    let decisions = match &args.file {
        Some(path) => of_recording(path),
        None => of_running_system(&args.gateway),
    };
    match decisions {
        Ok(decisions) => {
            print(newest(decisions, args.last), args.gateway.json);
            Outcome::Success
        }
        Err(failure) => report_failure(args.gateway.json, failure),
    }
}

fn newest(mut decisions: Vec<v1::DecisionRecord>, last: Option<NonZeroUsize>) -> Vec<v1::DecisionRecord> {
    let left_out = last.map_or(0, |last| decisions.len().saturating_sub(last.get()));
    decisions.split_off(left_out)
}

fn print(decisions: Vec<v1::DecisionRecord>, json: bool) {
    if json {
        return output::line(format_args!("{:#}", to_json(&list(decisions))));
    }
    if decisions.is_empty() {
        return output::line("no decision was recorded");
    }
    let decisions: Vec<DecisionRecord> = decisions.into_iter().map(told).collect();
    for line in chain(&decisions) {
        if !output::is_read(visible::one_line(&line)) {
            return;
        }
    }
}

/// As far as the file can be read; what is wrong with the rest goes to standard error.
fn of_recording(path: &Path) -> Result<Vec<v1::DecisionRecord>, Failure> {
    let found = recorded::decisions(path).map_err(|error| Failure::bad_input(error.to_string()))?;
    if let Some(problem) = found.problem {
        output::error_line(format_args!("{}: {problem}; only the part before is shown", path.display()));
    }
    Ok(found.messages)
}

/// Of the gateway that is meant; of the newest recording, where none is named and none runs here.
fn of_running_system(args: &GatewayArgs) -> Result<Vec<v1::DecisionRecord>, Failure> {
    let is_named = args.url.is_some() || args.pid.is_some() || args.vehicle.is_some();
    match Gateway::find(args) {
        Ok(gateway) => gateway.decisions(&gateway.vehicle()?, 0),
        Err(failure) if is_named || failure.outcome != Outcome::Unreachable => Err(failure),
        Err(failure) => of_newest_recording(failure),
    }
}

/// Of the newest recording that has any: a system that was started and ended before it decided anything explains no flight.
fn of_newest_recording(nothing_runs: Failure) -> Result<Vec<v1::DecisionRecord>, Failure> {
    let Some(folder) = state_folder::recordings() else { return Err(nothing_runs) };
    let files = recorded::newest_first(&folder)
        .map_err(|cause| Failure::bad_input(format!("{}: cannot be read: {cause}", folder.display())))?;
    let has_decisions = |path: &&PathBuf| recorded::decisions(path).is_ok_and(|it| !it.messages.is_empty());
    let Some(path) = files.iter().find(has_decisions) else {
        let folder = folder.display();
        return Err(Failure::bad_input(format!(
            "no system runs here, and there is no recording with a decision in {folder}; name a file"
        )));
    };
    output::error_line(format_args!("no system runs here; the newest recording with a decision is {}", path.display()));
    of_recording(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_ones_are_told() {
        #[track_caller]
        fn check(last: Option<usize>, expected: &[u64]) {
            let decision = |sequence| v1::DecisionRecord { sequence, ..Default::default() };
            let told = newest((1..=4).map(decision).collect(), last.and_then(NonZeroUsize::new));
            assert_eq!(told.iter().map(|it| it.sequence).collect::<Vec<_>>(), expected);
        }
        check(None, &[1, 2, 3, 4]);
        check(Some(2), &[3, 4]);
        check(Some(9), &[1, 2, 3, 4]);
    }
}
