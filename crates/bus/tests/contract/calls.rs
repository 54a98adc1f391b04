//! Requests and what comes of them.

use std::time::Duration;

use kittiwake_proto::topics::{Request, Response, Service};
use kittiwake_proto::v1;
use node::{CallError, CallId, Effect, Event, Scope};

use crate::stories::contract::probe::{Probe, Seen};
use crate::stories::contract::shell::Shell;

const LONG: Duration = Duration::from_secs(50);
const SHORT: Duration = Duration::from_millis(300);

fn call(id: u64, request: Request, timeout: Duration) -> Effect {
    Effect::Call { call: CallId(id), vehicle: None, trace: None, request, timeout }
}

fn permission(area: &str) -> Request {
    Request::Permission(v1::PermissionRequest { area: area.into(), ..Default::default() })
}

/// What came of each call, by its id.
fn outcomes(seen: &Seen) -> Vec<(u64, Result<String, CallError>)> {
    let mut outcomes = seen.pick(|event| match event {
        Event::Reply { call, result } => {
            let words = |response: &Response| match response {
                Response::Permission(receipt) => receipt.refusal.clone(),
                other => format!("{other:?}"),
            };
            Some((call.0, result.as_ref().map(words).map_err(|error| *error)))
        }
        _ => None,
    });
    outcomes.sort_by_key(|(call, _)| *call);
    outcomes
}

/// Answers requests for permission with their area, and leaves those for skills without a reply, which no node may.
fn server() -> Probe {
    Probe::listener("control-tower", &[]).serving(&[Service::Permission, Service::Skill]).on_event(|event, effects| {
        if let Event::Request { token, request: Request::Permission(request), .. } = event {
            let receipt = v1::PermissionReceipt { received: true, refusal: request.area.clone() };
            effects.push(Effect::Reply { token: *token, response: Response::Permission(receipt) });
        }
    })
}

/// Makes these calls when it first sees the process `of`.
fn caller(of: &'static str, calls: Vec<Effect>) -> Probe {
    let mut calls = Some(calls);
    Probe::listener("mcm", &[]).on_event(move |event, effects| {
        if matches!(event, Event::Peer { service, alive: true, .. } if service == of) {
            effects.extend(calls.take().into_iter().flatten());
        }
    })
}

/// One that is answered, one whose node does not answer, one that nobody serves: each ends once, and only the last one
/// waits for its deadline.
pub fn one_answer_each(shell: &mut dyn Shell) {
    let calls = vec![
        call(1, permission("A"), LONG),
        call(2, Request::Skill(v1::SkillRequest::default()), 10 * LONG),
        call(3, Request::Fault(v1::FaultRequest::default()), SHORT),
        call(4, permission("B"), LONG),
    ];
    let scope = || Scope::Vehicle("uav1".into());
    let seen = shell.add(scope(), caller("control-tower", calls));
    shell.add(scope(), server());
    shell.wait_for("the end of every call", &mut || 4 <= outcomes(&seen).len());
    let expected =
        [(1, Ok("A".into())), (2, Err(CallError::Unanswered)), (3, Err(CallError::Unavailable)), (4, Ok("B".into()))];
    assert_eq!(outcomes(&seen), expected);
}

/// A request that nobody serves is kept until its deadline, and answered by the node that comes before it.
pub fn server_comes_later(shell: &mut dyn Shell) {
    let calls = vec![call(1, permission("A"), SHORT), call(2, permission("B"), LONG)];
    let scope = || Scope::Vehicle("uav1".into());
    let seen = shell.add(scope(), caller("mcm", calls));
    shell.wait_for("the end of the first call", &mut || !outcomes(&seen).is_empty());
    shell.add(scope(), server());
    shell.wait_for("the end of the second call", &mut || 2 <= outcomes(&seen).len());
    assert_eq!(outcomes(&seen), [(1, Err(CallError::Unavailable)), (2, Ok("B".into()))]);
}

/// People ask for as much work as they please: between two orders the node acts, and so does everybody else in its loop.
pub fn one_order_at_a_time(shell: &mut dyn Shell) {
    const ORDERS: u64 = 40;
    let order = |id| call(id, Request::Mission(v1::MissionRequest::default()), LONG);
    let calls = (1..=ORDERS).map(order).chain([call(ORDERS + 1, permission("A"), LONG)]).collect();
    let scope = || Scope::Vehicle("uav1".into());
    let gate = shell.gate(&scope());
    let opened = gate.clone();
    let server = server().serving(&[Service::Permission, Service::Mission]).on_event(move |event, effects| {
        let Event::Request { token, request, .. } = event else { return };
        // Until all have arrived.
        gate.wait();
        let response = match request {
            Request::Mission(_) => Response::Mission(v1::MissionReply::default()),
            _ => Response::Permission(v1::PermissionReceipt::default()),
        };
        effects.push(Effect::Reply { token: *token, response });
    });
    let seen = shell.add(scope(), caller("control-tower", calls));
    let asked = shell.add(scope(), server);
    shell.wait_for("the calls", &mut || seen.peer("control-tower", true));
    opened.open();
    shell.wait_for("an answer to every call", &mut || ORDERS < outcomes(&seen).len() as u64);
    assert!(outcomes(&seen).iter().all(|(_, outcome)| outcome.is_ok()));
    let order = |event: &Event| match event {
        Event::Request { request, .. } if request.service() == Service::Mission => Some(()),
        _ => None,
    };
    let turns: Vec<usize> = asked.turns(order).iter().map(Vec::len).collect();
    assert_eq!(turns.iter().sum::<usize>() as u64, ORDERS);
    assert!(turns.iter().all(|orders| *orders <= 1), "{turns:?}");
}
