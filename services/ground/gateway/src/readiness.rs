//! Whether there is a system to look at: its services alive, their data arriving.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::time::Time;
use node::VehicleId;

use crate::process::Health;
use crate::state::{Snapshot, Vehicle};

/// The services besides the gateway itself, which is there if it can answer.
const SERVICES: [&str; 6] = ["vehicle-sim", "skill-manager", "monitor", "planner", "mcm", "control-tower"];

/// Whether at least one vehicle's system is complete.
#[derive(Debug, PartialEq, Eq)]
pub enum Readiness {
    /// It is, for these.
    Ready(Vec<VehicleId>),
    /// What each vehicle lacks; empty if none was seen.
    NotReady(BTreeMap<VehicleId, Vec<String>>),
}

/// The readiness of the fleet; a process that shows no progress for `stale_after` does not count.
pub fn readiness(snapshot: &Snapshot, stale_after: Duration) -> Readiness {
    let vehicles = &snapshot.fleet.vehicles;
    let lacks: BTreeMap<_, _> =
        vehicles.iter().map(|(name, it)| (name.clone(), missing(snapshot, it, stale_after))).collect();
    let ready: Vec<_> = lacks.iter().filter(|(_, missing)| missing.is_empty()).map(|(name, _)| name.clone()).collect();
    if ready.is_empty() { Readiness::NotReady(lacks) } else { Readiness::Ready(ready) }
}

fn missing(snapshot: &Snapshot, vehicle: &Vehicle, stale_after: Duration) -> Vec<String> {
    let services = SERVICES.into_iter().filter_map(|service| lack(snapshot, vehicle, service, stale_after));
    let data = [
        ("vehicle status", vehicle.status.is_some()),
        ("introspection", vehicle.introspection.is_some()),
        ("planner status", vehicle.planner.is_some()),
        ("mission manager status", vehicle.mcm.is_some()),
    ];
    let data = data.into_iter().filter(|(_, seen)| !seen).map(|(name, _)| format!("{name} not received yet"));
    services.chain(data).collect()
}

/// What is wrong with a service, wherever it belongs.
fn lack(snapshot: &Snapshot, vehicle: &Vehicle, service: &str, stale_after: Duration) -> Option<String> {
    let now: Time = snapshot.now.time;
    let candidates = [&vehicle.processes, &snapshot.fleet.ground];
    let healths: Vec<_> =
        candidates.iter().filter_map(|it| it.get(service)).map(|it| it.health(now, stale_after)).collect();
    match healths.as_slice() {
        [] => Some(format!("{service} not seen yet")),
        some if some.contains(&Health::Alive) => None,
        some if some.contains(&Health::Stale) => Some(format!("{service} shows no progress")),
        _ => Some(format!("{service} is gone")),
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

    /// A complete system, and what happens to it.
    #[track_caller]
    fn check(without: &str, later: u64, gone: &str, expected: Result<(), &[&str]>) {
        let mut snapshot = Snapshot::default();
        let mut fold = |event| snapshot.fleet.fold(Now::default(), event, &mut Vec::new());
        let peer = |service: &str, alive| {
            let vehicle = if service == "control-tower" { "" } else { "uav1" }.into();
            Event::Peer { vehicle, service: service.into(), instance: "1".into(), alive }
        };
        SERVICES.into_iter().filter(|it| *it != without).for_each(|it| fold(peer(it, true)));
        fold(peer(gone, false));
        let data = [
            Message::from(v1::VehicleStatus::default()),
            v1::Introspection::default().into(),
            v1::PlannerStatus::default().into(),
            v1::McmStatus::default().into(),
        ];
        for message in data.into_iter().filter(|it| it.topic().key() != without) {
            fold(Event::Message { vehicle: "uav1".into(), message });
        }
        snapshot.now.time = Time::after(Duration::from_secs(later));
        let expected = match expected {
            Ok(()) => Readiness::Ready(vec!["uav1".into()]),
            Err(lacks) => {
                Readiness::NotReady([("uav1".into(), lacks.iter().map(|it| it.to_string()).collect())].into())
            }
        };
        assert_eq!(readiness(&snapshot, STALE_AFTER), expected);
    }

    #[test]
    fn a_complete_system_is_ready_and_an_incomplete_one_says_what_it_lacks() {
        check("", 0, "", Ok(()));
        check("planner", 0, "", Err(&["planner not seen yet"]));
        check("control-tower", 0, "", Err(&["control-tower not seen yet"]));
        check("monitor/introspection", 0, "", Err(&["introspection not received yet"]));
        check("", 0, "control-tower", Err(&["control-tower is gone"]));
        check("", 0, "mcm", Err(&["mcm is gone"]));
        let stale = SERVICES.map(|it| format!("{it} shows no progress"));
        check("", 3, "", Err(&stale.each_ref().map(|it| it.as_str())));
    }

    #[test]
    fn without_a_vehicle_nothing_is_ready() {
        assert_eq!(readiness(&Snapshot::default(), STALE_AFTER), Readiness::NotReady(BTreeMap::new()));
    }
}
