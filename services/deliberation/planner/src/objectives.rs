//! The objectives, in order, and their progress.

use std::collections::BTreeSet;
use std::time::Duration;

use domain::fmu::Gripper;
use domain::geometry::Ned;
use domain::mission::terms::Terms;
use domain::mission::{self, InvalidObjective, ObjectiveStatus, Progress, ReleaseProgress};
use domain::plan::Step;
use domain::state::{State, Tolerance};
use domain::survey::Survey;
use domain::time::Time;

/// The objectives of the mission; the first that is not terminal is the current one.
#[derive(Debug)]
pub(crate) struct Objectives {
    list: Vec<Objective>,
}

/// An objective and its course so far.
#[derive(Debug)]
pub(crate) struct Objective {
    /// Unique within the mission.
    pub name: String,
    /// The state to reach.
    pub goal: State,
    /// Its progress.
    pub progress: Progress,
    /// Total number of steps planned for it.
    pub plan_steps: u32,
    /// Number of plans made for it.
    pub plans: u32,
    /// Areas whose permission was requested for it, each once, in the order of the plan.
    pub permissions: Vec<String>,
    /// What is asked of it besides.
    pub terms: Terms,
    /// A polygon to be flown over on the way to the goal, and how far that has come.
    pub survey: Option<Survey>,
    /// Since when the vehicle has been there, if it stays there.
    pub dwells_since: Option<Time>,
    /// How far the release has come that it asks for. The goal asks for an open gripper until that was seen.
    pub release: ReleaseProgress,
}

impl Objectives {
    /// Those of the mission, all waiting.
    pub(crate) fn new(objectives: &[mission::Objective]) -> Objectives {
        Objectives { list: objectives.iter().map(Objective::waiting).collect() }
    }

    /// Those of a mission that was begun.
    pub(crate) fn with_past(list: Vec<Objective>) -> Objectives {
        Objectives { list }
    }

    /// Puts one in at `index`, which is no less than the current one's and no more than their number.
    pub(crate) fn insert(&mut self, index: usize, objective: &mission::Objective) {
        self.list.insert(index.min(self.list.len()), Objective::waiting(objective));
    }

    /// Takes one out.
    pub(crate) fn remove(&mut self, index: usize) {
        self.list.remove(index);
    }

    /// Gives one up.
    pub(crate) fn give_up(&mut self, index: usize, reason: String) {
        if let Some(objective) = self.list.get_mut(index) {
            objective.progress = Progress::Failure(reason);
        }
    }

    /// Gives up the current one, and with it all that are left.
    pub(crate) fn give_up_rest(&mut self, reason: &str) {
        let waiting = self.list.iter_mut().filter(|it| it.progress == Progress::Waiting);
        for (index, objective) in waiting.enumerate() {
            let reason = if index == 0 { reason.to_owned() } else { format!("not attempted: {reason}") };
            objective.progress = Progress::Failure(reason);
        }
    }

    /// Gives up the one with this name.
    pub(crate) fn give_up_named(&mut self, name: &str, reason: &str) {
        if let Some(objective) = self.list.iter_mut().find(|it| it.name == name) {
            objective.progress = Progress::Failure(reason.to_owned());
        }
    }

    /// The indices of those that are not settled.
    pub(crate) fn waiting(&self) -> Vec<usize> {
        (0..self.list.len()).filter(|it| self.list[*it].progress == Progress::Waiting).collect()
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

    /// All of them, in order.
    pub(crate) fn all(&self) -> &[Objective] {
        &self.list
    }

    /// Where those on the ground are.
    pub(crate) fn on_ground(&self) -> impl Iterator<Item = Ned> {
        self.list.iter().filter(|it| !it.goal.flying).map(|it| it.goal.position)
    }

    /// The index of the one worked on; the number of objectives once all are terminal.
    pub(crate) fn current_index(&self) -> usize {
        self.list.iter().position(|it| it.progress == Progress::Waiting).unwrap_or(self.list.len())
    }

    /// The one worked on.
    pub(crate) fn current(&mut self) -> Option<&mut Objective> {
        self.list.iter_mut().find(|it| it.progress == Progress::Waiting)
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
    /// An objective that was not attempted yet.
    pub(crate) fn waiting(it: &mission::Objective) -> Objective {
        Objective {
            name: it.name.clone(),
            goal: State { gripper: it.terms.drop.then_some(Gripper::Released), ..State::new(it.position, it.flying) },
            progress: Progress::Waiting,
            plan_steps: 0,
            plans: 0,
            permissions: Vec::new(),
            terms: it.terms.clone(),
            survey: it.survey.clone(),
            dwells_since: None,
            release: ReleaseProgress::NotPlanned,
        }
    }

    /// A plan was made for it, of which `new_steps` were not in the one before.
    pub(crate) fn planned(&mut self, new_steps: &[Step]) {
        self.plans += 1;
        self.plan_steps += new_steps.len() as u32;
        if self.release == ReleaseProgress::NotPlanned && new_steps.iter().any(Step::releases) {
            self.release = ReleaseProgress::Planned;
        }
        let mut known: BTreeSet<String> = self.permissions.iter().cloned().collect();
        let asked = new_steps.iter().flat_map(|it| &it.ask).map(|need| &need.area);
        self.permissions.extend(asked.filter(|it| known.insert((*it).clone())).cloned());
    }

    /// The load was seen released there: it is not asked for again.
    pub(crate) fn release_seen(&mut self) {
        self.release = ReleaseProgress::Seen;
        self.goal.gripper = None;
    }

    /// For how long the vehicle, which is there `now`, stays there yet.
    pub(crate) fn stays_for(&mut self, now: Time) -> Duration {
        let since = *self.dwells_since.get_or_insert(now);
        self.terms.dwell.saturating_sub(now - since)
    }

    /// As far as it has come.
    pub(crate) fn of(status: ObjectiveStatus) -> Result<Objective, InvalidObjective> {
        let mission::Objective { name, position, flying, terms, survey } = status.objective;
        let checked = mission::Objective { terms, survey, ..mission::Objective::new(name, position, flying)? };
        let mut objective = Objective {
            progress: status.progress,
            plan_steps: status.plan_steps,
            plans: if status.plan_steps == 0 { 0 } else { status.replans + 1 },
            permissions: status.permissions,
            release: status.release,
            ..Objective::waiting(&checked)
        };
        if status.release == ReleaseProgress::Seen {
            objective.release_seen();
        }
        Ok(objective)
    }

    /// Whether it is neither reached nor given up.
    pub(crate) fn is_waiting(&self) -> bool {
        self.progress == Progress::Waiting
    }

    /// As in the mission's status.
    pub(crate) fn status(&self) -> ObjectiveStatus {
        ObjectiveStatus {
            objective: self.objective(),
            progress: self.progress.clone(),
            plan_steps: self.plan_steps,
            replans: self.plans.saturating_sub(1),
            permissions: self.permissions.clone(),
            release: self.release,
        }
    }

    /// As a mission file has it.
    pub(crate) fn objective(&self) -> mission::Objective {
        mission::Objective {
            name: self.name.clone(),
            position: self.goal.position,
            flying: self.goal.flying,
            terms: self.terms.clone(),
            survey: self.survey.clone(),
        }
    }

    /// The same with only what is still to be done: a load that was released is not released again.
    pub(crate) fn rest(&self) -> mission::Objective {
        let mut rest = self.objective();
        rest.terms.drop &= self.release != ReleaseProgress::Seen;
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
