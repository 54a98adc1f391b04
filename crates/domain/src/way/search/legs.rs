//! What a straight leg has to do with the areas, whatever the time.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use super::{Among, Entry, KEPT, Trip, may_open};
use crate::airspace::{Stay, is_at_heights, stays_within};
use crate::area::{Area, AreaKind};
use crate::area_map::MARGINS;
use crate::corners::GrownRing;
use crate::geometry::Ned;
use crate::known_ground::Hill;
use crate::way::{Exempt, SAME_HEIGHT_M};

/// The areas that may be in the way from a start to a goal.
pub(super) struct Obstacles<'a> {
    pub(super) among: Among<'a>,
    pub(super) trip: Trip,
    /// The height that ways are preferably flown at, in metres above the origin.
    pub(super) level_m: f64,
    /// Distance kept to the borders of the areas, in metres.
    pub(super) margin_m: f64,
    /// Which of [`MARGINS`] that is.
    part: usize,
    /// By index, whether an area may be in the way.
    may_bar: Vec<bool>,
    /// No area that is closed at all times is entered by force.
    stops_at_walls: bool,
}

/// What a leg touches.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Touched {
    /// The first one on it of the areas that are closed at all times, whatever else it touches.
    Wall(usize),
    /// These.
    Areas {
        /// Areas whose inside it touches.
        stays: Vec<(usize, Vec<Stay>)>,
        /// Areas that it passes nearer than the margin.
        near: Vec<usize>,
    },
}

impl Touched {
    /// Their indices.
    pub(super) fn areas(&self) -> Vec<usize> {
        match self {
            Touched::Wall(area) => vec![*area],
            Touched::Areas { stays, near } => stays.iter().map(|it| it.0).chain(near.iter().copied()).collect(),
        }
    }

    /// The same where areas have other indices; `None` if one of them is no more.
    pub(super) fn moved(&self, to: &BTreeMap<usize, usize>) -> Option<Touched> {
        let moved = |area: &usize| to.get(area).copied();
        Some(match self {
            Touched::Wall(area) => Touched::Wall(moved(area)?),
            Touched::Areas { stays, near } => {
                let stays = stays.iter().map(|(area, stays)| Some((moved(area)?, stays.clone())));
                let mut stays = stays.collect::<Option<Vec<_>>>()?;
                let mut near = near.iter().map(moved).collect::<Option<Vec<_>>>()?;
                stays.sort_by_key(|it| it.0);
                near.sort_unstable();
                Touched::Areas { stays, near }
            }
        })
    }
}

impl<'a> Obstacles<'a> {
    /// Those for a way that keeps this part of the margin.
    pub(super) fn new(trip: Trip, part: usize, among: Among<'a>) -> Obstacles<'a> {
        let Among { rule, asked, limits, entries, .. } = among;
        let level_m = trip.lands_from_m.unwrap_or(trip.to.height_m());
        let heights_m = [trip.from.height_m(), trip.to.height_m(), level_m, limits.least_height_m, limits.highest_m];
        let low_m = heights_m.into_iter().fold(f64::INFINITY, f64::min) - rule.vertical_margin_m;
        let high_m = heights_m.into_iter().fold(f64::NEG_INFINITY, f64::max) + rule.vertical_margin_m;
        let may_bar = |(index, area): (usize, &Area)| {
            let is_asked = may_open(area) && asked.contains(&index);
            !is_asked && area.touches_heights(low_m, high_m)
        };
        let may_bar = rule.areas.iter().enumerate().map(may_bar).collect();
        let is_forced_wall = |(area, entry): (&Area, &Entry)| *entry == Entry::Forced && is_wall(area);
        let stops_at_walls = !std::iter::zip(rule.areas, entries).any(is_forced_wall);
        Obstacles { among, trip, level_m, margin_m: MARGINS[part] * limits.margin_m, part, may_bar, stops_at_walls }
    }

    /// Whether the vehicle is at the height of the way where it begins.
    pub(super) fn begins_level(&self) -> bool {
        (self.trip.from.height_m() - self.level_m).abs() <= SAME_HEIGHT_M
    }

    /// Every zone that may be in the way.
    pub(super) fn all(&self) -> impl Iterator<Item = usize> {
        (0..self.may_bar.len()).filter(|it| self.may_bar[*it])
    }

    /// Whether a zone may be in the way: not where its permission is asked for before, nor far from all heights.
    pub(super) fn may_bar(&self, zone: usize) -> bool {
        self.may_bar[zone]
    }

    pub(super) fn area(&self, zone: usize) -> &'a Area {
        &self.among.rule.areas[zone]
    }

    /// The rings of a zone, grown by the margin: ways round it turn at their corners.
    pub(super) fn grown(&self, zone: usize) -> &'a [GrownRing] {
        self.among.map.grown(zone, self.part, self.margin_m)
    }

    /// Whether `point` is in an area, heights within the margin included.
    pub(super) fn covers(&self, zone: usize, point: Ned) -> bool {
        let (area, outline) = (self.area(zone), self.among.map.outline(zone));
        !stays_within(area, outline, point, point, self.among.rule.vertical_margin_m).is_empty()
    }

    /// How long the leg between two points takes.
    pub(super) fn time(&self, here: Ned, there: Ned) -> Duration {
        self.among.limits.speeds.time(here, there)
    }

    /// The ground over which the leg between two points is too low.
    pub(super) fn hills(&self, here: Ned, there: Ned) -> impl Iterator<Item = Hill> {
        let Trip { to, lands_from_m, .. } = self.trip;
        let named = lands_from_m.is_none().then_some(to);
        self.among.rule.ground.hills((here, there), named, self.among.limits)
    }

    /// What the leg between two points touches.
    pub(super) fn touched(&self, here: Ned, there: Ned, exempt: Exempt) -> Arc<Touched> {
        let look = || self.look(here, there, exempt);
        self.among.map.legs.get((here, there), self.margin_m, exempt, self.stops_at_walls, look)
    }

    /// What the leg touches, of all areas, so that it can be kept for other searches.
    fn look(&self, here: Ned, there: Ned, exempt: Exempt) -> Touched {
        let map = self.among.map;
        let (x, y) = (there.east_m - here.east_m, there.north_m - here.north_m);
        // From where on the way is beside the box of an area, times the square of the way's length.
        let begins = |zone: usize| {
            let bounds = map.outline(zone).bounds()?;
            let nearest = |along: f64, low: f64, high: f64| along * if 0.0 < along { low } else { high };
            Some(nearest(x, bounds.min().x, bounds.max().x) + nearest(y, bounds.min().y, bounds.max().y))
        };
        let mut close: Vec<(f64, usize)> =
            map.near(here, there, self.margin_m).filter_map(|zone| Some((begins(zone)?, zone))).collect();
        close.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (mut stays, mut near) = (Vec::new(), Vec::new());
        for (_, zone) in close {
            let Some(meeting) = self.meeting(zone, here, there, exempt) else { continue };
            if self.stops_at_walls && is_wall(self.area(zone)) {
                return Touched::Wall(zone);
            }
            match meeting {
                Meeting::Inside(inside) => stays.push((zone, inside)),
                Meeting::Near => near.push(zone),
            }
        }
        stays.sort_by_key(|it| it.0);
        near.sort_unstable();
        Touched::Areas { stays, near }
    }

    fn meeting(&self, zone: usize, here: Ned, there: Ned, exempt: Exempt) -> Option<Meeting> {
        let (area, vertical_m) = (self.area(zone), self.among.rule.vertical_margin_m);
        let (outline, kept_m) = (self.among.map.outline(zone), KEPT * self.margin_m);
        if outline.is_aside(kept_m, here, there) || !is_at_heights(area, here, there, vertical_m) {
            return None;
        }
        let inside = stays_within(area, outline, here, there, vertical_m);
        if !inside.is_empty() {
            return Some(Meeting::Inside(inside));
        }
        (!outline.keeps_clear(here, there, kept_m, exempt)).then_some(Meeting::Near)
    }
}

/// How a leg meets an area.
enum Meeting {
    Inside(Vec<Stay>),
    /// It passes nearer than the margin.
    Near,
}

/// Whether an area is closed at all times, whatever is asked for.
fn is_wall(area: &Area) -> bool {
    area.kind == AreaKind::KeepOut && area.always_applies()
}
