//! Ways without a plan, as the areas stand now: out of an area, to a place, and to ground where a landing is allowed.

use std::collections::BTreeSet;
use std::time::Duration;

use domain::airspace::{Grants, latest, stays};
use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::way;

use super::World;

/// A landing where the vehicle is goes this far aside, in seconds of flight, to come down where no area forbids it. (ENG: 4 % of
/// the battery; what is below 10 % lasts for more than two minutes.)
const FREE_GROUND_LIMIT_S: f64 = 60.0;

impl World {
    /// The points to fly to, to leave every area in which the vehicle must not be; empty if it is in none, `None` if
    /// there is no way out.
    pub(crate) fn way_out(&self) -> Option<Vec<Ned>> {
        let here = self.vehicle?.position;
        let leaving = self.areas_around(here).map(|area| self.time_to_leave(area, here)).max().unwrap_or_default();
        let grants = self.grants();
        way::way_out(here, &self.airspace(&grants, self.limits.leave_lead + leaving), &self.limits.flight)
    }

    /// The points to fly to, the last one over ground where no area forbids to land; empty if that is here, `None` if there is none
    /// within [`FREE_GROUND_LIMIT_S`].
    pub(crate) fn way_to_free_ground(&self) -> Option<Vec<Ned>> {
        let here = self.vehicle?.position;
        let grants = self.grants();
        let way = way::way_to_free_ground(here, &self.airspace(&grants, self.limits.leave_lead), &self.limits.flight)?;
        (self.limits.flight.time_along_s(here, &way) <= FREE_GROUND_LIMIT_S).then_some(way)
    }

    /// Records which areas forbid a landing where the vehicle is, and whether it flies aside first.
    pub(crate) fn say_what_forbids_landing(&mut self, flies_aside: bool) {
        let Some(here) = self.vehicle.map(|it| it.position) else { return };
        let grants = self.grants();
        let barred = self.airspace(&grants, self.limits.leave_lead).barred(Duration::ZERO);
        let below = barred.into_iter().filter(|it| it.is_at_or_below(here)).map(|it| it.name.as_str());
        let areas = below.collect::<Vec<_>>().join(", ");
        let text = match (areas.is_empty(), flies_aside) {
            (true, true) => "no landing here: an area below is about to apply; flies aside first".to_owned(),
            (false, true) => format!("no landing here, in or over {areas}: flies aside first"),
            (true, false) => format!("no free ground within {FREE_GROUND_LIMIT_S} s: lands where it is"),
            (false, false) => {
                format!("no free ground within {FREE_GROUND_LIMIT_S} s: lands where it is, in or over {areas}")
            }
        };
        self.say("contingency", text);
    }

    /// Asks for the permissions without which there is no way to `to`, if that is why there is none; returns whether an
    /// answer may still come.
    pub(super) fn ask_for_way(&mut self, to: Ned, preferred_height_m: f64) -> bool {
        let Some(here) = self.vehicle.map(|it| it.position) else { return false };
        let held = self.grants();
        let all: Grants = self.planner.areas().iter().map(|it| (it.name.clone(), Duration::MAX)).collect();
        let with_all = self.airspace(&all, self.limits.leave_lead);
        let Some(way) = way::way_to(here, to, preferred_height_m, &with_all, &self.limits.flight) else { return false };
        let points: Vec<Ned> = std::iter::once(here).chain(way).chain([to]).collect();
        let is_on_way = |area: &&Area| {
            let margin_m = self.limits.vertical_margin_m;
            area.kind == AreaKind::Permission
                && points.windows(2).any(|it| !stays(area, it[0], it[1], margin_m).is_empty())
        };
        let airspace = self.airspace(&held, self.limits.leave_lead);
        let flight =
            Duration::try_from_secs_f64(self.limits.flight.time_along_s(here, &points[1..])).unwrap_or(Duration::MAX);
        let barred: BTreeSet<String> =
            airspace.barred(latest(flight)).into_iter().filter(is_on_way).map(|it| it.name.clone()).collect();
        let by = self.needed_by();
        for area in &barred {
            if self.permissions.renew(self.now.time, area, by, &self.limits, &mut self.outbox) {
                self.say("permission", format!("asking for area {area}, which the only way leads through"));
            }
        }
        !barred.is_empty()
    }

    /// The points to fly to, the last one over `to`, preferably at this height; `None` if there is no way.
    pub(crate) fn way_to(&self, to: Ned, preferred_height_m: f64) -> Option<Vec<Ned>> {
        let here = self.vehicle?.position;
        let grants = self.grants();
        let airspace = self.airspace(&grants, self.limits.leave_lead);
        way::way_to(here, to, preferred_height_m, &airspace, &self.limits.flight)
    }

    /// What is in the way to `site`, straight from where the vehicle is, and for how long it is closed.
    pub(super) fn what_closes_the_way(&self, site: Ned) -> Option<String> {
        let here = self.vehicle?.position;
        let breach = self.breach_on_way(here, site.at_height(here.height_m()), self.limits.flight.speed_m_s)?;
        let name = &breach.area;
        let area = self.planner.areas().iter().find(|it| it.name == *name)?;
        Some(match (area.kind, area.until_utc_ms.and_then(|until| u64::try_from(until - self.now.utc_ms).ok())) {
            (AreaKind::KeepOut, Some(left_ms)) => {
                format!("keep-out area {name} is closed for {} s more", left_ms / 1000)
            }
            (AreaKind::KeepOut, None) => format!("keep-out area {name} is closed"),
            (AreaKind::Permission, Some(left_ms)) => {
                format!("area {name} is closed without permission for {} s more", left_ms / 1000)
            }
            (AreaKind::Permission, None) => format!("area {name} is closed without permission"),
        })
    }
}
