//! Every state times every event, written out: nothing is refused or taken by accident.

use super::*;

/// One row per state, one column per event, in the order of [`events`]:
///
/// Commanded, TooEarly, AlreadyTrue, Accepted, Refused, Done, Cancel, Neutral, NeutralRefused, Overwritten, Sent.
///
/// Each cell: the next state, `*` for a registration, `!` for a loiter request, `.` for an
/// announcement; `-` where the event is refused.
const TABLE: &[(&str, [&str; 11])] = &[
    ("PR waiting", ["PR commanding", "-", "E *.", "-", "end .", "-", "end .", "-", "-", "A .", "-"]),
    ("PR commanding", ["-", "PR waiting", "-", "E *.", "end .", "-", "PR cancelled", "-", "-", "A .", "-"]),
    ("PR cancelled", ["-", "-", "-", "C *!.", "end .", "-", "PR cancelled", "-", "-", "-", "-"]),
    ("E", ["-", "-", "-", "-", "-", "R", "C !.", "-", "-", "A .", "-"]),
    ("R", ["-", "-", "-", "-", "-", "-", "-", "-", "-", "-", "end ."]),
    ("C", ["-", "-", "-", "-", "-", "R", "C", "end .", "E .", "A .", "-"]),
    ("A", ["-", "-", "-", "-", "-", "-", "-", "-", "-", "-", "end ."]),
    ("end", ["-", "-", "-", "-", "-", "-", "-", "-", "-", "-", "-"]),
];

fn failed() -> Ending {
    Ending::because(SkillOutcome::Failed, "motor failure")
}

fn states() -> [SkillState; 8] {
    [
        SkillState::ProcessRequest(Processing::Waiting),
        SkillState::ProcessRequest(Processing::Commanding),
        SkillState::ProcessRequest(Processing::CancelRequested),
        SkillState::Execute { trouble: None },
        SkillState::Report(failed()),
        SkillState::Cancel,
        SkillState::Abort { by: SkillId(2) },
        SkillState::Ended(failed()),
    ]
}

fn events() -> [Event; 11] {
    [
        Event::Commanded,
        Event::TooEarly,
        Event::AlreadyTrue,
        Event::Accepted,
        Event::Refused(failed()),
        Event::Done(failed()),
        Event::Cancel,
        Event::Neutral,
        Event::NeutralRefused("rejected".into()),
        Event::Overwritten { by: SkillId(2) },
        Event::Sent,
    ]
}

fn name(state: &SkillState) -> &'static str {
    match state {
        SkillState::ProcessRequest(Processing::Waiting) => "PR waiting",
        SkillState::ProcessRequest(Processing::Commanding) => "PR commanding",
        SkillState::ProcessRequest(Processing::CancelRequested) => "PR cancelled",
        SkillState::Execute { .. } => "E",
        SkillState::Report(_) => "R",
        SkillState::Cancel => "C",
        SkillState::Abort { .. } => "A",
        SkillState::Ended(_) => "end",
    }
}

fn cell(result: &Result<(SkillState, &'static [Action]), InvalidTransition>) -> String {
    let Ok((state, actions)) = result else { return "-".into() };
    let marks: String = actions
        .iter()
        .map(|it| match it {
            Action::Register => '*',
            Action::RequestNeutral => '!',
            Action::Announce => '.',
        })
        .collect();
    format!("{} {marks}", name(state)).trim_end().into()
}

#[test]
fn every_state_answers_every_event_as_the_table_says() {
    for (state, (row, cells)) in states().into_iter().zip(TABLE) {
        assert_eq!(name(&state), *row, "rows are in the order of the states");
        for (event, expected) in events().into_iter().zip(cells) {
            let result = state.clone().on(event.clone());
            assert_eq!(cell(&result), *expected, "{event:?} in {state:?}");
        }
    }
}

#[test]
fn a_refused_event_leaves_the_state_as_it_was() {
    for state in states() {
        for event in events() {
            if let Err(invalid) = state.clone().on(event.clone()) {
                assert_eq!(invalid, InvalidTransition { state: state.clone(), event });
            }
        }
    }
}

#[test]
fn the_ending_says_what_happened() {
    #[track_caller]
    fn check(state: SkillState, event: Event, outcome: SkillOutcome, reason: &str) {
        let (state, _) = state.on(event).unwrap();
        assert_eq!(state, SkillState::Ended(Ending::because(outcome, reason)));
    }
    let waiting = || SkillState::ProcessRequest(Processing::Waiting);
    check(waiting(), Event::Refused(failed()), SkillOutcome::Failed, "motor failure");
    check(waiting(), Event::Cancel, SkillOutcome::Cancelled, "cancelled before anything was commanded");
    check(SkillState::Cancel, Event::Neutral, SkillOutcome::Cancelled, "cancelled by the caller");
    check(SkillState::Abort { by: SkillId(7) }, Event::Sent, SkillOutcome::Aborted, "overwritten by skill 7");
    check(SkillState::Report(Ending::success()), Event::Sent, SkillOutcome::Succeeded, "");
}
