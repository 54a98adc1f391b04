//! The actions of the vehicle as back-chaining sees them: each has a state that it reaches and a
//! state that it starts from. A new action is a variant and the arms the compiler asks for.

use std::sync::Arc;

use domain::fmu::{FlightMode, Gripper};
use domain::geometry::Ned;
use domain::plan::{Condition, Parameters};
use domain::skill::Goal;
use domain::speeds::Speeds;
use domain::state::{State, Tolerance};
use domain::task::Stance;

use crate::rules::Rules;

/// For how long the vehicle hovers for a release, in seconds, of its time and its energy. (ENG: a second until a servo has opened,
/// and as much again before and behind it for the command and for the status that shows it.)
const RELEASE_S: f64 = 3.0;

/// What a chain is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Action {
    /// Straight down to the ground.
    Land,
    /// Straight up from the ground.
    Takeoff,
    /// At rest where the vehicle is; on the ground, nothing. No objective asks for it. The communication plan does, where a permission is
    /// needed before a takeoff or a landing, and a release does, which begins at rest.
    Stop,
    /// Straight through the air to a position.
    Position,
    /// The load released where the vehicle hovers.
    Release,
    /// A task done by a process of its own where the vehicle hovers or stands.
    Task,
}

impl Action {
    /// In the order that breaks ties between equal scores.
    pub(crate) const ALL: [Action; 6] =
        [Action::Land, Action::Takeoff, Action::Stop, Action::Position, Action::Release, Action::Task];

    pub(crate) fn of(goal: &Goal) -> Action {
        match goal {
            Goal::Land | Goal::LandOnTarget => Action::Land,
            Goal::Takeoff { .. } => Action::Takeoff,
            Goal::Stop => Action::Stop,
            Goal::Position { .. } | Goal::Velocity { .. } => Action::Position,
            Goal::Release { .. } => Action::Release,
            Goal::Task(_) => Action::Task,
        }
    }

    /// Its name in plans, logs and the planner's notes.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Action::Land => "land",
            Action::Takeoff => "takeoff",
            Action::Stop => "stop",
            Action::Position => "position",
            Action::Release => "release",
            Action::Task => "task",
        }
    }

    /// Whether it can end in `goal`, on the way from `start`.
    pub(crate) fn reaches(self, goal: &State, start: &State, rules: &Rules) -> bool {
        let next_task = goal.done.last().filter(|_| start.done.len() < goal.done.len());
        let is_place_in_air = goal.flying && goal.mode.is_none() && goal.gripper.is_none() && next_task.is_none();
        match self {
            Action::Land => !goal.flying && next_task.is_none(),
            // Only where it is a climb worth the name: the ground may be higher than the goal.
            Action::Takeoff => {
                let climb_m = goal.position.height_m() - ground_height_m(goal, start, rules);
                is_place_in_air && rules.config.least_climb_m.get() <= climb_m
            }
            // All it changes is the mode.
            Action::Stop => goal.mode == Some(FlightMode::Loiter) && goal.gripper.is_none() && next_task.is_none(),
            Action::Position => is_place_in_air,
            Action::Release => goal.flying && goal.gripper == Some(Gripper::Released) && next_task.is_none(),
            Action::Task => next_task.is_some_and(|it| {
                let height_m = goal.position.height_m();
                rules.skills.height_m(it, Stance::at_place(goal.flying), height_m) == Some(height_m)
            }),
        }
    }

    /// The state closest to `start` from which it can reach `goal`, which is reached within the tolerance.
    pub(crate) fn propagate_backwards(self, goal: &State, start: &State, tolerance: Tolerance, rules: &Rules) -> State {
        let (goal_m, ground_m) = (goal.position.height_m(), start.position.height_m());
        match self {
            // One that is over the spot already sinks from its height: it need not climb again.
            Action::Land if start.flying && start.is_over(goal, tolerance) => State::new(start.position, true),
            Action::Land => State::new(goal.position.at_height(goal_m + rules.config.takeoff_height_m.get()), true),
            Action::Takeoff => State::new(goal.position.at_height(ground_height_m(goal, start, rules)), false),
            Action::Stop => State { mode: None, ..goal.clone() },
            Action::Position if start.flying => State::new(start.position, true),
            Action::Position => {
                let is_climb = rules.config.least_climb_m.get() <= goal_m - ground_m;
                let height_m = if is_climb { goal_m } else { ground_m + rules.config.takeoff_height_m.get() };
                State::new(start.position.at_height(height_m), true)
            }
            // At rest there: a load that leaves a moving vehicle falls elsewhere.
            Action::Release => State { gripper: None, mode: Some(FlightMode::Loiter), ..goal.clone() },
            Action::Task => {
                let before = goal.done.split_last().map_or(Vec::new(), |(_, before)| before.to_vec());
                State { done: before, mode: goal.flying.then_some(FlightMode::Loiter), ..goal.clone() }
            }
        }
    }

    /// How it is flown from `from` to `goal`, and under which conditions. They are silent about the place: from wherever the vehicle is it
    /// flies to the goal. The permissions of the areas on its way are added later.
    pub(crate) fn parameters(self, from: &State, goal: &State, rules: &Rules) -> Parameters {
        let when = |flying, mode| Condition { flying, mode, ..Condition::default() };
        let in_air = Some(true);
        let (goal, precondition, invariant) = match self {
            // The invariant does not ask for flying, which ends with success.
            Action::Land => (Goal::Land, when(in_air, None), when(None, Some(FlightMode::Land))),
            // No clause about the mode: at the top the autopilot goes over to loiter by itself.
            Action::Takeoff => {
                let climb_m = goal.position.height_m() - from.position.height_m();
                (Goal::Takeoff { climb_m }, when(Some(false), None), Condition::default())
            }
            Action::Stop => {
                let mode = from.flying.then_some(FlightMode::Loiter);
                (Goal::Stop, when(Some(from.flying), None), when(Some(from.flying), mode))
            }
            Action::Position => {
                let goal = Goal::fly_to(goal.position, rules.aircraft.flight.cruise_m_s.get());
                (goal, when(in_air, None), when(in_air, Some(FlightMode::Offboard)))
            }
            Action::Release => {
                let goal = Goal::Release { over: goal.position };
                (goal, when(in_air, None), when(in_air, Some(FlightMode::Loiter)))
            }
            Action::Task => {
                let task = goal.done.last().cloned().unwrap_or_default();
                let skill = Some(task.skill.clone());
                let condition = |mode| Condition { skill: skill.clone(), ..when(Some(goal.flying), mode) };
                let mode = goal.flying.then_some(FlightMode::Loiter);
                let over = Goal::Task(Arc::new(rules.skills.goal(&task, goal.position)));
                (over, condition(None), condition(mode))
            }
        };
        Parameters { goal, precondition, invariant }
    }
}

/// Where the ground is: known under a vehicle that stands on it.
fn ground_height_m(goal: &State, start: &State, rules: &Rules) -> f64 {
    if start.flying {
        goal.position.height_m() - rules.config.takeoff_height_m.get()
    } else {
        start.position.height_m()
    }
}

/// How long an action takes besides its way, in seconds.
pub(crate) fn time_s(goal: &Goal) -> f64 {
    match goal {
        Goal::Release { .. } => RELEASE_S,
        Goal::Task(it) => it.estimate_s,
        Goal::Land
        | Goal::LandOnTarget
        | Goal::Takeoff { .. }
        | Goal::Stop
        | Goal::Position { .. }
        | Goal::Velocity { .. } => 0.0,
    }
}

/// The straight way that must be free for an action from `from` to `to`: of a release that of the load, which falls to the height
/// of the take-off point.
pub(crate) fn free_way(goal: &Goal, (from, to): (Ned, Ned)) -> (Ned, Ned) {
    if goal.is_release() { (from, from.at_height(from.height_m().min(0.0))) } else { (from, to) }
}

/// How fast what needs that way moves along it: the vehicle with `speeds`, or the load.
pub(crate) fn free_speeds(goal: &Goal, speeds: Speeds) -> Speeds {
    if goal.is_release() { Speeds::OF_A_LOAD } else { speeds }
}
