//! Every state with every event.

use domain::geometry::Ned;
use domain::plan::{Condition, DenialKind, Parameters, StepId};
use domain::skill::Goal;
use domain::state::State;

use super::*;

/// One row per state, one column per event, in the order of [`events`]. A cell is the next state; `=` where
/// nothing changes.
const TABLE: &[(&str, [&str; 8])] = &[
    // adopted, advanced, dropped, failed, withdrawn, given up, heard, interrupted
    ("idle", ["7 1/1", "=", "=", "=", "=", "=", "=", "="]),
    ("2 2/3", ["7 1/1", "3 3/3", "idle", FAILED, "2 2/3 withdrawn", "given up", "=", "interrupted: why, rest 2 3"]),
    ("3 3/3", ["7 1/1", "idle", "idle", LAST, "3 3/3 withdrawn", "given up", "=", "interrupted: why, rest 3"]),
    (
        "2 2/3 withdrawn",
        ["7 1/1", "3 3/3 withdrawn", "idle", FAILED, "=", "given up", "=", "interrupted: why, rest 2 3"],
    ),
    (FAILED, ["7 1/1", "=", "=", "=", "=", "=", "given up", "="]),
    ("given up", ["7 1/1", "=", "=", "=", "=", "=", "=", "="]),
];

const FAILED: &str = "failed: why, A denied, rest 2 3";
const LAST: &str = "failed: why, A denied, rest 3";

fn step(id: u64) -> Step {
    let nominal = Parameters { goal: Goal::Land, precondition: Condition::default(), invariant: Condition::default() };
    Step {
        id: StepId(id),
        objective: 0,
        from: Ned::default(),
        reaches: State::new(Ned::default(), false),
        nominal,
        ask: Vec::new(),
        ask_ahead: Vec::new(),
        auxiliary: false,
        passed: 0,
        along: Vec::new(),
        text: String::new(),
    }
}

fn denial() -> Denial {
    Denial { area: "A".into(), kind: DenialKind::Refused, reason: "closed".into() }
}

fn steps() -> Arc<[Arc<Step>]> {
    [1, 2, 3].into_iter().map(|id| Arc::new(step(id))).collect()
}

fn flying(at: usize, withdrawn: Option<&str>) -> Flight {
    Flight::Flying { steps: steps(), at, withdrawn: withdrawn.map(str::to_owned) }
}

fn states() -> [Flight; 6] {
    let failed = Some(Failure { reason: "why".into(), interrupted: false });
    [
        Flight::Idle,
        flying(1, None),
        flying(2, None),
        flying(1, Some("changed")),
        Flight::Interrupted { steps: steps(), at: 1, failed, denials: vec![denial()] },
        Flight::Interrupted { steps: steps(), at: 1, failed: None, denials: Vec::new() },
    ]
}

fn events() -> [Event; 8] {
    [
        Event::Adopted(Plan { objective: 0, steps: vec![step(7)], revision: 1 }),
        Event::Advanced,
        Event::Dropped,
        Event::Failed("why".into(), vec![denial()]),
        Event::Withdrawn("changed".into()),
        Event::GivenUp,
        Event::Heard,
        Event::Interrupted("why".into()),
    ]
}

fn name(flight: &Flight) -> String {
    match flight {
        Flight::Idle => "idle".into(),
        Flight::Flying { steps, at, withdrawn } => {
            let withdrawn = if withdrawn.is_some() { " withdrawn" } else { "" };
            format!("{} {}/{}{withdrawn}", steps[*at].id, at + 1, steps.len())
        }
        Flight::Interrupted { failed: Some(Failure { reason, interrupted }), denials, .. } => {
            let denied: String = denials.iter().map(|it| format!(", {} denied", it.area)).collect();
            let word = if *interrupted { "interrupted" } else { "failed" };
            let rest: String = flight.rest().iter().map(|it| format!(" {}", it.id)).collect();
            format!("{word}: {reason}{denied}, rest{rest}")
        }
        Flight::Interrupted { failed: None, .. } => "given up".into(),
    }
}

#[test]
fn every_state_answers_every_event_as_the_table_says() {
    for (state, (row, cells)) in states().into_iter().zip(TABLE) {
        assert_eq!(name(&state), *row, "rows are in the order of the states");
        for (event, expected) in events().into_iter().zip(cells) {
            let mut after = state.clone();
            after.on(event.clone());
            let found = if after == state { "=".to_owned() } else { name(&after) };
            assert_eq!(found, *expected, "{event:?} in {row}");
        }
    }
}
