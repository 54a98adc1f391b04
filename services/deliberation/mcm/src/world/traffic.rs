//! Other traffic: where what stands is not flown, and how what comes near is kept out of the way of.

use std::time::Duration;

use domain::area::Area;
use domain::contingency::group::Group;
use domain::geometry::Ned;
use domain::traffic::{Evasion, Mover, evade};
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;

use super::World;

/// What stands is taken to stand for this long yet, in mission time; told again after half of that time. (ENG: a plan waits for its end, and
/// for no end that is later than `hold_at_most_s` of [planner]; once the traffic is gone it is made again.)
const STANDS_ON: Duration = Duration::from_secs(100);

#[derive(Debug, Default)]
pub(super) struct SeenTraffic {
    near: Vec<Mover>,
    told: Vec<v1::Area>,
    occupied: Vec<Area>,
}

impl SeenTraffic {
    pub(super) fn hear(&mut self, introspection: &mut v1::Introspection) -> Result<(), InvalidMessage> {
        let near = std::mem::take(&mut introspection.traffic);
        self.near = near.into_iter().map(Mover::try_from).collect::<Result<_, _>>()?;
        // A hundred times a second, and mostly the same.
        if introspection.occupied != self.told {
            let told = std::mem::take(&mut introspection.occupied);
            self.occupied = told.iter().cloned().map(Area::try_from).collect::<Result<_, _>>()?;
            self.told = told;
        }
        Ok(())
    }
}

impl World {
    /// Keeps out of what is taken by traffic that stands, as out of any area.
    pub(super) fn watch_traffic(&mut self) {
        let taken = &self.planner.mission.taken;
        let occupied = &self.seen.traffic.occupied;
        if taken.is_empty() && occupied.is_empty() {
            return;
        }
        let ms = |mission: Duration| self.setup.limits.pace.to_wall(mission).as_millis() as i64;
        let (until_ms, renewed_ms) = (self.now.utc_ms + ms(STANDS_ON), self.now.utc_ms + ms(STANDS_ON / 2));
        let is_same = |it: &Area, known: &Area| *it == Area { until_utc_ms: None, ..known.clone() };
        let lasts = |known: &Area| known.until_utc_ms.is_some_and(|it| renewed_ms < it);
        let is_known = |it: &Area| taken.iter().any(|known| is_same(it, known) && lasts(known));
        if taken.len() == occupied.len() && occupied.iter().all(is_known) {
            return;
        }
        let was_taken = |it: &&Area| taken.iter().any(|known| known.name == it.name);
        let begin = occupied.iter().filter(|it| !was_taken(it)).map(|it| format!("nothing enters {}", it.name));
        let is_taken = |it: &&Area| occupied.iter().any(|other| other.name == it.name);
        let end = taken.iter().filter(|it| !is_taken(it)).map(|it| format!("{} is free", it.name));
        let said: Vec<String> = begin.chain(end).collect();
        let taken = occupied.iter().map(|it| Area { until_utc_ms: Some(until_ms), ..it.clone() }).collect();
        self.planner.mission.take(taken);
        self.watch.airspace.invalidate();
        said.into_iter().for_each(|it| self.say("traffic", it));
    }

    /// How the vehicle keeps out of the way of what comes near; `chosen` before. `None`: its position is not known.
    pub(crate) fn evasion(&self, chosen: Option<Evasion>) -> Option<Evasion> {
        let here = self.seen.vehicle?.position;
        if self.doubts_position() {
            // It would fly by a place that is not believed.
            return Some(Evasion::Stay);
        }
        let limits = self.limits_in_wind();
        let lowest_m = self.planner.mission.ground.height_m(here) + limits.least_height_m;
        let may_fly = |to| self.is_clear(here, to) && self.breach_towards(to, limits.speeds.cruise_m_s).is_none();
        let may_land = self.areas_that_forbid_landing(here).is_empty() && self.landing_forbidden_by(here).is_none();
        Some(evade(here, &self.seen.traffic.near, &limits.speeds, lowest_m, chosen, may_fly, may_land))
    }

    /// Where to keep out of the way of what comes near while the vehicle waits; `before`: where it was to be. `None`: where it is.
    pub(crate) fn place_out_of_traffic(&self, before: Option<Ned>) -> Option<Ned> {
        if self.seen.traffic.near.is_empty() {
            return None;
        }
        match self.evasion(before.map(Evasion::To))? {
            Evasion::To(place) => Some(place),
            Evasion::Stay | Evasion::Land => None,
        }
    }

    /// A landing here would come too near other traffic. Returns whether it may wait until that has passed: whatever is wrong with the vehicle
    /// itself does not.
    pub(crate) fn may_wait_for_traffic(&mut self) -> bool {
        let row = self.response_row().map(|row| &self.setup.table.rows()[row]);
        let may_wait = row.is_some_and(|it| matches!(it.group, Some(Group::Airspace | Group::Link | Group::Mission)));
        let Some(here) = self.seen.vehicle.map(|it| it.position).filter(|_| may_wait) else { return false };
        let near = &self.seen.traffic.near;
        Evasion::Land.is_too_near(here, &self.limits_in_wind().speeds, near)
            && self.may_wait(
                Duration::ZERO,
                (self.slack_here(), Duration::MAX),
                "other traffic is too near to the way down",
            )
    }

    /// Why it keeps out of the way of traffic by staying where it is, in words.
    pub(crate) fn why_it_stays(&self) -> &'static str {
        let Some(here) = self.seen.vehicle.map(|it| it.position).filter(|_| !self.doubts_position()) else {
            return "its position is in doubt";
        };
        let passes = Evasion::Stay.is_well_clear(here, &self.limits_in_wind().speeds, &self.seen.traffic.near);
        if passes { "what comes near passes well clear" } else { "no place in reach is farther from what comes near" }
    }

    pub(crate) fn has_cause(&self) -> bool {
        self.response_row().and_then(|row| self.flags.of_row(row)).is_some_and(|it| it.holds())
    }
}
