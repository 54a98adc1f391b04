//! One process of the system: a service on its bus, or several of them.

use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use bus::{BusError, Composition, Hosted, Link, Nudge, Process, Scope, Stop};
use control_tower::ControlTower;
use domain::declared_skill::DeclaredSkills;
use domain::file::Mistakes;
use gateway::Gateway;
use gateway::audit::OpenError;
use gateway::process::{GatewayProcess, StartError};
use gateway::tls::{Demand, Encryption};
use mavlink_bridge::MavlinkBridge;
use mavlink_bridge::ground::GroundSocket;
use mavlink_bridge::socket::Socket;
use mcm::Mcm;
use monitor::Monitor;
use node::Node;
use planner::Planner;
use px4_bridge::Px4Bridge;
use simulation::recording::{RECORDED, Recorded};
use simulation::resumable::Resumable;
use skill_manager::SkillManager;
use vehicle_sim::VehicleSim;

use crate::backend::Backend;
use crate::check_inputs::{self, Inputs};
use crate::cli::{OnboardArgs, ProcessArgs};
use crate::composition::ONBOARD;
use crate::config::Config;
use crate::outcome::Outcome;
use crate::run::end::stop_on_end;
use crate::run::first_start::nothing_flies;
use crate::run::persisted::{self, Persisted};
use crate::run::px4_port::Px4Port;
use crate::run::state_folder::FLEET;
use crate::run::watchdog::Watched;
use crate::run::{inputs, state_folder, tower_key};
use crate::service::Service;
use crate::setup::access;
use crate::{output, signing_key, telemetry};

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
    Access(#[from] access::Failure),
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
    run_process(service.name(), &[service], args)
}

/// Runs several services of one vehicle, in one thread, until it is asked to end.
pub fn run_onboard(args: &OnboardArgs) -> Outcome {
    run_process(ONBOARD, &args.nodes.services(), &args.process)
}

/// Runs `services`, which stand in one scope, as the process `name`.
fn run_process(name: &'static str, services: &[Service], args: &ProcessArgs) -> Outcome {
    output::in_background();
    if let Some((option, _)) =
        args.settings.given().into_iter().find(|(it, _)| !services.iter().any(|service| service.reads(it)))
    {
        let readers: Vec<_> = Service::ALL.into_iter().filter(|it| it.reads(option)).map(Service::name).collect();
        output::error_line(format_args!(
            "{name}: found `{option}`, which is for {} only\n  help: leave the option out",
            readers.join(" and ")
        ));
        return Outcome::BadInput;
    }
    let inputs = match check_inputs::read_or_tell(&args.settings) {
        Ok(inputs) => inputs,
        Err(outcome) => return outcome,
    };
    for backend in services.iter().filter_map(|it| Backend::of_service(*it)) {
        if let Err(mistakes) = inputs.suits(backend) {
            return check_inputs::tell(&mistakes);
        }
    }
    let demand = if nothing_flies(&args.settings) { Demand::Usable } else { Demand::Nothing };
    let read_tls = || check_inputs::read_tls(&inputs.config, demand);
    let tls = match services.contains(&Service::Gateway).then(read_tls).transpose() {
        Ok(tls) => tls.flatten(),
        Err(outcome) => return outcome,
    };
    let vehicle = inputs.config.vehicle.as_str();
    let telemetry = telemetry::start(name, vehicle, &inputs.config.telemetry);
    let scope = services.first().map_or(Scope::Fleet, |it| it.scope(vehicle));
    let open_timeout = inputs.config.connect_limit_s.seconds();
    let link = Link { connect: args.connect.clone(), scope, open_timeout };
    let stop = Stop::new();
    let result = stop_on_end(&stop, args.exit_with_parent).map_err(Failure::from).and_then(|()| match services {
        [Service::Gateway] => run_gateway(args, &inputs, tls, &link, &stop),
        _ => run_on_bus(services, args, &inputs, &link, &stop),
    });
    telemetry.end();
    report(name, result)
}

fn run_on_bus(
    services: &[Service],
    args: &ProcessArgs,
    inputs: &Inputs,
    link: &Link,
    stop: &Stop,
) -> Result<(), Failure> {
    let mut parts = Vec::new();
    for service in services {
        let direct = args.direct.as_ref().and_then(|it| service.direct(it));
        parts.push((build(*service, args, inputs)?, direct));
    }
    let pace = inputs.config.speed.pace();
    let mut nodes = Vec::new();
    let mut watched;
    let mut parts = parts.iter_mut();
    // They have one loop, so one watchdog is enough. The last one has its first turn after all others have had theirs.
    let last = parts.next_back();
    for (Part { node, nudge }, direct) in parts {
        nodes.push(Hosted { node: node.as_mut(), direct: direct.take(), nudge: nudge.clone() });
    }
    if let Some((Part { node, nudge }, direct)) = last {
        watched = Watched::new(node.as_mut());
        nodes.push(Hosted { node: &mut watched, direct: direct.take(), nudge: nudge.clone() });
    }
    Ok(Composition { nodes, link, pace, is_only_one: true }.run(stop)?)
}

fn run_gateway(
    args: &ProcessArgs,
    inputs: &Inputs,
    tls: Option<Encryption>,
    link: &Link,
    stop: &Stop,
) -> Result<(), Failure> {
    let Inputs { contingencies, .. } = inputs;
    let mut config = inputs.config.clone();
    config.gateway.recording.attached = inputs.texts();
    let access = access::access_control(&args.settings, config.gateway.audit_files.get().into())?;
    let (pace, nudge) = (config.speed.pace(), Nudge::default());
    let wake = nudge.clone();
    let gateway = Gateway::new(&config.gateway, pace, access, contingencies, move || wake.wake());
    let process = GatewayProcess::bind(gateway, config.http, tls)?;
    output::line(process.url()?);
    let run = |node: &mut Gateway| Process { pace, nudge, ..Process::of(&mut Watched::new(node), link) }.run(stop);
    Ok(process.run(run)??)
}

/// A service that is ready to run.
struct Part {
    node: Box<dyn Node>,
    /// Has it act on something that the bus does not bring.
    nudge: Nudge,
}

impl Part {
    /// One with nothing to do besides what the bus brings.
    fn of(node: impl Node + 'static) -> Part {
        Part { node: Box::new(node), nudge: Nudge::default() }
    }
}

fn build(service: Service, args: &ProcessArgs, inputs: &Inputs) -> Result<Part, Failure> {
    let Inputs { config, mission, trees, contingencies, skills, state, tower_key, tower_secret, .. } = inputs;
    let (pace, seed) = (config.speed.pace(), config.seed);
    let vehicle = config.vehicle.as_str();
    Ok(match service {
        Service::VehicleSim => Part::of(VehicleSim::new(&config.vehicle_sim, pace, seed)),
        Service::Px4Bridge => {
            let nudge = Nudge::default();
            let port = Px4Port::open(&config.px4_bridge, &nudge)?;
            Part { node: Box::new(Px4Bridge::new(&config.px4_bridge, port).with_skills(skills)), nudge }
        }
        Service::MavlinkBridge => build_mavlink_bridge(&config.mavlink_bridge, skills)?,
        Service::SkillManager => Part::of(SkillManager::new(&config.skill_manager, pace)),
        Service::Monitor => Part::of(Monitor::new(&config.monitor, contingencies, pace).with_skills(skills.clone())),
        Service::Planner => {
            let record = Record { args, config, instance: start_number(), tower_key: String::new() };
            let planner = Planner::new(&config.planner, &config.aircraft(), pace).with_skills(skills.clone());
            match record.begin(planner.name())? {
                None => Part::of(planner),
                Some((number, inputs)) => Part::of(Recorded::new(planner, number, inputs)),
            }
        }
        Service::Mcm => {
            let key = tower_key.as_ref().map(|path| tower_key::read_public(path)).transpose()?;
            let told = key.as_ref().map_or_else(String::new, ToString::to_string);
            let record = Record { args, config, instance: start_number(), tower_key: told };
            let table = contingencies.clone();
            let mcm = Mcm::new(&config.mcm, &config.aircraft(), vehicle, record.instance, trees, table, pace)?;
            let mcm = mcm.of_mission(mission).measured_with(bus::monotonic_ns);
            let mcm = match key {
                Some(key) => mcm.that_verifies_with(key),
                None => mcm,
            };
            let has_run = args.settings.has_run;
            match record.begin(mcm.name())? {
                None => with_state(mcm, state.clone(), vehicle, has_run)?,
                Some((number, inputs)) => {
                    with_state(Recorded::new(mcm, number, inputs), state.clone(), vehicle, has_run)?
                }
            }
        }
        Service::ControlTower => {
            let policy = config.permissions;
            let mut tower = config.control_tower.clone();
            if !args.settings.simulated {
                // A real aircraft lands at real sites: their parties say whether they are ready.
                tower.sites.iter_mut().for_each(|it| it.simulated = None);
            }
            let tower = ControlTower::new(&tower, policy, seed, pace, start_number());
            let tower = if state.is_some() { tower.that_is_stored() } else { tower };
            let tower = match tower_key::of_tower(tower_secret.as_deref(), state.as_deref())? {
                Some(key) => tower.that_signs_with(key),
                None => tower,
            };
            with_state(tower, state.clone(), FLEET, args.settings.has_run)?
        }
        Service::Gateway => unreachable!("it has a server beside its node: see `run_gateway`"),
    })
}

fn build_mavlink_bridge(config: &mavlink_bridge::config::Config, skills: &DeclaredSkills) -> Result<Part, Failure> {
    let nudge = Nudge::default();
    let wake = nudge.clone();
    let socket = Socket::open(&config.connect, move || wake.wake())?;
    let bridge = MavlinkBridge::new(config, signing_key::signed(config, Box::new(socket), 0).map_err(Failure::Files)?)
        .with_skills(skills);
    let bridge = match &config.ground {
        None => bridge,
        Some(endpoint) => {
            let wake = nudge.clone();
            let socket = GroundSocket::open(endpoint, move || wake.wake())?;
            bridge.seen_from_the_ground(signing_key::signed(config, Box::new(socket), 1).map_err(Failure::Files)?)
        }
    };
    Ok(Part { node: Box::new(bridge), nudge })
}

/// What the recording of a process begins with, if it has one.
struct Record<'a> {
    args: &'a ProcessArgs,
    config: &'a Config,
    instance: u64,
    tower_key: String,
}

impl Record<'_> {
    /// Begins the recording of what `service` is given, with its number among those that are recorded, if the settings name a folder.
    fn begin(&self, service: &str) -> Result<Option<(u8, inputs::Inputs)>, Failure> {
        let number = RECORDED.iter().position(|it| *it == service);
        let (Some(folder), Some(number)) = (&self.args.settings.record_inputs, number) else { return Ok(None) };
        let is_awaited = nothing_flies(&self.args.settings);
        let file = &self.args.settings.config;
        let header = inputs::header(self.config, file, self.instance, self.tower_key.clone()).map_err(Failure::Files);
        let begun = header.and_then(|header| {
            inputs::Inputs::begin(folder, service, header, is_awaited)
                .map_err(|cause| Failure::Inputs { folder: folder.to_owned(), cause })
        });
        match begun {
            Ok(inputs) => Ok(Some((number as u8, inputs))),
            Err(failure) if is_awaited => Err(failure),
            Err(failure) => {
                output::error_line(format_args!("{service}: {failure}; it runs without a recording"));
                Ok(None)
            }
        }
    }
}

/// `service`, whose state is `owner`'s and in `folder`, if there is one, as it must be if it `has_run` before.
fn with_state<N: Resumable + 'static>(
    service: N,
    folder: Option<PathBuf>,
    owner: &str,
    has_run: bool,
) -> Result<Part, Failure> {
    let Some(folder) = folder else { return Ok(Part::of(service)) };
    let (name, owner) = (service.name(), owner.to_owned());
    let nudge = Nudge::default();
    let wake = nudge.clone();
    let open = move || state_folder::open(&folder, name, &owner, N::FORMAT, has_run);
    let persisted = Persisted::new(service, start_number(), open, move || wake.wake())?;
    Ok(Part { node: Box::new(persisted), nudge })
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
                Failure::Bus(BusError::RunsAlready { .. } | BusError::Superseded { .. })
                | Failure::State(persisted::StartError::InUse(_))
                | Failure::Access(access::Failure::Audit(OpenError::InUse(_)))
                | Failure::Key(_)
                | Failure::Files(_)
                | Failure::Inputs { .. } => Outcome::BadInput,
                _ => Outcome::NotKeptUp,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command, ProcessCommand, RunArgs};
    use clap::Parser;

    #[test]
    fn a_disk_for_recordings_keeps_no_process_away_that_may_be_needed_in_flight() {
        #[track_caller]
        fn check(more: &[&str], starts: bool) {
            let file = tempfile::NamedTempFile::new().unwrap();
            let no_folder = file.path().to_str().unwrap();
            for name in RECORDED {
                let cli = Cli::parse_from([&["kittiwake", "run", name, "--record-inputs", no_folder], more].concat());
                let Some(Command::Run(RunArgs { process: ProcessCommand::Service(service) })) = cli.command else {
                    panic!("{cli:?}")
                };
                let (service, args) = service.split();
                let inputs = check_inputs::read(&args.settings).unwrap();
                assert_eq!(build(service, &args, &inputs).is_ok(), starts, "{name} {more:?}");
            }
        }
        check(&["--exit-with-parent", "--simulated"], false);
        check(&["--exit-with-parent", "--simulated", "--has-run"], true);
        // By a launcher over a real autopilot, which may have been started again in flight.
        check(&["--exit-with-parent"], true);
        // By systemd or in a container.
        check(&[], true);
    }
}
