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
            Err(format!("found {it}, expected a number between 0.000001 and 1000000"))
        }
    }
}

/// From 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
#[serde(try_from = "f64")]
pub struct Fraction(f64);

impl Fraction {
    /// Nothing of it.
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
            Err(format!("found {it}, expected a fraction from 0 to 1"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_refused() {
        assert!(Positive::try_from(0.0).is_err());
        assert!(Positive::try_from(f64::NAN).is_err());
        assert!(Fraction::try_from(1.5).is_err());
        assert_eq!(Positive::try_from(4.0).unwrap().period(), Duration::from_millis(250));
    }
}
