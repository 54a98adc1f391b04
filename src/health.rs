//! `kittiwake health`: whether one process is on the bus and makes progress, for its supervisor.
//!
//! A process that is alive for the operating system may still be off the bus, or stuck.
//! So this asks on the bus, as another process would.

use std::sync::mpsc;
use std::time::Duration;

use bus::{BusError, Link, Presence, RouterView};
use serde_json::json;

use crate::cli::HealthArgs;
use crate::health::subject::{Part, Subject};
use crate::outcome::Outcome;
use crate::output;
use crate::service::Service;

mod subject;

/// The answer is given within this time in any case.
const LIMIT: Duration = Duration::from_millis(2800);
/// Its parts: for the answer of a router,
const ROUTER_LIMIT: Duration = Duration::from_millis(500);
/// and for a heartbeat of a service, which comes four times a second.
const PATIENCE: Duration = Duration::from_millis(1600);

/// What is said about a process.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Verdict {
    healthy: bool,
    said: String,
}

/// Prints the health of the process in one line. Exit code 0 if it is healthy, 1 if not.
pub fn health(args: &HealthArgs) -> Outcome {
    let subject = match subject::find(args) {
        Ok(subject) => subject,
        Err(mistake) => {
            output::error_line(mistake);
            return Outcome::BadInput;
        }
    };
    let verdict = examine_within(LIMIT, subject.clone());
    if args.json {
        output::line(json!({ "process": subject.name(), "healthy": verdict.healthy, "said": verdict.said }));
    } else {
        output::line(format_args!("{}: {}", subject.name(), verdict.said));
    }
    if verdict.healthy { Outcome::Success } else { Outcome::Unavailable }
}

/// A name that does not resolve, or a network without any answer, holds up the thread, not the answer.
fn examine_within(limit: Duration, subject: Subject) -> Verdict {
    let (sender, verdict) = mpsc::sync_channel(1);
    std::thread::spawn(move || {
        // Fails only once the time has passed.
        let _ = sender.send(examine(&subject));
    });
    let late = |_| Verdict { healthy: false, said: format!("no answer within {limit:?}") };
    verdict.recv_timeout(limit).unwrap_or_else(late)
}

fn examine(subject: &Subject) -> Verdict {
    match &subject.part {
        Part::Router => {
            let found = bus::look_at_router(&link(subject, bus::Scope::Fleet), PATIENCE);
            judge_router(found, &subject.peers)
        }
        Part::Service(service) => look_for(*service, subject),
        Part::Onboard(composition) => all_of(composition.services().into_iter().map(|it| (it, look_for(it, subject)))),
    }
}

fn look_for(service: Service, subject: &Subject) -> Verdict {
    let link = link(subject, service.scope(&subject.vehicle));
    judge(bus::look_for(&link, service.name(), PATIENCE))
}

/// Of several services in one process each must be healthy. They have one loop: the first that is not, or the last, speaks for all.
fn all_of(each: impl Iterator<Item = (Service, Verdict)>) -> Verdict {
    let mut said = String::new();
    for (service, verdict) in each {
        said = format!("{service}: {}", verdict.said);
        if !verdict.healthy {
            return Verdict { healthy: false, said };
        }
    }
    Verdict { healthy: true, said }
}

fn link(subject: &Subject, scope: bus::Scope) -> Link {
    Link { connect: subject.connect.clone(), scope, open_timeout: ROUTER_LIMIT }
}

fn judge(found: Result<Presence, BusError>) -> Verdict {
    let (healthy, said) = match found {
        Ok(Presence::Alive(it)) => {
            (true, format!("up for {:.0} s, {} events handled, {} dropped", it.uptime_s, it.handled, it.dropped))
        }
        Ok(Presence::Stuck) => (false, format!("on the bus, but no sign of progress within {PATIENCE:?}")),
        Ok(Presence::Absent) => (false, "not on the bus".to_owned()),
        Err(cause) => (false, cause.to_string()),
    };
    Verdict { healthy, said }
}

/// A router is healthy if it routes. A link that is down is printed, and is no reason to restart the router.
fn judge_router(found: Result<Option<RouterView>, BusError>, peers: &[String]) -> Verdict {
    let (healthy, said) = match found {
        Ok(Some(it)) => (true, format!("{} listens{}", it.name, links(&it, peers))),
        Ok(None) => (false, format!("listens, but did not give its name within {PATIENCE:?}")),
        Err(cause) => (false, cause.to_string()),
    };
    Verdict { healthy, said }
}

fn links(view: &RouterView, expected: &[String]) -> String {
    let down: Vec<_> = expected.iter().filter(|it| !view.links.contains(it)).cloned().collect();
    let told =
        [("link up", &view.links), ("link down", &down), ("more connections than one machine makes", &view.crowded)];
    let told = told.into_iter().filter(|(_, names)| !names.is_empty());
    told.map(|(state, names)| format!("; {state}: {}", names.join(", "))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1::Heartbeat;

    #[test]
    fn a_process_with_several_services_is_as_healthy_as_the_worst() {
        #[track_caller]
        fn check(is_healthy: [bool; 3], healthy: bool, said: &str) {
            let services = [Service::SkillManager, Service::Monitor, Service::Mcm];
            let each = services.into_iter().zip(is_healthy).map(|(service, healthy)| {
                let said = if healthy { "up" } else { "stuck" }.to_owned();
                (service, Verdict { healthy, said })
            });
            assert_eq!(all_of(each), Verdict { healthy, said: said.to_owned() });
        }
        check([true; 3], true, "mcm: up");
        check([true, false, true], false, "monitor: stuck");
    }

    #[test]
    fn a_process_on_the_bus_that_makes_progress_is_healthy() {
        #[track_caller]
        fn check(found: Result<Presence, BusError>, healthy: bool, said: &str) {
            let verdict = judge(found);
            assert_eq!((verdict.healthy, verdict.said.as_str()), (healthy, said));
        }
        let heartbeat = Heartbeat { uptime_s: 12.3, handled: 4, dropped: 1, ..Default::default() };
        check(Ok(Presence::Alive(heartbeat)), true, "up for 12 s, 4 events handled, 1 dropped");
        check(Ok(Presence::Stuck), false, "on the bus, but no sign of progress within 1.6s");
        check(Ok(Presence::Absent), false, "not on the bus");
        let nobody =
            BusError::Unreachable { locators: "tcp/r:1".into(), waited: ROUTER_LIMIT, cause: "refused".into() };
        check(Err(nobody), false, "no router reached at tcp/r:1 within 500ms: refused");
    }

    #[test]
    fn a_router_is_healthy_with_any_state_of_its_link() {
        #[track_caller]
        fn check(up: &[&str], crowded: &[&str], expected: &[&str], said: &str) {
            let names = |it: &[&str]| it.iter().map(|it| (*it).to_owned()).collect::<Vec<_>>();
            let view = RouterView { name: "r".into(), links: names(up), crowded: names(crowded) };
            let verdict = judge_router(Ok(Some(view)), &names(expected));
            assert_eq!((verdict.healthy, verdict.said.as_str()), (true, said));
        }
        check(&[], &[], &[], "r listens");
        check(&["g"], &[], &["g"], "r listens; link up: g");
        check(&[], &[], &["g"], "r listens; link down: g");
        check(&["a"], &[], &["a", "b", "c"], "r listens; link up: a; link down: b, c");
        check(&["a"], &["a"], &["a"], "r listens; link up: a; more connections than one machine makes: a");
        assert!(!judge_router(Ok(None), &[]).healthy);
    }

    #[test]
    #[expect(clippy::disallowed_methods, reason = "the answer is waited for up to a limit")]
    fn an_answer_comes_in_time_though_no_router_does() {
        // Takes the call and never answers it.
        let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let connect = vec![format!("tcp/{}", silent.local_addr().unwrap())];
        let subject = Subject { part: Part::Router, connect, vehicle: String::new(), peers: Vec::new() };
        let start = std::time::Instant::now();
        let verdict = examine_within(Duration::from_millis(300), subject);
        assert_eq!(verdict, Verdict { healthy: false, said: "no answer within 300ms".into() });
        assert!(start.elapsed() < LIMIT);
    }
}
