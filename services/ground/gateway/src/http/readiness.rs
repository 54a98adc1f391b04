//! Whether a vehicle's system is complete: its services alive, their data arriving.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::json::text_list;
use kittiwake_proto::v1;
use node::VehicleId;

use crate::fleet::processes::Health;
use crate::fleet::{Snapshot, VehicleState};
use crate::http::problem::{Kind, Problem};

/// The services besides the gateway itself, which runs if it can answer.
const SERVICES: [&str; 5] = ["skill-manager", "monitor", "planner", "mcm", "control-tower"];
/// What flies: one of these, the first where none is seen.
const BACKENDS: [&str; 3] = ["vehicle-sim", "px4-bridge", "mavlink-bridge"];

/// The vehicles whose system is complete; a process that shows no progress for `stale_after` does not count.
///
/// # Errors
/// What each vehicle lacks, if none is complete.
pub(crate) fn readiness(snapshot: &Snapshot, stale_after: Duration) -> Result<v1::Readiness, Problem> {
    let (ready, incomplete) = judge(snapshot, stale_after);
    if !ready.is_empty() {
        let vehicles = ready.iter().map(|name| name.to_string()).collect();
        return Ok(v1::Readiness { status: "ready".to_owned(), vehicles });
    }
    let detail = if incomplete.is_empty() { "no vehicle seen yet" } else { "no vehicle's system is complete" };
    let missing = incomplete.into_iter().map(|(name, missing)| (name.to_string(), text_list(missing)));
    Err(Problem::unavailable(detail).of(Kind::NotReady).with(|problem| problem.missing = missing.collect()))
}

/// The vehicles whose system is complete, and what each of the others lacks.
fn judge(snapshot: &Snapshot, stale_after: Duration) -> (Vec<VehicleId>, BTreeMap<VehicleId, Vec<String>>) {
    let judged = snapshot.fleet.vehicles.iter();
    let judged = judged.map(|(name, state)| (name.clone(), missing(snapshot, state, stale_after)));
    let (ready, incomplete): (BTreeMap<_, _>, BTreeMap<_, _>) = judged.partition(|(_, missing)| missing.is_empty());
    (ready.into_keys().collect(), incomplete)
}

fn missing(snapshot: &Snapshot, vehicle: &VehicleState, stale_after: Duration) -> Vec<String> {
    if let Some(silent) =
        vehicle.silent_for(snapshot.now.time).filter(|_| vehicle.is_lost(snapshot.now.time, stale_after))
    {
        return vec![format!("no contact for {} s of mission time", silent.as_secs())];
    }
    let services = [backend(vehicle)]
        .into_iter()
        .chain(SERVICES)
        .filter_map(|service| lack(snapshot, vehicle, service, stale_after));
    let data = [
        ("vehicle status", vehicle.status.is_some()),
        ("introspection", vehicle.introspection.is_some()),
        ("mission", vehicle.mission.is_some()),
        ("mission manager status", vehicle.mcm.is_some()),
    ];
    let data = data.into_iter().filter(|(_, seen)| !seen).map(|(name, _)| format!("{name} not received yet"));
    services.chain(data).collect()
}

/// The process that flies the vehicle, as far as is known.
fn backend(vehicle: &VehicleState) -> &'static str {
    BACKENDS.into_iter().find(|it| vehicle.processes.get(it).is_some()).unwrap_or(BACKENDS[0])
}

/// What is wrong with a service, of the vehicle or of the ground.
fn lack(snapshot: &Snapshot, vehicle: &VehicleState, service: &str, stale_after: Duration) -> Option<String> {
    let now: Time = snapshot.now.time;
    let candidates = [&vehicle.processes, &snapshot.fleet.ground];
    let healths: Vec<_> =
        candidates.iter().filter_map(|it| it.get(service)).map(|it| it.health(now, stale_after)).collect();
    match healths.as_slice() {
        [] => Some(format!("{service} not seen yet")),
        some if some.contains(&Health::Alive) => None,
        some if some.contains(&Health::Stale) => Some(format!("{service} shows no progress")),
        _ => Some(format!("{service} is dead")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::time::Now;
    use kittiwake_proto::topics::Message;
    use kittiwake_proto::v1;
    use node::Event;

    const STALE_AFTER: Duration = Duration::from_secs(2);

    /// Compares the readiness of a system that is complete except for `without` and has lost `gone`, `later` seconds
    /// after its last messages.
    #[track_caller]
    fn check(without: &str, later: u64, gone: &str, expected: Result<(), &[&str]>) {
        for backend in BACKENDS {
            check_with(backend, without, later, gone, expected);
        }
    }

    #[track_caller]
    fn check_with(backend: &str, without: &str, later: u64, gone: &str, expected: Result<(), &[&str]>) {
        let mut snapshot = Snapshot::default();
        let mut fold = |event| snapshot.fleet.fold(Now::default(), event, &mut Vec::new());
        let peer = |service: &str, alive| {
            let vehicle = if service == "control-tower" { "" } else { "uav1" }.into();
            Event::Peer { vehicle, service: service.into(), instance: "1".into(), alive }
        };
        [backend].into_iter().chain(SERVICES).filter(|it| *it != without).for_each(|it| fold(peer(it, true)));
        fold(peer(gone, false));
        let data = [
            Message::from(v1::VehicleStatus::default()),
            v1::Introspection::default().into(),
            v1::MissionStatus::default().into(),
            v1::McmStatus::default().into(),
        ];
        for message in data.into_iter().filter(|it| it.topic().key() != without) {
            fold(Event::Message { vehicle: "uav1".into(), message });
        }
        snapshot.now.time = Time::after(Duration::from_secs(later));
        let lacks = expected.err().map(|lacks| lacks.iter().map(|it| it.to_string()).collect::<Vec<_>>());
        let ready = if lacks.is_none() { vec!["uav1".into()] } else { Vec::new() };
        let incomplete = lacks.map(|lacks| ("uav1".into(), lacks)).into_iter().collect();
        assert_eq!(judge(&snapshot, STALE_AFTER), (ready, incomplete));
    }

    #[test]
    fn a_complete_system_is_ready_and_an_incomplete_one_says_what_it_lacks() {
        check("", 0, "", Ok(()));
        check("planner", 0, "", Err(&["planner not seen yet"]));
        check("control-tower", 0, "", Err(&["control-tower not seen yet"]));
        check("monitor/introspection", 0, "", Err(&["introspection not received yet"]));
        check("", 0, "control-tower", Err(&["control-tower is dead"]));
        check("", 0, "mcm", Err(&["mcm is dead"]));
        check("", 3, "", Err(&["no contact for 3 s of mission time"]));
    }

    #[test]
    fn one_that_nothing_flies_lacks_its_simulator() {
        check_with("vehicle-sim", "vehicle-sim", 0, "", Err(&["vehicle-sim not seen yet"]));
        check_with("px4-bridge", "", 0, "px4-bridge", Err(&["px4-bridge is dead"]));
    }

    #[test]
    fn without_a_vehicle_nothing_is_ready() {
        assert_eq!(judge(&Snapshot::default(), STALE_AFTER), (Vec::new(), BTreeMap::new()));
    }
}
