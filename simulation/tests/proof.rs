//! Every single flag in every phase of a mission, and a part of the ordered pairs; `kittiwake check` flies all of them.

use std::path::Path;

use simulation::System;
use simulation::proof::flight::{Case, Flown};
use simulation::proof::{cases, fly_all};

/// Of the pairs every one of this number: a prime, so that no phase and no row is left out.
const ONE_OF: usize = 61;

/// Flies these cases of the shipped table.
#[track_caller]
fn check(chosen: impl Fn(usize, &Case) -> bool) {
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config");
    let system = System::read(&config).unwrap();
    let cases = cases(system.table(), system.skills().all().len(), false);
    let chosen: Vec<Case> =
        cases.into_iter().enumerate().filter(|(at, it)| chosen(*at, it)).map(|(_, it)| it).collect();
    let flown = fly_all(&config, &chosen, 2, |_| {}).unwrap();
    assert!(100 < flown.len(), "{} flights", flown.len());
    let told = |it: &Flown| format!("{:?}: {:#?}\n{}", it.case, it.faults, it.story.join("\n"));
    let faulty: Vec<String> = flown.iter().filter(|it| !it.faults.is_empty()).map(told).collect();
    assert!(faulty.is_empty(), "{} of {}:\n{}", faulty.len(), flown.len(), faulty.join("\n\n"));
}

#[test]
fn every_single_flag_is_answered_in_every_phase() {
    check(|_, it| it.second.is_none());
}

#[test]
fn a_part_of_the_pairs_is_answered_by_the_order() {
    check(|at, it| it.second.is_some() && at.is_multiple_of(ONE_OF));
}
