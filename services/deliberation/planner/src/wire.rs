//! The planner's own messages, from and to its own types.

use domain::energy::{Budget, Wind};
use domain::geometry::Ned;
use domain::mission::Objective;
use domain::state::State;
use kittiwake_proto::v1;

use crate::forecast::{Forecast, LegForecast, MissionForecast, PermissionForecast};
use crate::mission_request::{MissionRequest, Reply};

/// The state that a request about the mission starts from, if it names one, and what is asked.
pub(crate) fn mission_request(request: v1::MissionRequest) -> Result<(Option<State>, MissionRequest), Reply> {
    use v1::mission_request::Request;
    let state = request.state.map(State::try_from).transpose();
    let state = state.map_err(|invalid| Reply::new(format!("`state`: {invalid}")))?;
    let operator = request.operator;
    let request = match request.request {
        None | Some(Request::Read(_)) => return Err(Reply::new("no request in it")),
        Some(Request::Validate(it)) => MissionRequest::Validate(it.text, it.wind.map(wind).transpose()?),
        Some(Request::Upload(it)) => MissionRequest::Upload(it.text),
        Some(Request::ValidateAirspace(it)) => MissionRequest::Airspace { text: it.text, is_tried: true },
        Some(Request::AdoptAirspace(it)) => MissionRequest::Airspace { text: it.text, is_tried: false },
        Some(Request::Insert(it)) => MissionRequest::Insert(it.index as usize, objective(it.objective)?),
        Some(Request::Remove(it)) => MissionRequest::Remove(it.name),
        Some(Request::Skip(it)) => MissionRequest::Skip { objective: it.name, operator },
    };
    Ok((state, request))
}

fn objective(objective: Option<v1::NewObjective>) -> Result<Objective, Reply> {
    let objective = objective.ok_or_else(|| Reply::new("`objective` is missing"))?;
    let position = objective.position.ok_or_else(|| Reply::new("`objective.position` is missing"))?;
    let position = Ned::try_from(position);
    let position = position.map_err(|invalid| Reply::new(format!("`objective.position`: {invalid}")))?;
    Objective::new(objective.name, position, objective.flying).map_err(|invalid| Reply::new(invalid.to_string()))
}

/// The answer to a request about the mission, to which the mission manager adds the mission as it stands then.
pub(crate) fn mission_reply(result: Result<Reply, Reply>) -> v1::MissionReply {
    let accepted = result.is_ok();
    let Reply { text, mistakes, forecast } = result.unwrap_or_else(|refused| refused);
    let forecast = *forecast.unwrap_or_default();
    let energy = forecast.budget.as_ref().map(|it| energy_forecast(&forecast, it));
    let order = forecast.order;
    let forecast = forecast.objectives.into_iter().map(objective_forecast).collect();
    v1::MissionReply { accepted, text, mistakes, forecast, status: None, energy, order }
}

/// As it stands in a request: the speed, and the direction it comes from if that is known.
fn wind(wind: v1::ForecastWind) -> Result<Wind, Reply> {
    let v1::ForecastWind { speed_m_s, from_deg } = wind;
    if !(0.0..=FASTEST_WIND_M_S).contains(&speed_m_s) || from_deg.is_some_and(|it| !(-360.0..=360.0).contains(&it)) {
        return Err(Reply::new(format!(
            "`wind` is {speed_m_s} m/s from {} degrees, expected 0 to {FASTEST_WIND_M_S} m/s from -360 to 360 degrees",
            from_deg.map_or_else(|| "unknown".to_owned(), |it| it.to_string())
        )));
    }
    Ok(from_deg.map_or(Wind::Against(speed_m_s), |from_deg| Wind::from_direction(speed_m_s, from_deg)))
}

/// A stronger wind is a typing mistake: hurricanes begin at 33 m/s (Beaufort 12).
const FASTEST_WIND_M_S: f64 = 60.0;

fn energy_forecast(forecast: &MissionForecast, budget: &Budget) -> v1::EnergyForecast {
    v1::EnergyForecast {
        needs_wh: forecast.needs_wh,
        way_home_wh: forecast.way_home.energy_wh,
        way_home_s: forecast.way_home.time_s,
        usable_wh: budget.usable_wh,
        charge_wh: budget.charge_wh,
        capacity_wh: budget.capacity_wh,
        reserve: budget.reserve.get(),
        shortfall: forecast.shortfall().map(|it| it.to_string()).unwrap_or_default(),
    }
}

fn objective_forecast(forecast: Forecast) -> v1::ObjectiveForecast {
    v1::ObjectiveForecast {
        permissions: forecast.permissions(),
        objective: forecast.objective,
        reachable: forecast.unreachable.is_none(),
        reason: forecast.unreachable.unwrap_or(forecast.wait),
        plan: Some(forecast.plan.map(Into::into).unwrap_or_default()),
        flight_time_s: forecast.flight_time_s,
        length_m: forecast.length_m,
        energy_wh: forecast.energy_wh,
        begins_s: forecast.begins_s,
        stay_s: forecast.stay_s,
        worth: forecast.worth,
        legs: forecast.legs.into_iter().map(leg_forecast).collect(),
    }
}

fn leg_forecast(leg: LegForecast) -> v1::LegForecast {
    let (from, to) = leg.way;
    let ask = |it: PermissionForecast| v1::PermissionForecast {
        area: it.area,
        asked_s: it.asked_s,
        until_s: it.until_s,
        ahead: it.ahead,
    };
    v1::LegForecast {
        text: leg.text,
        from: Some(from.into()),
        to: Some(to.into()),
        length_m: from.distance_m(to),
        time_s: leg.time_s,
        energy_wh: leg.energy_wh,
        charge: leg.charge,
        areas: leg.areas,
        asks: leg.asks.into_iter().map(ask).collect(),
        alternate: leg.alternate.as_ref().map(Into::into),
    }
}
