//! When a row's expression raises its flag, and when it lets it fall.

use std::time::Duration;

use serde::Deserialize;

use super::expression::{Expression, Threshold, Verdict};
use super::snapshot::{Field, Snapshot};

/// The expression of a row, with the times for which it must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct When {
    /// Raises the flag. What is not known counts as raised: see [`When::finding`].
    pub raises: Expression,
    /// Lets the flag fall while the first one does not hold; without it the flag falls when the first one does not hold.
    pub clears: Option<Expression>,
    /// How long the expression must hold before the flag is raised, in mission time.
    pub hold: Duration,
    /// How long it must be over before the flag falls, in mission time.
    pub clears_after: Duration,
    /// In which situation it counts.
    pub during: During,
}

/// In which situation a row's expressions count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum During {
    /// At any time.
    Always,
    /// While the vehicle is armed.
    Armed,
    /// While it flies.
    Flying,
}

impl During {
    /// Whether it counts for these values; `None` where that is not known.
    pub fn applies(self, snapshot: &Snapshot) -> Option<bool> {
        self.field().map_or(Some(true), |field| snapshot.get(field).map(|it| it > 0.5))
    }

    /// The field that says whether it counts.
    pub fn field(self) -> Option<Field> {
        match self {
            During::Always => None,
            During::Armed => Some(Field::Armed),
            During::Flying => Some(Field::Flying),
        }
    }
}

/// How a row's expressions stand for one snapshot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// What raises the flag holds.
    Raises,
    /// Whether it holds is not known, which counts as raised; with the field of which nothing is known.
    Unknown(Option<Field>),
    /// Neither: it no longer holds, and what clears the flag does not hold yet, or is not known.
    Between,
    /// It does not hold, and nothing speaks against the flag's fall.
    Clears,
}

impl When {
    /// How it stands for these values, in a situation in which it counts.
    pub fn finding(&self, snapshot: &Snapshot) -> Finding {
        match (self.raises.verdict(snapshot), &self.clears) {
            (Verdict::Holds, _) => Finding::Raises,
            (Verdict::Unknown(field), _) => Finding::Unknown(field),
            (Verdict::DoesNotHold, Some(clears)) if clears.verdict(snapshot) != Verdict::Holds => Finding::Between,
            (Verdict::DoesNotHold, _) => Finding::Clears,
        }
    }

    /// The fields that decide whether the flag is raised.
    pub fn fields(&self) -> &[Field] {
        self.raises.fields()
    }

    /// Whether the flag would fall where it is raised: both expressions are comparisons of one field with a constant, in opposite
    /// directions, and the ranges in which they hold overlap.
    pub(super) fn contradicts_itself(&self) -> bool {
        let cleared_by = self.clears.as_ref().and_then(Expression::threshold);
        let (Some(raised_by), Some(cleared_by)) = (self.raises.threshold(), cleared_by) else { return false };
        let Threshold { field, value, above } = cleared_by;
        let overlaps = if above { value < raised_by.value } else { raised_by.value < value };
        field == raised_by.field && above != raised_by.above && overlaps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn when(raises: &str, clears: Option<&str>) -> When {
        let expression = |text: &str| Expression::parse(text).unwrap_or_else(|problem| panic!("{text}: {problem:?}"));
        When {
            raises: expression(raises),
            clears: clears.map(expression),
            hold: Duration::ZERO,
            clears_after: Duration::ZERO,
            during: During::Always,
        }
    }

    #[test]
    fn between_its_two_expressions_a_flag_stays_as_it_is() {
        #[track_caller]
        fn check(clears: Option<&str>, charge: Option<f64>, expected: Finding) {
            let mut snapshot = Snapshot::UNKNOWN;
            snapshot.set(Field::BatteryCharge, charge);
            let when = when("battery.charge_percent < 5 %", clears);
            assert_eq!(when.finding(&snapshot), expected, "{clears:?} {charge:?}");
        }
        let higher = Some("battery.charge_percent > 7 %");
        check(higher, Some(4.9), Finding::Raises);
        check(higher, Some(5.0), Finding::Between);
        check(higher, Some(7.0), Finding::Between);
        check(higher, Some(7.1), Finding::Clears);
        check(None, Some(5.0), Finding::Clears);
        check(higher, None, Finding::Unknown(Some(Field::BatteryCharge)));
        // What clears it depends on a field of which nothing is known.
        check(Some("wind.speed_m_s < 5 m/s"), Some(50.0), Finding::Between);
    }

    #[test]
    fn a_flag_that_would_fall_where_it_is_raised_is_noticed() {
        #[track_caller]
        fn check(raises: &str, clears: &str, expected: bool) {
            assert_eq!(when(raises, Some(clears)).contradicts_itself(), expected, "{raises}, {clears}");
        }
        check("battery.charge_percent < 5 %", "battery.charge_percent > 7 %", false);
        check("battery.charge_percent < 5 %", "battery.charge_percent > 5 %", false);
        check("battery.charge_percent < 5 %", "battery.charge_percent > 4 %", true);
        check("wind.speed_m_s > 12 m/s", "wind.speed_m_s < 10 m/s", false);
        check("wind.speed_m_s > 12 m/s", "wind.speed_m_s < 13 m/s", true);
        check("wind.speed_m_s > 12 m/s", "position.height_m < 13 m", false);
    }
}
