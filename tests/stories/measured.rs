//! The program that measures, from the outside.

use std::path::Path;
use std::process::Command;

use clap::Parser;
use kittiwake_kpi::analysis::Class;
use kittiwake_kpi::args::Cli;

use crate::support::{KITTIWAKE, shipped};

/// The program in a folder of its own, with the executable `beside` linked as `kittiwake-kpi`: how `kittiwake kpi` ends
/// there, and what it prints.
fn kpi_beside(beside: Option<&str>, args: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let program = folder.path().join("kittiwake");
    std::fs::hard_link(KITTIWAKE, &program).unwrap();
    if let Some(beside) = beside {
        std::os::unix::fs::symlink(beside, folder.path().join("kittiwake-kpi")).unwrap();
    }
    let output = Command::new(program).arg("kpi").args(args).output().unwrap();
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

#[test]
fn the_program_that_measures_is_started_or_it_is_said_how_to_build_it() {
    let there = kpi_beside(Some("/bin/echo"), &["--floor", "--tick-ms", "10"]);
    assert_eq!(there, (Some(0), "--floor --tick-ms 10\n".into()));
    assert_eq!(kpi_beside(Some("/bin/false"), &[]).0, Some(1), "its exit code is handed on");
    let (code, said) = kpi_beside(None, &["--floor"]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("kittiwake-kpi is missing: build it with `cargo build"), "{said}");
}

#[test]
fn a_flight_shows_its_transitions_to_who_looks_on() {
    let config = shipped().join("kittiwake.toml");
    let args = ["kpi", "--samples", "1", "--speed", "20", "--config", config.to_str().unwrap()];
    let args = Cli::parse_from(args).args;
    let samples = kittiwake_kpi::transitions(Path::new(KITTIWAKE), &args, "uav1", 10).unwrap();
    for class in [Class::N2N, Class::N2T, Class::T2N] {
        let took_s = samples.of_class(class);
        assert!(!took_s.is_empty() && took_s.iter().all(|it| 0.0 < *it && *it < 1.0), "{class:?}: {took_s:?}");
    }
    assert!(!samples.felt_transitions.is_empty(), "no transition was followed to the vehicle");
    assert!(0 < samples.tick_histogram.iter().sum::<u64>(), "no tick was counted");
}
