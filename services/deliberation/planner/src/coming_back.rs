//! No takeoff without the permission to come back: what the landing at the end of the mission needs is asked for before the first takeoff, and must
//! be granted until the vehicle is down there.
//!
//! A home that is closed on the way back leaves a vehicle in the air with no place to land at. Nobody is asked about a keep-out area; whether it
//! is over by then is a matter of the forecast.

use std::time::Duration;

use domain::airspace::{Motion, latest};
use domain::area::AreaKind;
use domain::geometry::Ned;
use domain::harm::Harm;
use domain::plan::{Parameters, PermissionNeed};
use domain::skill::Goal;
use domain::state::State;
use domain::way::Asked;

use crate::actions::{Action as _, stop::Stop};
use crate::airspace::{Access, Airspace};
use crate::energy::Judge;
use crate::objectives::Objectives;
use crate::plan::{ActionStep, CommunicationStep, Step};

/// Lets `steps`, which begin on the ground at `state`, ask for what coming back needs, before anything lifts off.
///
/// # Errors
/// Why there is no coming back, if a permission for it is not to be had.
pub(crate) fn ask_for(
    steps: &mut Vec<Step>,
    state: &State,
    objectives: &Objectives,
    airspace: &Airspace,
    judge: &Judge,
) -> Result<(), String> {
    let takes_off = |it: &Step| matches!(it.action.nominal.goal, Goal::Takeoff { .. });
    let Some(takeoff) = steps.iter().position(takes_off).filter(|_| !state.flying) else { return Ok(()) };
    let (end, lands_after) = landing(steps, objectives, judge);
    let speeds = judge.config.speeds();
    let over = end.at_height(end.height_m() + judge.config.takeoff_height_m.get());
    let motion = Motion { begins: lands_after, speeds, airborne: true, accepts: Harm::NONE };
    let entered = airspace.first_entries(over, end, motion, &Asked::new());
    let lasts = latest(lands_after.saturating_add(speeds.time(over, end))).saturating_add(airspace.rule.lead);
    let mut needs = Vec::new();
    for (_, zone) in entered {
        let zone = &airspace.zones[zone];
        match &zone.access {
            _ if zone.area.kind == AreaKind::KeepOut => {}
            Access::Ask { at_most: Some(granted), .. } if *granted < lasts => {
                let (area, granted_s, needed_s) = (&zone.area.name, granted.as_secs(), lasts.as_secs());
                return Err(format!(
                    "no takeoff without the permission to come back: that for area {area} holds for {granted_s} s, {needed_s} s are needed"
                ));
            }
            Access::Ask { .. } => needs.push(PermissionNeed { area: zone.area.name.clone(), lasts }),
            Access::Closed { reason } => {
                return Err(format!("no takeoff without the permission to come back: {reason}"));
            }
        }
    }
    if !needs.is_empty() {
        ask_before(steps, takeoff, needs, judge);
    }
    Ok(())
}

/// Where the mission ends on the ground, and when the landing there begins, from now on.
fn landing(steps: &[Step], objectives: &Objectives, judge: &Judge) -> (Ned, Duration) {
    let (waiting, all) = (objectives.waiting(), objectives.all());
    let stay_s = |index: usize| all[index].terms.dwell.as_secs_f64();
    let there_s: f64 = steps.iter().map(|it| it.flight_time_s(judge.config)).sum();
    let first_s = waiting.first().map_or(0.0, |it| stay_s(*it));
    let hop_s = |pair: &[usize]| judge.visit(&all[pair[0]].goal, &all[pair[1]]).time_s + stay_s(pair[1]);
    let hops_s: f64 = waiting.windows(2).map(hop_s).sum();
    let last = waiting.last().map(|it| &all[*it].goal);
    let (end, home_s) = match last {
        Some(goal) if !goal.flying => (goal.position, 0.0),
        Some(goal) => (Ned::default(), judge.home(goal).time_s),
        None => (Ned::default(), 0.0),
    };
    (end, Duration::try_from_secs_f64(there_s + first_s + hops_s + home_s).unwrap_or(Duration::MAX))
}

/// The step before the one of this index asks for `needs` too; where none asks, there is one that does.
fn ask_before(steps: &mut Vec<Step>, takeoff: usize, needs: Vec<PermissionNeed>, judge: &Judge) {
    let asks = takeoff.checked_sub(1).filter(|it| steps[*it].communication.auxiliary);
    let index = asks.unwrap_or_else(|| {
        let stands = State::new(steps[takeoff].action.from, false);
        let nominal: Parameters = Stop.set_parameters(&stands, &stands, judge.config);
        let action = ActionStep { name: Stop.name(), from: stands.position, to: stands, nominal };
        let communication = CommunicationStep { auxiliary: true, ..CommunicationStep::default() };
        steps.insert(takeoff, Step { id: None, action, communication, passed: 0 });
        takeoff
    });
    let ask = &mut steps[index].communication.ask;
    for need in needs {
        match ask.iter_mut().find(|it| it.area == need.area) {
            Some(known) => known.lasts = known.lasts.max(need.lasts),
            None => ask.push(need),
        }
    }
}
