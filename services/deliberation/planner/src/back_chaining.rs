//! From the objective back to the start: which actions, in which order. Knows no areas.

use domain::declared_skill::ROOM_M;
use domain::state::{State, Tolerance};
use domain::task::Stance;

use crate::actions::Action;
use crate::rules::Rules;

/// An action between the state it starts from and the one it reaches.
#[derive(Debug, Clone)]
pub(crate) struct Link {
    pub action: Action,
    pub from: State,
    pub to: State,
}

/// Why no chain of actions leads from the start to the goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NoChain {
    /// No action can reach the state that was to be reached next.
    #[error("no action leads to it")]
    NoAction,
    /// The limit was reached before the start was.
    #[error("no plan of at most {0} actions leads to it")]
    TooDeep(u32),
}

/// The actions that lead from `start` to `goal`, last to fly first; none if `start` is there within the tolerance.
pub(crate) fn chain(start: &State, goal: &State, tolerance: Tolerance, rules: &Rules) -> Result<Vec<Link>, NoChain> {
    let mut links: Vec<Link> = Vec::new();
    let mut current_goal = goal.clone();
    let mut depth = 0;
    while !start.matches(&current_goal, if_at_another_height(&current_goal, goal, tolerance)) {
        if let Some(height_m) = height_before(&current_goal, start, goal, tolerance, rules) {
            let (action, from) = match current_goal.mode {
                Some(_) => (Action::Stop, State { mode: None, ..current_goal.clone() }),
                None => {
                    let position = current_goal.position.at_height(height_m);
                    (Action::Position, State { position, ..current_goal.clone() })
                }
            };
            links.push(Link { action, from: from.clone(), to: current_goal });
            current_goal = from;
            continue;
        }
        // A mission bounds its tasks itself.
        if depth == rules.config.depth_limit.get() {
            return Err(NoChain::TooDeep(rules.config.depth_limit.get()));
        }
        // Of equal scores the first is kept: the table's order breaks ties.
        let best = Action::ALL
            .into_iter()
            .filter(|it| it.reaches(&current_goal, start, rules))
            .map(|it| (it, it.propagate_backwards(&current_goal, start, tolerance, rules)))
            .min_by_key(|(_, from)| score(from, start, tolerance));
        let (action, from) = best.ok_or(NoChain::NoAction)?;
        depth += u32::from(action != Action::Task);
        links.push(Link { action, from: from.clone(), to: current_goal });
        current_goal = from;
    }
    if let Some(first) = links.last_mut() {
        // Within the tolerance; where it really is, is where the areas lie.
        first.from = start.clone();
    }
    Ok(links)
}

/// The height over the place of `goal` from which the vehicle comes straight up or down to `next`: that at which the next task can be done;
/// without one that of `goal`, for a release and on the way there. `None` if `next` is at that height, or the vehicle is over the place.
fn height_before(next: &State, start: &State, goal: &State, tolerance: Tolerance, rules: &Rules) -> Option<f64> {
    if !goal.flying {
        return None;
    }
    let goal_m = goal.position.height_m();
    let wanted_m = match next.done.last().filter(|_| start.done.len() < next.done.len()) {
        Some(task) => rules.skills.height_m(task, Stance::Hovers, goal_m)?,
        None if next.gripper.is_some() || !start.is_over(next, tolerance) => goal_m,
        None => return None,
    };
    (wanted_m != next.position.height_m()).then_some(wanted_m)
}

/// A task that has a height of its own is done there, however near to it that of the objective is.
fn if_at_another_height(next: &State, goal: &State, tolerance: Tolerance) -> Tolerance {
    let is_other = goal.flying && next.position.height_m() != goal.position.height_m();
    Tolerance {
        vertical_m: if is_other { ROOM_M.min(tolerance.vertical_m) } else { tolerance.vertical_m },
        ..tolerance
    }
}

/// How near `state` comes to `start`; less is nearer. The place counts first, then whether the vehicle is in the air, because only flying
/// changes the place. The height counts last.
fn score(state: &State, start: &State, tolerance: Tolerance) -> (u64, bool, u64) {
    let millimetres = |metres: f64| (metres.abs() * 1e3).round() as u64;
    let apart_m = state.position.horizontal_distance_m(start.position);
    let over_ground = if state.is_over(start, tolerance) { 0 } else { millimetres(apart_m) };
    let height = millimetres(state.position.height_m() - start.position.height_m());
    (over_ground, state.flying != start.flying, height)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::config::Config;
    use domain::declared_skill::{DeclaredSkill, DeclaredSkills};
    use domain::file::Source;
    use domain::fmu::{FlightMode, Gripper};
    use domain::geometry::Ned;
    use domain::task::Task;

    /// `(east, height, flying)`.
    type At = (f64, f64, bool);

    fn state((east, height, flying): At) -> State {
        State::new(Ned::new(0.0, east, -height), flying)
    }

    #[track_caller]
    fn check(start: At, goal: At, expected: &str) {
        let links = chain(&state(start), &state(goal), Rules::for_tests().tolerance(), &Rules::for_tests()).unwrap();
        let text: Vec<_> = links
            .iter()
            .rev()
            .map(|it| format!("{} to {} at {} m", it.action.name(), it.to.position.east_m, it.to.position.height_m()))
            .collect();
        assert_eq!(text.join(", "), expected);
    }

    #[test]
    fn the_chain_leads_from_the_start_to_the_goal() {
        check(
            (0.0, 0.0, false),
            (500.0, 0.0, false),
            "takeoff to 0 at 10 m, position to 500 at 10 m, land to 500 at 0 m",
        );
        check((0.0, 0.0, false), (500.0, 40.0, true), "takeoff to 0 at 40 m, position to 500 at 40 m");
        check((0.0, 0.0, false), (0.0, 40.0, true), "takeoff to 0 at 40 m");
        check((0.0, 0.0, false), (1.0, 0.0, false), "");
    }

    #[test]
    fn a_plan_from_the_air_starts_at_the_present_height() {
        check((250.0, 33.0, true), (0.0, 0.0, false), "position to 0 at 10 m, land to 0 at 0 m");
        check((1.0, 5.0, true), (0.0, 0.0, false), "land to 0 at 0 m");
    }

    #[test]
    fn the_ground_is_not_level() {
        check(
            (0.0, 50.0, false),
            (500.0, 0.0, false),
            "takeoff to 0 at 60 m, position to 500 at 10 m, land to 500 at 0 m",
        );
        check((0.0, 0.0, false), (500.0, 1.0, true), "takeoff to 0 at 10 m, position to 500 at 1 m");
    }

    #[test]
    fn a_load_is_released_by_a_vehicle_at_rest() {
        #[track_caller]
        fn check(start: &State, expected: &[&str]) {
            let goal = State { gripper: Some(Gripper::Released), ..state((500.0, 40.0, true)) };
            let links = chain(start, &goal, Rules::for_tests().tolerance(), &Rules::for_tests()).unwrap();
            let names: Vec<_> = links.iter().rev().map(|it| it.action.name()).collect();
            assert_eq!(names, expected, "{start:?}");
        }
        let there = || state((500.0, 40.0, true));
        check(&state((0.0, 0.0, false)), &["takeoff", "position", "stop", "release"]);
        check(&there(), &["stop", "release"]);
        check(&State { mode: Some(FlightMode::Loiter), ..there() }, &["release"]);
        check(&State { gripper: Some(Gripper::Released), ..there() }, &[]);
    }

    /// A meter that is read at 3 m, and a lamp at any height.
    fn rules_with_tasks() -> Rules {
        let skill = |name: &str, condition: &str| {
            let text = format!(
                "version = 1\nsummary = \"Works\"\nprecondition = \"{condition}\"\nseconds = 5.0\nlimit_s = 9.0\n\
                 outcome = {{ done = \"success\" }}\n"
            );
            DeclaredSkill::read(&Source { path: format!("{name}.toml").into(), text }).unwrap()
        };
        let meter = skill("meter", "position.height_m >= 2.5 m and position.height_m <= 3.5 m");
        let skills = DeclaredSkills::of(vec![meter, skill("lamp", "vehicle.flying")]);
        Rules { skills: Arc::new(skills), ..Rules::for_tests() }
    }

    #[test]
    fn a_task_is_done_at_the_height_that_it_asks_for() {
        #[track_caller]
        fn check(start: At, tasks: &[&str], drops: bool, expected: &str) {
            let done = tasks.iter().map(|it| Task { skill: (*it).into(), inputs: Vec::new() }).collect();
            let goal = State { gripper: drops.then_some(Gripper::Released), done, ..state((500.0, 40.0, true)) };
            let rules = rules_with_tasks();
            let links = chain(&state(start), &goal, rules.tolerance(), &rules).unwrap();
            let text: Vec<_> =
                links.iter().rev().map(|it| format!("{} {}", it.action.name(), it.to.position.height_m())).collect();
            assert_eq!(text.join(", "), expected, "{start:?}");
        }
        let ground = (0.0, 0.0, false);
        check(ground, &["lamp"], false, "takeoff 40, position 40, stop 40, task 40");
        check(ground, &["meter"], false, "takeoff 40, position 40, position 3, stop 3, task 3, position 40");
        check(
            ground,
            &["lamp", "meter", "lamp"],
            true,
            "takeoff 40, position 40, stop 40, release 40, task 40, position 3, stop 3, task 3, position 40, stop 40, \
             task 40",
        );
        // Over the place it goes straight there, however little is missing.
        check((500.0, 20.0, true), &["meter"], false, "position 3, stop 3, task 3, position 40");
        check((500.0, 4.5, true), &["meter"], false, "position 3, stop 3, task 3, position 40");
        check((500.0, 3.2, true), &["meter"], false, "stop 3, task 3, position 40");
    }

    #[test]
    fn what_no_action_reaches_has_no_chain() {
        let goal = State { mode: Some(FlightMode::Return), ..state((0.0, 10.0, true)) };
        assert_eq!(
            chain(&state((0.0, 0.0, false)), &goal, Rules::for_tests().tolerance(), &Rules::for_tests()).unwrap_err(),
            NoChain::NoAction
        );
    }

    #[test]
    fn the_depth_is_limited() {
        let config = Config { depth_limit: std::num::NonZeroU32::MIN, ..Config::for_tests() };
        let rules = Rules::of(config);
        let error =
            chain(&state((0.0, 0.0, false)), &state((500.0, 0.0, false)), rules.tolerance(), &rules).unwrap_err();
        assert_eq!(error, NoChain::TooDeep(1));
    }
}
