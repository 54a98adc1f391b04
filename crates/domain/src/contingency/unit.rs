//! Units of measurement: what a rule compares must be alike.

use std::fmt;

/// The names of the base units, in the order of their powers.
const BASE: [&str; 7] = ["m", "s", "V", "A", "degC", "deg", "%"];

/// The highest power of a base unit that an expression may come to.
const HIGHEST: i8 = 4;

/// A unit as powers of base units: `m/s` is the first power of the metre and minus the first of the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit([i8; 7]);

impl Unit {
    /// A ratio of like values.
    pub const NONE: Unit = Unit([0; 7]);
    /// Metres.
    pub const METRE: Unit = Unit([1, 0, 0, 0, 0, 0, 0]);
    /// Seconds.
    pub const SECOND: Unit = Unit([0, 1, 0, 0, 0, 0, 0]);
    /// Metres per second.
    pub const METRE_PER_SECOND: Unit = Unit([1, -1, 0, 0, 0, 0, 0]);
    /// Metres per second squared.
    pub const METRE_PER_SECOND_SQUARED: Unit = Unit([1, -2, 0, 0, 0, 0, 0]);
    /// Volts.
    pub const VOLT: Unit = Unit([0, 0, 1, 0, 0, 0, 0]);
    /// Amperes.
    pub const AMPERE: Unit = Unit([0, 0, 0, 1, 0, 0, 0]);
    /// Degrees Celsius.
    pub const CELSIUS: Unit = Unit([0, 0, 0, 0, 1, 0, 0]);
    /// Degrees of an angle.
    pub const DEGREE: Unit = Unit([0, 0, 0, 0, 0, 1, 0]);
    /// Hundredths of the whole.
    pub const PERCENT: Unit = Unit([0, 0, 0, 0, 0, 0, 1]);

    /// The unit of a product; `None` if a power is higher than any quantity of a vehicle has.
    pub(crate) fn times(self, other: Unit) -> Option<Unit> {
        self.with(other, |a, b| a + b)
    }

    /// The unit of a quotient; `None` as for a product.
    pub(crate) fn per(self, other: Unit) -> Option<Unit> {
        self.with(other, |a, b| a - b)
    }

    fn with(self, other: Unit, combine: fn(i8, i8) -> i8) -> Option<Unit> {
        let mut powers = self.0;
        for (power, other) in powers.iter_mut().zip(other.0) {
            // Both are at most `HIGHEST`, so this does not overflow.
            *power = combine(*power, other);
        }
        powers.iter().all(|it| it.abs() <= HIGHEST).then_some(Unit(powers))
    }
}

/// As it is written in a rule: `m/s`, `%`; `no unit` for a ratio.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let written = |wanted: fn(i8) -> bool| {
            let powers = BASE.iter().zip(self.0).filter(|(_, power)| wanted(*power));
            powers
                .map(
                    |(name, power)| {
                        if power.abs() == 1 { (*name).to_owned() } else { format!("{name}{}", power.abs()) }
                    },
                )
                .collect::<Vec<_>>()
                .join(" ")
        };
        let (above, below) = (written(|power| 0 < power), written(|power| power < 0));
        match (above.as_str(), below.as_str()) {
            ("", "") => f.write_str("no unit"),
            (above, "") => f.write_str(above),
            ("", below) => write!(f, "1/{below}"),
            (above, below) => write!(f, "{above}/{below}"),
        }
    }
}

/// Every unit that may follow a number, with the factor to the unit that values are kept in.
const SUFFIXES: [(&str, Unit, f64); 14] = [
    ("m", Unit::METRE, 1.0),
    ("km", Unit::METRE, 1000.0),
    ("s", Unit::SECOND, 1.0),
    ("ms", Unit::SECOND, 0.001),
    ("min", Unit::SECOND, 60.0),
    ("h", Unit::SECOND, 3600.0),
    ("m/s", Unit::METRE_PER_SECOND, 1.0),
    ("km/h", Unit::METRE_PER_SECOND, 1.0 / 3.6),
    ("m/s2", Unit::METRE_PER_SECOND_SQUARED, 1.0),
    ("V", Unit::VOLT, 1.0),
    ("A", Unit::AMPERE, 1.0),
    ("degC", Unit::CELSIUS, 1.0),
    ("deg", Unit::DEGREE, 1.0),
    ("%", Unit::PERCENT, 1.0),
];

/// The unit called `name` after a number, and the factor to the unit that values are kept in.
pub(crate) fn suffix(name: &str) -> Option<(Unit, f64)> {
    SUFFIXES.iter().find(|(known, ..)| *known == name).map(|(_, unit, factor)| (*unit, *factor))
}

/// The names of all units that may follow a number.
pub(crate) fn suffix_names() -> Vec<&'static str> {
    SUFFIXES.iter().map(|(name, ..)| *name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_shown_as_it_is_written() {
        #[track_caller]
        fn check(unit: Option<Unit>, expected: &str) {
            assert_eq!(unit.map(|it| it.to_string()).as_deref(), Some(expected));
        }
        check(Some(Unit::METRE_PER_SECOND), "m/s");
        check(Unit::METRE.per(Unit::METRE), "no unit");
        check(Unit::METRE.times(Unit::METRE), "m2");
        check(Unit::NONE.per(Unit::SECOND), "1/s");
        check(Unit::VOLT.times(Unit::AMPERE), "V A");
        for (name, unit, factor) in SUFFIXES {
            assert_eq!(suffix(name), Some((unit, factor)));
            if factor == 1.0 {
                check(Some(unit), name);
            }
        }
    }

    #[test]
    fn no_power_grows_without_end() {
        let mut unit = Some(Unit::METRE);
        for _ in 1..HIGHEST {
            unit = unit.and_then(|it| it.times(Unit::METRE));
        }
        assert!(unit.is_some());
        assert_eq!(unit.and_then(|it| it.times(Unit::METRE)), None);
    }
}
