//! Whole flights over MAVLink: both autopilots as they were measured (`fake-autopilots`), the bridge, and all services above it.

use std::path::Path;
use std::time::Duration;

use control_tower::policy::Policy;
use domain::declared_skill::DeclaredSkills;
use domain::file::Source;
use domain::time::Pace;
use fake_autopilots::bridged::Bridged;
use fake_autopilots::wire::{Faults, Wire};
use fake_autopilots::{FakeAutopilot, Kind};
use kittiwake_proto::v1::{MissionOutcome, MissionReport};
use mavlink_bridge::signing::Key;
use serde::Deserialize;
use simulation::{Machine, Setup, Simulation};
use vehicle_sim::VehicleSim;

mod flights;
mod stories;

const LIMIT: Duration = Duration::from_secs(1500);
const BOTH: [Kind; 2] = [Kind::Px4, Kind::ArduPilot];

/// The section of the bridge in the shipped configuration.
#[derive(Deserialize)]
struct Sections {
    mavlink_bridge: mavlink_bridge::config::Config,
}

/// The reference mission over an autopilot of `kind` and a link with `faults`.
#[track_caller]
fn reference(kind: Kind, permissions: Policy, faults: Faults) -> Simulation<'static> {
    with_keys(kind, permissions, faults, None, None)
}

/// The same, where the autopilot and the bridge sign with these keys.
#[track_caller]
fn with_keys(
    kind: Kind,
    permissions: Policy,
    faults: Faults,
    autopilots: Option<&str>,
    bridges: Option<&str>,
) -> Simulation<'static> {
    let [autopilots, bridges] = [autopilots, bridges].map(|it| it.map(|it| it.repeat(32).parse::<Key>().unwrap()));
    mission(None, kind, permissions, faults, autopilots, bridges)
}

/// The same with another mission.
#[track_caller]
fn mission(
    file: Option<&Path>,
    kind: Kind,
    permissions: Policy,
    faults: Faults,
    autopilots: Option<Key>,
    bridges: Option<Key>,
) -> Simulation<'static> {
    let config = crate::stories::support::shipped();
    let skills = DeclaredSkills::read(&config.join("skills")).unwrap();
    let setup = Setup { config: &config, mission: file, permissions, seed: 1, machine: Machine::Ideal };
    let sections: Sections = Source::read(&config.join("kittiwake.toml")).unwrap().parse().unwrap();
    let simulation = Simulation::with_vehicle(&setup, |vehicle| {
        let (wire, vehicle) = (Wire::new(faults, 1), kind.flies(vehicle.clone()));
        let make = move || VehicleSim::new(&vehicle, Pace::REAL_TIME, 1);
        let autopilot = FakeAutopilot::new(kind, wire.clone(), make);
        let autopilot = match autopilots {
            Some(key) => autopilot.signing_with(key),
            None => autopilot,
        };
        let bridged = Bridged::new(autopilot, &sections.mavlink_bridge, wire);
        let bridged = match bridges {
            Some(key) => bridged.signing_with(key),
            None => bridged,
        };
        bridged.with_skills(&skills)
    });
    simulation.unwrap()
}

#[track_caller]
fn fly(simulation: &mut Simulation<'_>) -> MissionReport {
    let report = simulation.fly(LIMIT);
    report.unwrap_or_else(|| panic!("the mission to end\n{}", simulation.decision_log()))
}

#[track_caller]
fn assert_success(simulation: &Simulation<'_>, report: &MissionReport) {
    assert_eq!(report.outcome(), MissionOutcome::Success, "{}\n{}", report.reason, simulation.decision_log());
    assert_eq!(simulation.breaches(), [], "{}", simulation.decision_log());
}
