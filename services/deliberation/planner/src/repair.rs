//! A plan mended after a failure: a new way to the state the failed step was to reach, and the
//! rest of the plan as it was.

use domain::geometry::Ned;
use domain::state::State;

use crate::airspace::{Airspace, Asked};
use crate::config::Config;
use crate::drafting::draft;
use crate::plan::Step;

/// Steps from `state` to the goal of `failed`, then `rest`; `None` if that is not valid any more,
/// so that the objective itself has to be planned for.
pub fn repair(state: &State, failed: Step, rest: Vec<Step>, airspace: &Airspace, config: &Config) -> Option<Vec<Step>> {
    let is_held = |area: &String| state.permissions.contains(area);
    let ask: Vec<String> = failed.communication.ask.iter().filter(|it| !is_held(it)).cloned().collect();
    let asked_later = rest.iter().flat_map(|it| &it.communication.ask);
    if ask.iter().chain(asked_later).any(|it| airspace.was_denied(it)) {
        return None;
    }
    let mut steps = draft(state, &failed.action.to, airspace, config).ok()?;
    if steps.is_empty() && !airspace.trespassed(state.position, &Asked::new()).is_empty() {
        // It is where it was to be, and must not stay there.
        return None;
    }
    if !ask.is_empty() {
        let last = steps.pop().unwrap_or_else(|| here(&failed, state.position));
        let also = last.communication.ask.iter().filter(|it| !ask.contains(it));
        let ask = ask.iter().chain(also).cloned().collect();
        steps.push(last.asking(ask));
    }
    let asked = asked_in(&steps, airspace);
    is_valid(&rest, asked, airspace).then(|| steps.into_iter().chain(rest).collect())
}

/// `failed` flown again by a vehicle that has reached its goal.
fn here(failed: &Step, position: Ned) -> Step {
    let mut step = Step { id: None, ..failed.clone() };
    step.action.from = position;
    step
}

/// Whether no step touches an area that is not held, nor asked for in an earlier step.
fn is_valid(steps: &[Step], mut asked: Asked, airspace: &Airspace) -> bool {
    steps.iter().all(|step| {
        let (from, to) = step.way();
        let is_kept_out = airspace.barred(&asked).any(|(_, it)| it.area.is_crossed(from, to));
        asked.extend(asked_in(std::slice::from_ref(step), airspace));
        !is_kept_out
    })
}

fn asked_in(steps: &[Step], airspace: &Airspace) -> Asked {
    let is_asked = |name: &String| steps.iter().any(|it| it.communication.ask.contains(name));
    airspace.zones.iter().enumerate().filter(|(_, it)| is_asked(&it.area.name)).map(|(index, _)| index).collect()
}
