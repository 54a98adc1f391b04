//! Every state with every event.

use domain::geometry::Ned;
use domain::plan::{Condition, DenialKind, Parameters};
use domain::state::State;
use std::time::Duration;

use super::*;

/// One row per state, one column per event, in the order of [`events`]. A cell is the next state; `=` where
/// nothing changes.
const TABLE: &[(&str, [&str; 12])] = &[
    // adopted, asked, known, lost, advanced, dropped, failed, withdrawn, given up, denials heard, finished, interrupted
    ("idle", ["7 1/1 ?", "=", "=", "=", "=", "=", "=", "=", "=", "=", "=", "="]),
    (
        "1 2/3 ?",
        [
            "7 1/1 ?",
            "1 2/3 asked",
            "=",
            "=",
            "idle",
            "idle",
            "failed 1: why, A denied",
            "1 2/3 ? withdrawn",
            "given up",
            "=",
            "=",
            "interrupted 1: why",
        ],
    ),
    (
        "1 2/3 asked",
        [
            "7 1/1 ?",
            "=",
            "1 2/3 then 2",
            "1 2/3 ? from 5",
            "idle",
            "idle",
            "failed 1: why, A denied",
            "1 2/3 asked withdrawn",
            "given up",
            "=",
            "=",
            "interrupted 1: why",
        ],
    ),
    (
        "1 2/3 then 2",
        [
            "7 1/1 ?",
            "=",
            "=",
            "=",
            "2 3/3 ?",
            "idle",
            "failed 1: why, A denied",
            "1 2/3 then 2 withdrawn",
            "given up",
            "=",
            "=",
            "interrupted 1: why",
        ],
    ),
    (
        "1 2/3 last",
        [
            "7 1/1 ?",
            "=",
            "=",
            "=",
            "idle",
            "idle",
            "failed 1: why, A denied",
            "1 2/3 last withdrawn",
            "given up",
            "=",
            "=",
            "interrupted 1: why",
        ],
    ),
    (
        "1 2/3 ? withdrawn",
        [
            "7 1/1 ?",
            "1 2/3 asked withdrawn",
            "=",
            "=",
            "idle",
            "idle",
            "failed 1: why, A denied",
            "=",
            "given up",
            "=",
            "=",
            "interrupted 1: why",
        ],
    ),
    ("failed 1: why, A denied", ["7 1/1 ?", "=", "=", "=", "=", "=", "=", "=", "=", "failed 1: why", "given up", "="]),
    ("failed 1: why", ["7 1/1 ?", "=", "=", "=", "=", "=", "=", "=", "=", "=", "given up", "="]),
    ("given up", ["7 1/1 ?", "=", "=", "=", "=", "=", "=", "=", "=", "=", "=", "="]),
];

fn step(id: u64) -> Step {
    let nominal = Parameters { goal: Goal::Land, precondition: Condition::default(), invariant: Condition::default() };
    let reaches = State::new(Ned::default(), false);
    Step {
        id: StepId(id),
        objective: 0,
        reaches,
        nominal,
        ask: Vec::new(),
        ask_ahead: Vec::new(),
        auxiliary: false,
        text: String::new(),
    }
}

fn denial() -> Denial {
    Denial { area: "A".into(), kind: DenialKind::Refused, reason: "closed".into() }
}

fn flying(next: Next, withdrawn: Option<&str>) -> Flight {
    Flight::Flying { step: Arc::new(step(1)), number: 2, count: 3, next, withdrawn: withdrawn.map(str::to_owned) }
}

fn states() -> [Flight; 9] {
    let failed = Some(FailedStep { id: StepId(1), reason: "why".into(), interrupted: false });
    [
        Flight::Idle,
        flying(Next::Unknown(Time::ZERO), None),
        flying(Next::Asked, None),
        flying(Next::Known(Some(Arc::new(step(2)))), None),
        flying(Next::Known(None), None),
        flying(Next::Unknown(Time::ZERO), Some("changed")),
        Flight::Interrupted { goal: Goal::Land, failed: failed.clone(), denials: vec![denial()] },
        Flight::Interrupted { goal: Goal::Land, failed, denials: Vec::new() },
        Flight::Interrupted { goal: Goal::Land, failed: None, denials: Vec::new() },
    ]
}

fn events() -> [Event; 12] {
    [
        Event::Adopted(Plan { objective: 0, steps: vec![step(7)], revision: 1, epoch: 0 }),
        Event::NextAsked,
        Event::NextKnown(StepId(1), Some(Arc::new(step(2)))),
        Event::NextLost(StepId(1), Time::after(Duration::from_secs(5))),
        Event::Advanced,
        Event::Dropped,
        Event::Failed("why".into(), vec![denial()]),
        Event::Withdrawn("changed".into()),
        Event::GivenUp,
        Event::DenialsHeard,
        Event::Finished,
        Event::Interrupted("why".into()),
    ]
}

fn name(flight: &Flight) -> String {
    match flight {
        Flight::Idle => "idle".into(),
        Flight::Flying { step, number, count, next, withdrawn } => {
            let next = match next {
                Next::Unknown(Time::ZERO) => "?".into(),
                Next::Unknown(at) => format!("? from {}", at.as_secs_f64()),
                Next::Asked => "asked".into(),
                Next::Known(Some(next)) => format!("then {}", next.id),
                Next::Known(None) => "last".into(),
            };
            let withdrawn = if withdrawn.is_some() { " withdrawn" } else { "" };
            format!("{} {number}/{count} {next}{withdrawn}", step.id)
        }
        Flight::Interrupted { failed: Some(FailedStep { id, reason, interrupted }), denials, .. } => {
            let denied: String = denials.iter().map(|it| format!(", {} denied", it.area)).collect();
            let word = if *interrupted { "interrupted" } else { "failed" };
            format!("{word} {id}: {reason}{denied}")
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

#[test]
fn news_of_another_step_change_nothing() {
    for event in [Event::NextKnown(StepId(9), None), Event::NextLost(StepId(9), Time::ZERO)] {
        let mut flight = flying(Next::Asked, None);
        flight.on(event);
        assert_eq!(flight, flying(Next::Asked, None));
    }
}
