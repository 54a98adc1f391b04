//! No takeoff without the permission to come back: where no place to land at is open without one, what the landing at the end of the mission needs is
//! asked for before the takeoff, and must be granted until the vehicle is down there.
//!
//! A home that is closed on the way back leaves a vehicle in the air with no place to land at. Nobody is asked about a keep-out area; whether it
//! is over by then is a matter of the forecast.

use std::time::Duration;

use domain::airspace::{Motion, latest};
use domain::area::AreaKind;
use domain::geometry::Ned;
use domain::plan::{PermissionNeed, Step};
use domain::site::{Site, SiteKind};
use domain::skill::Goal;
use domain::state::State;
use domain::way::Asked;

use crate::actions::Action;
use crate::airspace::{Access, Airspace, Zone};
use crate::objectives::Objectives;
use crate::plan::{NEW, flight_time_s};
use crate::rules::Rules;

/// Lets `steps`, which begin on the ground at `state`, ask for what coming back needs, before anything lifts off: nothing, where home, the end of
/// the mission or one of `sites` is open without asking.
///
/// # Errors
/// Why there is no coming back, if a permission for it is not to be had.
pub(crate) fn ask_for(
    steps: &mut Vec<Step>,
    state: &State,
    (objectives, sites): (&Objectives, &[Site]),
    airspace: &Airspace,
    rules: &Rules,
) -> Result<(), String> {
    let takes_off = |it: &Step| matches!(it.nominal.goal, Goal::Takeoff { .. });
    let Some(takeoff) = steps.iter().position(takes_off).filter(|_| !state.flying) else { return Ok(()) };
    let (end, lands_after) = landing(steps, objectives, rules);
    let speeds = rules.speeds();
    let motion = Motion { begins: lands_after, ..Motion::in_air(speeds) };
    let over = |place: Ned| place.at_height(place.height_m() + rules.config.takeoff_height_m.get());
    let sites = sites.iter().filter(|it| it.kind == SiteKind::Landing).map(|it| it.position);
    let places = [end, Ned::default()].into_iter().chain(sites);
    let entered = places.map(|it| airspace.first_entries(over(it), it, motion, &Asked::new()));
    let mut entered: Vec<Vec<(f64, usize)>> = entered.collect();
    if entered.iter().any(Vec::is_empty) {
        return Ok(());
    }
    entered.retain(|it| it.iter().all(|(_, zone)| airspace.zones[*zone].area.kind == AreaKind::Permission));
    let lasts = latest(lands_after.saturating_add(speeds.time(over(end), end))).saturating_add(airspace.rule.lead);
    let mut why = None;
    for zones in entered {
        match zones.into_iter().map(|(_, zone)| needed(&airspace.zones[zone], lasts)).collect() {
            Ok(needs) => {
                ask_before(steps, takeoff, needs, rules);
                return Ok(());
            }
            Err(reason) => _ = why.get_or_insert(format!("no takeoff without the permission to come back: {reason}")),
        }
    }
    why.map_or(Ok(()), Err)
}

/// What is to be asked for to come down in `zone`, or why that is of no use.
fn needed(zone: &Zone, lasts: Duration) -> Result<PermissionNeed, String> {
    let area = &zone.area.name;
    match &zone.access {
        Access::Ask { at_most: Some(granted), .. } if *granted < lasts => {
            let (granted_s, needed_s) = (granted.as_secs(), lasts.as_secs());
            Err(format!("the one for area {area} holds for {granted_s} s, {needed_s} s are needed"))
        }
        Access::Ask { .. } => Ok(PermissionNeed { area: area.clone(), lasts }),
        Access::Closed { reason } => Err(reason.clone()),
    }
}

/// Where the mission ends on the ground, and when the landing there begins, from now on.
fn landing(steps: &[Step], objectives: &Objectives, rules: &Rules) -> (Ned, Duration) {
    let (waiting, all) = (objectives.waiting(), objectives.all());
    let stay_s = |index: usize| all[index].terms().dwell.as_secs_f64();
    let there_s: f64 = steps.iter().map(|it| flight_time_s(it, rules)).sum();
    let first_s = waiting.first().map_or(0.0, |it| stay_s(*it));
    let hop_s = |pair: &[usize]| rules.visit(&all[pair[0]].goal, &all[pair[1]]).time_s + stay_s(pair[1]);
    let hops_s: f64 = waiting.windows(2).map(hop_s).sum();
    let last = waiting.last().map(|it| &all[*it].goal);
    let end = last.filter(|it| !it.flying).map_or(Ned::default(), |it| it.position);
    let home_s = last.filter(|it| it.flying).map_or(0.0, |it| rules.home(it).time_s);
    (end, Duration::try_from_secs_f64(there_s + first_s + hops_s + home_s).unwrap_or(Duration::MAX))
}

/// The step before the one of this index asks for `needs` too; where none asks, there is one that does.
fn ask_before(steps: &mut Vec<Step>, takeoff: usize, needs: Vec<PermissionNeed>, rules: &Rules) {
    let asks = takeoff.checked_sub(1).filter(|it| steps[*it].auxiliary);
    let index = asks.unwrap_or_else(|| {
        let stands = State::new(steps[takeoff].from, false);
        let nominal = Action::Stop.parameters(&stands, &stands, rules);
        let (ask, ask_ahead) = (Vec::new(), Vec::new());
        let step = Step {
            id: NEW,
            reaches: stands,
            nominal,
            ask,
            ask_ahead,
            auxiliary: true,
            passed: 0,
            along: Vec::new(),
            ..steps[takeoff].clone()
        };
        steps.insert(takeoff, step);
        takeoff
    });
    let ask = &mut steps[index].ask;
    for need in needs {
        match ask.iter_mut().find(|it| it.area == need.area) {
            Some(known) => known.lasts = known.lasts.max(need.lasts),
            None => ask.push(need),
        }
    }
}
