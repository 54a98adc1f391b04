//! Steps and places in words, for decision records.

use kittiwake_proto::v1;

/// A step in a few words.
pub(crate) fn step(step: &v1::PlanStep) -> String {
    let action = step.nominal.as_ref().and_then(|it| it.goal.as_ref()).map_or_else(|| "nothing".into(), goal);
    match step.ask_permissions.as_slice() {
        [] => action,
        areas => format!("{action}, asking {}", areas.join(" and ")),
    }
}

/// A goal in a few words.
pub(crate) fn goal(goal: &v1::SkillGoal) -> String {
    use v1::skill_goal::Goal as G;
    match &goal.goal {
        None => "nothing".into(),
        Some(G::Land(_)) => "land".into(),
        Some(G::Takeoff(it)) => format!("takeoff by {:.0} m", it.climb_m),
        Some(G::Stop(_)) => "stop".into(),
        Some(G::Position(it)) => match &it.target {
            Some(at) => format!("fly to {}", place(at)),
            None => "fly nowhere".into(),
        },
        Some(G::Velocity(_)) => "fly at a velocity".into(),
    }
}

/// A place as north, east, height.
pub(crate) fn place(at: &v1::Ned) -> String {
    // Adding zero turns a negative zero into a positive one.
    let [north, east, height] = [at.north_m, at.east_m, -at.down_m].map(|it| it.round() + 0.0);
    format!("({north:.0}, {east:.0}, {height:.0})")
}
