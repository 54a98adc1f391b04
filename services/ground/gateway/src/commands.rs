//! What an operator, the tower and the safety pilot order over HTTP. Each answers what happened.

use std::sync::Arc;
use std::time::Instant;

use axum::Extension;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use kittiwake_proto::json::{from_json, to_json};
use kittiwake_proto::topics::{Message, Request, Response as Reply};
use kittiwake_proto::v1;
use node::{CallError, VehicleId};
use serde_json::{Value, json};
use v1::mission_request::Request as Ask;
use v1::operator_command::Verb;

use crate::access::Role;
use crate::guard::{Asked, Outcome, Site};
use crate::http::{document, no_such_vehicle};
use crate::orders::Wish;
use crate::problem::Problem;
use crate::routes::{Access, Method, READERS, Route, Routes};
use crate::view;

type Outcomes = Result<Response, Problem>;

const HELM: Access = Access::Helm(&[]);
const HELM_OR_SAFETY: Access = Access::Helm(&[Role::Safety]);
const OPERATORS: Access = Access::OneOf(&[Role::Operator]);
const TOWER: Access = Access::Keyed(&[Role::Tower]);
const INJECTORS: Access = Access::Keyed(&[Role::Operator, Role::Safety]);

macro_rules! route {
    ($method:ident $path:literal $access:expr, $summary:literal, $body:literal => $answer:literal) => {
        Route {
            method: Method::$method,
            path: concat!("/api/v1/vehicles/{id}/", $path),
            access: $access,
            summary: $summary,
            body: $body,
            answer: $answer,
        }
    };
}

/// Adds every route that orders something.
pub(crate) fn add_to(routes: Routes, simulation: bool) -> Routes {
    let routes = routes
        .add(route!(Post "command/take" OPERATORS, "Take command of the vehicle", "" => "Command"), take)
        .add(route!(Post "command/release" OPERATORS, "Give command back", "" => "Command"), release)
        .add(
            route!(Post "command/hand-over" OPERATORS, "Let somebody else take command", "HandOver" => "Command"),
            hand_over,
        )
        .add(route!(Post "start" HELM, "Begin a mission that waits for it", "" => "Done"), start)
        .add(route!(Post "pause" HELM_OR_SAFETY, "Hold until resumed", "" => "Done"), pause)
        .add(route!(Post "resume" HELM, "Go on after a pause", "" => "Done"), resume)
        .add(route!(Post "abort" HELM_OR_SAFETY, "Land here and end the mission", "" => "Done"), abort)
        .add(route!(Post "return" HELM_OR_SAFETY, "Fly home, land and end the mission", "" => "Done"), return_home)
        .add(
            route!(Post "land-at" HELM_OR_SAFETY, "Land at a place and end the mission",
                "kittiwake.v1.LandAt" => "Done"),
            land_at,
        )
        .add(route!(Post "replan" HELM, "Give the present step up and plan anew", "" => "Done"), replan)
        .add(
            route!(Post "contingencies/{flag}/acknowledge" HELM_OR_SAFETY, "Say that a contingency has been seen",
                "" => "Done"),
            acknowledge,
        )
        .add(
            route!(Post "plan/decision" HELM, "Approve or refuse a plan that waits for it",
                "kittiwake.v1.DecidePlan" => "Done"),
            decide_plan,
        )
        .add(
            route!(Post "permissions/{area}/decision" TOWER, "Grant, deny or revoke a permission by hand",
                "kittiwake.v1.DecideRequest" => "Done"),
            decide_permission,
        )
        .add(
            route!(Post "mission/validate" OPERATORS, "What a mission would take, without flying it",
                "kittiwake.v1.MissionText" => "kittiwake.v1.MissionReply"),
            validate,
        )
        .add(
            route!(Put "mission" HELM, "Put another mission in the place of the present one",
                "kittiwake.v1.MissionText" => "kittiwake.v1.MissionReply"),
            upload,
        )
        .add(
            route!(Post "mission/objectives" HELM, "Insert an objective",
                "kittiwake.v1.InsertObjective" => "kittiwake.v1.MissionReply"),
            insert,
        )
        .add(
            route!(Delete "mission/objectives/{name}" HELM, "Take an objective out",
                "" => "kittiwake.v1.MissionReply"),
            remove,
        )
        .add(
            route!(Post "mission/objectives/{name}/skip" HELM, "Give an objective up",
                "" => "kittiwake.v1.MissionReply"),
            skip,
        );
    if !simulation {
        return routes;
    }
    routes
        .add(
            route!(Post "simulation/flags" INJECTORS, "Raise or lower a flag by hand",
                "kittiwake.v1.FlagEvent" => "Done"),
            inject_flag,
        )
        .add(route!(Get "simulation/faults" READERS, "The faults that can be injected", "" => "FaultList"), list_faults)
        .add(
            route!(Post "simulation/faults" INJECTORS, "Inject a fault into the simulator",
                "kittiwake.v1.FaultRequest" => "Done"),
            inject_fault,
        )
}

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

impl Site {
    fn vehicle(&self, id: &str) -> Result<VehicleId, Problem> {
        let snapshot = self.snapshot();
        snapshot.fleet.vehicles.get_key_value(id).map(|(id, _)| id.clone()).ok_or_else(|| no_such_vehicle(id))
    }

    /// Asks one of the vehicle's services.
    async fn ask(&self, vehicle: &VehicleId, request: Request, asked: &Asked) -> Result<Reply, Problem> {
        let what = request.service().key();
        match self.api.orders.call(vehicle, request, asked.trace.clone()).await {
            Some(Ok(reply)) => Ok(reply),
            None => Err(busy()),
            Some(Err(error)) => {
                let known = match error {
                    CallError::Unavailable | CallError::Late => "nothing was done",
                    CallError::Unanswered | CallError::Malformed => "whether it was done is not known",
                };
                let detail = format!("`{what}` is {error}; {known}; it may be repeated under the same key");
                Err(Problem::new(StatusCode::SERVICE_UNAVAILABLE, detail))
            }
        }
    }

    /// Orders something of the mission manager.
    async fn order(&self, id: &str, asked: Asked, word: &str, verb: Verb) -> Outcomes {
        let vehicle = self.vehicle(id)?;
        let (request_id, operator) = (asked.request_id.clone(), asked.who.name.to_string());
        let command = v1::OperatorCommand { request_id, operator, verb: Some(verb) };
        match self.ask(&vehicle, Request::OperatorCommand(command), &asked).await? {
            Reply::OperatorCommand(it) if it.done => Ok(self.done(&vehicle, word, &asked, &it.text)),
            Reply::OperatorCommand(it) => Err(refused(word, &asked, it.text)),
            _ => Err(senseless()),
        }
    }

    /// Asks the planner about the mission, from where the vehicle is now.
    async fn mission(&self, id: &str, asked: &Asked, ask: Ask) -> Outcomes {
        let vehicle = self.vehicle(id)?;
        let request = v1::MissionRequest {
            request_id: asked.request_id.clone(),
            operator: asked.who.name.to_string(),
            state: self.planning_state(&vehicle),
            request: Some(ask),
        };
        let Reply::Mission(reply) = self.ask(&vehicle, Request::Mission(request), asked).await? else {
            return Err(senseless());
        };
        if reply.accepted {
            let answer = view::stamped(self.snapshot().now, to_json(&reply));
            return Ok(with_outcome(document(answer), &reply.text));
        }
        let status = if reply.mistakes.is_empty() { StatusCode::CONFLICT } else { StatusCode::UNPROCESSABLE_ENTITY };
        let forecast: Vec<Value> = reply.forecast.iter().map(to_json).collect();
        let problem = Problem::new(status, reply.text).with("mistakes", json!(reply.mistakes));
        Err(problem.with("forecast", json!(forecast)))
    }

    /// Where the vehicle is, as the monitor saw it last.
    fn planning_state(&self, vehicle: &str) -> Option<v1::PlanningState> {
        let snapshot = self.snapshot();
        let state = snapshot.fleet.vehicles.get(vehicle)?;
        let seen = &state.introspection.as_ref()?.message;
        let granted = state.ledger.iter().flat_map(|it| &it.message.permissions);
        let granted = granted.filter(|it| it.state() == v1::PermissionState::Granted);
        Some(v1::PlanningState {
            position: Some(seen.local_position.as_ref()?.position?),
            flying: seen.derived.as_ref()?.flying,
            mode: 0,
            permissions: granted.map(|it| it.area.clone()).collect(),
        })
    }

    fn done(&self, vehicle: &VehicleId, verb: &str, asked: &Asked, text: &str) -> Response {
        let answer = json!({ "vehicle": &**vehicle, "verb": verb, "requestId": key(asked), "text": text });
        with_outcome(document(view::stamped(self.snapshot().now, answer)), text)
    }

    fn helm_moved(&self, vehicle: &VehicleId, moved: Result<(), String>) -> Outcomes {
        moved.map_err(|it| Problem::new(StatusCode::CONFLICT, it))?;
        let helm = self.api.helms.of(vehicle, Instant::now());
        let record = helm.to_json();
        self.api.orders.send(Wish::Tell { vehicle: vehicle.clone(), kind: "command", record: record.clone() });
        let words = match (helm.holder, helm.offered_to) {
            (None, _) => "nobody holds command".to_owned(),
            (Some(holder), None) => format!("{holder} holds command"),
            (Some(holder), Some(to)) => format!("{holder} holds command, and offers it to {to}"),
        };
        Ok(with_outcome(document(record), &words))
    }
}

/// The client's own key.
fn key(asked: &Asked) -> &str {
    asked.request_id.split_once(':').map_or("", |(_, key)| key)
}

fn with_outcome(mut response: Response, text: &str) -> Response {
    response.extensions_mut().insert(Outcome(Arc::from(text)));
    response.into_response()
}

fn read<M: prost::Message + prost::Name + Default>(body: &Value) -> Result<M, Problem> {
    from_json(body).map_err(|it| bad_body(&it))
}

fn bad_body(what: &str) -> Problem {
    Problem::new(StatusCode::BAD_REQUEST, format!("the body makes no sense: {what}"))
}

/// The state forbids it.
fn refused(verb: &str, asked: &Asked, why: String) -> Problem {
    Problem::new(StatusCode::CONFLICT, why).with("verb", json!(verb)).with("requestId", json!(key(asked)))
}

fn busy() -> Problem {
    Problem::new(StatusCode::SERVICE_UNAVAILABLE, "too much is asked at once; nothing was done")
}

fn senseless() -> Problem {
    Problem::new(StatusCode::BAD_GATEWAY, "the answer was not one to the question")
}
