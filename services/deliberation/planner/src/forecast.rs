//! What a mission needs, as far as it is known beforehand: each objective is planned from where the
//! one before leaves the vehicle, as if every permission were granted.

use std::time::Duration;

use domain::airspace::Grants;
use domain::mission::Progress;
use domain::plan::{Plan, PlanRequest};
use domain::state::State;
use domain::time::Now;

use crate::config::Config;
use crate::mission_planner::{Answer, MissionPlanner};
use crate::plan::Step;

/// What one objective takes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Forecast {
    /// Its name.
    pub objective: String,
    /// Why it cannot be reached, if so.
    pub unreachable: Option<String>,
    /// What has to be waited for before.
    pub wait: String,
    /// What would be flown; `None` if it is reached already, or never.
    pub plan: Option<Plan>,
    /// Areas to get permission for.
    pub permissions: Vec<String>,
    /// At the speeds that are planned with, in seconds, waits not counted.
    pub flight_time_s: f64,
    /// In metres.
    pub length_m: f64,
}

/// Most waits on the way, for all objectives together; a mission that needs more cannot be flown.
const MOST_WAITS: usize = 16;

/// Plans `planner`'s mission without flying it.
pub(crate) fn fly_through(
    mut planner: MissionPlanner,
    mut state: State,
    mut now: Now,
    config: &Config,
) -> Vec<Forecast> {
    let mut forecasts: Vec<Forecast> = planner.objectives().all().iter().map(|it| blank(&it.name)).collect();
    let (mut waits, mut planned) = (0, 0);
    while planned < forecasts.len() && waits < MOST_WAITS {
        let request = PlanRequest {
            request_id: String::new(),
            state: state.clone(),
            grants: Grants::new(),
            failed: None,
            denials: Vec::new(),
            accepted_loss: 0,
        };
        match planner.replan(request, now) {
            Answer::Plan(steps) => {
                planned += 1;
                let Some(last) = steps.last() else { break };
                if let Some(forecast) = forecasts.get_mut(planner.objectives().current_index()) {
                    forecast.plan = Some(planner.plan());
                    describe(forecast, &steps, config);
                }
                state.permissions.extend(steps.iter().flat_map(asked));
                now = planner.after(now, flight_time(&steps, config));
                state = State { permissions: state.permissions, ..last.action.to.clone() };
                if last.id.is_none_or(|id| planner.step_done(id, &state).is_err()) {
                    break;
                }
            }
            Answer::Hold { wait, reason } => {
                waits += 1;
                if let Some(forecast) = forecasts.get_mut(planner.objectives().current_index()) {
                    forecast.wait = reason;
                }
                now = planner.after(now, wait);
            }
            Answer::Finished => break,
        }
    }
    // Those that are left over lie beyond one that was never reached, or were reached without a step.
    for (forecast, objective) in forecasts.iter_mut().zip(planner.objectives().all()) {
        forecast.unreachable = match &objective.progress {
            Progress::Success => None,
            Progress::Failure(reason) => Some(reason.clone()),
            Progress::Waiting => Some("not reached within the waits of a forecast".into()),
        };
    }
    forecasts
}

fn blank(name: &str) -> Forecast {
    Forecast {
        objective: name.to_owned(),
        unreachable: None,
        wait: String::new(),
        plan: None,
        permissions: Vec::new(),
        flight_time_s: 0.0,
        length_m: 0.0,
    }
}

fn describe(forecast: &mut Forecast, steps: &[Step], config: &Config) {
    forecast.permissions = steps.iter().flat_map(asked).collect();
    forecast.flight_time_s = flight_time(steps, config).as_secs_f64();
    forecast.length_m = steps.iter().map(|it| it.action.from.distance_m(it.action.to.position)).sum();
}

fn flight_time(steps: &[Step], config: &Config) -> Duration {
    let seconds = steps.iter().map(|step| step.flight_time_s(config)).sum();
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

fn asked(step: &Step) -> impl Iterator<Item = String> {
    step.communication.ask.iter().map(|need| need.area.clone())
}
