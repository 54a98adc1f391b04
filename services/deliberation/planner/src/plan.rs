//! Steps as they are drafted, each with a part in the tracks that run side by side: what is flown, and what is asked for.

use std::time::Duration;

use domain::airspace::Motion;
use domain::geometry::Ned;
use domain::plan::{Parameters, PermissionNeed, Step, StepId};
use domain::skill::Goal;

use crate::actions::{Action, free_speeds, free_way, time_s};
use crate::rules::Rules;

/// The id of a step that has not been given one yet.
pub(crate) const NEW: StepId = StepId(0);

pub(crate) fn action(step: &Step) -> Action {
    Action::of(&step.nominal.goal)
}

/// In a few words: `fly to (0, 90, 10) with camera (every_m 12), asking A and B`.
pub(crate) fn in_words(step: &Step) -> String {
    let areas: Vec<&str> = step.ask.iter().map(|need| need.area.as_str()).collect();
    let asking = if areas.is_empty() { String::new() } else { format!(", asking {}", areas.join(" and ")) };
    let along: Vec<String> = step.along.iter().map(|it| it.task.to_string()).collect();
    let with = if along.is_empty() { String::new() } else { format!(" with {}", along.join(" and ")) };
    format!("{}{with}{asking}", step.nominal.goal)
}

/// The same step as one that asks for the permissions of `ask`, or, if there are none, for nothing.
pub(crate) fn asking(mut step: Step, ask: Vec<PermissionNeed>) -> Step {
    step.auxiliary = !ask.is_empty();
    hold(&mut step.nominal, step.auxiliary);
    Step { ask, ask_ahead: Vec::new(), ..step }
}

/// A step that waits for permissions at a position stays there until it is replaced.
pub(crate) fn hold(parameters: &mut Parameters, waits: bool) {
    if let Goal::Position { hold_at_target, .. } = &mut parameters.goal {
        *hold_at_target = waits;
    }
}

/// How long `step` is flown at least, in seconds.
pub(crate) fn flight_time_s(step: &Step, rules: &Rules) -> f64 {
    rules.speeds().time_s(step.from, step.reaches.position) + time_s(&step.nominal.goal)
}

/// The same as a duration.
pub(crate) fn flight_time(step: &Step, rules: &Rules) -> Duration {
    let besides = Duration::from_secs_f64(time_s(&step.nominal.goal));
    rules.speeds().time(step.from, step.reaches.position).saturating_add(besides)
}

/// The straight way that must be free for `step`.
pub(crate) fn way_to_keep_free(step: &Step) -> (Ned, Ned) {
    free_way(&step.nominal.goal, step.way())
}

/// How what needs that way moves if `step` begins at this time from now on.
pub(crate) fn motion(step: &Step, begins: Duration, rules: &Rules) -> Motion {
    let airborne = action(step) != Action::Takeoff;
    let speeds = free_speeds(&step.nominal.goal, rules.speeds());
    Motion { begins, speeds, airborne, is_load: step.releases() }
}

/// How long after the beginning of `step` this fraction of that way is behind.
pub(crate) fn free_time_to(step: &Step, fraction: f64, rules: &Rules) -> Duration {
    let (from, to) = way_to_keep_free(step);
    free_speeds(&step.nominal.goal, rules.speeds()).time_to(fraction, from, to)
}
