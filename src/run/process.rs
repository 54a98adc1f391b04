//! One process of the system: a service on its bus.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use bus::{BusError, Direct, Link, Nudge, Process, Stop};
use control_tower::ControlTower;
use domain::file::Mistakes;
use domain::time::Pace;
use gateway::Gateway;
use gateway::process::{GatewayProcess, StartError};
use mavlink_bridge::MavlinkBridge;
use mavlink_bridge::ground::GroundSocket;
use mavlink_bridge::socket::Socket;
use mcm::Mcm;
use monitor::Monitor;
use node::Node;
use planner::Planner;
use px4_bridge::Px4Bridge;
use rustls::ServerConfig;
use simulation::recording::{RECORDED, Recorded};
use simulation::resumable::Resumable;
use skill_manager::SkillManager;
use vehicle_sim::VehicleSim;

use crate::backend::Backend;
use crate::check_inputs::{self, Inputs};
use crate::cli::ProcessArgs;
use crate::config::Config;
use crate::outcome::Outcome;
use crate::run::end::stop_on_end;
use crate::run::persisted::{self, Persisted};
use crate::run::px4_port::Px4Port;
use crate::run::watchdog::Watched;
use crate::run::{inputs, state_folder, tower_key};
use crate::service::Service;
use crate::settings::Settings;
use crate::setup::access;
use crate::{output, signing_key, telemetry};

/// The owner of what the ground stores about all vehicles.
const FLEET: &str = "the fleet";

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
    #[error(transparent)]
    State(#[from] persisted::StartError),
    #[error(transparent)]
    Key(#[from] tower_key::Failure),
    #[error("{0}")]
    Files(Mistakes),
    #[error("{}: the recording of the inputs cannot be begun: {cause}", folder.display())]
    Inputs { folder: PathBuf, cause: std::io::Error },
    #[error("the operating system refuses: {0}")]
    System(#[from] std::io::Error),
}

/// Runs a service until it is over or is asked to end.
pub fn run_service(service: Service, args: &ProcessArgs) -> Outcome {
    let inputs = match check_inputs::read_or_tell(&args.settings) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    if let Some(Err(mistakes)) = Backend::of_service(service).map(|it| inputs.suits(it)) {
        return check_inputs::tell(&mistakes);
    }
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
        .and_then(|()| run(service, &args.settings, inputs, tls, &link, direct.as_ref(), &stop));
    telemetry.end();
    report(service.name(), result)
}

fn run(
    service: Service,
    settings: &Settings,
    inputs: Inputs,
    tls: Option<Arc<ServerConfig>>,
    link: &Link,
    direct: Option<&Direct>,
    stop: &Stop,
) -> Result<(), Failure> {
    let Inputs { config_file: _, config, mission, trees, contingencies, access, state, tower_key, tower_secret } =
        inputs;
    let (pace, seed) = (config.speed.pace(), config.seed);
    let place = Place { link, direct, pace, stop };
    let on_bus = |mut node: Box<dyn Node>| place.run(node.as_mut(), Nudge::default());
    let vehicle = config.vehicle.as_str();
    match service {
        Service::VehicleSim => on_bus(Box::new(VehicleSim::new(&config.vehicle_sim, pace, seed))),
        Service::Px4Bridge => {
            let nudge = Nudge::default();
            let port = Px4Port::open(&config.px4_bridge, &nudge)?;
            place.run(&mut Px4Bridge::new(&config.px4_bridge, port), nudge)
        }
        Service::MavlinkBridge => {
            let nudge = Nudge::default();
            let wake = nudge.clone();
            let config = &config.mavlink_bridge;
            let socket = Socket::open(&config.connect, move || wake.wake())?;
            let bridge =
                MavlinkBridge::new(config, signing_key::signed(config, Box::new(socket), 0).map_err(Failure::Files)?);
            let mut bridge = match &config.ground {
                None => bridge,
                Some(endpoint) => {
                    let wake = nudge.clone();
                    let socket = GroundSocket::open(endpoint, move || wake.wake())?;
                    bridge
                        .seen_from_the_ground(signing_key::signed(config, Box::new(socket), 1).map_err(Failure::Files)?)
                }
            };
            place.run(&mut bridge, nudge)
        }
        Service::SkillManager => on_bus(Box::new(SkillManager::new(&config.skill_manager, pace))),
        Service::Monitor => on_bus(Box::new(Monitor::new(&config.monitor, &contingencies, pace))),
        Service::Planner => {
            let record = Record { settings, config: &config, instance: start_number(), tower_key: String::new() };
            let planner = Planner::new(&config.planner, &config.energy, mission, pace);
            place.run_recorded(planner, &record, state)
        }
        Service::Mcm => {
            let key = tower_key.map(|path| tower_key::read_public(&path)).transpose()?;
            let told = key.as_ref().map_or_else(String::new, ToString::to_string);
            let record = Record { settings, config: &config, instance: start_number(), tower_key: told };
            let mcm = Mcm::new(&config.mcm, &config.energy, vehicle, record.instance, &trees, contingencies, pace)?;
            let mcm = mcm.of_mission(&mission).measured_with(bus::monotonic_ns);
            let mcm = match key {
                Some(key) => mcm.that_verifies_with(key),
                None => mcm,
            };
            place.run_recorded(mcm, &record, state)
        }
        Service::ControlTower => {
            let policy = config.permissions;
            let tower = ControlTower::new(&config.control_tower, policy, seed, pace, start_number());
            let tower = if state.is_some() { tower.that_is_stored() } else { tower };
            let tower = match tower_key::of_tower(tower_secret.as_deref(), state.as_deref())? {
                Some(key) => tower.that_signs_with(key),
                None => tower,
            };
            place.run_with_state(tower, state, FLEET)
        }
        Service::Gateway => {
            let access = access::access_control(access.as_deref(), config.gateway.audit_files.get().into())?;
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

/// What the recording of a process begins with, if it has one.
struct Record<'a> {
    settings: &'a Settings,
    config: &'a Config,
    instance: u64,
    tower_key: String,
}

/// Where a process runs.
struct Place<'a> {
    link: &'a Link,
    direct: Option<&'a Direct>,
    pace: Pace,
    stop: &'a Stop,
}

impl Place<'_> {
    fn run(&self, node: &mut dyn Node, nudge: Nudge) -> Result<(), Failure> {
        let Place { link, direct, pace, stop } = *self;
        Ok(Process { direct, pace, nudge, is_only_one: true, ..Process::of(&mut Watched::new(node), link) }
            .run(stop)?)
    }

    /// `service` of a vehicle, whose inputs are recorded if the settings name a folder.
    fn run_recorded<N: Resumable>(
        &self,
        service: N,
        record: &Record<'_>,
        state: Option<PathBuf>,
    ) -> Result<(), Failure> {
        let (name, vehicle) = (service.name(), record.config.vehicle.as_str());
        let number = RECORDED.iter().position(|it| *it == name);
        let (Some(folder), Some(number)) = (&record.settings.record_inputs, number) else {
            return self.run_with_state(service, state, vehicle);
        };
        let header = inputs::header(record.config, &record.settings.config, record.instance, record.tower_key.clone());
        let inputs = header.map_err(Failure::Files).and_then(|header| {
            inputs::Inputs::begin(folder, name, &header)
                .map_err(|cause| Failure::Inputs { folder: folder.clone(), cause })
        })?;
        self.run_with_state(Recorded::new(service, number as u8, inputs), state, vehicle)
    }

    /// `service`, whose state is `owner`'s and in `folder`, if there is one.
    fn run_with_state<N: Resumable>(
        &self,
        mut service: N,
        folder: Option<PathBuf>,
        owner: &str,
    ) -> Result<(), Failure> {
        let Some(folder) = folder else { return self.run(&mut service, Nudge::default()) };
        let (name, owner) = (service.name(), owner.to_owned());
        let nudge = Nudge::default();
        let wake = nudge.clone();
        let open = move || state_folder::open(&folder, name, &owner);
        self.run(&mut Persisted::new(service, start_number(), open, move || wake.wake())?, nudge)
    }
}

/// Differs at each start of a process, so that a restarted one repeats none of its request ids.
#[expect(clippy::disallowed_methods, reason = "no two processes start in the same nanosecond of UTC")]
fn start_number() -> u64 {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    since_epoch.as_nanos() as u64
}

fn report(name: &str, result: Result<(), Failure>) -> Outcome {
    match result {
        Ok(()) => Outcome::Success,
        Err(failure) => {
            output::error_line(format_args!("{name}: {failure}"));
            match failure {
                // It does not become better by trying again.
                Failure::State(persisted::StartError::InUse(_))
                | Failure::Key(_)
                | Failure::Files(_)
                | Failure::Inputs { .. } => Outcome::BadInput,
                _ => Outcome::NotKeptUp,
            }
        }
    }
}
