//! Whether the table answers everything: reviewed, tried in every set of flags, and flown.

use std::path::Path;
use std::time::{Duration, Instant};

use domain::contingency::Contingencies;
use domain::file::{Mistake, Mistakes, Source};
use simulation::proof::flight::{Case, Flown};
use simulation::proof::review::{Place, Remark, review};
use simulation::proof::sets::{Sets, try_sets};
use simulation::proof::{cases, classes, faults, fly_all};

use crate::progress::Progress;

/// Everything that was found.
pub struct Proof {
    /// What can be seen without flying, with its place in the table.
    pub remarks: Vec<Mistake>,
    /// Every set of flags.
    pub sets: Sets,
    /// Every flight; none after a remark.
    pub flown: Vec<Flown>,
    /// Every flight with faults; none after a remark.
    pub with_faults: Vec<faults::Flown>,
    /// How many kinds of rows there are.
    pub kinds: usize,
    /// Wall time.
    pub took: Duration,
}

impl Proof {
    /// Whether there is nothing against the table.
    pub fn holds(&self) -> bool {
        let flights_hold = self.faulty().next().is_none() && self.faulty_by_fault().next().is_none();
        self.remarks.is_empty() && self.sets.wrong.is_empty() && flights_hold
    }

    /// The flights with faults that have something against them.
    pub fn faulty_by_fault(&self) -> impl Iterator<Item = &faults::Flown> {
        self.with_faults.iter().filter(|it| !it.faults.is_empty())
    }

    /// The flights with something against them.
    pub fn faulty(&self) -> impl Iterator<Item = &Flown> {
        self.flown.iter().filter(|it| !it.faults.is_empty())
    }
}

/// Tries everything with the configuration file `config`, whose table is that of the file `path`.
///
/// # Errors
/// Mistakes in the files, if they were changed meanwhile.
#[expect(clippy::disallowed_methods, reason = "says how long it took")]
pub fn prove(
    config: &Path,
    path: &Path,
    table: &Contingencies,
    skills: usize,
    is_quick: bool,
    jobs: usize,
) -> Result<Proof, Mistakes> {
    let started = Instant::now();
    let source = Source::read(path)?;
    let remarks: Vec<Mistake> = review(table).iter().map(|it| placed(&source, it)).collect();
    let sets = try_sets(table, is_quick);
    let kinds = classes(table).len();
    // What a flight would show of such a table is shown by the remark.
    let is_flown = remarks.is_empty() && sets.wrong.is_empty();
    let cases = if is_flown { cases(table, skills, is_quick) } else { Vec::new() };
    let by_fault = if is_flown { faults::cases(is_quick) } else { Vec::new() };
    let progress = Progress::of((cases.len() + by_fault.len()) as u64, "flights");
    let flown = fly_all(config, &cases, jobs, |_| progress.done());
    let with_faults = faults::fly_all(config, &by_fault, jobs, || progress.done());
    progress.end();
    Ok(Proof { remarks, sets, flown: flown?, with_faults: with_faults?, kinds, took: started.elapsed() })
}

/// A remark at the line of its row, or of its waiver.
fn placed(source: &Source, remark: &Remark) -> Mistake {
    let (key, name) = match &remark.place {
        Place::Row(flag) => ("flag", flag.as_str()),
        Place::Waiver(hazard) => ("hazard", *hazard),
        Place::Table => return source.mistake(None, remark.what.clone(), remark.help),
    };
    let is_there = |line: &str| {
        let rest = line.trim_start().strip_prefix(key).map(str::trim_start);
        let value = rest.and_then(|it| it.strip_prefix('=')).map(str::trim_start);
        value.is_some_and(|it| ["\"", "'"].iter().any(|quote| it.starts_with(&format!("{quote}{name}{quote}"))))
    };
    let mut before = 0;
    let span = source.text.split_inclusive('\n').find_map(|line| {
        let at = before;
        before += line.len();
        is_there(line).then(|| at..at + line.trim_end().len())
    });
    source.mistake(span, remark.what.clone(), remark.help)
}

/// A flight in words: `obstacle, then battery_low after 2 s, cruise`.
pub fn case(table: &Contingencies, case: &Case) -> String {
    let flag = |row: usize| table.rows().get(row).map_or("", |it| it.flag.as_str());
    let second =
        case.second.map_or(String::new(), |(row, gap)| format!(", then `{}` after {} s", flag(row), gap.as_secs()));
    format!("`{}`{second}, {}", flag(case.first), case.stage)
}
