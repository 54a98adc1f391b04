//! A plan mended after a failure: a new way to the state the failed step was to reach, and the
//! rest of the plan as it was.

use std::time::Duration;

use domain::geometry::Ned;
use domain::plan::{PermissionNeed, Step};
use domain::state::{State, Tolerance};
use domain::way::Asked;

use crate::actions::Action;
use crate::airspace::Airspace;
use crate::drafting::draft;
use crate::plan::{NEW, action, asking, flight_time, motion, way_to_keep_free};
use crate::rules::Rules;
use crate::survey::Via;

/// Steps from `state` to the goal of `failed`, then `rest`; `None` if that is not valid any more,
/// so that the objective itself has to be planned for.
///
/// On the ground nothing is mended: the step's goal was computed from where the vehicle was thought to be, and flying
/// there would be a way that nobody asked for.
pub(crate) fn repair(
    state: &State,
    failed: Step,
    rest: Vec<Step>,
    tolerance: Tolerance,
    airspace: &Airspace,
    rules: &Rules,
) -> Option<Vec<Step>> {
    if !state.flying || action(&failed) == Action::Takeoff {
        return None;
    }
    let is_held = |need: &&PermissionNeed| state.permissions.contains(&need.area);
    let ask: Vec<PermissionNeed> = failed.ask.iter().filter(|need| !is_held(need)).cloned().collect();
    let asked_later = rest.iter().flat_map(|it| &it.ask);
    let is_useless = |need: &PermissionNeed| airspace.was_denied(&need.area) || airspace.has_ended(need);
    if ask.iter().chain(asked_later).any(is_useless) {
        return None;
    }
    let goal = Via { state: failed.reaches.clone(), passed: failed.passed as usize };
    let mut steps = draft(state, &[goal], tolerance, airspace, rules).ok()?;
    if steps.is_empty() && airspace.is_trespassed(state.position) {
        // It is where it was to be, and must not stay there.
        return None;
    }
    if !ask.is_empty() {
        let last = steps.pop().unwrap_or_else(|| here(&failed, state.position));
        let also = last.ask.iter().filter(|need| ask.iter().all(|it| it.area != need.area));
        let ask = ask.iter().chain(also).cloned().collect();
        steps.push(asking(last, ask));
    }
    steps.extend(rest);
    is_valid(&steps, state.position, airspace, rules).then_some(steps)
}

/// `failed` flown again by a vehicle that has reached its goal.
fn here(failed: &Step, position: Ned) -> Step {
    Step { id: NEW, from: position, ..failed.clone() }
}

/// Whether no step touches an area that may not be entered then, nor was asked for in an earlier step; what the vehicle
/// at `here` is in may be left.
fn is_valid(steps: &[Step], here: Ned, airspace: &Airspace, rules: &Rules) -> bool {
    /// Only what begins now, and here, is leaving.
    const LATER: Duration = Duration::from_millis(1);
    let mut asked = Asked::new();
    let mut begins = Duration::ZERO;
    steps.iter().all(|step| {
        let (from, _) = step.way();
        if from != here {
            begins = begins.max(LATER);
        }
        let (begin, end) = way_to_keep_free(step);
        let is_kept_out = !airspace.first_entries(begin, end, motion(step, begins, rules), &asked).is_empty();
        let zones = airspace.zones.iter().enumerate();
        asked.extend(zones.filter(|(_, zone)| step.asks_for(&zone.area.name)).map(|(index, _)| index));
        begins = begins.saturating_add(flight_time(step, rules));
        !is_kept_out
    })
}
