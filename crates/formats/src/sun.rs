//! When the sun rises and sets, for schedules that name no hour.
//!
//! The equations are those of the NOAA Global Monitoring Division's solar calculator ("General Solar Position Calculations"), after
//! Meeus, Astronomical Algorithms; they are within two minutes of an almanac below 72 degrees of latitude.

use std::f64::consts::TAU;

use domain::geodesy::LatLon;

use crate::content::{Outline, Window};

const DAY_MS: i64 = 86_400_000;
/// For hills at the horizon, and what the equations are off, in minutes. (ENG)
const MARGIN_MIN: f64 = 10.0;
/// Farther from Greenwich the day of the sun and the day of UTC are not the same, in degrees.
const FARTHEST_DEG: f64 = 90.0;

/// What a schedule names in place of an hour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    /// `BMCT`: the morning's civil twilight begins.
    Dawn,
    /// `SR`.
    Sunrise,
    /// `SS`.
    Sunset,
    /// `EMCT`: the evening's civil twilight ends.
    Dusk,
}

impl Event {
    /// Their names in ED-269 and ED-318.
    pub(crate) const NAMES: [(&'static str, Event); 4] =
        [("BMCT", Event::Dawn), ("SR", Event::Sunrise), ("SS", Event::Sunset), ("EMCT", Event::Dusk)];

    /// Of the sun's middle, from straight above: with refraction and the half of its disc, and for civil twilight.
    fn zenith_deg(self) -> f64 {
        match self {
            Event::Sunrise | Event::Sunset => 90.833,
            Event::Dawn | Event::Dusk => 96.0,
        }
    }

    /// The minute of the day in UTC; `None`: it does not happen on that day.
    fn minute(self, at: LatLon, day_of_year: f64) -> Option<f64> {
        let year = TAU / 365.0 * (day_of_year - 1.0);
        let (sin, cos) = year.sin_cos();
        let (sin2, cos2) = (2.0 * year).sin_cos();
        let (sin3, cos3) = (3.0 * year).sin_cos();
        let equation_min =
            229.18 * (0.000_075 + 0.001_868 * cos - 0.032_077 * sin - 0.014_615 * cos2 - 0.040_849 * sin2);
        let declination = 0.006_918 - 0.399_912 * cos + 0.070_257 * sin - 0.006_758 * cos2 + 0.000_907 * sin2
            - 0.002_697 * cos3
            + 0.001_48 * sin3;
        let latitude = at.latitude_deg().to_radians();
        let hour_angle = self.zenith_deg().to_radians().cos() / (latitude.cos() * declination.cos())
            - latitude.tan() * declination.tan();
        let turn_deg = Some(hour_angle).filter(|it| it.abs() < 1.0)?.acos().to_degrees();
        let before_noon = matches!(self, Event::Dawn | Event::Sunrise);
        let turn_deg = if before_noon { turn_deg } else { -turn_deg };
        Some(720.0 - 4.0 * (at.longitude_deg() + turn_deg) - equation_min)
    }

    /// The earliest and the latest minute of the day in UTC at which it happens at one of these places on one of the days of the
    /// window; `None`: that cannot be said.
    pub(crate) fn minutes(self, places: &[LatLon], window: Window) -> Option<(i64, i64)> {
        if places.iter().any(|it| FARTHEST_DEG < it.longitude_deg().abs()) {
            return None;
        }
        let mut minutes = Vec::new();
        for day in days(window) {
            for place in places {
                minutes.push(self.minute(*place, day)?);
            }
        }
        let first = minutes.iter().copied().reduce(f64::min)? - MARGIN_MIN;
        let last = minutes.iter().copied().reduce(f64::max)? + MARGIN_MIN;
        Some((first.floor() as i64, last.ceil() as i64))
    }
}

/// The days of the year in a window; all of them if it has no end, or is longer than a year.
fn days(window: Window) -> Vec<f64> {
    let of_year = |ms: i64| {
        // Two days at most off after a century: that is within the margin but for the far north.
        let day = (ms as f64 / DAY_MS as f64).rem_euclid(365.2425);
        day.floor() + 1.0
    };
    match (window.from_utc_ms, window.until_utc_ms) {
        (Some(from), Some(until)) if (until - from) / DAY_MS < 365 => {
            (from / DAY_MS - 1..=until / DAY_MS + 1).map(|day| of_year(day * DAY_MS)).collect()
        }
        _ => (1..=365).map(f64::from).collect(),
    }
}

/// Places between which the sun rises and sets earliest and latest over these outlines: the corners of the box round each.
pub(crate) fn places<'a>(outlines: impl Iterator<Item = &'a Outline>) -> Vec<LatLon> {
    let mut places = Vec::new();
    for outline in outlines {
        let corners = match outline {
            Outline::Polygon { border, .. } => border.clone(),
            Outline::Circle { centre, .. } => vec![*centre],
        };
        let range = |of: fn(&LatLon) -> f64| {
            let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
            corners.iter().map(of).fold((low, high), |(low, high), it| (low.min(it), high.max(it)))
        };
        let (south, north) = range(|it| it.latitude_deg());
        let (west, east) = range(|it| it.longitude_deg());
        let corner = |latitude, longitude| LatLon::new(latitude, longitude).ok();
        places.extend(
            [corner(south, west), corner(south, east), corner(north, west), corner(north, east)].into_iter().flatten(),
        );
    }
    places
}
