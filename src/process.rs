//! One process of the system: a service on its bus.

use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use bus::{BusError, Direct, Link, Nudge, Process, Stop};
use control_tower::ControlTower;
use gateway::Gateway;
use gateway::process::{GatewayProcess, StartError};
use mcm::Mcm;
use monitor::Monitor;
use planner::Planner;
use rustls::ServerConfig;
use skill_manager::SkillManager;
use vehicle_sim::VehicleSim;

use crate::check_inputs::{self, Inputs};
use crate::cli::ProcessArgs;
use crate::end::stop_on_end;
use crate::kept::Kept;
use crate::outcome::Outcome;
use crate::service::Service;
use crate::watchdog::Watched;
use crate::{access, output, telemetry};

/// Why a process ended early.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Bus(#[from] BusError),
    #[error(transparent)]
    Gateway(#[from] StartError),
    #[error("the behavior tree cannot be built: {0}")]
    Tree(#[from] behavior_tree::InstantiateError),
    #[error(transparent)]
    Access(#[from] gateway::access::InvalidTokens),
    #[error("the operating system refuses: {0}")]
    System(#[from] std::io::Error),
}

/// Runs a service until it is over or is asked to end.
pub fn run_service(service: Service, args: &ProcessArgs) -> Outcome {
    let inputs = match check_inputs::read_or_tell(&args.settings) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    let tls = match (service == Service::Gateway).then(|| check_inputs::read_tls(&inputs.config)).transpose() {
        Ok(tls) => tls.flatten(),
        Err(outcome) => return outcome,
    };
    let telemetry = telemetry::start(service.name(), inputs.config.vehicle.as_str(), &inputs.config.telemetry);
    let link = Link {
        connect: args.connect.clone(),
        scope: service.scope(inputs.config.vehicle.as_str()),
        open_timeout: inputs.config.connect_limit_s.seconds(),
    };
    let direct = args.direct.as_ref().and_then(|it| service.direct(it));
    let stop = Stop::new();
    let result = stop_on_end(&stop, args.exit_with_parent)
        .map_err(Failure::from)
        .and_then(|()| run(service, inputs, tls, &link, direct.as_ref(), &stop));
    telemetry.end();
    told(service.name(), result)
}

fn run(
    service: Service,
    inputs: Inputs,
    tls: Option<Arc<ServerConfig>>,
    link: &Link,
    direct: Option<&Direct>,
    stop: &Stop,
) -> Result<(), Failure> {
    let Inputs { config, mission, trees, contingencies, access, state } = inputs;
    let (pace, seed) = (config.speed.pace(), config.seed);
    let on_bus = |mut node: Box<dyn node::Node>| {
        Ok(Process { direct, pace, ..Process::of(&mut Watched::new(node.as_mut()), link) }.run(stop)?)
    };
    match service {
        Service::VehicleSim => on_bus(Box::new(VehicleSim::new(&config.vehicle_sim, pace, seed))),
        Service::SkillManager => on_bus(Box::new(SkillManager::new(&config.skill_manager, pace))),
        Service::Monitor => on_bus(Box::new(Monitor::new(&config.monitor, &contingencies, pace))),
        Service::Planner => {
            let planner = Planner::new(&config.planner, mission, pace);
            match state {
                Some(folder) => on_bus(Box::new(Kept::new(planner, &folder)?)),
                None => on_bus(Box::new(planner)),
            }
        }
        Service::Mcm => {
            let (vehicle, start) = (config.vehicle.as_str(), start_number());
            let mcm = Mcm::new(&config.mcm, vehicle, start, &trees, contingencies, pace)?;
            let mcm = mcm.of_mission(&mission).measured_with(bus::monotonic_ns);
            match state {
                Some(folder) => on_bus(Box::new(Kept::new(mcm, &folder)?)),
                None => on_bus(Box::new(mcm)),
            }
        }
        Service::ControlTower => {
            on_bus(Box::new(ControlTower::new(&config.control_tower, config.permissions, seed, pace)))
        }
        Service::Gateway => {
            let access = access::access_control(access.as_deref())?;
            let nudge = Nudge::default();
            let wake = nudge.clone();
            let gateway = Gateway::new(&config.gateway, pace, access, contingencies.rows(), move || wake.wake());
            let process = GatewayProcess::bind(gateway, config.http, tls)?;
            output::line(process.url()?);
            let run =
                |node: &mut Gateway| Process { pace, nudge, ..Process::of(&mut Watched::new(node), link) }.run(stop);
            Ok(process.run(run)??)
        }
    }
}

/// Differs at each start of a process, so that a restarted one repeats none of its request ids.
#[expect(clippy::disallowed_methods, reason = "no two processes start in the same nanosecond of UTC")]
fn start_number() -> u64 {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    since_epoch.as_nanos() as u64
}

fn told(name: &str, result: Result<(), Failure>) -> Outcome {
    match result {
        Ok(()) => Outcome::Success,
        Err(failure) => {
            output::error_line(format_args!("{name}: {failure}"));
            Outcome::NotKeptUp
        }
    }
}
