//! Where the posts of a tile are.

use std::ops::RangeInclusive;

use domain::geodesy::LatLon;

use crate::Problem;
use crate::extent::Extent;

/// The most posts of a part, which is read as a whole.
const MOST_IN_PART: u64 = 1 << 24;
/// The most rows, and the most columns. (One arc second round the Earth is 1.3 million.)
const MOST_ACROSS: u32 = 2_000_000;

/// Posts in rows from north to south, each from west to east. They are stored in *parts*, rectangles of the same size but for the last ones
/// of a row and of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    /// Of the first post.
    pub(crate) north_deg: f64,
    /// Of the first post.
    pub(crate) west_deg: f64,
    /// From one row to the next, above 0.
    pub(crate) row_deg: f64,
    /// From one column to the next, above 0.
    pub(crate) column_deg: f64,
    pub(crate) rows: u32,
    pub(crate) columns: u32,
    /// Rows of a part.
    pub(crate) part_rows: u32,
    /// Columns of a part.
    pub(crate) part_columns: u32,
}

impl Grid {
    /// Refuses what cannot be a part of the Earth, and what would take too much memory.
    pub(crate) fn checked(self) -> Result<Grid, Problem> {
        let Grid { rows, columns, .. } = self;
        let sizes = 2..=MOST_ACROSS;
        if !sizes.contains(&rows) || !sizes.contains(&columns) {
            let message =
                format!("{columns} x {rows} posts, expected 2 x 2 at least and {MOST_ACROSS} x {MOST_ACROSS} at most");
            return Err(Problem::new(message, "cut the tile to what the mission needs"));
        }
        let in_part = u64::from(self.part_rows) * u64::from(self.part_columns);
        if MOST_IN_PART < in_part {
            let message = format!("{in_part} posts are stored as one piece, expected at most {MOST_IN_PART}");
            return Err(Problem::new(message, "write the tile again with smaller strips or tiles"));
        }
        let Extent { south, north, west, east } = self.extent(0.5);
        let is_on_earth = -90.5 <= south && north <= 90.5 && -180.5 <= west && east <= 180.5;
        let is_north_up = 0.0 < self.row_deg && 0.0 < self.column_deg;
        if !is_on_earth || !is_north_up {
            let message = format!(
                "its posts lie from {west} to {east} east and from {south} to {north} north, expected degrees on the Earth"
            );
            return Err(Problem::new(message, "write the tile again in degrees, latitude and longitude"));
        }
        Ok(self)
    }

    /// From the outermost posts, and this many steps beyond.
    pub(crate) fn extent(&self, steps: f64) -> Extent {
        Extent {
            south: self.north_deg - (f64::from(self.rows) - 1.0 + steps) * self.row_deg,
            north: self.north_deg + steps * self.row_deg,
            west: self.west_deg - steps * self.column_deg,
            east: self.west_deg + (f64::from(self.columns) - 1.0 + steps) * self.column_deg,
        }
    }

    /// The finer a tile, the smaller.
    pub(crate) fn cell_deg2(&self) -> f64 {
        self.row_deg * self.column_deg
    }

    /// The row and the column of a place, with fractions; beyond the outermost posts that of the nearest.
    pub(crate) fn position(&self, at: LatLon) -> (f64, f64) {
        (self.row(at.latitude_deg()), self.column(at.longitude_deg()))
    }

    fn row(&self, latitude_deg: f64) -> f64 {
        at_post((self.north_deg - latitude_deg) / self.row_deg).clamp(0.0, f64::from(self.rows - 1))
    }

    fn column(&self, longitude_deg: f64) -> f64 {
        at_post((longitude_deg - self.west_deg) / self.column_deg).clamp(0.0, f64::from(self.columns - 1))
    }

    /// The rows and columns of all posts that the ground within `area` is made of.
    pub(crate) fn posts_round(&self, area: Extent) -> (RangeInclusive<u32>, RangeInclusive<u32>) {
        let rows = self.row(area.north).floor() as u32..=self.row(area.south).ceil() as u32;
        let columns = self.column(area.west).floor() as u32..=self.column(area.east).ceil() as u32;
        (rows, columns)
    }

    /// In which part a post is.
    pub(crate) fn part_of(&self, row: u32, column: u32) -> u32 {
        row / self.part_rows * self.parts_across() + column / self.part_columns
    }

    fn parts_across(&self) -> u32 {
        self.columns.div_ceil(self.part_columns)
    }

    /// The rows and columns of a part.
    pub(crate) fn posts_of(&self, part: u32) -> (RangeInclusive<u32>, RangeInclusive<u32>) {
        let (down, across) = (part / self.parts_across(), part % self.parts_across());
        let range = |index: u32, size: u32, all: u32| index * size..=(index * size + (size - 1)).min(all - 1);
        (range(down, self.part_rows, self.rows), range(across, self.part_columns, self.columns))
    }
}

/// A place at a post needs no other one, which may have no data: degrees are not exact.
fn at_post(steps: f64) -> f64 {
    const SAME: f64 = 1e-6;
    if (steps - steps.round()).abs() < SAME { steps.round() } else { steps }
}
