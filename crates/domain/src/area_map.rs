//! What of a mission's areas does not depend on the time, kept between searches of ways: their outlines, where they lie, the rings
//! grown by the margin at whose corners ways turn, and the legs that were looked at.
//!
//! It only ever remembers what would be computed again, so a process that has kept one answers as one that has not.

use std::cell::OnceCell;
use std::collections::BTreeMap;

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree, RTreeObject, SelectionFunction};

use crate::airspace::{Airspace, drift_m};
use crate::area::Area;
use crate::corners::{GrownRing, grown};
use crate::geometry::Ned;
use crate::outline::Outline;
use crate::way::KeptLegs;

/// The areas, to be asked for by their index.
#[derive(Debug, Clone, Default)]
pub struct AreaMap {
    areas: Vec<MappedArea>,
    /// To be found by place.
    placed: RTree<Placed>,
    /// The legs that were looked at, with what they touch.
    pub(crate) legs: KeptLegs,
}

/// The bounding box of an area, with its index. The first coordinate is east, the second one north.
type Placed = GeomWithData<Rectangle<[f64; 2]>, usize>;

#[derive(Debug, Clone)]
struct MappedArea {
    area: Area,
    outline: Outline,
    /// Its rings, grown by the margins of [`MARGINS`], in the same order.
    grown: [OnceCell<Vec<GrownRing>>; 2],
}

/// The distances to borders that a way is searched with, in parts of the margin: where no way keeps the margin, half is
/// tried, since two areas may be that close to each other.
pub(crate) const MARGINS: [f64; 2] = [1.0, 0.5];

impl AreaMap {
    /// A map of `areas`.
    pub fn new(areas: &[Area]) -> AreaMap {
        let areas: Vec<MappedArea> = areas.iter().map(MappedArea::new).collect();
        AreaMap { placed: placed(&areas), areas, legs: KeptLegs::default() }
    }

    /// Becomes a map of `areas`. Of those that are as they were, what is known stays known; legs near any other are forgotten.
    pub fn update(&mut self, areas: &[Area]) {
        if self.areas.len() == areas.len() && std::iter::zip(&self.areas, areas).all(|(old, new)| old.area == *new) {
            return;
        }
        let count = self.areas.len();
        let mut old: BTreeMap<String, (usize, MappedArea)> =
            self.areas.drain(..).enumerate().map(|(index, it)| (it.area.name.clone(), (index, it))).collect();
        if old.len() != count {
            // Two of one name cannot be told apart.
            return *self = AreaMap::new(areas);
        }
        let mut moved_to = BTreeMap::new();
        let mut changed: Vec<Outline> = Vec::new();
        for (index, area) in areas.iter().enumerate() {
            let known = old.remove(&area.name);
            self.areas.push(match known {
                Some((before, known)) if known.area == *area => {
                    moved_to.insert(before, index);
                    known
                }
                other => {
                    let new = MappedArea::new(area);
                    changed.extend(other.map(|(_, it)| it.outline));
                    changed.push(new.outline.clone());
                    new
                }
            });
        }
        changed.extend(old.into_values().map(|(_, it)| it.outline));
        self.placed = placed(&self.areas);
        self.legs.forget_near(&changed, &moved_to);
    }

    /// The outline of an area.
    pub(crate) fn outline(&self, area: usize) -> &Outline {
        &self.areas[area].outline
    }

    /// The rings of an area, grown by `margin_m`, which is that part of the margin.
    pub(crate) fn grown(&self, area: usize, part: usize, margin_m: f64) -> &[GrownRing] {
        let MappedArea { area, grown: kept, .. } = &self.areas[area];
        kept[part].get_or_init(|| grown(area, margin_m))
    }

    /// The areas whose bounding box is no farther than `distance_m` from the straight way, in no order.
    pub fn near(&self, from: Ned, to: Ned, distance_m: f64) -> impl Iterator<Item = usize> {
        self.placed.locate_with_selection_function(Along::new(from, to, distance_m)).map(|it| it.data)
    }

    /// The areas that the straight way may touch, in the mission's order.
    pub fn along(&self, from: Ned, to: Ned) -> Vec<usize> {
        let mut found: Vec<usize> = self.near(from, to, drift_m(from, to)).collect();
        found.sort_unstable();
        found
    }

    /// Whether a vehicle in the air at `point` must leave one of the areas now, by a `rule` for the same ones.
    pub fn is_trespassed(&self, rule: &Airspace, point: Ned) -> bool {
        let alone = |area: usize| Airspace { areas: &rule.areas[area..=area], ..*rule };
        self.along(point, point).into_iter().any(|it| alone(it).trespassed(point).next().is_some())
    }
}

impl MappedArea {
    fn new(area: &Area) -> MappedArea {
        MappedArea { area: area.clone(), outline: Outline::new(area), grown: Default::default() }
    }
}

fn placed(areas: &[MappedArea]) -> RTree<Placed> {
    let place = |(index, it): (usize, &MappedArea)| {
        let bounds = it.outline.bounds()?;
        let (low, high) = (bounds.min(), bounds.max());
        Some(Placed::new(Rectangle::from_corners([low.x, low.y], [high.x, high.y]), index))
    };
    RTree::bulk_load(areas.iter().enumerate().filter_map(place).collect())
}

/// Selects the boxes that a straight way comes near to.
struct Along {
    centre: [f64; 2],
    /// From the centre of the way to its end.
    half: [f64; 2],
    distance_m: f64,
}

impl Along {
    fn new(from: Ned, to: Ned, distance_m: f64) -> Along {
        let (a, b) = ([from.east_m, from.north_m], [to.east_m, to.north_m]);
        let each = |of: fn(f64, f64) -> f64| [of(a[0], b[0]), of(a[1], b[1])];
        Along { centre: each(|a, b| (a + b) / 2.0), half: each(|a, b| (b - a) / 2.0), distance_m }
    }

    /// By the axes of the box and the one across the way (separating axis theorem: Gottschalk, Lin and Manocha, OBBTree, SIGGRAPH
    /// 1996).
    fn touches(&self, envelope: &AABB<[f64; 2]>) -> bool {
        /// Rounding: a thousandth of a millimetre.
        const ROUNDING_M: f64 = 1e-6;
        let (low, high) = (envelope.lower(), envelope.upper());
        let reach_m = self.distance_m + ROUNDING_M;
        let extent = [0, 1].map(|axis| (high[axis] - low[axis]) / 2.0 + reach_m);
        let apart = [0, 1].map(|axis| self.centre[axis] - (high[axis] + low[axis]) / 2.0);
        let [x, y] = self.half;
        apart[0].abs() <= extent[0] + x.abs()
            && apart[1].abs() <= extent[1] + y.abs()
            && (x * apart[1] - y * apart[0]).abs() <= x.abs() * extent[1] + y.abs() * extent[0]
    }
}

impl SelectionFunction<Placed> for Along {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; 2]>) -> bool {
        self.touches(envelope)
    }

    fn should_unpack_leaf(&self, leaf: &Placed) -> bool {
        self.touches(&leaf.envelope())
    }
}
