//! A decision in words, with what belongs to its record.

use domain::decision::{DecisionKind, Rejected};
use domain::measured::Measured;

use super::CONTINGENCY;

#[derive(Debug)]
pub(crate) struct Said {
    pub(super) topic: &'static str,
    pub(super) kind: DecisionKind,
    pub(super) text: String,
    pub(super) row: Option<usize>,
    pub(super) area: Option<String>,
    pub(super) measured: Option<Measured>,
    pub(super) response: String,
    pub(super) response_reason: String,
    pub(super) rejected: Vec<Rejected>,
    pub(super) cause: Cause,
    pub(super) ends_mission: bool,
}

/// What a decision follows from; the number of its record is known once that is published.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Cause {
    /// Something outside of the manager.
    Nothing,
    /// The flag of this row was raised.
    Raised(usize),
    /// The response to the flag of this row; where it has none, that the flag was raised.
    Case(usize),
    /// The response that is under way.
    Response,
    Plan,
    /// What a new plan is wanted for.
    Replanning,
    Step,
    /// That this area was asked for.
    Asked(String),
    /// What has ended the mission.
    End,
}

impl Cause {
    /// What decisions about a topic follow from, where nothing else is known.
    fn of(topic: &str) -> Cause {
        match topic {
            CONTINGENCY => Cause::Response,
            "plan" => Cause::Replanning,
            "step" | "permission" => Cause::Step,
            _ => Cause::Nothing,
        }
    }
}

impl Said {
    /// Without anything but words.
    pub(crate) fn new(topic: &'static str, kind: DecisionKind, text: impl Into<String>) -> Said {
        Said {
            topic,
            kind,
            text: text.into(),
            row: None,
            area: None,
            measured: None,
            response: String::new(),
            response_reason: String::new(),
            rejected: Vec::new(),
            cause: Cause::of(topic),
            ends_mission: false,
        }
    }

    pub(crate) fn about(self, row: impl Into<Option<usize>>) -> Said {
        Said { row: row.into(), ..self }
    }

    pub(crate) fn about_area(self, area: impl Into<String>) -> Said {
        Said { area: Some(area.into()), ..self }
    }

    pub(crate) fn led_to_by(self, cause: Cause) -> Said {
        Said { cause, ..self }
    }

    pub(crate) fn measuring(self, measured: Option<Measured>) -> Said {
        Said { measured, ..self }
    }

    /// This is done, for this reason in figures.
    pub(crate) fn taking(self, response: impl Into<String>, response_reason: impl Into<String>) -> Said {
        Said { response: response.into(), response_reason: response_reason.into(), ..self }
    }

    pub(crate) fn rejecting(self, rejected: Vec<Rejected>) -> Said {
        Said { rejected, ..self }
    }

    pub(crate) fn ending_mission(self, ends_mission: bool) -> Said {
        Said { ends_mission, ..self }
    }
}
