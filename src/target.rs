//! The running system that a command addresses.

use std::path::PathBuf;

use crate::cli::TargetArgs;
use crate::run::run_file::{self, Running};

/// The gateway that the environment names, for a system started by another user, and the caller's token for it: never an argument,
/// which everybody on the machine could read.
#[derive(Debug, Default)]
pub struct Environment {
    /// `KITTIWAKE_URL`: the gateway's address, where no argument names a system.
    pub url: Option<String>,
    /// `KITTIWAKE_TOKEN`.
    token: Option<String>,
}

impl Environment {
    /// An empty variable counts as unset.
    pub fn read() -> Environment {
        let variable = |name| std::env::var(name).ok().filter(|it| !it.is_empty());
        Environment { url: variable("KITTIWAKE_URL"), token: variable("KITTIWAKE_TOKEN") }
    }

    /// The token for the gateway at `url`: the caller's own if that is the gateway it is for, else `of_run`, the one of its run file.
    ///
    /// # Errors
    /// If the caller's own is the only one, and for another gateway: it may be a stranger that listens at `url`.
    pub fn token_for(self, url: &str, of_run: String) -> Result<String, String> {
        let is_named = self.url.is_some_and(|it| it.trim_end_matches('/') == url.trim_end_matches('/'));
        match self.token {
            Some(own) if is_named => Ok(own),
            Some(_) if of_run.is_empty() => Err(format!(
                "KITTIWAKE_TOKEN is sent to KITTIWAKE_URL only: set KITTIWAKE_URL={url} if the token is for it"
            )),
            _ => Ok(of_run),
        }
    }
}

/// The addresses of that system.
#[derive(Debug, PartialEq, Eq)]
pub struct Target {
    /// The router's locator; empty if only the gateway's address is known.
    pub connect: String,
    /// The gateway's address; empty if only the router's locator is known.
    pub http: String,
    /// The token in its run file; may be empty.
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
        choose(&named_by(args, Environment::read().url), run_file::running())
    }
}

/// The arguments, with the address of the environment where none of them names a system.
fn named_by(args: &TargetArgs, url: Option<String>) -> TargetArgs {
    let names_one = args.pid.is_some() || args.connect.is_some() || args.http.is_some();
    let http = args.http.clone().or(url.filter(|_| !names_one));
    TargetArgs { http, ..args.clone() }
}

fn choose(args: &TargetArgs, running: Vec<Running>) -> Result<Target, String> {
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
                token: it.token,
                vehicle: it.vehicle,
                config: Some(it.config),
                ca: it.ca,
            })
        }
        // Not started by `kittiwake up`, or by another user: only the given addresses are known.
        0 if args.connect.is_some() || args.http.is_some() => Ok(Target {
            connect: args.connect.clone().unwrap_or_default(),
            http: args.http.clone().unwrap_or_default(),
            token: String::new(),
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
        let found = choose(&args, running.iter().map(|it| system(*it)).collect());
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
    #[test]
    fn the_token_of_the_environment_is_for_the_gateway_of_the_environment_alone() {
        #[track_caller]
        fn check(named: Option<&str>, url: &str, of_run: &str, expected: Result<&str, &str>) {
            let environment = Environment { url: named.map(str::to_owned), token: Some("own".into()) };
            let found = environment.token_for(url, of_run.into());
            match expected {
                Ok(token) => assert_eq!(found.as_deref(), Ok(token)),
                Err(part) => assert!(found.unwrap_err().contains(part)),
            }
        }
        check(Some("http://127.0.0.1:1/"), "http://127.0.0.1:1", "of its run", Ok("own"));
        check(Some("http://127.0.0.1:1"), "http://127.0.0.1:2", "of its run", Ok("of its run"));
        check(None, "http://127.0.0.1:2", "of its run", Ok("of its run"));
        check(None, "http://127.0.0.1:2", "", Err("set KITTIWAKE_URL=http://127.0.0.1:2 if"));
        check(Some("http://127.0.0.1:1"), "http://127.0.0.1:2", "", Err("is sent to KITTIWAKE_URL only"));
    }
}
