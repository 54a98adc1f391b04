//! The ground: level, with rectangles that are higher or lower and harm somebody else when the vehicle comes down there.

use std::fmt;

use nalgebra::Vector3;

/// What the ground consists of at a place: who or what a vehicle harms that comes down there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Surface {
    /// Nobody.
    Land,
    /// The vehicle.
    Water,
    /// People.
    People,
}

/// A rectangle of ground with vertical sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Its south and north side, metres north of the origin.
    pub north_m: [f64; 2],
    /// Its west and east side, metres east of the origin.
    pub east_m: [f64; 2],
    /// Above the origin.
    pub height_m: f64,
    /// What is there.
    pub surface: Surface,
}

/// All of the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Ground {
    /// Its height outside of the patches, above the origin.
    pub elsewhere_m: f64,
    /// What is there.
    pub elsewhere: Surface,
    /// Where patches overlap, the last one counts.
    pub patches: Vec<Patch>,
}

/// Land at the height of the origin.
impl Default for Ground {
    fn default() -> Ground {
        Ground { elsewhere_m: 0.0, elsewhere: Surface::Land, patches: Vec::new() }
    }
}

impl Patch {
    /// A square of this side round a place.
    pub fn square((north_m, east_m): (f64, f64), side_m: f64, height_m: f64, surface: Surface) -> Patch {
        let range = |middle_m: f64| [middle_m - side_m / 2.0, middle_m + side_m / 2.0];
        Patch { north_m: range(north_m), east_m: range(east_m), height_m, surface }
    }

    fn holds(&self, north_m: f64, east_m: f64) -> bool {
        let is_within = |[from, to]: [f64; 2], it: f64| from <= it && it <= to;
        is_within(self.north_m, north_m) && is_within(self.east_m, east_m)
    }
}

impl Ground {
    /// Its height above the origin, and what is there.
    pub fn at(&self, north_m: f64, east_m: f64) -> (f64, Surface) {
        let patch = self.patches.iter().rev().find(|it| it.holds(north_m, east_m));
        patch.map_or((self.elsewhere_m, self.elsewhere), |it| (it.height_m, it.surface))
    }

    /// The height of the ground below, or above, this position, downwards from the origin.
    pub(crate) fn down_m(&self, position: Vector3<f64>) -> f64 {
        -self.at(position.x, position.y).0
    }
}

impl fmt::Display for Surface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Surface::Land => "land",
            Surface::Water => "water",
            Surface::People => "people",
        })
    }
}

/// One line for each patch.
impl fmt::Display for Ground {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ground: {} at {} m", self.elsewhere, self.elsewhere_m)?;
        for Patch { north_m: [south, north], east_m: [west, east], height_m, surface } in &self.patches {
            write!(f, "\n  {surface} at {height_m} m, {south} to {north} m north, {west} to {east} m east")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_patch_that_holds_a_place_counts() {
        let patches = vec![
            Patch::square((0.0, 0.0), 400.0, 0.0, Surface::People),
            Patch::square((100.0, 0.0), 40.0, 60.0, Surface::Land),
        ];
        let ground = Ground { elsewhere_m: -15.0, elsewhere: Surface::Water, patches };
        assert_eq!(ground.at(0.0, 0.0), (0.0, Surface::People));
        assert_eq!(ground.at(119.0, -19.0), (60.0, Surface::Land));
        assert_eq!(ground.at(201.0, 0.0), (-15.0, Surface::Water));
        let said = "ground: water at -15 m\n  people at 0 m, -200 to 200 m north, -200 to 200 m east\n  \
                    land at 60 m, 80 to 120 m north, -20 to 20 m east";
        assert_eq!(ground.to_string(), said);
    }
}
