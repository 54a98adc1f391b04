//! Decisions of the mission manager, and the values that flags are raised by.

use kittiwake_proto::v1;

use super::{InvalidMessage, finite, out_of_range};
use crate::decision::{DecisionKind, DecisionRecord, Rejected};
use crate::measured::{Measured, Unit};

impl From<DecisionKind> for v1::DecisionKind {
    fn from(kind: DecisionKind) -> v1::DecisionKind {
        match kind {
            DecisionKind::Note => v1::DecisionKind::Unspecified,
            DecisionKind::ContingencyRaised => v1::DecisionKind::ContingencyRaised,
            DecisionKind::ContingencyAnswered => v1::DecisionKind::ContingencyAnswered,
            DecisionKind::ContingencyWaits => v1::DecisionKind::ContingencyWaits,
            DecisionKind::ContingencyCleared => v1::DecisionKind::ContingencyCleared,
            DecisionKind::ResponseFailed => v1::DecisionKind::ResponseFailed,
            DecisionKind::ResponseSkipped => v1::DecisionKind::ResponseSkipped,
            DecisionKind::ResponseWaits => v1::DecisionKind::ResponseWaits,
            DecisionKind::SiteChosen => v1::DecisionKind::SiteChosen,
            DecisionKind::OrderAccepted => v1::DecisionKind::OrderAccepted,
            DecisionKind::OrderRefused => v1::DecisionKind::OrderRefused,
            DecisionKind::PlanAdopted => v1::DecisionKind::PlanAdopted,
            DecisionKind::PlanProposed => v1::DecisionKind::PlanProposed,
            DecisionKind::PlanLate => v1::DecisionKind::PlanLate,
            DecisionKind::PlanRejected => v1::DecisionKind::PlanRejected,
            DecisionKind::PlanHold => v1::DecisionKind::PlanHold,
            DecisionKind::PlanFinished => v1::DecisionKind::PlanFinished,
            DecisionKind::PermissionAsked => v1::DecisionKind::PermissionAsked,
            DecisionKind::PermissionDecided => v1::DecisionKind::PermissionDecided,
            DecisionKind::StepBegun => v1::DecisionKind::StepBegun,
            DecisionKind::StepSucceeded => v1::DecisionKind::StepSucceeded,
            DecisionKind::StepFailed => v1::DecisionKind::StepFailed,
            DecisionKind::MissionOver => v1::DecisionKind::MissionOver,
        }
    }
}

/// The kind in a message. One of a later version is a note: its text says what it is about.
fn kind(kind: v1::DecisionKind) -> DecisionKind {
    DecisionKind::ALL.into_iter().find(|it| v1::DecisionKind::from(*it) == kind).unwrap_or(DecisionKind::Note)
}

impl From<DecisionRecord> for v1::DecisionRecord {
    fn from(it: DecisionRecord) -> v1::DecisionRecord {
        v1::DecisionRecord {
            at_s: it.at_s,
            topic: it.topic,
            text: it.text,
            sequence: it.number,
            utc_ms: it.utc_ms,
            kind: v1::DecisionKind::from(it.kind) as i32,
            flag: it.flag,
            value: it.measured.map(Measured::value),
            threshold: it.measured.map(Measured::threshold),
            unit: it.measured.map_or("", |it| it.unit().symbol()).to_owned(),
            response: it.response,
            response_reason: it.response_reason,
            rejected: it
                .rejected
                .into_iter()
                .map(|Rejected { what, why }| v1::RejectedAlternative { what, why })
                .collect(),
            parent: it.parent.unwrap_or_default(),
        }
    }
}

impl TryFrom<v1::DecisionRecord> for DecisionRecord {
    type Error = InvalidMessage;
    fn try_from(it: v1::DecisionRecord) -> Result<DecisionRecord, InvalidMessage> {
        let kind = kind(it.kind());
        let measured = match (it.value, it.threshold) {
            (None, None) => None,
            (Some(value), Some(threshold)) => {
                let (value, threshold) = (finite("value", value)?, finite("threshold", threshold)?);
                let unit = Unit::of_symbol(&it.unit).ok_or_else(|| out_of_range("unit", &it.unit, "a known unit"))?;
                Measured::new(value, threshold, unit)
            }
            (None, Some(_)) => return Err(InvalidMessage::Missing("value")),
            (Some(_), None) => return Err(InvalidMessage::Missing("threshold")),
        };
        Ok(DecisionRecord {
            number: it.sequence,
            at_s: finite("at_s", it.at_s)?,
            utc_ms: it.utc_ms,
            topic: it.topic,
            kind,
            text: it.text,
            flag: it.flag,
            measured,
            response: it.response,
            response_reason: it.response_reason,
            rejected: it
                .rejected
                .into_iter()
                .map(|v1::RejectedAlternative { what, why }| Rejected { what, why })
                .collect(),
            parent: Some(it.parent).filter(|it| *it != 0),
        })
    }
}

/// A record to be shown. Of one that makes no sense only the words, the time and the place among the others are taken.
pub fn told(record: v1::DecisionRecord) -> DecisionRecord {
    let words = |it: v1::DecisionRecord| DecisionRecord {
        number: it.sequence,
        at_s: 0.0,
        utc_ms: it.utc_ms,
        topic: it.topic,
        kind: DecisionKind::Note,
        text: it.text,
        flag: it.flag,
        measured: None,
        response: String::new(),
        response_reason: String::new(),
        rejected: Vec::new(),
        parent: Some(it.parent).filter(|it| *it != 0),
    };
    DecisionRecord::try_from(record.clone()).unwrap_or_else(|_| words(record))
}

/// The sentence of a record.
pub fn sentence(record: &v1::DecisionRecord) -> String {
    told(record.clone()).sentence()
}

/// Records as the document that shows them.
pub fn list(records: impl IntoIterator<Item = v1::DecisionRecord>) -> v1::DecisionList {
    let entry =
        |record: v1::DecisionRecord| v1::decision_list::Entry { sentence: sentence(&record), record: Some(record) };
    v1::DecisionList { decisions: records.into_iter().map(entry).collect() }
}

/// The value that a flag was raised by, if it has one that makes sense. A flag counts also where its value does not: a rule may
/// have failed because the value is not a number.
pub fn measured(value: Option<f64>, threshold: Option<f64>, unit: &str) -> Option<Measured> {
    Measured::new(value?, threshold?, Unit::of_symbol(unit)?)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn measured_values() -> impl Strategy<Value = Option<Measured>> {
        let one = (-1e6..1e6, -1e6..1e6, prop::sample::select(Unit::ALL.to_vec()));
        prop::option::of(one.prop_map(|(value, threshold, unit)| Measured::new(value, threshold, unit).unwrap()))
    }

    fn text() -> impl Strategy<Value = String> {
        "[a-z`_ ]{0,12}"
    }

    fn record() -> impl Strategy<Value = DecisionRecord> {
        let rejected = (text(), text()).prop_map(|(what, why)| Rejected { what, why });
        let of = prop::sample::select(DecisionKind::ALL.to_vec());
        let numbers = (any::<u64>(), 0.0..1e6, any::<i64>(), prop::option::of(1..=u64::MAX));
        let words = (text(), text(), text(), text(), text());
        (numbers, of, words, measured_values(), prop::collection::vec(rejected, 0..4)).prop_map(
            |((number, at_s, utc_ms, parent), kind, words, measured, rejected)| {
                let (topic, text, flag, response, response_reason) = words;
                DecisionRecord {
                    number,
                    at_s,
                    utc_ms,
                    topic,
                    kind,
                    text,
                    flag,
                    measured,
                    response,
                    response_reason,
                    rejected,
                    parent,
                }
            },
        )
    }

    proptest! {
        #[test]
        fn a_decision_survives_the_wire(record in record()) {
            let message = v1::DecisionRecord::from(record.clone());
            prop_assert_eq!(sentence(&message), record.sentence());
            prop_assert_eq!(DecisionRecord::try_from(message), Ok(record));
        }

        #[test]
        fn the_value_of_a_flag_survives_the_wire(one in measured_values()) {
            let unit = one.map_or("", |it| it.unit().symbol());
            prop_assert_eq!(measured(one.map(Measured::value), one.map(Measured::threshold), unit), one);
        }
    }

    #[test]
    fn a_value_that_makes_no_sense_is_refused_in_a_record_and_left_out_of_a_flag() {
        #[track_caller]
        fn check(value: Option<f64>, threshold: Option<f64>, unit: &str, expected: &str) {
            let record =
                v1::DecisionRecord { value, threshold, unit: unit.into(), text: "low".into(), ..Default::default() };
            assert_eq!(DecisionRecord::try_from(record.clone()).unwrap_err().to_string(), expected);
            assert_eq!(sentence(&record), "Low.");
            assert_eq!(measured(value, threshold, unit), None);
        }
        check(Some(f64::NAN), Some(1.0), "m", "`value` is NaN, expected a finite number");
        check(Some(1.0), Some(f64::INFINITY), "m", "`threshold` is inf, expected a finite number");
        check(Some(1.0), Some(1.0), "ell", "`unit` is \"ell\", expected a known unit");
        check(Some(1.0), None, "m", "`threshold` is missing");
        check(None, Some(1.0), "m", "`value` is missing");
    }

    #[test]
    fn a_record_of_an_earlier_version_is_a_note() {
        let before =
            v1::DecisionRecord { at_s: 1.5, topic: "step".into(), text: "takeoff".into(), ..Default::default() };
        let record = DecisionRecord::try_from(before.clone()).unwrap();
        assert_eq!((record.kind, record.parent, record.sentence()), (DecisionKind::Note, None, "Takeoff.".into()));
        let later = v1::DecisionRecord { kind: 9999, ..before };
        assert_eq!(DecisionRecord::try_from(later).map(|it| it.kind), Ok(DecisionKind::Note));
    }
}
