//! What a straight leg has to do with the areas, whatever the time.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::airspace::{Stay, is_at_heights, stays};
use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::way::{Exempt, KEPT, keeps_clear};
use geo::{BoundingRect, Coord, Intersects, Line, Rect};
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use super::Among;

/// The areas that may be in the way from a start to a goal.
pub(super) struct Obstacles<'a> {
    pub(super) among: Among<'a>,
    pub(super) from: Ned,
    pub(super) to: Ned,
    /// Distance kept to the borders of the areas, in metres.
    pub(super) margin_m: f64,
    /// By their index, each with the rectangle outside of which a leg keeps the margin from it.
    bounds: BTreeMap<usize, Rect<f64>>,
    /// The same, to be found by place.
    zones: RTree<Placed>,
}

/// The rectangle of a zone, with its index.
type Placed = GeomWithData<Rectangle<[f64; 2]>, usize>;

/// A leg, with what it touches.
pub(super) struct Leg {
    pub(super) time: Duration,
    /// Zones whose inside it touches.
    pub(super) stays: Vec<(usize, Vec<Stay>)>,
    /// Zones that it passes nearer than the margin.
    pub(super) near: Vec<usize>,
}

impl<'a> Obstacles<'a> {
    pub(super) fn new(from: Ned, to: Ned, margin_m: f64, among: Among<'a>) -> Obstacles<'a> {
        let Among { airspace, asked, config, .. } = among;
        let low_m = from.height_m().min(to.height_m()).min(config.least_height_m.get());
        let high_m = from.height_m().max(to.height_m()).max(config.highest_m.get());
        let vertical_m = airspace.rule.vertical_margin_m;
        let may_bar = |zone: usize| {
            let area = airspace.zones[zone].area;
            let is_asked = area.kind == AreaKind::Permission && asked.contains(&zone);
            let touches = area.touches_heights(low_m - vertical_m, high_m + vertical_m);
            (!is_asked && touches).then(|| Some((zone, bounds(area, margin_m)?)))?
        };
        let bounds: BTreeMap<usize, Rect<f64>> = (0..airspace.zones.len()).filter_map(may_bar).collect();
        let corners = |it: &Rect<f64>| Rectangle::from_corners([it.min().x, it.min().y], [it.max().x, it.max().y]);
        let placed = bounds.iter().map(|(zone, it)| Placed::new(corners(it), *zone)).collect();
        Obstacles { among, from, to, margin_m, bounds, zones: RTree::bulk_load(placed) }
    }

    /// Every zone that may be in the way.
    pub(super) fn all(&self) -> BTreeSet<usize> {
        self.bounds.keys().copied().collect()
    }

    pub(super) fn area(&self, zone: usize) -> &'a Area {
        self.among.airspace.zones[zone].area
    }

    /// The leg between two points.
    pub(super) fn leg(&self, here: Ned, there: Ned, exempt: Exempt) -> Leg {
        let time = self.among.config.speeds().time(here, there);
        let mut leg = Leg { time, stays: Vec::new(), near: Vec::new() };
        let line = Line::new((here.east_m, here.north_m), (there.east_m, there.north_m));
        let around = AABB::from_corners([here.east_m, here.north_m], [there.east_m, there.north_m]);
        let mut close: Vec<usize> = self.zones.locate_in_envelope_intersecting(&around).map(|it| it.data).collect();
        close.sort_unstable();
        for zone in close {
            match self.meeting(zone, &line, here, there, exempt) {
                None => {}
                Some(Meeting::Inside(stays)) => leg.stays.push((zone, stays)),
                Some(Meeting::Near) => leg.near.push(zone),
            }
        }
        leg
    }

    fn meeting(&self, zone: usize, line: &Line, here: Ned, there: Ned, exempt: Exempt) -> Option<Meeting> {
        if !self.bounds.get(&zone)?.intersects(line) {
            return None;
        }
        let (area, vertical_m) = (self.area(zone), self.among.airspace.rule.vertical_margin_m);
        let inside = stays(area, here, there, vertical_m);
        if !inside.is_empty() {
            return Some(Meeting::Inside(inside));
        }
        let is_near = is_at_heights(area, here, there, vertical_m)
            && !keeps_clear(area, here, there, KEPT * self.margin_m, exempt);
        is_near.then_some(Meeting::Near)
    }
}

/// How a leg meets an area.
enum Meeting {
    Inside(Vec<Stay>),
    /// It passes nearer than the margin.
    Near,
}

/// The rectangle around `area` and the margin.
fn bounds(area: &Area, margin_m: f64) -> Option<Rect<f64>> {
    let around = area.polygon().bounding_rect()?;
    let margin = Coord { x: margin_m, y: margin_m };
    Some(Rect::new(around.min() - margin, around.max() + margin))
}
