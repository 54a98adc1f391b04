//! Three faults in one flight, and why the vehicle did what it did: every decision has its record, and each follows from another.

use std::collections::BTreeSet;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::decision::chain::chain;
use domain::wire::decision::told;
use kittiwake_proto::v1::{self, DecisionKind, MissionOutcome};
use node::virtual_bus::UTC_START_MS;
use simulation::Simulation;

use crate::stories::support::simulation;

const LIMIT: Duration = Duration::from_secs(2400);

#[track_caller]
fn await_decision(simulation: &mut Simulation<'_>, text: &str) {
    assert!(simulation.fly_until(text, LIMIT), "`{text}` in vain:\n{}", simulation.decision_log());
}

/// An obstacle, a position that is silent for a while, and a battery that sinks to a fifth.
fn flight() -> Vec<v1::DecisionRecord> {
    let mut simulation = simulation(None, Policy::Grant);
    await_decision(&mut simulation, "step 4 of 5");
    simulation.pass(Duration::from_secs(10));
    simulation.inject_flag("obstacle");
    await_decision(&mut simulation, "`obstacle` is over");
    simulation.pass(Duration::from_secs(5));
    simulation.inject_fault("drop", &["vehicle_local_position"]);
    await_decision(&mut simulation, "`local_position_stale`: stop");
    simulation.pass(Duration::from_secs(5));
    simulation.inject_fault("clear", &[]);
    await_decision(&mut simulation, "`local_position_stale` is over");
    simulation.pass(Duration::from_secs(5));
    simulation.inject_fault("battery", &["0.2"]);
    let report = simulation.fly(LIMIT).expect("the mission to end");
    assert_eq!(report.outcome(), MissionOutcome::Emergency, "{}", simulation.decision_log());
    simulation.decisions().into_iter().map(|(_, record)| record).collect()
}

/// The last record of this kind about this flag.
#[track_caller]
fn last<'a>(records: &'a [v1::DecisionRecord], kind: DecisionKind, flag: &str) -> &'a v1::DecisionRecord {
    let found = records.iter().rev().find(|it| it.kind() == kind && it.flag == flag);
    found.unwrap_or_else(|| panic!("no {kind:?} of `{flag}` in {records:#?}"))
}

#[test]
fn each_decision_has_a_number_a_time_and_a_cause_before_it() {
    let records = flight();
    let mut numbers = BTreeSet::new();
    for record in &records {
        assert!(numbers.last().is_none_or(|last| *last < record.sequence), "numbers rise: {record:?}");
        assert!(record.parent == 0 || numbers.contains(&record.parent), "it follows from nothing: {record:?}");
        let utc_s = (record.utc_ms - UTC_START_MS) as f64 / 1000.0;
        assert!((utc_s - record.at_s).abs() < 0.002, "two times: {record:?}");
        numbers.insert(record.sequence);
    }
}

#[test]
fn each_fault_is_told_with_its_value_and_what_was_done() {
    let records = flight();
    for (flag, unit, response) in [("local_position_stale", "s", "stop"), ("battery_low", "%", "divert")] {
        let raised = last(&records, DecisionKind::ContingencyRaised, flag);
        assert_eq!((raised.parent, raised.unit.as_str()), (0, unit), "{raised:?}");
        let answered = last(&records, DecisionKind::ContingencyAnswered, flag);
        assert_eq!((answered.parent, answered.response.as_str()), (raised.sequence, response));
        assert_eq!((answered.value, answered.threshold), (raised.value, raised.threshold));
        let cleared = last(&records, DecisionKind::ContingencyCleared, flag);
        assert_eq!(cleared.parent, answered.sequence);
    }
    let low = last(&records, DecisionKind::ContingencyRaised, "battery_low");
    assert!(low.threshold == Some(25.0) && low.value.is_some_and(|it| 10.0 < it && it < 25.0), "{low:?}");
    // By hand: nothing was measured.
    assert_eq!(last(&records, DecisionKind::ContingencyRaised, "obstacle").value, None);
    let place = last(&records, DecisionKind::SiteChosen, "battery_low");
    assert!(place.unit == "Wh" && place.value < place.threshold, "{place:?}");
    assert!(!place.rejected.is_empty() && place.rejected.iter().all(|it| !it.why.is_empty()), "{place:?}");
}

#[test]
fn the_chain_has_each_response_under_its_fault() {
    let records: Vec<_> = flight().into_iter().map(told).collect();
    let lines = chain(&records);
    assert_eq!(lines.len(), records.len());
    let text = lines.join("\n");
    // The times of day are as long as each other.
    let stories: [&[&str]; 3] = [
        &["Flag `obstacle` raised: by hand.", "  `obstacle`: stop.", "    `obstacle` is over."],
        &["Flag `local_position_stale` raised: local position has been silent for ", "  `local_position_stale`: stop."],
        &["`battery_low`: ", "  `battery_low`: divert.", "    Flies to "],
    ];
    for story in stories {
        let begins = |line: &String, part: &&str| line.split_once("  ").is_some_and(|(_, it)| it.starts_with(part));
        let is_told = lines.windows(story.len()).any(|window| window.iter().zip(story).all(|(a, b)| begins(a, b)));
        assert!(is_told, "{story:?} is missing in:\n{text}");
    }
    let chosen = lines.iter().find(|it| it.contains("Flies to ")).expect("a place");
    assert!(chosen.contains(" usable)") && chosen.contains(" Not "), "{chosen}");
}
