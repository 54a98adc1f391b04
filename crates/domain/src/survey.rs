//! A survey: parallel lines over a polygon, flown to and fro (boustrophedon, as an ox ploughs).
//!
//! The lines are those of one heading, a spacing apart, clipped to the polygon, so that no point is farther than half a
//! spacing from a line or its continuation. Without a heading they run as the polygon is narrowest across: that gives the
//! fewest lines, and so the fewest turns (Huang, Optimal Line-sweep-based Decompositions for Coverage Algorithms, ICRA 2001).
//! Where a line meets a concave polygon more than once, the pieces that lie beside each other from line to line are a cell, which
//! is flown as a whole before the nearest other one (Choset and Pignon, Coverage Path Planning: The Boustrophedon Cellular
//! Decomposition, FSR 1997).
//!
//! Not flown over: what lies between two lines and is so narrow that neither meets it. It knows no areas: the ways between turns
//! are found, and judged, like all ways.

use geo::{ConvexHull, Coord};

use crate::area::{Area, AreaKind};
use crate::geometry::Ned;

/// A survey that can be flown, and how far it has been; [`Survey::new`] is the only way to obtain one.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    corners: Vec<Ned>,
    spacing_m: f64,
    picture_distance_m: Option<f64>,
    heading_deg: Option<f64>,
    turns: Vec<Turn>,
    passed: usize,
}

/// An end of a line, at height 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Where.
    pub at: Ned,
    /// The way to it, from the turn before, is a line of the survey.
    pub ends_line: bool,
}

/// Why a survey cannot be flown.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidSurvey {
    /// Its corners make no polygon.
    #[error("it crosses itself, has fewer than three corners or encloses nothing")]
    Shape,
    /// A corner is not a number, or too far away.
    #[error("it has a corner more than {} km from the origin", FARTHEST_M / 1e3)]
    TooFar,
    /// It has too many corners.
    #[error("it has {0} corners, expected at most {MOST_CORNERS}")]
    TooManyCorners(usize),
    /// The lines are too close to each other, or too far apart.
    #[error("its spacing is {0} m, expected {LEAST_SPACING_M} to {MOST_SPACING_M} m")]
    Spacing(f64),
    /// The pictures are too close to each other, or too far apart.
    #[error("its pictures are {0} m apart, expected {LEAST_PICTURE_DISTANCE_M} to {MOST_SPACING_M} m")]
    PictureDistance(f64),
    /// The heading is not a direction.
    #[error("its heading is {0}, expected degrees from -360 to 360")]
    Heading(f64),
    /// It has too many lines.
    #[error("it has {lines} lines, expected at most {MOST_LINES}")]
    TooManyLines {
        /// How many.
        lines: usize,
    },
}

/// The most lines, pieces of lines in a concave polygon counted each: one battery does not last for more, and a plan has two legs
/// for each.
pub const MOST_LINES: usize = 100;
/// The most corners: that it crosses itself is found by comparing each side with each.
pub const MOST_CORNERS: usize = 500;
/// Lines nearer to each other than this are one line to a plan, whose steps are reached within 3 m, in metres.
pub const LEAST_SPACING_M: f64 = 5.0;
/// Pictures nearer to each other than this are a typing mistake, in metres: no camera takes them at any speed of a survey.
pub const LEAST_PICTURE_DISTANCE_M: f64 = 0.1;
/// A greater spacing is a typing mistake, in metres.
pub const MOST_SPACING_M: f64 = 10_000.0;
/// As far as the places of a mission may lie, in metres.
const FARTHEST_M: f64 = 100_000.0;

impl Survey {
    /// A survey of the polygon with these corners (in order, not closed, heights not used), its lines `spacing_m` apart. Lines run
    /// along `heading_deg`, clockwise from north, and without one as makes them fewest.
    ///
    /// # Errors
    /// Why there is no such survey.
    pub fn new(corners: Vec<Ned>, spacing_m: f64, heading_deg: Option<f64>) -> Result<Survey, InvalidSurvey> {
        if !(LEAST_SPACING_M..=MOST_SPACING_M).contains(&spacing_m) {
            return Err(InvalidSurvey::Spacing(spacing_m));
        }
        if let Some(heading_deg) = heading_deg.filter(|it| !(-360.0..=360.0).contains(it)) {
            return Err(InvalidSurvey::Heading(heading_deg));
        }
        if MOST_CORNERS < corners.len() {
            return Err(InvalidSurvey::TooManyCorners(corners.len()));
        }
        if !corners.iter().all(|it| it.is_sound() && it.horizontal_distance_m(Ned::default()) <= FARTHEST_M) {
            return Err(InvalidSurvey::TooFar);
        }
        let corners: Vec<Ned> = corners.into_iter().map(|it| it.at_height(0.0)).collect();
        let area = area_of(&corners);
        if !area.is_simple() {
            return Err(InvalidSurvey::Shape);
        }
        let heading = heading_deg.map(f64::to_radians).or_else(|| heading_of_fewest_lines(&area));
        let frame = Frame::along(heading.ok_or(InvalidSurvey::Shape)?);
        let pieces = frame.pieces(&corners, spacing_m)?;
        let turns = turns(cells(pieces), frame);
        if turns.is_empty() {
            return Err(InvalidSurvey::Shape);
        }
        Ok(Survey { corners, spacing_m, picture_distance_m: None, heading_deg, turns, passed: 0 })
    }

    /// The same with a picture each time this distance was flown along a line, if any are to be taken.
    ///
    /// # Errors
    /// If the distance is out of range.
    pub fn with_pictures(self, picture_distance_m: Option<f64>) -> Result<Survey, InvalidSurvey> {
        match picture_distance_m.filter(|it| !(LEAST_PICTURE_DISTANCE_M..=MOST_SPACING_M).contains(it)) {
            Some(wrong_m) => Err(InvalidSurvey::PictureDistance(wrong_m)),
            None => Ok(Survey { picture_distance_m, ..self }),
        }
    }

    /// The polygon's corners, at height 0.
    pub fn corners(&self) -> &[Ned] {
        &self.corners
    }

    /// Between its lines, in metres.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// Along a line from one picture to the next, in metres; `None` if the survey does not say.
    pub fn picture_distance_m(&self) -> Option<f64> {
        self.picture_distance_m
    }

    /// The heading of its lines, if one was asked for.
    pub fn heading_deg(&self) -> Option<f64> {
        self.heading_deg
    }

    /// Where its lines begin and end, in the order of the flight; at least one.
    pub fn turns(&self) -> &[Turn] {
        &self.turns
    }

    /// How many of its turns have been passed.
    pub fn passed(&self) -> usize {
        self.passed
    }

    /// The same with this many turns passed, if not more were already. The last one is never passed: it is the objective itself.
    #[must_use]
    pub fn with_passed(self, passed: usize) -> Survey {
        Survey { passed: passed.min(self.turns.len() - 1).max(self.passed), ..self }
    }
}

fn area_of(corners: &[Ned]) -> Area {
    Area::new("", AreaKind::Permission, corners.to_vec())
}

/// The direction, in radians clockwise from north, across which the polygon is narrowest; a side of its convex hull has it (Houle
/// and Toussaint, Computing the Width of a Set, IEEE PAMI 10 (5), 1988). `None` if it encloses nothing.
fn heading_of_fewest_lines(area: &Area) -> Option<f64> {
    let hull = area.polygon().convex_hull();
    let width_m = |heading: f64| {
        let frame = Frame::along(heading);
        let across = |it: &Coord| frame.across_m(Ned::new(it.y, it.x, 0.0));
        let across: Vec<f64> = hull.exterior().coords().map(across).collect();
        extent_m(&across)[1] - extent_m(&across)[0]
    };
    let headings = hull.exterior().lines().map(|it| it.dx().atan2(it.dy()).rem_euclid(std::f64::consts::PI));
    headings.min_by(|a, b| width_m(*a).total_cmp(&width_m(*b)))
}

/// The least and the greatest of these.
fn extent_m(values_m: &[f64]) -> [f64; 2] {
    let extend = |[low_m, high_m]: [f64; 2], it: &f64| [low_m.min(*it), high_m.max(*it)];
    values_m.iter().fold([f64::INFINITY, f64::NEG_INFINITY], extend)
}

/// Metres along and across the lines.
#[derive(Debug, Clone, Copy)]
struct Frame {
    sin: f64,
    cos: f64,
}

/// A line's part inside of the polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// Number of the line.
    line: usize,
    across_m: f64,
    /// Where it begins and ends along the line; the smaller one first.
    along_m: [f64; 2],
}

impl Piece {
    /// Whether a stretch across both lines meets both.
    fn is_beside(&self, other: &Piece) -> bool {
        self.along_m[0] < other.along_m[1] && other.along_m[0] < self.along_m[1]
    }
}

impl Frame {
    fn along(heading: f64) -> Frame {
        let (sin, cos) = heading.sin_cos();
        Frame { sin, cos }
    }

    fn along_m(self, at: Ned) -> f64 {
        at.north_m * self.cos + at.east_m * self.sin
    }

    fn across_m(self, at: Ned) -> f64 {
        at.east_m * self.cos - at.north_m * self.sin
    }

    fn place(self, along_m: f64, across_m: f64) -> Ned {
        Ned::new(along_m * self.cos - across_m * self.sin, along_m * self.sin + across_m * self.cos, 0.0)
    }

    /// The pieces of all lines, line by line: as few lines as cover the width, with the same room at both borders.
    fn pieces(self, corners: &[Ned], spacing_m: f64) -> Result<Vec<Vec<Piece>>, InvalidSurvey> {
        let corners: Vec<(f64, f64)> = corners.iter().map(|it| (self.along_m(*it), self.across_m(*it))).collect();
        let across: Vec<f64> = corners.iter().map(|it| it.1).collect();
        let [low_m, high_m] = extent_m(&across);
        // A width of ten spacings, computed with rounding, has ten lines.
        let count = (((high_m - low_m) / spacing_m - 1e-9).ceil() as usize).max(1);
        if MOST_LINES < count {
            return Err(InvalidSurvey::TooManyLines { lines: count });
        }
        let first_m = f64::midpoint(low_m, high_m) - (count - 1) as f64 / 2.0 * spacing_m;
        let lines: Vec<Vec<Piece>> =
            (0..count).map(|line| pieces_of(line, first_m + line as f64 * spacing_m, &corners)).collect();
        let pieces = lines.iter().map(Vec::len).sum();
        if MOST_LINES < pieces { Err(InvalidSurvey::TooManyLines { lines: pieces }) } else { Ok(lines) }
    }
}

/// The pieces of one line. `corners` are (along, across).
fn pieces_of(line: usize, across_m: f64, corners: &[(f64, f64)]) -> Vec<Piece> {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    // A corner on the line belongs to one of its two sides, so that each border is met once.
    let met = sides.filter(|(a, b)| (a.1 <= across_m) != (b.1 <= across_m));
    let mut along_m: Vec<f64> = met.map(|(a, b)| a.0 + (b.0 - a.0) * (across_m - a.1) / (b.1 - a.1)).collect();
    along_m.sort_by(f64::total_cmp);
    // However short: at the point of a triangle it is what covers that.
    along_m.chunks_exact(2).map(|it| Piece { line, across_m, along_m: [it[0], it[1]] }).collect()
}

/// Pieces that lie beside each other from line to line, where neither lies beside another one.
fn cells(lines: Vec<Vec<Piece>>) -> Vec<Vec<Piece>> {
    let mut cells: Vec<Vec<Piece>> = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let before: &[Piece] = if index == 0 { &[] } else { &lines[index - 1] };
        for piece in line {
            let only = |among: &[Piece], of: &Piece| among.iter().filter(|it| it.is_beside(of)).count() == 1;
            let last = before.iter().find(|it| it.is_beside(piece)).filter(|it| only(before, piece) && only(line, it));
            match cells.iter_mut().find(|it| it.last() == last && last.is_some()) {
                Some(cell) => cell.push(*piece),
                None => cells.push(vec![*piece]),
            }
        }
    }
    cells
}

/// The turns of all cells: the nearest corner of a cell first, from the take-off point on.
fn turns(mut cells: Vec<Vec<Piece>>, frame: Frame) -> Vec<Turn> {
    let mut turns: Vec<Turn> = Vec::new();
    while !cells.is_empty() {
        let here = turns.last().map_or(Ned::default(), |it| it.at);
        let ways = cells.iter().enumerate().flat_map(|(index, cell)| {
            let to_and_fro = |(from_end, from_far)| (index, flown(cell, from_end, from_far, frame));
            [(false, false), (false, true), (true, false), (true, true)].map(to_and_fro)
        });
        let begins_m =
            |way: &(usize, Vec<Turn>)| way.1.first().map_or(f64::MAX, |it| here.horizontal_distance_m(it.at));
        let Some((index, way)) = ways.min_by(|a, b| begins_m(a).total_cmp(&begins_m(b))) else { break };
        cells.swap_remove(index);
        turns.extend(way);
    }
    // A step between turns this close would be over before it began.
    let mut kept: Vec<Turn> = Vec::new();
    for turn in turns {
        match kept.last() {
            Some(last) if last.at.horizontal_distance_m(turn.at) < LEAST_SPACING_M => {}
            _ => kept.push(turn),
        }
    }
    kept
}

/// The turns of one cell, from its last line on or from its first, beginning at the far end of that or at the near one.
fn flown(cell: &[Piece], from_end: bool, from_far: bool, frame: Frame) -> Vec<Turn> {
    let line = |(index, piece): (usize, &Piece)| {
        let [near, far] = piece.along_m.map(|along_m| frame.place(along_m, piece.across_m));
        let is_back = from_far != (index % 2 == 1);
        let (begin, end) = if is_back { (far, near) } else { (near, far) };
        [Turn { at: begin, ends_line: false }, Turn { at: end, ends_line: true }]
    };
    if from_end {
        cell.iter().rev().enumerate().flat_map(line).collect()
    } else {
        cell.iter().enumerate().flat_map(line).collect()
    }
}

#[cfg(test)]
mod tests;
