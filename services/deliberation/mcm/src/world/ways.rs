//! Ways without a plan, as the areas stand now: out of an area, to a place, and to ground where a landing is allowed.

use std::collections::BTreeSet;
use std::time::Duration;

use domain::airspace::{Grants, latest};
use domain::area::{Area, AreaKind};
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::harm::Harm;
use domain::mission::unfit_landing_site;
use domain::site::SiteKind;
use domain::way::{self, FlightLimits, Found, Leaving, MOST_LEGS, Surroundings};

use super::World;
use crate::journal::{Cause, Said};

/// A landing where the vehicle is goes this far aside, in seconds of flight, to come down where no area forbids it. (ENG: 4 % of
/// the battery; what is below 10 % lasts for more than two minutes.)
const FREE_GROUND_LIMIT_S: f64 = 60.0;

fn length_m(from: Ned, way: &[Ned]) -> f64 {
    std::iter::once(&from).chain(way).zip(way).map(|(a, b)| a.distance_m(*b)).sum()
}

/// What a vehicle does that must leave the areas in which it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum WayOut {
    /// It flies to these points; to none if it is in no such area.
    Flies(Vec<Ned>),
    Stays(Stay),
}

/// Why a vehicle does not fly out of the areas in which it must not be.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stay {
    pub(crate) why: String,
    /// For how long it would have to stay at least; `None`: the areas have no end.
    pub(crate) at_least: Option<Duration>,
}

impl World {
    /// How the vehicle leaves every area in which it must not be; `None` if its position is not known. A way that takes longer than
    /// the areas apply, or is longer than the configuration allows, is not flown; one that ends before a permission does may have
    /// any length.
    pub(crate) fn way_out(&self) -> Option<WayOut> {
        let here = self.seen.vehicle?.position;
        let leaving = self.time_to_leave_all(here);
        let (grants, limits) = (self.permits().to_enter(), &self.limits_in_wind());
        let airspace = self.airspace(&grants, self.setup.limits.leave_lead.saturating_add(leaving));
        let farthest_m = self.setup.limits.config.farthest_out_m.get();
        let may_be_flown = |way: &[Ned]| {
            let flight = Duration::try_from_secs_f64(limits.speeds.time_along_s(here, way)).unwrap_or(Duration::MAX);
            length_m(here, way) <= farthest_m || self.airspace(&grants, flight).trespassed(here).next().is_none()
        };
        Some(match way::leaving(here, &airspace, limits) {
            Leaving::Flies(way) if may_be_flown(&way) => WayOut::Flies(way),
            Leaving::Flies(way) => WayOut::Stays(Stay {
                why: format!("the way out is {:.0} m long, longer than {farthest_m:.0} m", length_m(here, &way)),
                at_least: airspace.trespass_ends(here),
            }),
            Leaving::Stays { ends, way } => WayOut::Stays(Stay {
                why: format!("the way out takes {} s, and the area is over in {} s", way.as_secs(), ends.as_secs()),
                at_least: Some(ends),
            }),
            Leaving::NoWay => WayOut::Stays(Stay {
                why: "no way out that may be flown".to_owned(),
                // A permission or a window may open one at any moment.
                at_least: Some(Duration::ZERO),
            }),
        })
    }

    /// Why the vehicle must not be sent to land at `site`, by a flag, or an area that applies when it arrives there; the end of a
    /// sentence that begins with the place.
    pub(super) fn unfit_to_land(&self, site: Ned) -> Option<String> {
        if let Some(flag) = self.landing_forbidden_by(site) {
            return Some(format!("is one where no landing begins while `{flag}` is up"));
        }
        let here = self.seen.vehicle?.position;
        let (grants, limits) = (self.permits().to_enter(), &self.flight_limits());
        let airspace = self.airspace(&grants, self.setup.limits.leave_lead);
        let over = site.at_height(self.planner.mission.ground.approach_m(here, site, limits));
        let flight_s = limits.speeds.time_along_s(here, &[over, site]);
        let arrival = latest(Duration::try_from_secs_f64(flight_s).unwrap_or(Duration::MAX));
        let applies = |area: &&Area| airspace.applies(area).is_some_and(|(opens, _)| opens <= arrival);
        unfit_landing_site(site, self.planner.areas().iter().filter(applies))
    }

    /// The points to fly to, the last one over ground where no area forbids to land, and that harms no more than this; empty if that is
    /// here, `None` if there is none within [`FREE_GROUND_LIMIT_S`].
    pub(super) fn way_to_ground(&self, accepts: Harm) -> Option<Vec<Ned>> {
        let way = self.ground_aside(accepts)?;
        let flight_s = self.limits_in_wind().speeds.time_along_s(self.seen.vehicle?.position, &way);
        (flight_s <= FREE_GROUND_LIMIT_S).then_some(way)
    }

    /// The same to ground that harms nothing, as far as the battery suffices, and no farther than out of an area.
    pub(super) fn way_to_ground_far_off(&self) -> Option<Vec<Ned>> {
        let (here, way) = (self.seen.vehicle?.position, self.ground_aside(Harm::NONE)?);
        let is_near = length_m(here, &way) <= self.setup.limits.config.farthest_out_m.get();
        (is_near && self.battery_suffices(here, &way)).then_some(way)
    }

    fn ground_aside(&self, accepts: Harm) -> Option<Vec<Ned>> {
        let grants = self.permits().to_land();
        let airspace = self.airspace(&grants, self.setup.limits.leave_lead);
        way::way_to_ground(self.seen.vehicle?.position, accepts, &airspace, &self.limits_in_wind())
    }

    /// Whether the battery suffices to land at the end of `way`, before a row lands where the vehicle is.
    fn battery_suffices(&self, here: Ned, way: &[Ned]) -> bool {
        let (Some(charge), Some(end)) = (self.seen.vehicle.and_then(|it| it.charge), way.last()) else { return false };
        let ground_m = self.planner.mission.ground.height_m(*end);
        let flown: Vec<Ned> = way.iter().copied().chain([end.at_height(ground_m.min(end.height_m()))]).collect();
        let energy = self.energy();
        let needs_wh = energy.landing_flight_wh(here, &flown, &self.limits_in_wind().speeds, self.wind());
        self.holds_in_wind() && needs_wh <= energy.budget_above(charge, self.setup.table.lands_below()).usable_wh
    }

    pub(super) fn areas_that_forbid_landing(&self, here: Ned) -> Vec<String> {
        let barred = self.airspace(&self.permits().grants, self.setup.limits.leave_lead).barred(Duration::ZERO);
        barred.into_iter().filter(|it| it.is_at_or_below(here)).map(|it| it.name.clone()).collect()
    }

    /// The permissions without which there is no way to `to`, if there is one with them.
    pub(super) fn needed_for_way(&self, to: Ned) -> BTreeSet<String> {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else { return BTreeSet::new() };
        let permits = self.permits();
        let held = permits.to_enter();
        let limits = self.flight_limits();
        let found = self.surroundings(&held, &limits, SiteKind::Landing).way_if_granted(here, to, MOST_LEGS);
        let mut needs = found.way.map(|it| it.needs).unwrap_or_default();
        // What a flag forbids is waited for, not asked for.
        needs.retain(|area| !permits.is_only_forbidden(area));
        needs
    }

    /// Asks for the permissions without which there is no way to `to`, if that is why there is none.
    pub(super) fn ask_for_way(&mut self, to: Ned) {
        let barred = self.needed_for_way(to);
        let by = self.needed_by();
        for area in &barred {
            if self.permissions.renew(self.now.time, area, by, &mut self.out.outbox) {
                let text = format!("asking for area {area}, which the only way leads through");
                let said = Said::new("permission", DecisionKind::PermissionAsked, text);
                self.record(said.about_area(area).led_to_by(Cause::Response));
            }
        }
    }

    /// The points to fly to, the last one over `to`; `None` if there is no way.
    pub(crate) fn way_to(&self, to: Ned) -> Option<Vec<Ned>> {
        self.way_within((to, SiteKind::Landing), MOST_LEGS).way
    }

    /// The same with limited effort.
    pub(crate) fn way_within(&self, (to, kind): (Ned, SiteKind), most_legs: u32) -> Found<Vec<Ned>> {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else { return Found { way: None, legs: 0 } };
        let (grants, limits) = (self.permits().to_enter(), self.flight_limits());
        self.surroundings(&grants, &limits, kind).way_within(here, to, most_legs)
    }

    /// What ways without a plan are searched among, to a place of this kind.
    pub(super) fn surroundings<'a>(
        &'a self,
        grants: &'a Grants,
        limits: &'a FlightLimits,
        ends_at: SiteKind,
    ) -> Surroundings<'a> {
        let airspace = self.airspace(grants, self.setup.limits.leave_lead);
        Surroundings { airspace, map: self.planner.mission.areas().map(), limits, ends_at }
    }

    /// `why`, and what is in the way to `site`.
    pub(crate) fn why_no_way(&self, why: &str, site: Ned) -> String {
        self.what_closes_the_way(site).map_or_else(|| why.to_owned(), |closed| format!("{why}, {closed}"))
    }

    /// Whether what closes the straight way to `site` may be over in time: a permission may come at any moment, a keep-out area ends as it says.
    pub(super) fn may_open_within(&self, site: Ned, limit: Duration) -> bool {
        let Some(here) = self.seen.vehicle.map(|it| it.position) else { return true };
        let over = site.at_height(here.height_m());
        let breach = self.breach_on_way(here, over, self.flight_limits().speeds.cruise_m_s);
        let area = breach.and_then(|breach| self.planner.areas().iter().find(|it| it.name == breach.area));
        let Some(area) = area.filter(|it| it.kind == AreaKind::KeepOut) else { return true };
        let latest_ms = self.now.utc_ms + self.setup.limits.pace.to_wall(limit).as_millis() as i64;
        let ends_ms = area.windows_after(self.now.utc_ms).next().and_then(|(_, ends_ms)| ends_ms);
        ends_ms.is_some_and(|it| it <= latest_ms)
    }

    /// What is in the way to `site`, straight from where the vehicle is, and for how long it is closed.
    fn what_closes_the_way(&self, site: Ned) -> Option<String> {
        let here = self.seen.vehicle?.position;
        let breach =
            self.breach_on_way(here, site.at_height(here.height_m()), self.flight_limits().speeds.cruise_m_s)?;
        let name = &breach.area;
        if let Some(row) = self.narrowing().no_new_area.filter(|_| self.permits().grants.contains_key(name)) {
            return Some(format!("area {name} is not entered while `{}` is up", self.flags.name(row)));
        }
        let area = self.planner.areas().iter().find(|it| it.name == *name)?;
        let now_ms = self.now.utc_ms;
        let ends_ms = area.windows_after(now_ms).next().and_then(|(_, ends_ms)| ends_ms);
        Some(match (area.kind, ends_ms.and_then(|ends_ms| u64::try_from(ends_ms.saturating_sub(now_ms)).ok())) {
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
