//! The running system that a command addresses.

use std::path::PathBuf;

use crate::cli::TargetArgs;
use crate::run::run_file::{self, Running};

/// The environment variable with the caller's own token, for a system started by another user: never an argument, which
/// everybody on the machine could read.
const TOKEN: &str = "KITTIWAKE_TOKEN";

/// The environment variable with the gateway's address, where no argument names a system: the one of the commands about vehicles.
const URL: &str = "KITTIWAKE_URL";

/// The addresses of that system.
#[derive(Debug, PartialEq, Eq)]
pub struct Target {
    /// The router's locator; empty if only the gateway's address is known.
    pub connect: String,
    /// The gateway's address; empty if only the router's locator is known.
    pub http: String,
    /// The token for the gateway.
    pub token: String,
    /// The vehicle's name.
    pub vehicle: String,
    /// Its configuration file, if it is known.
    pub config: Option<PathBuf>,
    /// The CA file for the gateway's certificate, if it is not one of the operating system's.
    pub ca: Option<PathBuf>,
}

impl Target {
    /// The system that the arguments name, else the one of KITTIWAKE_URL, else the only one that runs.
    pub fn find(args: &TargetArgs) -> Result<Target, String> {
        let args = named_by(args, std::env::var(URL).ok());
        choose(&args, run_file::running(), std::env::var(TOKEN).ok())
    }
}

/// The arguments, with the address of the environment where none of them names a system.
fn named_by(args: &TargetArgs, url: Option<String>) -> TargetArgs {
    let names_one = args.pid.is_some() || args.connect.is_some() || args.http.is_some();
    let http = args.http.clone().or(url.filter(|it| !names_one && !it.is_empty()));
    TargetArgs { http, ..args.clone() }
}

/// `own` is the caller's own token.
fn choose(args: &TargetArgs, running: Vec<Running>, own: Option<String>) -> Result<Target, String> {
    let matches = |it: &Running| {
        args.pid.is_none_or(|pid| pid == it.pid)
            && args.connect.as_ref().is_none_or(|connect| *connect == it.connect)
            && args.http.as_ref().is_none_or(|http| http.trim_end_matches('/') == it.http)
            && args.vehicle.as_ref().is_none_or(|vehicle| vehicle.as_str() == it.vehicle)
    };
    let (mut found, others): (Vec<_>, Vec<_>) = running.into_iter().partition(matches);
    match found.len() {
        1 => {
            let it = found.remove(0);
            Ok(Target {
                connect: it.connect,
                http: it.http,
                token: own.unwrap_or(it.token),
                vehicle: it.vehicle,
                config: Some(it.config),
                ca: it.ca,
            })
        }
        // Not started by `kittiwake up`, or by another user: only the given addresses are known.
        0 if args.connect.is_some() || args.http.is_some() => Ok(Target {
            connect: args.connect.clone().unwrap_or_default(),
            http: args.http.clone().unwrap_or_default(),
            token: own.unwrap_or_default(),
            vehicle: args.vehicle.as_ref().map_or("uav1", |it| it.as_str()).to_owned(),
            config: args.config.clone(),
            ca: None,
        }),
        0 if others.is_empty() => {
            Err("unavailable: no system runs; start one with `kittiwake up`, or name one with --connect or --url"
                .into())
        }
        0 => Err(format!("unavailable: no such system runs; these do:\n{}", list(&others))),
        _ => Err(format!("several systems run; name one with --pid, --connect, --url or --vehicle:\n{}", list(&found))),
    }
}

fn list(running: &[Running]) -> String {
    let line =
        |it: &Running| format!("  --pid {}  {}  --connect {}  --url {}", it.pid, it.vehicle, it.connect, it.http);
    running.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn system(pid: u32) -> Running {
        Running {
            pid,
            connect: format!("tcp/127.0.0.1:{pid}"),
            http: format!("http://127.0.0.1:1{pid}"),
            token: String::new(),
            vehicle: format!("uav{pid}"),
            config: "kittiwake.toml".into(),
            ca: None,
        }
    }

    #[track_caller]
    fn check(args: TargetArgs, running: &[u32], expected: Result<&str, &str>) {
        let found = choose(&args, running.iter().map(|it| system(*it)).collect(), None);
        match (found, expected) {
            (Ok(target), Ok(connect)) => assert_eq!(target.connect, connect),
            (Err(said), Err(part)) => assert!(said.contains(part), "{said}"),
            (found, expected) => panic!("found {found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn the_only_system_needs_no_name() {
        check(TargetArgs::default(), &[1], Ok("tcp/127.0.0.1:1"));
    }

    #[test]
    fn the_address_of_the_environment_counts_where_no_argument_names_a_system() {
        let of = |args: TargetArgs, url: &str| named_by(&args, Some(url.into())).http;
        assert_eq!(of(TargetArgs::default(), "http://ground:8080").as_deref(), Some("http://ground:8080"));
        assert_eq!(of(TargetArgs::default(), ""), None);
        assert_eq!(of(TargetArgs { pid: Some(2), ..Default::default() }, "http://ground:8080"), None);
        let here = TargetArgs { http: Some("http://here:1".into()), ..Default::default() };
        assert_eq!(of(here, "http://ground:8080").as_deref(), Some("http://here:1"));
    }

    #[test]
    fn of_several_one_is_named() {
        check(TargetArgs::default(), &[1, 2], Err("--pid 2  uav2"));
        check(TargetArgs { pid: Some(2), ..Default::default() }, &[1, 2], Ok("tcp/127.0.0.1:2"));
        check(
            TargetArgs { vehicle: Some("uav1".parse().unwrap()), ..Default::default() },
            &[1, 2],
            Ok("tcp/127.0.0.1:1"),
        );
        check(
            TargetArgs { http: Some("http://127.0.0.1:12/".into()), ..Default::default() },
            &[1, 2],
            Ok("tcp/127.0.0.1:2"),
        );
    }

    #[test]
    fn a_system_that_nobody_knows_of_is_reached_by_its_address() {
        check(TargetArgs { connect: Some("tcp/10.0.0.1:7".into()), ..Default::default() }, &[1], Ok("tcp/10.0.0.1:7"));
        check(TargetArgs::default(), &[], Err("no system runs"));
        check(TargetArgs { pid: Some(3), ..Default::default() }, &[1], Err("no such system runs"));
    }
}
