//! That a table answers everything: what can be seen without flying, hazards included ([`hazards`]), every set of flags within a
//! group, every single flag and every ordered pair in every phase of a mission, flown by the services themselves, and flags that faults
//! raise ([`faults`]).
//!
//! Nothing here knows the name of a row: rows, order and responses are read from the table, and the rules that flights are judged by
//! ([`flight`]) are those of the order.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use domain::contingency::Contingencies;
use domain::file::Mistakes;

mod classes;
pub mod faults;
pub mod flight;
pub mod hazards;
pub mod review;
mod rises;
pub mod sets;
pub mod stage;

pub use classes::classes;
use flight::{Case, Flown, fly};
use stage::Stage;

use crate::{Conduct, System};

/// Between two flags: at one moment, while the first response begins, and once it is established.
const GAPS: [Duration; 3] = [Duration::ZERO, Duration::from_secs(2), Duration::from_secs(12)];
/// The one that is flown in every phase.
const GAP: Duration = GAPS[1];
/// Pairs in a hurry: for each class as many others as second flag.
const OTHERS: usize = 2;

/// The flights that show what the manager does with a table, each once.
///
/// Of rows that it cannot tell apart ([`classes`]) the first is flown, and with another one of its kind the last. Of `skills` each is under
/// way once with every flag, and with every pair; in a hurry each flag meets one of them.
pub fn cases(table: &Contingencies, skills: usize, is_quick: bool) -> Vec<Case> {
    let classes = classes(table);
    let mut cases = Vec::new();
    let single = |stage: Stage, class: &[usize]| Case { stage, first: class[0], second: None };
    if is_quick {
        cases.extend(classes.iter().map(|it| single(Stage::Cruise, it)));
        let stages = Stage::ALL.into_iter().cycle();
        let pairs = (1..=OTHERS).flat_map(|away| (0..classes.len()).map(move |it| (it, away)));
        for ((number, away), stage) in pairs.zip(stages) {
            // Another class each time, as long as there are others.
            let other = (number + away * (number % 7 + 1)) % classes.len();
            cases.extend(pair(stage, GAP, &classes[number], &classes[other]));
        }
        let tasks = (0..skills).cycle().map(|it| Stage::Task(it, Conduct::Endless));
        cases.extend(tasks.zip(&classes).map(|(stage, class)| single(stage, class)));
        return cases;
    }
    for skill in 0..skills {
        for conduct in [Conduct::Endless, Conduct::Deaf, Conduct::Gone] {
            cases.extend(classes.iter().map(|it| single(Stage::Task(skill, conduct), it)));
        }
        let stage = Stage::Task(skill, Conduct::Endless);
        let pairs = classes.iter().flat_map(|first| classes.iter().filter_map(move |it| pair(stage, GAP, first, it)));
        cases.extend(pairs);
    }
    for stage in Stage::ALL {
        cases.extend(classes.iter().map(|it| single(stage, it)));
        for gap in GAPS.into_iter().filter(|it| *it == GAP || stage == Stage::Cruise) {
            for first in &classes {
                cases.extend(classes.iter().filter_map(|second| pair(stage, gap, first, second)));
            }
        }
    }
    cases
}

/// `None` for a class of one with itself.
fn pair(stage: Stage, gap: Duration, first: &[usize], second: &[usize]) -> Option<Case> {
    let (one, other) = (first[0], if first == second { *second.last()? } else { second[0] });
    (one != other).then_some(Case { stage, first: one, second: Some((other, gap)) })
}

/// Flies them, `jobs` at a time, `done` after each; in their order.
///
/// # Errors
/// Mistakes in the files, if they were changed meanwhile.
pub fn fly_all(
    config: &std::path::Path,
    cases: &[Case],
    jobs: usize,
    done: impl Fn(&Flown) + Sync,
) -> Result<Vec<Flown>, Mistakes> {
    each(config, cases, jobs, |system, case| {
        let flown = fly(system, system.table(), case)?;
        done(&flown);
        Ok(flown)
    })
}

/// Flies each of `items`, `jobs` at a time; in their order.
fn each<Item: Sync, Flown: Send>(
    config: &std::path::Path,
    items: &[Item],
    jobs: usize,
    fly: impl Fn(&System, &Item) -> Result<Flown, Mistakes> + Sync,
) -> Result<Vec<Flown>, Mistakes> {
    let (next, flown) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let job = || -> Result<(), Mistakes> {
        // Trees hold leaves that live in one thread.
        let system = System::read(config)?;
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(number) else { return Ok(()) };
            let flight = fly(&system, item)?;
            flown.lock().unwrap_or_else(|it| it.into_inner()).insert(number, flight);
        }
    };
    let results = std::thread::scope(|scope| {
        let started: Vec<_> = (0..jobs.max(1)).map(|_| scope.spawn(job)).collect();
        started.into_iter().map(|it| it.join()).collect::<Vec<_>>()
    });
    for result in results {
        result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    }
    Ok(flown.into_inner().unwrap_or_else(|it| it.into_inner()).into_values().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    fn config() -> PathBuf {
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../config")
    }

    #[test]
    fn every_pair_of_rows_is_that_of_a_class_and_every_phase_is_flown() {
        let system = System::read(&config()).unwrap();
        let (table, classes) = (system.table(), classes(system.table()));
        assert_eq!(classes.iter().map(Vec::len).sum::<usize>(), table.rows().len(), "each row is in one class");
        let cases = cases(table, 0, false);
        for stage in Stage::ALL {
            let singles = cases.iter().filter(|it| it.stage == stage && it.second.is_none()).count();
            assert_eq!(singles, classes.len(), "{stage}");
            let pairs = cases.iter().filter(|it| it.stage == stage && it.second.is_some_and(|(_, gap)| gap == GAP));
            let large = classes.iter().filter(|it| 1 < it.len()).count();
            assert_eq!(pairs.count(), classes.len() * (classes.len() - 1) + large, "{stage}");
        }
    }

    #[test]
    fn the_flights_in_a_hurry_have_nothing_against_the_shipped_table() {
        let system = System::read(&config()).unwrap();
        let cases = cases(system.table(), system.skills().all().len(), true);
        let flown = fly_all(&config(), &cases, 2, |_| {}).unwrap();
        assert_eq!(flown.len(), cases.len());
        let faulty: Vec<&Flown> = flown.iter().filter(|it| !it.faults.is_empty()).collect();
        let told = |it: &&Flown| format!("{:?}: {:#?}\n{}", it.case, it.faults, it.story.join("\n"));
        assert!(faulty.is_empty(), "{}", faulty.iter().map(told).collect::<Vec<_>>().join("\n\n"));
    }
}
