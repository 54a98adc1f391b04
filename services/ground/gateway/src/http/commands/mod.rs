//! What operators, the tower and the safety pilot order over HTTP. Each handler answers what happened.

#![expect(clippy::disallowed_methods, reason = "command authority is leased on the wall clock")]

use std::time::Instant;

use axum::Extension;
use axum::extract::{Path, State};
use domain::file::did_you_mean;
use kittiwake_proto::topics::{Message, Request, Response as Reply};
use kittiwake_proto::v1;
use serde::Deserialize;
use serde_json::Value;
use v1::mission_request::Request as MissionCall;
use v1::operator_command::Verb;

use crate::access::utc_ms_now;
use crate::http::answer::{Answer, document};
use crate::http::guard::AuthorizedRequest;
use crate::http::problem::Problem;
use crate::http::site::Site;
use crate::orders::Order;
use crate::view;
use answers::{busy, invalid_member, invalid_reply, read, read_optional, refused};
pub(crate) use missions::Missions;
pub(crate) use table::add_to;

mod answers;
mod missions;
mod table;

type Shared = State<Site>;
type Authorized = Extension<AuthorizedRequest>;

/// The thing that a path names besides the vehicle.
#[derive(Deserialize)]
struct Named {
    #[serde(alias = "area", alias = "flag", alias = "site")]
    name: String,
}

async fn take(State(site): Shared, Extension(request): Authorized) -> Answer {
    let taken = site.api.authorities.take(request.vehicle()?, &request.who.name, Instant::now());
    site.command_changed(&request, taken)
}

async fn release(State(site): Shared, Extension(request): Authorized) -> Answer {
    let released = site.api.authorities.release(request.vehicle()?, &request.who.name, Instant::now());
    site.command_changed(&request, released)
}

async fn hand_over(State(site): Shared, Extension(request): Authorized) -> Answer {
    let v1::HandOver { to } = read(&request.body)?;
    if to.is_empty() || 64 < to.len() {
        return Err(invalid_member("/to", "`to` needs 1 to 64 characters"));
    }
    let (authorities, vehicle, who, now) =
        (&site.api.authorities, request.vehicle()?, &request.who.name, Instant::now());
    let offered = authorities.check(vehicle, who, now).and_then(|()| {
        if *to == **who {
            return Err(format!("{to} has command of {vehicle}: name somebody else"));
        }
        if !site.api.tokens.get().let_command(&to, utc_ms_now()) {
            return Err(format!("{to} cannot take command: no valid token has this name and the role `operator`"));
        }
        authorities.hand_over(vehicle, who, &to, now)
    });
    site.command_changed(&request, offered)
}

macro_rules! verbs {
    ($($name:ident $word:literal $verb:expr;)*) => {
        $(async fn $name(State(site): Shared, Extension(request): Authorized) -> Answer {
            let verb: fn(&Value) -> Result<Verb, Problem> = $verb;
            site.order(&request, $word, verb(&request.body)?).await
        })*
    };
}

verbs! {
    start "start" |_| Ok(Verb::Start(v1::StartMission {}));
    pause "pause" |body| read_optional(body).map(Verb::Pause);
    resume "resume" |_| Ok(Verb::Resume(v1::ResumeMission {}));
    abort "abort" |body| read_optional(body).map(Verb::Abort);
    return_home "return" |body| read_optional(body).map(Verb::Return);
    land_at "land-at" |body| read(body).map(Verb::LandAt);
    replan "replan" |_| Ok(Verb::Replan(v1::ReplanMission {}));
    inspected "inspected" |_| Ok(Verb::Inspected(v1::Inspected {}));
    decide_plan "plan/decision" |body| read(body).map(Verb::DecidePlan);
}

async fn acknowledge(State(site): Shared, Path(it): Path<Named>, Extension(request): Authorized) -> Answer {
    let verb = Verb::Acknowledge(v1::AcknowledgeFlag { flag: it.name });
    site.order(&request, "acknowledge", verb).await
}

async fn decide_permission(State(site): Shared, Path(it): Path<Named>, Extension(request): Authorized) -> Answer {
    let area = it.name;
    let mut decision: v1::DecideRequest = read(&request.body)?;
    (decision.vehicle, decision.area) = (request.vehicle()?.to_string(), area.clone());
    let word = match decision.decision() {
        v1::Decision::Grant => "granted",
        v1::Decision::Deny => "denied",
        v1::Decision::Revoke => "revoked",
        v1::Decision::Unspecified => return Err(invalid_member("/decision", "`decision` is missing")),
    };
    match site.call(&request, Request::Decide(decision)).await? {
        Reply::Decide(reply) if reply.accepted => site.done(&request, "permission", format!("area {area}: {word}")),
        Reply::Decide(reply) => Err(refused(&request, "permission", reply.refusal)),
        _ => Err(invalid_reply(&request)),
    }
}

async fn accept_loss(State(site): Shared, Extension(request): Authorized) -> Answer {
    let vehicle = request.vehicle()?.to_string();
    match site.call(&request, Request::AcceptLoss(v1::AcceptLossRequest { vehicle })).await? {
        Reply::AcceptLoss(reply) if reply.accepted => {
            site.done(&request, "permission", "the control tower grants again, for every vehicle".to_owned())
        }
        Reply::AcceptLoss(reply) => Err(refused(&request, "permission", reply.refusal)),
        _ => Err(invalid_reply(&request)),
    }
}

async fn report_site(State(site): Shared, Path(it): Path<Named>, Extension(request): Authorized) -> Answer {
    let report = v1::SiteReport { site: it.name.clone(), ..read(&request.body)? };
    match site.call(&request, Request::SiteReport(report)).await? {
        Reply::SiteReport(reply) if reply.accepted => {
            site.done(&request, "site", format!("site {}: the report is taken, for every vehicle", it.name))
        }
        Reply::SiteReport(reply) => Err(refused(&request, "site", reply.refusal)),
        _ => Err(invalid_reply(&request)),
    }
}

async fn validate(State(site): Shared, Extension(request): Authorized) -> Answer {
    site.mission(&request, MissionCall::Validate(read(&request.body)?)).await
}

async fn upload(State(site): Shared, Extension(request): Authorized) -> Answer {
    site.mission(&request, MissionCall::Upload(read(&request.body)?)).await
}

async fn validate_airspace(State(site): Shared, Extension(request): Authorized) -> Answer {
    site.mission(&request, MissionCall::ValidateAirspace(read(&request.body)?)).await
}

async fn adopt_airspace(State(site): Shared, Extension(request): Authorized) -> Answer {
    site.mission(&request, MissionCall::AdoptAirspace(read(&request.body)?)).await
}

async fn insert(State(site): Shared, Extension(request): Authorized) -> Answer {
    site.mission(&request, MissionCall::Insert(read(&request.body)?)).await
}

async fn remove(State(site): Shared, Path(it): Path<Named>, Extension(request): Authorized) -> Answer {
    site.mission(&request, MissionCall::Remove(v1::RemoveObjective { name: it.name })).await
}

async fn skip(State(site): Shared, Path(it): Path<Named>, Extension(request): Authorized) -> Answer {
    site.mission(&request, MissionCall::Skip(v1::SkipObjective { name: it.name })).await
}

/// The present mission, from the mission manager itself.
async fn read_mission(State(site): Shared, Extension(request): Authorized) -> Answer {
    site.read_mission(&request).await
}

async fn inject_flag(State(site): Shared, Extension(request): Authorized) -> Answer {
    let flag: v1::FlagEvent = read(&request.body)?;
    if flag.name.is_empty() {
        return Err(invalid_member("/name", "`name` is missing"));
    }
    let known: Vec<&str> = site.api.of_table.flags.iter().map(String::as_str).collect();
    // A gateway without a table knows none.
    if !known.is_empty() && !known.contains(&flag.name.as_str()) {
        let why = format!("unknown flag `{}`: {}", flag.name, did_you_mean(&flag.name, &known));
        return Err(invalid_member("/name", &why));
    }
    let text = format!("flag `{}` {}", flag.name, if flag.raised { "raised" } else { "cleared" });
    let order = Order::Publish { vehicle: request.vehicle()?.clone(), message: Message::from(flag) };
    if !site.api.orders.send(order) {
        return Err(busy());
    }
    site.done(&request, "simulation/flags", text)
}

/// The faults of the simulator, which lists them in reply to a request without a name.
async fn list_faults(State(site): Shared, Extension(request): Authorized) -> Answer {
    match site.call(&request, Request::Fault(v1::FaultRequest::default())).await? {
        Reply::Fault(reply) => {
            let snapshot = site.snapshot();
            let (mission_time_s, utc) = (snapshot.mission_time_s(request.vehicle()?), view::utc(snapshot.now.utc_ms));
            Ok(document(&v1::FaultList { mission_time_s, utc, faults: reply.known }))
        }
        _ => Err(invalid_reply(&request)),
    }
}

async fn inject_fault(State(site): Shared, Extension(request): Authorized) -> Answer {
    match site.call(&request, Request::Fault(read(&request.body)?)).await? {
        Reply::Fault(reply) if reply.accepted => site.done(&request, "simulation/faults", reply.detail),
        Reply::Fault(reply) => Err(refused(&request, "simulation/faults", reply.detail)),
        _ => Err(invalid_reply(&request)),
    }
}
