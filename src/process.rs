//! One process of the system: the router, or a service on its bus.

use std::net::TcpListener;
use std::time::{SystemTime, UNIX_EPOCH};

use bus::{BusError, Link, Nudge, Stop};
use control_tower::ControlTower;
use gateway::Gateway;
use mcm::Mcm;
use monitor::Monitor;
use planner::Planner;
use skill_manager::SkillManager;
use vehicle_sim::VehicleSim;

use crate::check_inputs::{self, Inputs};
use crate::cli::{ProcessArgs, RouterArgs};
use crate::end::stop_on_end;
use crate::outcome::Outcome;
use crate::service::Service;
use crate::{access, output, telemetry};

/// Why a process ended early.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Bus(#[from] BusError),
    #[error("cannot listen on {address}: {cause}")]
    Http { address: String, cause: std::io::Error },
    #[error("the behavior tree cannot be built: {0}")]
    Tree(#[from] behavior_tree::InstantiateError),
    #[error(transparent)]
    Access(#[from] gateway::access::BadTokens),
    #[error("the operating system refuses: {0}")]
    System(#[from] std::io::Error),
}

/// Runs the router; the first line on standard output is the locator it listens on.
pub fn run_router(args: &RouterArgs) -> Outcome {
    let telemetry = telemetry::start("router", "", &telemetry::Config { otlp_endpoint: None });
    let stop = Stop::new();
    let result = stop_on_end(&stop, args.exit_with_parent).map_err(Failure::from).and_then(|()| {
        bus::run_router(&args.listen, &stop, |bound| bound.iter().for_each(output::line))?;
        Ok(())
    });
    telemetry.end();
    told("router", result)
}

/// Runs a service until it is over or is asked to end.
pub fn run_service(service: Service, args: &ProcessArgs) -> Outcome {
    let inputs = match check_inputs::read_or_tell(&args.settings) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    let telemetry = telemetry::start(service.name(), inputs.config.vehicle.as_str(), &inputs.config.telemetry);
    let link = Link {
        connect: args.connect.clone(),
        scope: service.scope(inputs.config.vehicle.as_str()),
        open_timeout: inputs.config.connect_limit_s.seconds(),
    };
    let stop = Stop::new();
    let result = stop_on_end(&stop, args.exit_with_parent)
        .map_err(Failure::from)
        .and_then(|()| run(service, inputs, &link, &stop));
    telemetry.end();
    told(service.name(), result)
}

fn run(service: Service, inputs: Inputs, link: &Link, stop: &Stop) -> Result<(), Failure> {
    let Inputs { config, mission, trees, contingencies, access } = inputs;
    let (pace, seed) = (config.speed.pace(), config.seed);
    let on_bus = |mut node: Box<dyn node::Node>| Ok(bus::run(node.as_mut(), link, pace, stop)?);
    match service {
        Service::VehicleSim => on_bus(Box::new(VehicleSim::new(&config.vehicle_sim, pace, seed))),
        Service::SkillManager => on_bus(Box::new(SkillManager::new(&config.skill_manager, pace))),
        Service::Monitor => on_bus(Box::new(Monitor::new(&config.monitor, &contingencies, pace))),
        Service::Planner => on_bus(Box::new(Planner::new(&config.planner, mission, pace))),
        Service::Mcm => {
            let (vehicle, start) = (config.vehicle.as_str(), start_number());
            let mcm = Mcm::new(&config.mcm, vehicle, start, &trees, contingencies, pace)?;
            on_bus(Box::new(mcm.with_stopwatch(bus::monotonic_ns)))
        }
        Service::ControlTower => {
            on_bus(Box::new(ControlTower::new(&config.control_tower, config.permissions, seed, pace)))
        }
        Service::Gateway => {
            let address = config.http;
            let listen = |cause| Failure::Http { address: address.to_string(), cause };
            let listener = TcpListener::bind(address).map_err(listen)?;
            listener.set_nonblocking(true)?;
            let bound = listener.local_addr()?;
            output::line(format_args!("http://{bound}"));
            let nudge = Nudge::default();
            let wake = nudge.clone();
            let door = access::door(access.as_deref())?;
            let (mut node, api) = Gateway::new(&config.gateway, pace, door, move || wake.wake());
            let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
            let _guard = runtime.enter();
            let listener = tokio::net::TcpListener::from_std(listener)?;
            let (ended, end) = tokio::sync::oneshot::channel::<()>();
            let serving = runtime.spawn(gateway::serve(listener, api, async {
                let _ = end.await;
            }));
            let result = bus::run_nudged(&mut node, link, pace, stop, &nudge);
            drop(ended);
            // A client that keeps its stream open does not keep the process.
            runtime.shutdown_background();
            drop(serving);
            Ok(result?)
        }
    }
}

/// Another one at each start of a process, so that a restarted one repeats none of its request ids.
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
