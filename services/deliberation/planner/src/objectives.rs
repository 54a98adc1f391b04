//! The objectives, in order, and their progress.

use std::collections::BTreeSet;
use std::time::Duration;

use domain::fmu::Gripper;
use domain::geometry::Ned;
use domain::mission::terms::Terms;
use domain::mission::{self, ObjectiveStatus, Progress, ReleaseProgress};
use domain::plan::Step;
use domain::state::{State, Tolerance};
use domain::time::Time;

/// The objectives of the mission; the first that is not terminal is the current one.
#[derive(Debug)]
pub(crate) struct Objectives {
    list: Vec<Objective>,
}

/// An objective and its course so far.
#[derive(Debug)]
pub(crate) struct Objective {
    /// What the mission asks for, and its result so far.
    pub status: ObjectiveStatus,
    /// The state to reach. It asks for an open gripper until the release was seen.
    pub goal: State,
    /// Since when the vehicle has been there, if it stays there.
    pub dwells_since: Option<Time>,
}

impl Objectives {
    /// Those of the mission, all waiting.
    pub(crate) fn new(objectives: &[mission::Objective]) -> Objectives {
        Objectives { list: objectives.iter().map(|it| Objective::of(ObjectiveStatus::waiting(it))).collect() }
    }

    /// Those of a mission that was begun.
    pub(crate) fn with_past(list: Vec<Objective>) -> Objectives {
        Objectives { list }
    }

    /// Puts one in at `index`, which is no less than the current one's and no more than their number.
    pub(crate) fn insert(&mut self, index: usize, objective: &mission::Objective) {
        self.list.insert(index.min(self.list.len()), Objective::of(ObjectiveStatus::waiting(objective)));
    }

    pub(crate) fn remove(&mut self, index: usize) {
        self.list.remove(index);
    }

    pub(crate) fn give_up(&mut self, index: usize, reason: String) {
        if let Some(objective) = self.list.get_mut(index) {
            objective.status.progress = Progress::Failure(reason);
        }
    }

    /// Gives up the current one, and with it all that are left.
    pub(crate) fn give_up_rest(&mut self, reason: &str) {
        let waiting = self.list.iter_mut().filter(|it| it.status.progress == Progress::Waiting);
        for (index, objective) in waiting.enumerate() {
            let reason = if index == 0 { reason.to_owned() } else { format!("not attempted: {reason}") };
            objective.status.progress = Progress::Failure(reason);
        }
    }

    /// Gives up the one with this name.
    pub(crate) fn give_up_named(&mut self, name: &str, reason: &str) {
        if let Some(objective) = self.list.iter_mut().find(|it| it.status.objective.name == name) {
            objective.status.progress = Progress::Failure(reason.to_owned());
        }
    }

    /// The indices of those that are not settled.
    pub(crate) fn waiting(&self) -> Vec<usize> {
        (0..self.list.len()).filter(|it| self.list[*it].status.progress == Progress::Waiting).collect()
    }

    /// Puts the settled ones first, and behind them the others as `order` says, which has the index of each once.
    pub(crate) fn reorder(&mut self, order: &[usize]) {
        let place = |index: usize| order.iter().position(|it| *it == index);
        let mut list: Vec<(Option<usize>, Objective)> =
            std::mem::take(&mut self.list).into_iter().enumerate().map(|(index, it)| (place(index), it)).collect();
        // A stable sort, in which no place comes before the first.
        list.sort_by_key(|(place, _)| *place);
        self.list = list.into_iter().map(|(_, it)| it).collect();
    }

    pub(crate) fn all(&self) -> &[Objective] {
        &self.list
    }

    /// Where those on the ground are.
    pub(crate) fn on_ground(&self) -> impl Iterator<Item = Ned> {
        self.list.iter().filter(|it| !it.goal.flying).map(|it| it.goal.position)
    }

    /// The index of the one worked on; the number of objectives once all are terminal.
    pub(crate) fn current_index(&self) -> usize {
        self.list.iter().position(|it| it.status.progress == Progress::Waiting).unwrap_or(self.list.len())
    }

    /// The one worked on.
    pub(crate) fn current(&mut self) -> Option<&mut Objective> {
        self.list.iter_mut().find(|it| it.status.progress == Progress::Waiting)
    }
}

/// Two objectives farther apart than this can be told from each other, in metres. (ENG: the position skill is content with
/// one metre, and the estimate wanders a little.)
const LEAST_TOLERANCE_M: f64 = 1.2;

impl Objectives {
    /// How near to the one at `index` is there: as configured, but no nearer to the objective before and after it, or to
    /// the take-off point before the first, than half the distance.
    pub(crate) fn tolerance(&self, index: usize, usual: Tolerance) -> Tolerance {
        let Some(objective) = self.list.get(index) else { return usual };
        let takeoff_point = State::new(Ned::default(), false);
        let before =
            index.checked_sub(1).and_then(|before| self.list.get(before)).map_or(&takeoff_point, |it| &it.goal);
        let after = self.list.get(index + 1).map(|it| &it.goal);
        std::iter::once(before).chain(after).fold(usual, |tolerance, other| apart(&objective.goal, other, tolerance))
    }
}

/// `tolerance`, or a smaller one by which `a` and `b` are two.
fn apart(a: &State, b: &State, tolerance: Tolerance) -> Tolerance {
    let over_ground_m = a.position.horizontal_distance_m(b.position);
    let height_m = (a.position.height_m() - b.position.height_m()).abs();
    let usual_height_m = if a.flying { tolerance.vertical_m } else { tolerance.ground_m };
    if a.flying != b.flying || usual_height_m < height_m {
        return tolerance;
    }
    let half = |apart_m: f64, usual_m: f64| (apart_m / 2.0).max(LEAST_TOLERANCE_M).min(usual_m);
    if LEAST_TOLERANCE_M < over_ground_m {
        Tolerance { horizontal_m: half(over_ground_m, tolerance.horizontal_m), ..tolerance }
    } else if a.flying && LEAST_TOLERANCE_M < height_m {
        Tolerance { vertical_m: half(height_m, tolerance.vertical_m), ..tolerance }
    } else {
        tolerance
    }
}

impl Objective {
    /// As far as it has come.
    pub(crate) fn of(status: ObjectiveStatus) -> Objective {
        let mission::Objective { position, flying, terms, .. } = &status.objective;
        let asks_for_release = terms.drop && status.release != ReleaseProgress::Seen;
        let gripper = asks_for_release.then_some(Gripper::Released);
        let goal = State { gripper, done: terms.tasks.clone(), ..State::new(*position, *flying) };
        Objective { status, goal, dwells_since: None }
    }

    /// `state`, of a vehicle that has done those of its tasks that are done.
    pub(crate) fn as_begun(&self, state: &State) -> State {
        let tasks = &self.terms().tasks;
        State { done: tasks[..self.status.tasks_done.min(tasks.len())].to_vec(), ..state.clone() }
    }

    pub(crate) fn has_done_its_tasks(&self) -> bool {
        self.terms().tasks.len() <= self.status.tasks_done
    }

    /// What the mission asks for besides its state.
    pub(crate) fn terms(&self) -> &Terms {
        &self.status.objective.terms
    }

    /// A plan was made for it, of which `new_steps` were not in the one before.
    pub(crate) fn planned(&mut self, new_steps: &[Step]) {
        let status = &mut self.status;
        status.replans += u32::from(status.plan_steps != 0);
        status.plan_steps += new_steps.len() as u32;
        if status.release == ReleaseProgress::NotPlanned && new_steps.iter().any(Step::releases) {
            status.release = ReleaseProgress::Planned;
        }
        let mut known: BTreeSet<String> = status.permissions.iter().cloned().collect();
        let asked = new_steps.iter().flat_map(|it| &it.ask).map(|need| &need.area);
        status.permissions.extend(asked.filter(|it| known.insert((*it).clone())).cloned());
    }

    /// The load was seen released there: it is not asked for again.
    pub(crate) fn release_seen(&mut self) {
        self.status.release = ReleaseProgress::Seen;
        self.goal.gripper = None;
    }

    /// It has landed on its target, which need not lie where the mission says: the vehicle stays there.
    pub(crate) fn landed_on_target(&mut self, place: Ned) {
        self.goal.position = place.at_height(self.goal.position.height_m());
    }

    /// For how long the vehicle, which is there `now`, stays there yet.
    pub(crate) fn stays_for(&mut self, now: Time) -> Duration {
        let since = *self.dwells_since.get_or_insert(now);
        self.terms().dwell.saturating_sub(now - since)
    }

    /// As a mission file has it, with only what is still to be done: a load that was released is not released again, and no task is
    /// done twice.
    pub(crate) fn rest(&self) -> mission::Objective {
        let mut rest = self.status.objective.clone();
        rest.terms.drop &= self.status.release != ReleaseProgress::Seen;
        rest.terms.tasks.drain(..self.status.tasks_done.min(rest.terms.tasks.len()));
        rest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objectives_that_follow_each_other_closely_are_reached_more_exactly() {
        /// `(east, height, flying)` of two objectives; the tolerances over ground and in height of the second one.
        #[track_caller]
        fn check(first: (f64, f64, bool), second: (f64, f64, bool), expected: (f64, f64)) {
            let objective = |(east_m, height_m, flying): (f64, f64, bool)| mission::Objective {
                name: String::new(),
                position: Ned::new(0.0, east_m, -height_m),
                flying,
                terms: Terms::default(),
                survey: None,
            };
            let usual = Tolerance { horizontal_m: 3.0, vertical_m: 2.0, ground_m: 5.0 };
            let objectives = Objectives::new(&[objective(first), objective(second)]);
            let found = objectives.tolerance(1, usual);
            assert_eq!((found.horizontal_m, found.vertical_m), expected, "{first:?} {second:?}");
        }
        check((100.0, 10.0, true), (200.0, 10.0, true), (3.0, 2.0));
        check((100.0, 10.0, true), (102.5, 10.0, true), (1.25, 2.0));
        check((100.0, 0.0, false), (104.0, 0.0, false), (2.0, 2.0));
        // No vehicle is more exact.
        check((100.0, 10.0, true), (101.5, 10.0, true), (1.2, 2.0));
        // What differs otherwise is another state anyway.
        check((100.0, 10.0, true), (102.5, 0.0, false), (3.0, 2.0));
        check((100.0, 10.0, true), (102.5, 20.0, true), (3.0, 2.0));
        check((100.0, 10.0, true), (100.0, 11.5, true), (3.0, 1.2));
        check((100.0, 10.0, true), (100.0, 10.0, true), (3.0, 2.0));
    }
}
