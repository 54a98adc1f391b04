//! Numbers from configuration files that carry their range: a value outside it is a parse error
//! with file, line and column, not a surprise in flight.

use std::time::Duration;

use serde::Deserialize;

/// More than zero, less than a million.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Positive(f64);

impl Positive {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }

    /// The number as seconds.
    pub fn seconds(self) -> Duration {
        Duration::from_secs_f64(self.0)
    }

    /// The time from one to the next at this many a second.
    pub fn period(self) -> Duration {
        Duration::from_secs_f64(1.0 / self.0)
    }
}

impl TryFrom<f64> for Positive {
    type Error = String;
    fn try_from(it: f64) -> Result<Positive, String> {
        if 1e-6 <= it && it <= 1e6 {
            Ok(Positive(it))
        } else {
            Err(format!("found {}, expected a number between 0.000001 and 1000000", readable(it)))
        }
    }
}

/// Seconds, of at least `LEAST_MS` and at most `MOST_MS` milliseconds: a value beyond them would leave a process dead, end one that lives, or
/// let nothing that waits for it ever come or ever end.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Seconds<const LEAST_MS: u32, const MOST_MS: u32>(f64);

impl<const LEAST_MS: u32, const MOST_MS: u32> Seconds<LEAST_MS, MOST_MS> {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }

    /// The time.
    pub fn seconds(self) -> Duration {
        Duration::from_secs_f64(self.0)
    }
}

impl<const LEAST_MS: u32, const MOST_MS: u32> TryFrom<f64> for Seconds<LEAST_MS, MOST_MS> {
    type Error = String;
    fn try_from(it: f64) -> Result<Self, String> {
        let (least, most) = (f64::from(LEAST_MS) / 1000.0, f64::from(MOST_MS) / 1000.0);
        if least <= it && it <= most {
            Ok(Seconds(it))
        } else {
            Err(format!("found {} s, expected {least} s to {most} s", readable(it)))
        }
    }
}

/// A number, such as a rate, of at least `LEAST` and at most `MOST`: beyond them a process would do nothing, or nothing else.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Number<const LEAST: u32, const MOST: u32>(f64);

impl<const LEAST: u32, const MOST: u32> Number<LEAST, MOST> {
    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }

    /// The time from one to the next at this many a second.
    pub fn period(self) -> Duration {
        Duration::from_secs_f64(1.0 / self.0)
    }
}

impl<const LEAST: u32, const MOST: u32> TryFrom<f64> for Number<LEAST, MOST> {
    type Error = String;
    fn try_from(it: f64) -> Result<Self, String> {
        if f64::from(LEAST) <= it && it <= f64::from(MOST) {
            Ok(Number(it))
        } else {
            Err(format!("found {}, expected a number from {LEAST} to {MOST}", readable(it)))
        }
    }
}

/// From 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Fraction(f64);

impl Fraction {
    /// Nothing.
    pub const ZERO: Fraction = Fraction(0.0);

    /// The number.
    pub fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for Fraction {
    type Error = String;
    fn try_from(it: f64) -> Result<Fraction, String> {
        if (0.0..=1.0).contains(&it) {
            Ok(Fraction(it))
        } else {
            Err(format!("found {}, expected a fraction from 0 to 1", readable(it)))
        }
    }
}

/// In an answer or in a terminal: `1e308` has three hundred digits otherwise.
fn readable(it: f64) -> String {
    let has_few_digits = it == 0.0 || !it.is_finite() || (1e-6..1e15).contains(&it.abs());
    if has_few_digits { it.to_string() } else { format!("{it:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_refused() {
        assert!(Positive::try_from(0.0).is_err());
        assert!(Positive::try_from(f64::NAN).is_err());
        assert!(Fraction::try_from(1.5).is_err());
        assert!(
            [0.0, 0.99, 60.01, f64::INFINITY, f64::NAN]
                .iter()
                .all(|it| Seconds::<1000, 60_000>::try_from(*it).is_err())
        );
        assert!([1.0, 60.0].iter().all(|it| Seconds::<1000, 60_000>::try_from(*it).is_ok()));
        assert!([0.0, 1.99, 1000.5, f64::NAN].iter().all(|it| Number::<2, 1000>::try_from(*it).is_err()));
        assert_eq!(Number::<2, 1000>::try_from(4.0).unwrap().period(), Duration::from_millis(250));
        for (value, found) in
            [(0.0, "0"), (-2.5, "-2.5"), (f64::NAN, "NaN"), (1e7, "10000000"), (1e308, "1e308"), (-5e-300, "-5e-300")]
        {
            let expected = format!("found {found}, expected a number between 0.000001 and 1000000");
            assert_eq!(Positive::try_from(value), Err(expected));
        }
        assert_eq!(Positive::try_from(4.0).unwrap().period(), Duration::from_millis(250));
    }
}
