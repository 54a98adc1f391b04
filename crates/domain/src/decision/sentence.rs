//! A record in words: the only way decisions are reported to humans.

use super::{DecisionKind, DecisionRecord, Rejected};
use crate::measured::Unit;

impl DecisionRecord {
    /// The whole record as sentences: the decision, its reasons, the rejected alternatives and why.
    pub fn sentence(&self) -> String {
        let reason = match self.response_reason.as_str() {
            "" => String::new(),
            reason => format!(" ({reason})"),
        };
        let first = closed(&format!("{}{reason}", self.head()));
        let others = self.untold().map(|it| closed(&format!("Not {}: {}", it.what, it.why)));
        std::iter::once(first).filter(|it| !it.is_empty()).chain(others).collect::<Vec<_>>().join(" ")
    }

    /// What its text does not say, to follow the text on a line of a log; empty if there is nothing.
    pub fn addition(&self) -> String {
        let reason = Some(&self.response_reason).filter(|it| !it.is_empty()).map(|it| format!(" ({it})"));
        let others = self.untold().map(|it| format!("; not {}: {}", it.what, it.why));
        reason.into_iter().chain(others).collect()
    }

    /// What was rejected for a reason that the text does not give already.
    fn untold(&self) -> impl Iterator<Item = &Rejected> {
        self.rejected.iter().filter(|it| !self.text.contains(&it.why))
    }

    fn head(&self) -> String {
        match self.measured {
            // Of a silence the text names the source, which no unit says.
            Some(measured) if self.kind == DecisionKind::ContingencyRaised && measured.unit() != Unit::Second => {
                format!("`{}`: {measured}", self.flag)
            }
            _ => capitalised(&self.text),
        }
    }
}

fn capitalised(text: &str) -> String {
    let text = text.trim();
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}", first.to_uppercase(), letters.as_str()))
}

/// With a full stop, unless it ends already.
fn closed(text: &str) -> String {
    let is_open = !text.is_empty() && !text.ends_with(['.', '!', '?']);
    if is_open { format!("{text}.") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::samples::note;
    use super::super::{DecisionKind, DecisionRecord, Rejected};
    use crate::measured::{Measured, Unit};

    #[track_caller]
    fn check(record: &DecisionRecord, sentence: &str, addition: &str) {
        assert_eq!((record.sentence().as_str(), record.addition().as_str()), (sentence, addition));
    }

    fn rejected(what: &str, why: &str) -> Rejected {
        Rejected { what: what.into(), why: why.into() }
    }

    #[test]
    fn a_record_without_more_is_its_text_with_a_capital_letter_and_a_full_stop() {
        check(&note(1, "takeoff by 10 m", None), "Takeoff by 10 m.", "");
        check(&note(1, " area A: granted! ", None), "Area A: granted!", "");
        check(&note(1, "", None), "", "");
    }

    #[test]
    fn a_flag_is_told_by_its_value_and_a_silence_by_its_source() {
        let raised = |measured, text: &str| DecisionRecord {
            kind: DecisionKind::ContingencyRaised,
            flag: "battery_low".into(),
            measured,
            ..note(1, text, None)
        };
        let low = Measured::new(0.248, 0.25, Unit::Ratio);
        check(&raised(low, "flag `battery_low` raised: low"), "`battery_low`: 24.8 % is below 25 %.", "");
        check(&raised(None, "flag `battery_low` raised: by hand"), "Flag `battery_low` raised: by hand.", "");
        let silent = Measured::new(10.0, 10.0, Unit::Second);
        check(&raised(silent, "flag `x` raised: silent for 10 s"), "Flag `x` raised: silent for 10 s.", "");
        let answered =
            DecisionRecord { kind: DecisionKind::ContingencyAnswered, ..raised(low, "`battery_low`: divert") };
        check(&answered, "`battery_low`: divert.", "");
    }

    #[test]
    fn a_reason_that_the_text_gives_is_not_repeated() {
        let text = "`x`: divert failed (try 2 of 2): no way; next: land";
        let record = DecisionRecord { rejected: vec![rejected("divert", "no way")], ..note(1, text, None) };
        check(&record, "`x`: divert failed (try 2 of 2): no way; next: land.", "");
    }

    #[test]
    fn what_was_not_done_follows_with_its_reason() {
        let record = DecisionRecord {
            kind: DecisionKind::SiteChosen,
            response_reason: "1.9 km, 31 Wh of 54 usable".into(),
            rejected: vec![rejected("home", "the way needs 61 Wh"), rejected("stop", "less severe than divert")],
            ..note(1, "flies to site `harbour` to land", None)
        };
        check(
            &record,
            "Flies to site `harbour` to land (1.9 km, 31 Wh of 54 usable). Not home: the way needs 61 Wh. \
             Not stop: less severe than divert.",
            " (1.9 km, 31 Wh of 54 usable); not home: the way needs 61 Wh; not stop: less severe than divert",
        );
    }
}
