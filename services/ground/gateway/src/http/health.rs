//! The health of what the fleet stores.

use std::collections::BTreeSet;

use kittiwake_proto::v1;

use crate::fleet::{Snapshot, message_of};

/// What is wrong with the persisted state of any vehicle's process, one entry each; a process that has none, or that was
/// not heard yet, says nothing.
pub(crate) fn memory_problems(snapshot: &Snapshot) -> Vec<String> {
    // The tower has one memory for all vehicles, and every ledger reports on that.
    let ledgers = snapshot.fleet.vehicles.values().filter_map(|it| message_of(&it.ledger));
    let tower: BTreeSet<String> = ledgers.filter_map(|it| problem("control-tower", it.memory.as_ref()?)).collect();
    let vehicles = snapshot.fleet.vehicles.iter();
    let problems = vehicles.filter_map(|(vehicle, state)| {
        let health = message_of(&state.mcm).and_then(|it| it.memory.as_ref());
        health.and_then(|it| problem(&format!("{vehicle}/mcm"), it))
    });
    tower.into_iter().chain(problems).collect()
}

fn problem(process: &str, health: &v1::MemoryHealth) -> Option<String> {
    let v1::MemoryHealth { loss, failing } = health;
    let loss = loss.as_ref().map(|it| format!("waits for an operator, what was saved is unusable: {}", it.why));
    let failing = Some(failing).filter(|it| !it.is_empty()).map(|why| format!("cannot be saved: {why}"));
    let problems: Vec<String> = loss.into_iter().chain(failing).collect();
    (!problems.is_empty()).then(|| format!("{process}: {}", problems.join("; ")))
}
