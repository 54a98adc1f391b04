//! The process that is checked: the one that is named, or the one that this container runs.

use std::path::Path;

use bus::crossing::{Crossing, aircraft_name};
use clap::Parser;
use domain::file::Source;

use crate::cli::{Cli, Command, HealthArgs, ProcessArgs, ProcessCommand, RouterArgs, RunArgs};
use crate::composition::{Composition, ONBOARD};
use crate::config::Config;
use crate::service::Service;

/// A process of the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Router,
    Service(Service),
    Onboard(Composition),
}

/// The process to look for, and its router.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subject {
    pub part: Part,
    /// The router's locators.
    pub connect: Vec<String>,
    /// The vehicle that it belongs to, if it belongs to one.
    pub vehicle: String,
    /// The peers of a router on the link.
    pub peers: Vec<String>,
}

impl Subject {
    /// The process's name.
    pub fn name(&self) -> &'static str {
        match self.part {
            Part::Router => "router",
            Part::Service(service) => service.name(),
            Part::Onboard(_) => ONBOARD,
        }
    }
}

/// The process that `args` name. Without a name, that with the process id 1: in a container, the only one.
pub fn find(args: &HealthArgs) -> Result<Subject, String> {
    let Some(name) = &args.process else { return of_command(&of_the_container()?) };
    let service = Service::ALL.into_iter().find(|it| it.name() == name);
    let vehicle = match (service, &args.vehicle) {
        (None, _) => String::new(),
        (Some(_), Some(vehicle)) => vehicle.to_string(),
        (Some(_), None) => vehicle_of(&args.config)?,
    };
    Ok(Subject {
        part: service.map_or(Part::Router, Part::Service),
        connect: args.connect.clone(),
        vehicle,
        peers: Vec::new(),
    })
}

/// The arguments of the process with the id 1, without the program's name.
fn of_the_container() -> Result<Vec<String>, String> {
    let line = std::fs::read("/proc/1/cmdline").map_err(|cause| format!("/proc/1/cmdline: {cause}"))?;
    let words: Vec<String> = line
        .split(|it| *it == 0)
        .map(|it| String::from_utf8_lossy(it).into_owned())
        .filter(|it| !it.is_empty())
        .collect();
    arguments(&words).ok_or_else(|| {
        let found = words.first().map_or("nothing", String::as_str);
        format!("which process? found `{found}` as process 1, expected `kittiwake`; name one with --process")
    })
}

/// The arguments after the program's name; an init that started it may come before.
fn arguments(words: &[String]) -> Option<Vec<String>> {
    let is_program = |it: &String| Path::new(it).file_name().is_some_and(|name| name == "kittiwake");
    let program = words.iter().position(is_program)?;
    Some(words[program + 1..].to_vec())
}

fn of_command(words: &[String]) -> Result<Subject, String> {
    let line = words.join(" ");
    let parsed = Cli::try_parse_from(std::iter::once("kittiwake").chain(words.iter().map(String::as_str)));
    match parsed.map_err(|mistake| format!("`kittiwake {line}` is not a process: {mistake}"))?.command {
        Some(Command::Run(RunArgs { process: ProcessCommand::Router(args) })) => {
            let connect = args.listen.iter().map(|it| reachable(it)).collect();
            Ok(Subject { part: Part::Router, connect, vehicle: String::new(), peers: peers(&args)? })
        }
        Some(Command::Run(RunArgs { process: ProcessCommand::Service(command) })) => {
            let (service, args) = command.split();
            of_process(Part::Service(service), args)
        }
        Some(Command::Run(RunArgs { process: ProcessCommand::Onboard(args) })) => {
            of_process(Part::Onboard(args.nodes), args.process)
        }
        _ => Err(format!("`kittiwake {line}` is not a process of the system, expected the router or a service")),
    }
}

fn of_process(part: Part, args: ProcessArgs) -> Result<Subject, String> {
    let vehicle = match &args.settings.vehicle {
        Some(vehicle) => vehicle.to_string(),
        None => vehicle_of(&args.settings.config)?,
    };
    Ok(Subject { part, connect: args.connect, vehicle, peers: Vec::new() })
}

/// The peers at the other end of a router's link.
fn peers(args: &RouterArgs) -> Result<Vec<String>, String> {
    match (&args.dial, &args.link) {
        (Some(_), Some(table)) => {
            let table = Source::read(table).and_then(|it| Crossing::read(&it)).map_err(|it| it.to_string())?;
            Ok(vec![table.ground])
        }
        _ => Ok(args.vehicle.iter().map(|it| aircraft_name(it.as_str())).collect()),
    }
}

fn vehicle_of(config: &Path) -> Result<String, String> {
    let config = Source::read(config).and_then(|it| it.parse::<Config>()).map_err(|mistakes| mistakes.to_string())?;
    Ok(config.vehicle.to_string())
}

/// A router that listens on all addresses is reached on the loopback.
fn reachable(locator: &str) -> String {
    locator.replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(line: &str, expected: Result<(&str, &str, &str), &str>) {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let found = arguments(&words).ok_or("not the program".to_owned()).and_then(|it| of_command(&it));
        match (found, expected) {
            (Ok(it), Ok(expected)) => {
                assert_eq!((it.name(), it.connect.join(" ").as_str(), it.vehicle.as_str()), expected, "{line}");
            }
            (Err(said), Err(part)) => assert!(said.contains(part), "{said}"),
            (found, expected) => panic!("{line}: found {found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn a_process_is_looked_for_where_its_arguments_say() {
        let here = &crate::run::run_file::router_locator();
        check("kittiwake run mcm --vehicle uav7", Ok(("mcm", here, "uav7")));
        check(
            "/usr/local/bin/kittiwake run planner --vehicle uav1 --connect tcp/r:1",
            Ok(("planner", "tcp/r:1", "uav1")),
        );
        check("/sbin/docker-init -- kittiwake run gateway --vehicle uav1 --speed 20", Ok(("gateway", here, "uav1")));
        check("kittiwake run mcm", Ok(("mcm", here, "uav1")));
        check("kittiwake run onboard --nodes mcm,planner --vehicle uav7", Ok(("onboard", here, "uav7")));
        check("kittiwake run router", Ok(("router", here, "")));
        check("kittiwake run router --listen tcp/0.0.0.0:7447", Ok(("router", "tcp/127.0.0.1:7447", "")));
        check("kittiwake run router --listen tcp/[::]:1", Ok(("router", "tcp/[::1]:1", "")));
    }

    #[test]
    fn a_router_is_asked_about_those_it_is_linked_to() {
        #[track_caller]
        fn check(line: &str, expected: &[&str]) {
            let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            assert_eq!(of_command(&words).unwrap().peers, expected, "{line}");
        }
        check("run router", &[]);
        check("run router --dial tls/g:1 --certificates c --vehicle uav1", &["ground-router"]);
        let accept = "run router --accept tls/0.0.0.0:1 --certificates c --vehicle uav1 --vehicle uav2";
        check(accept, &["uav1-router", "uav2-router"]);
    }

    #[test]
    fn an_unknown_process_is_reported_as_unknown() {
        check("bash -c true", Err("not the program"));
        check("kittiwake status", Err("expected the router or a service"));
        check("kittiwake fly", Err("unrecognized subcommand"));
        check("kittiwake run mcm --config nowhere.toml", Err("nowhere.toml: cannot be read"));
    }
}
