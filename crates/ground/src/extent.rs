//! Rectangles of latitudes and longitudes.

use domain::geodesy::LatLon;

/// In degrees, a tenth of a millimetre: borders that are this near to each other are one.
const SAME_DEG: f64 = 1e-9;

/// Degrees; borders belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    pub(crate) south: f64,
    pub(crate) north: f64,
    pub(crate) west: f64,
    pub(crate) east: f64,
}

impl Extent {
    /// What holds all of `corners`, a little wider: two parts if they lie on both sides of the antimeridian, none without a corner.
    pub(crate) fn of(corners: &[LatLon]) -> Vec<Extent> {
        let around = |it: &mut dyn Iterator<Item = f64>| {
            it.fold(None, |found: Option<[f64; 2]>, degrees| {
                let [low, high] = found.unwrap_or([degrees; 2]);
                Some([low.min(degrees), high.max(degrees)])
            })
        };
        let longitudes = |are_east: bool| {
            let it = corners.iter().map(|it| it.longitude_deg()).filter(move |it| (0.0 <= *it) == are_east);
            around(&mut { it })
        };
        let Some([south, north]) = around(&mut corners.iter().map(|it| it.latitude_deg())) else { return Vec::new() };
        let ranges = match (longitudes(false), longitudes(true)) {
            // The short way round, as corners of areas are meant.
            (Some([west, west_end]), Some([east_begin, east])) if 180.0 < east - west => {
                vec![[-180.0, west_end], [east_begin, 180.0]]
            }
            (Some([west, _]), Some([_, east])) => vec![[west, east]],
            (one, other) => one.or(other).into_iter().collect(),
        };
        let wider = |[west, east]: [f64; 2]| Extent {
            south: south - SAME_DEG,
            north: north + SAME_DEG,
            west: west - SAME_DEG,
            east: east + SAME_DEG,
        };
        ranges.into_iter().map(wider).collect()
    }

    pub(crate) fn contains(self, at: LatLon) -> bool {
        let (latitude, longitude) = (at.latitude_deg(), at.longitude_deg());
        self.south <= latitude + SAME_DEG
            && latitude - SAME_DEG <= self.north
            && self.west <= longitude + SAME_DEG
            && longitude - SAME_DEG <= self.east
    }

    pub(crate) fn intersection(self, other: Extent) -> Option<Extent> {
        let common = Extent {
            south: self.south.max(other.south),
            north: self.north.min(other.north),
            west: self.west.max(other.west),
            east: self.east.min(other.east),
        };
        (common.south < common.north && common.west < common.east).then_some(common)
    }

    /// The rest without `inside`, a part of this. What is thinner than the rim that [`Extent::of`] adds is left away.
    pub(crate) fn without(self, inside: Extent) -> impl Iterator<Item = Extent> {
        let parts = [
            Extent { south: inside.north, ..self },
            Extent { north: inside.south, ..self },
            Extent { south: inside.south, north: inside.north, east: inside.west, ..self },
            Extent { south: inside.south, north: inside.north, west: inside.east, ..self },
        ];
        // Of a place or a line the rim is on both sides.
        let is_wide = |it: &Extent| 1.5 * SAME_DEG < (it.north - it.south).min(it.east - it.west);
        parts.into_iter().filter(is_wide)
    }
}
