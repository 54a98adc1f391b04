//! Positions and velocities in the local North-East-Down frame, in metres, origin at the take-off point.

/// A position. Down is positive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ned {
    /// Metres north of the origin.
    pub north_m: f64,
    /// Metres east of the origin.
    pub east_m: f64,
    /// Metres below the origin.
    pub down_m: f64,
}

impl Ned {
    /// A position from its three coordinates.
    pub const fn new(north_m: f64, east_m: f64, down_m: f64) -> Ned {
        Ned { north_m, east_m, down_m }
    }

    /// Height above the origin; the negation of `down_m`, so that callers never flip a sign by hand.
    pub fn height_m(self) -> f64 {
        -self.down_m
    }

    /// The same place at another height.
    pub fn at_height(self, height_m: f64) -> Ned {
        Ned { down_m: -height_m, ..self }
    }

    /// Straight-line distance.
    pub fn distance_m(self, other: Ned) -> f64 {
        match other.down_m - self.down_m {
            0.0 => self.horizontal_distance_m(other),
            down_m => self.horizontal_distance_m(other).hypot(down_m),
        }
    }

    /// Distance over ground.
    pub fn horizontal_distance_m(self, other: Ned) -> f64 {
        let (north_m, east_m) = (other.north_m - self.north_m, other.east_m - self.east_m);
        // A search computes it a hundred thousand times, and a root takes less time than `hypot`, which is there for squares that
        // do not fit: those of a thousand kilometres do.
        (north_m * north_m + east_m * east_m).sqrt()
    }

    /// The point `fraction` of the way to `other` (0 here, 1 there).
    pub fn towards(self, other: Ned, fraction: f64) -> Ned {
        let mix = |a: f64, b: f64| a + (b - a) * fraction;
        Ned::new(mix(self.north_m, other.north_m), mix(self.east_m, other.east_m), mix(self.down_m, other.down_m))
    }

    /// The distance over ground to the straight line between two places, in metres.
    pub fn horizontal_distance_to_line_m(self, from: Ned, to: Ned) -> f64 {
        let (north_m, east_m) = (to.north_m - from.north_m, to.east_m - from.east_m);
        let square = north_m * north_m + east_m * east_m;
        let along = (self.north_m - from.north_m) * north_m + (self.east_m - from.east_m) * east_m;
        let fraction = if square == 0.0 { 0.0 } else { (along / square).clamp(0.0, 1.0) };
        self.horizontal_distance_m(from.towards(to, fraction))
    }

    /// Whether every coordinate is a number and within the reach of any aircraft (1,000 km).
    pub(crate) fn is_sound(self) -> bool {
        [self.north_m, self.east_m, self.down_m].iter().all(|it| it.abs() <= 1e6)
    }
}

/// North, east and height in whole metres: `(0, 90, 10)`.
impl std::fmt::Display for Ned {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Adding zero turns a negative zero into a positive one.
        let [north, east, height] = [self.north_m, self.east_m, self.height_m()].map(|metres| metres.round() + 0.0);
        write!(f, "({north:.0}, {east:.0}, {height:.0})")
    }
}

/// A velocity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NedVelocity {
    /// Metres per second towards north.
    pub north_m_s: f64,
    /// Metres per second towards east.
    pub east_m_s: f64,
    /// Metres per second downwards.
    pub down_m_s: f64,
}

impl NedVelocity {
    /// A velocity from its three components.
    pub const fn new(north_m_s: f64, east_m_s: f64, down_m_s: f64) -> NedVelocity {
        NedVelocity { north_m_s, east_m_s, down_m_s }
    }

    /// Its magnitude.
    pub fn speed_m_s(self) -> f64 {
        self.ground_speed_m_s().hypot(self.down_m_s)
    }

    /// The magnitude of its horizontal part.
    pub fn ground_speed_m_s(self) -> f64 {
        self.north_m_s.hypot(self.east_m_s)
    }

    /// Upwards is positive.
    pub fn climb_rate_m_s(self) -> f64 {
        -self.down_m_s
    }

    /// Whether every component is a number and below the speed of any aircraft (1,000 m/s).
    pub(crate) fn is_sound(self) -> bool {
        [self.north_m_s, self.east_m_s, self.down_m_s].iter().all(|it| it.abs() <= 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_is_up() {
        assert_eq!(Ned::new(0.0, 0.0, -5.0).height_m(), 5.0);
        assert_eq!(Ned::default().at_height(5.0).down_m, -5.0);
    }

    #[test]
    fn what_is_not_a_number_is_not_sound() {
        assert!(!Ned::new(f64::NAN, 0.0, 0.0).is_sound());
        assert!(!NedVelocity::new(0.0, f64::INFINITY, 0.0).is_sound());
    }
}
