//! The planner's own messages, from and to its own types.

use domain::geometry::Ned;
use domain::mission::Objective;
use domain::plan::PlannerStatus;
use domain::state::State;
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;

use crate::forecast::Forecast;
use crate::mission_request::{Done, MissionRequest, Refusal};
use crate::persisted::Persisted;

/// The state that a request about the mission starts from, if it names one, and what is asked.
pub(crate) fn mission_request(request: v1::MissionRequest) -> Result<(Option<State>, MissionRequest), Refusal> {
    use v1::mission_request::Request;
    let state = request.state.map(State::try_from).transpose();
    let state = state.map_err(|invalid| Refusal::new(format!("`state`: {invalid}")))?;
    let operator = request.operator;
    let request = match request.request {
        None => return Err(Refusal::new("no request in it")),
        Some(Request::Read(_)) => MissionRequest::Read,
        Some(Request::Validate(it)) => MissionRequest::Validate(it.text),
        Some(Request::Upload(it)) => MissionRequest::Upload(it.text),
        Some(Request::Insert(it)) => MissionRequest::Insert(it.index as usize, objective(it.objective)?),
        Some(Request::Remove(it)) => MissionRequest::Remove(it.name),
        Some(Request::Skip(it)) => MissionRequest::Skip { objective: it.name, operator },
    };
    Ok((state, request))
}

fn objective(objective: Option<v1::NewObjective>) -> Result<Objective, Refusal> {
    let objective = objective.ok_or_else(|| Refusal::new("`objective` is missing"))?;
    let position = objective.position.ok_or_else(|| Refusal::new("`objective.position` is missing"))?;
    let position = Ned::try_from(position);
    let position = position.map_err(|invalid| Refusal::new(format!("`objective.position`: {invalid}")))?;
    Objective::new(objective.name, position, objective.flying).map_err(|invalid| Refusal::new(invalid.to_string()))
}

/// The answer to a request about the mission, with the mission as it stands then.
pub(crate) fn mission_reply(result: Result<Done, Refusal>, status: PlannerStatus) -> v1::MissionReply {
    let (accepted, Refusal { text, mistakes, forecast }) = match result {
        Ok(Done { text, forecast }) => (true, Refusal { text, forecast, ..Refusal::default() }),
        Err(refusal) => (false, refusal),
    };
    let forecast = forecast.into_iter().map(objective_forecast).collect();
    v1::MissionReply { accepted, text, mistakes, forecast, status: Some(status.into()) }
}

fn objective_forecast(forecast: Forecast) -> v1::ObjectiveForecast {
    v1::ObjectiveForecast {
        objective: forecast.objective,
        reachable: forecast.unreachable.is_none(),
        reason: forecast.unreachable.unwrap_or(forecast.wait),
        plan: Some(forecast.plan.map(Into::into).unwrap_or_default()),
        permissions: forecast.permissions,
        flight_time_s: forecast.flight_time_s,
        length_m: forecast.length_m,
    }
}

impl From<Persisted> for v1::PlannerMemory {
    fn from(persisted: Persisted) -> v1::PlannerMemory {
        v1::PlannerMemory {
            status: Some(persisted.status.into()),
            configured: persisted.configured,
            last_step_id: persisted.last_step_id,
            loss: None,
        }
    }
}

impl TryFrom<v1::PlannerMemory> for Persisted {
    type Error = InvalidMessage;
    fn try_from(memory: v1::PlannerMemory) -> Result<Persisted, InvalidMessage> {
        Ok(Persisted {
            configured: memory.configured,
            status: memory.status.ok_or(InvalidMessage::Missing("status"))?.try_into()?,
            last_step_id: memory.last_step_id,
        })
    }
}
