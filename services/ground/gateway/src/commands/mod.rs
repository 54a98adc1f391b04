//! What an operator, the tower and the safety pilot order over HTTP. Each answers what happened.

use std::time::Instant;

use axum::Extension;
use axum::extract::{Path, State};
use axum::response::Response;
use kittiwake_proto::json::to_json;
use kittiwake_proto::topics::{Message, Request, Response as Reply};
use kittiwake_proto::v1;
use serde_json::{Value, json};
use v1::mission_request::Request as Ask;
use v1::operator_command::Verb;

use crate::guard::{Asked, Site};
use crate::http::document;
use crate::orders::Wish;
use crate::problem::Problem;
use crate::view;
use answers::{bad_body, busy, read, refused, senseless};
pub(crate) use table::add_to;

mod answers;
mod table;

type Outcomes = Result<Response, Problem>;

async fn take(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    site.helm_moved(&vehicle, site.api.helms.take(&vehicle, &asked.who.name, Instant::now()))
}

async fn release(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    site.helm_moved(&vehicle, site.api.helms.release(&vehicle, &asked.who.name, Instant::now()))
}

async fn hand_over(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    let to = asked.body.get("to").and_then(Value::as_str).filter(|it| !it.is_empty() && it.len() <= 64);
    let to = to.ok_or_else(|| bad_body("`to` is missing"))?;
    site.helm_moved(&vehicle, site.api.helms.hand_over(&vehicle, &asked.who.name, to, Instant::now()))
}

macro_rules! verbs {
    ($($name:ident $word:literal $verb:expr;)*) => {
        $(async fn $name(
            State(site): State<Site>,
            Path(id): Path<String>,
            Extension(asked): Extension<Asked>,
        ) -> Outcomes {
            let verb: fn(&Value) -> Result<Verb, Problem> = $verb;
            let verb = verb(&asked.body)?;
            site.order(&id, asked, $word, verb).await
        })*
    };
}

verbs! {
    start "start" |_| Ok(Verb::Start(v1::StartMission {}));
    pause "pause" |_| Ok(Verb::Pause(v1::PauseMission {}));
    resume "resume" |_| Ok(Verb::Resume(v1::ResumeMission {}));
    abort "abort" |_| Ok(Verb::Abort(v1::AbortMission {}));
    return_home "return" |_| Ok(Verb::Return(v1::ReturnHome {}));
    land_at "land-at" |body| read(body).map(Verb::LandAt);
    replan "replan" |_| Ok(Verb::Replan(v1::ReplanMission {}));
    decide_plan "plan/decision" |body| read(body).map(Verb::DecidePlan);
}

async fn acknowledge(
    State(site): State<Site>,
    Path((id, flag)): Path<(String, String)>,
    Extension(asked): Extension<Asked>,
) -> Outcomes {
    site.order(&id, asked, "acknowledge", Verb::Acknowledge(v1::AcknowledgeFlag { flag })).await
}

async fn decide_permission(
    State(site): State<Site>,
    Path((id, area)): Path<(String, String)>,
    Extension(asked): Extension<Asked>,
) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    let mut decision: v1::DecideRequest = read(&asked.body)?;
    (decision.vehicle, decision.area) = (id, area.clone());
    let word = match decision.decision() {
        v1::Decision::Grant => "granted",
        v1::Decision::Deny => "denied",
        v1::Decision::Revoke => "revoked",
        v1::Decision::Unspecified => return Err(bad_body("`decision` is missing")),
    };
    match site.ask(&vehicle, Request::Decide(decision), &asked).await? {
        Reply::Decide(it) if it.accepted => {
            Ok(site.done(&vehicle, "permission", &asked, &format!("area {area}: {word}")))
        }
        Reply::Decide(it) => Err(refused("permission", &asked, it.refusal)),
        _ => Err(senseless()),
    }
}

async fn validate(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let text = read(&asked.body)?;
    site.mission(&id, &asked, Ask::Validate(text)).await
}

async fn upload(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let text = read(&asked.body)?;
    site.mission(&id, &asked, Ask::Upload(text)).await
}

async fn insert(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let objective = read(&asked.body)?;
    site.mission(&id, &asked, Ask::Insert(objective)).await
}

async fn remove(
    State(site): State<Site>,
    Path((id, name)): Path<(String, String)>,
    Extension(asked): Extension<Asked>,
) -> Outcomes {
    site.mission(&id, &asked, Ask::Remove(v1::RemoveObjective { name })).await
}

async fn skip(
    State(site): State<Site>,
    Path((id, name)): Path<(String, String)>,
    Extension(asked): Extension<Asked>,
) -> Outcomes {
    site.mission(&id, &asked, Ask::Skip(v1::SkipObjective { name })).await
}

async fn inject_flag(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    let mut flag: v1::FlagEvent = read(&asked.body)?;
    if flag.name.is_empty() {
        return Err(bad_body("`name` is missing"));
    }
    flag.source = "injector".to_owned();
    let text = format!("flag `{}` {}", flag.name, if flag.raised { "raised" } else { "lowered" });
    let message = Message::from(flag);
    if !site.api.orders.send(Wish::Publish { vehicle: vehicle.clone(), message }) {
        return Err(busy());
    }
    Ok(site.done(&vehicle, "simulation/flags", &asked, &text))
}

/// The simulator knows which there are: a request without a name asks for them.
async fn list_faults(State(site): State<Site>, Path(id): Path<String>, Extension(asked): Extension<Asked>) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    match site.ask(&vehicle, Request::Fault(v1::FaultRequest::default()), &asked).await? {
        Reply::Fault(it) => {
            let faults: Vec<Value> = it.known.iter().map(to_json).collect();
            Ok(document(view::stamped(site.snapshot().now, json!({ "faults": faults }))))
        }
        _ => Err(senseless()),
    }
}

async fn inject_fault(
    State(site): State<Site>,
    Path(id): Path<String>,
    Extension(asked): Extension<Asked>,
) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    match site.ask(&vehicle, Request::Fault(read(&asked.body)?), &asked).await? {
        Reply::Fault(it) if it.accepted => Ok(site.done(&vehicle, "simulation/faults", &asked, &it.detail)),
        Reply::Fault(it) => Err(refused("simulation/faults", &asked, it.detail)),
        _ => Err(senseless()),
    }
}

/// The mission as it stands, from the planner itself.
pub(crate) async fn read_mission(
    State(site): State<Site>,
    Path(id): Path<String>,
    Extension(asked): Extension<Asked>,
) -> Outcomes {
    let vehicle = site.vehicle(&id)?;
    let request = v1::MissionRequest { request: Some(Ask::Read(v1::ReadMission {})), ..Default::default() };
    match site.ask(&vehicle, Request::Mission(request), &asked).await? {
        Reply::Mission(v1::MissionReply { status: Some(status), .. }) => {
            Ok(document(view::stamped(site.snapshot().now, to_json(&status))))
        }
        _ => Err(senseless()),
    }
}
