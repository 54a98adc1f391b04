//! The processes of the system.

use std::fmt;
use std::path::Path;

use bus::{Direct, Scope};

use crate::backend::Backend;

/// A process that the launcher starts. A new one is a variant here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Service {
    /// The autopilot and its vehicle, simulated.
    VehicleSim,
    /// Between a PX4 and the `fmu/` topics.
    Px4Bridge,
    /// Between an autopilot that speaks MAVLink and the `fmu/` topics.
    MavlinkBridge,
    /// Turns skills into commands to the autopilot.
    SkillManager,
    /// Watches the vehicle's state and raises flags.
    Monitor,
    /// Turns objectives into plans.
    Planner,
    /// Decides what the vehicle does: mission and contingencies.
    Mcm,
    /// Grants and denies permissions to enter areas.
    ControlTower,
    /// Serves the operator over HTTP.
    Gateway,
}

impl Service {
    /// Every service, the layers that others build on first. A system has one vehicle backend: see [`crate::backend::Backend`].
    pub const ALL: [Service; 9] = [
        Service::VehicleSim,
        Service::Px4Bridge,
        Service::MavlinkBridge,
        Service::SkillManager,
        Service::Monitor,
        Service::Planner,
        Service::Mcm,
        Service::ControlTower,
        Service::Gateway,
    ];

    /// Its name: the subcommand, the liveliness token and the prefix of its log.
    pub fn name(self) -> &'static str {
        match self {
            Service::VehicleSim => "vehicle-sim",
            Service::Px4Bridge => "px4-bridge",
            Service::MavlinkBridge => "mavlink-bridge",
            Service::SkillManager => "skill-manager",
            Service::Monitor => "monitor",
            Service::Planner => "planner",
            Service::Mcm => "mcm",
            Service::ControlTower => "control-tower",
            Service::Gateway => "gateway",
        }
    }

    /// Its scope: the ground sees all vehicles, the others one.
    pub fn scope(self, vehicle: &str) -> Scope {
        match self {
            Service::ControlTower | Service::Gateway => Scope::Fleet,
            Service::VehicleSim
            | Service::Px4Bridge
            | Service::MavlinkBridge
            | Service::SkillManager
            | Service::Monitor
            | Service::Planner
            | Service::Mcm => Scope::Vehicle(vehicle.to_owned()),
        }
    }
}

/// The options that every process reads: it checks all files, so that one with a mistake is reported by each.
const READ_BY_ALL: [&str; 6] = ["--config", "--mission", "--speed", "--vehicle", "--has-run", "--simulated"];

impl Service {
    /// Those that run on board.
    pub fn on_board() -> Vec<Service> {
        Service::ALL.into_iter().filter(|it| matches!(it.scope(""), Scope::Vehicle(_))).collect()
    }

    /// Whether it reads this option of [`crate::settings::Settings`].
    pub fn reads(self, option: &str) -> bool {
        READ_BY_ALL.contains(&option) || self.own_options().contains(&option)
    }

    fn own_options(self) -> &'static [&'static str] {
        match self {
            Service::VehicleSim => &["--seed"],
            Service::Px4Bridge => &["--px4-endpoint"],
            Service::MavlinkBridge => &["--connect-autopilot", "--ground", "--signing-key"],
            Service::SkillManager | Service::Monitor => &[],
            Service::Planner => &["--record-inputs"],
            Service::Mcm => &["--state", "--tower-key", "--record-inputs"],
            Service::ControlTower => &["--permissions", "--seed", "--state", "--tower-secret"],
            Service::Gateway => &[
                "--http",
                "--access",
                "--recordings",
                "--tls-certificate",
                "--tls-key",
                "--plain-http-beyond-loopback",
            ],
        }
    }

    /// The services it has direct links to: those on the way of an event, a request or a command to a single receiver,
    /// where a hop through the router shows in the felt latencies of `kittiwake kpi`. `None` for a service without
    /// direct links.
    fn calls(self) -> Option<&'static [Service]> {
        match self {
            Service::VehicleSim | Service::Px4Bridge | Service::MavlinkBridge | Service::Monitor => Some(&[]),
            Service::SkillManager => Some(&[Service::VehicleSim]),
            Service::Mcm => Some(&[Service::SkillManager, Service::Monitor]),
            Service::Planner | Service::ControlTower | Service::Gateway => None,
        }
    }

    /// The name of its socket. The vehicle backends have one in common: who commands the vehicle need not know which one flies.
    fn socket(self) -> &'static str {
        match Backend::of_service(self) {
            Some(_) => "vehicle",
            None => self.name(),
        }
    }

    /// Its direct links, with their sockets in `folder`.
    pub fn direct(self, folder: &Path) -> Option<Direct> {
        let connect = self.calls()?.iter().map(|it| it.socket().to_owned()).collect();
        Some(Direct { folder: folder.to_owned(), listen: Some(self.socket().to_owned()), connect })
    }
}

impl fmt::Display for Service {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command, ProcessCommand, RunArgs};
    use clap::Parser;

    #[test]
    fn whoever_commands_the_vehicle_calls_whichever_backend_flies() {
        let folder = Path::new("/run/links");
        let called = Service::SkillManager.direct(folder).map(|it| it.connect).unwrap_or_default();
        for backend in Backend::ALL {
            let listens = backend.service().direct(folder).and_then(|it| it.listen);
            assert!(listens.is_some_and(|it| called.contains(&it)), "{backend}");
        }
    }

    #[test]
    fn every_service_is_run_by_its_name() {
        for service in Service::ALL {
            let cli = Cli::parse_from(["kittiwake", "run", service.name(), "--connect", "tcp/127.0.0.1:1"]);
            let Some(Command::Run(RunArgs { process: ProcessCommand::Service(command) })) = cli.command else {
                panic!("{service} is not a service command")
            };
            assert_eq!(command.split().0, service);
        }
    }
}
