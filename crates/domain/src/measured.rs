//! A value with the threshold that it was compared with, and the unit of both.

use std::fmt;

use crate::contingency::unit as rules;

/// The unit of a published value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Unit {
    /// A share, 0 to 1; shown in per cent.
    Ratio,
    /// Hundredths of the whole.
    Percent,
    /// Volts.
    Volt,
    /// Amperes.
    Ampere,
    /// Degrees Celsius.
    Celsius,
    /// Metres.
    Metre,
    /// Metres per second.
    MetrePerSecond,
    /// Metres per second squared.
    MetrePerSecondSquared,
    /// Radians.
    Radian,
    /// Degrees of an angle.
    Degree,
    /// Seconds.
    Second,
    /// Watt hours.
    WattHour,
}

impl Unit {
    /// Every unit.
    pub const ALL: [Unit; 12] = [
        Unit::Ratio,
        Unit::Percent,
        Unit::Volt,
        Unit::Ampere,
        Unit::Celsius,
        Unit::Metre,
        Unit::MetrePerSecond,
        Unit::MetrePerSecondSquared,
        Unit::Radian,
        Unit::Degree,
        Unit::Second,
        Unit::WattHour,
    ];

    /// As it is written in messages.
    pub fn symbol(self) -> &'static str {
        match self {
            Unit::Ratio => "ratio",
            Unit::Percent => "%",
            Unit::Volt => "V",
            Unit::Ampere => "A",
            Unit::Celsius => "°C",
            Unit::Metre => "m",
            Unit::MetrePerSecond => "m/s",
            Unit::MetrePerSecondSquared => "m/s²",
            Unit::Radian => "rad",
            Unit::Degree => "°",
            Unit::Second => "s",
            Unit::WattHour => "Wh",
        }
    }

    /// The unit of this symbol.
    pub fn of_symbol(symbol: &str) -> Option<Unit> {
        Unit::ALL.into_iter().find(|it| it.symbol() == symbol)
    }

    /// As it is shown to a human: the factor, the unit, and the decimals that are worth reading.
    fn shown(self) -> (f64, &'static str, usize) {
        match self {
            Unit::Ratio => (100.0, "%", 1),
            Unit::Percent | Unit::Celsius | Unit::Metre | Unit::Degree | Unit::Second | Unit::WattHour => {
                (1.0, self.symbol(), 1)
            }
            Unit::Volt | Unit::Ampere | Unit::MetrePerSecond | Unit::MetrePerSecondSquared | Unit::Radian => {
                (1.0, self.symbol(), 2)
            }
        }
    }
}

/// Of what an expression compares; `Err` with what no message has a name for, such as a ratio of like values.
impl TryFrom<rules::Unit> for Unit {
    type Error = rules::Unit;
    fn try_from(unit: rules::Unit) -> Result<Unit, rules::Unit> {
        let units = [
            (rules::Unit::PERCENT, Unit::Percent),
            (rules::Unit::VOLT, Unit::Volt),
            (rules::Unit::AMPERE, Unit::Ampere),
            (rules::Unit::CELSIUS, Unit::Celsius),
            (rules::Unit::METRE, Unit::Metre),
            (rules::Unit::METRE_PER_SECOND, Unit::MetrePerSecond),
            (rules::Unit::METRE_PER_SECOND_SQUARED, Unit::MetrePerSecondSquared),
            (rules::Unit::DEGREE, Unit::Degree),
            (rules::Unit::SECOND, Unit::Second),
        ];
        units.into_iter().find(|it| it.0 == unit).map(|it| it.1).ok_or(unit)
    }
}

/// What was measured, and what it was compared with; both are finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    value: f64,
    threshold: f64,
    unit: Unit,
}

impl Measured {
    /// A comparison; `None` unless both are finite.
    pub fn new(value: f64, threshold: f64, unit: Unit) -> Option<Measured> {
        (value.is_finite() && threshold.is_finite()).then_some(Measured { value, threshold, unit })
    }

    /// What was measured.
    pub fn value(self) -> f64 {
        self.value
    }

    /// What it was compared with.
    pub fn threshold(self) -> f64 {
        self.threshold
    }

    /// The unit of both.
    pub fn unit(self) -> Unit {
        self.unit
    }
}

/// Decimals beyond which two numbers count as the same to a reader.
const MOST_DECIMALS: usize = 6;

/// `24.8 % is below 25 %`, with as many decimals as show that the two differ.
impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (factor, unit, least) = self.unit.shown();
        let with = |decimals| (rounded(self.value * factor, decimals), rounded(self.threshold * factor, decimals));
        let differs = |(value, threshold): &(String, String)| value != threshold;
        let (value, threshold) = (least..=MOST_DECIMALS).map(with).find(differs).unwrap_or_else(|| with(least));
        let relation = match self.value.total_cmp(&self.threshold) {
            std::cmp::Ordering::Less => "is below",
            std::cmp::Ordering::Equal => "has reached",
            std::cmp::Ordering::Greater => "is above",
        };
        write!(f, "{value} {unit} {relation} {threshold} {unit}")
    }
}

/// Without zeros at the end.
fn rounded(number: f64, decimals: usize) -> String {
    let text = format!("{number:.decimals$}");
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text.as_str() };
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_comparison_is_shown_with_the_digits_that_it_needs() {
        #[track_caller]
        fn check(value: f64, threshold: f64, unit: Unit, expected: &str) {
            assert_eq!(Measured::new(value, threshold, unit).unwrap().to_string(), expected);
        }
        check(0.248, 0.25, Unit::Ratio, "24.8 % is below 25 %");
        check(0.2499, 0.25, Unit::Ratio, "24.99 % is below 25 %");
        check(2.75, 2.5, Unit::MetrePerSecond, "2.75 m/s is above 2.5 m/s");
        check(120.0, 120.0, Unit::Second, "120 s has reached 120 s");
        check(-0.04, 1.0, Unit::Metre, "0 m is below 1 m");
        check(30.2, 54.0, Unit::WattHour, "30.2 Wh is below 54 Wh");
        check(1.0 + 1e-12, 1.0, Unit::Radian, "1 rad is above 1 rad");
    }

    #[test]
    fn what_is_not_a_number_is_no_comparison() {
        for (value, threshold) in [(f64::NAN, 1.0), (1.0, f64::NAN), (f64::INFINITY, 1.0), (1.0, f64::NEG_INFINITY)] {
            assert_eq!(Measured::new(value, threshold, Unit::Metre), None);
        }
    }

    #[test]
    fn a_unit_is_found_by_its_symbol() {
        for unit in Unit::ALL {
            assert_eq!(Unit::of_symbol(unit.symbol()), Some(unit));
        }
        assert_eq!(Unit::of_symbol("furlong"), None);
        assert_eq!(Unit::of_symbol(""), None);
    }

    proptest! {
        /// What is shown never claims the opposite of what was measured.
        #[test]
        fn the_shown_numbers_are_in_the_order_of_the_measured_ones(value in -1e4..1e4_f64, threshold in -1e4..1e4_f64) {
            let text = Measured::new(value, threshold, Unit::Metre).unwrap().to_string();
            let numbers: Vec<f64> = text.split(' ').filter_map(|it| it.parse().ok()).collect();
            prop_assert_eq!(numbers.len(), 2, "{}", text);
            prop_assert!((value < threshold) == text.contains("is below"));
            let in_order = if value < threshold { numbers[0] <= numbers[1] } else { numbers[1] <= numbers[0] };
            prop_assert!(in_order, "{numbers:?}");
        }
    }
}
