//! The areas as one request for a plan sees them: the airspace rule, and what it takes to get each permission.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::time::Duration;

use domain::airspace::{self, Clock, Grants, Motion, Stay, latest, soonest, stays};
use domain::area::{Area, AreaKind};
use domain::area_map::AreaMap;
use domain::geometry::Ned;
use domain::known_ground::KnownGround;
use domain::plan::PermissionNeed;
use domain::state::State;
use domain::time::{Now, Pace};
use domain::way::Asked;

use crate::permissions::{Permissions, Standing};
use crate::rules::Rules;

/// An area, with what it takes to enter it while it applies.
#[derive(Debug, Clone)]
pub(crate) struct Zone<'a> {
    pub area: &'a Area,
    /// What it takes to get a permission that is not held for long enough.
    pub access: Access,
}

/// What it takes to get a permission.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Access {
    /// Asking for it, and a wait that is to be expected.
    Ask {
        wait_s: f64,
        /// It was denied when it was last asked for.
        denied: bool,
        /// Longer than this it is not granted, as far as is known.
        at_most: Option<Duration>,
    },
    /// It is not to be had, or the area is never entered.
    Closed {
        /// For the mission report.
        reason: String,
    },
}

/// Areas that a request has found to be of no use, with the reason for the mission report.
pub(crate) type Closures = BTreeMap<String, String>;

/// What ways lead round and over, whatever the time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Around {
    /// Of the areas.
    pub map: AreaMap,
    /// As the mission and the vehicle's place say it.
    pub ground: KnownGround,
}

#[derive(Debug, Clone)]
pub(crate) struct Airspace<'a> {
    /// The rule that the mission manager flies by.
    pub rule: airspace::Airspace<'a>,
    /// In the mission's order.
    pub zones: Vec<Zone<'a>>,
    /// What is known of them whatever the time, by the same index.
    pub map: &'a AreaMap,
    /// Legs that searches of ways may still look at, all together; without any left no way is found.
    pub legs_left: Cell<u32>,
}

/// The permissions that `state` holds; one of which no end is known holds forever.
pub(crate) fn grants(state: &State, known: &Grants) -> Grants {
    let endless = state.permissions.iter().map(|area| (area.clone(), Duration::MAX));
    endless.chain(known.iter().map(|(area, remaining)| (area.clone(), *remaining))).collect()
}

impl<'a> Airspace<'a> {
    /// The areas, with what is known around them, as they stand `now` for a vehicle that holds `grants`.
    pub(crate) fn new(
        (areas, around): (&'a [Area], &'a Around),
        grants: &'a Grants,
        permissions: &Permissions,
        closures: &Closures,
        (now, pace): (Now, Pace),
        rules: &Rules,
    ) -> Airspace<'a> {
        let rule = airspace::Airspace {
            areas,
            grants,
            clock: Clock { utc_ms: now.utc_ms, pace },
            lead: rules.config.grant_lead_s.seconds(),
            vertical_margin_m: rules.aircraft.flight.vertical_margin_m.get(),
            ground: &around.ground,
        };
        let zone = |area: &'a Area| {
            let closure = closures.get(&area.name).map(|reason| Access::Closed { reason: reason.clone() });
            Zone { area, access: closure.unwrap_or_else(|| access(area, permissions, now, rules)) }
        };
        Airspace { rule, zones: areas.iter().map(zone).collect(), map: &around.map, legs_left: Cell::new(u32::MAX) }
    }

    /// Whether a vehicle in the air at `point` must leave an area now.
    pub(crate) fn is_trespassed(&self, point: Ned) -> bool {
        self.map.is_trespassed(&self.rule, point)
    }

    /// Whether `zone` must not be stayed in between two moments by a plan that has asked for `asked`.
    pub(crate) fn is_barred(&self, zone: usize, asked: &Asked, from: Duration, until: Duration) -> bool {
        let Some(Zone { area, .. }) = self.zones.get(zone) else { return false };
        let is_asked = area.kind == AreaKind::Permission && asked.contains(&zone);
        !is_asked && self.rule.bars(area, from, until).is_some()
    }

    /// The zones entered on the straight way that must not be entered yet by a plan that has asked for `asked`, each with
    /// the fraction at which it first is, in the order in which they are.
    pub(crate) fn first_entries(&self, from: Ned, to: Ned, motion: Motion, asked: &Asked) -> Vec<(f64, usize)> {
        let way_m = from.distance_m(to);
        let entry = |index: usize| {
            if self.zones[index].area.kind == AreaKind::Permission && asked.contains(&index) {
                return None;
            }
            let alone = airspace::Airspace { areas: std::slice::from_ref(self.zones[index].area), ..self.rule };
            let breach = alone.first_breach(from, to, motion)?;
            Some((if way_m > 0.0 { from.distance_m(breach.at) / way_m } else { 0.0 }, index))
        };
        let mut found: Vec<_> = self.map.near(from, to, motion.scatter_m(from, to)).filter_map(entry).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found
    }

    /// Names of the areas that the way touches while they apply, and that may be entered: those whose permission must not
    /// be lost on it. One that is only being left is not among them.
    pub(crate) fn needed(&self, from: Ned, to: Ned, motion: Motion, asked: &Asked) -> Vec<String> {
        let nothing_held = Grants::new();
        let without = airspace::Airspace { grants: &nothing_held, ..self.rule };
        let is_needed = |&index: &usize| {
            let zone = &self.zones[index];
            let mut visits = self.visits(zone.area, from, to, motion).into_iter().peekable();
            let is_permission = zone.area.kind == AreaKind::Permission;
            is_permission
                && visits.peek().is_some()
                && visits.all(|(soonest, latest)| {
                    without.bars(zone.area, soonest, latest).is_some() && !self.is_barred(index, asked, soonest, latest)
                })
        };
        self.map.along(from, to).into_iter().filter(is_needed).map(|it| self.zones[it].area.name.clone()).collect()
    }

    /// Between which moments the way is inside `area`.
    fn visits(&self, area: &Area, from: Ned, to: Ned, motion: Motion) -> Vec<(Duration, Duration)> {
        let at = |fraction: f64| motion.begins.saturating_add(motion.speeds.time_to(fraction, from, to));
        let visit = |stay: Stay| (soonest(at(stay.enters)), latest(at(stay.leaves)));
        stays(area, from, to, self.rule.vertical_margin_m).into_iter().map(visit).collect()
    }

    /// The areas whose window closes within `limit`, each with the time until then.
    pub(crate) fn soon_over(&self, limit: Duration) -> Vec<(&'a Area, Duration)> {
        let left = |zone: &Zone<'a>| match self.rule.applies(zone.area)? {
            (_, Some(left)) if left <= limit => Some((zone.area, left)),
            _ => None,
        };
        self.zones.iter().filter_map(left).collect()
    }

    /// The zone of this name.
    pub(crate) fn zone(&self, name: &str) -> Option<&Zone<'a>> {
        self.zones.iter().find(|zone| zone.area.name == name)
    }

    /// Whether the time window of the area has closed, or its hours have and come again only after the permission that was to be asked
    /// for would have served, so that it is needed no more.
    pub(crate) fn has_ended(&self, need: &PermissionNeed) -> bool {
        let is_over = |area: &Area| match self.rule.applies(area) {
            None => true,
            Some((opens, _)) => area.hours.is_some() && need.lasts < opens,
        };
        self.zone(&need.area).is_some_and(|zone| is_over(zone.area))
    }

    /// Whether the permission for `area` was refused or too short, and is not held; it may have been asked for before the
    /// area applies.
    pub(crate) fn was_denied(&self, area: &str) -> bool {
        let is_held = self.rule.grants.get(area).is_some_and(|remaining| self.rule.lead < *remaining);
        let zone = self.zone(area).filter(|_| !is_held);
        zone.is_some_and(|zone| match &zone.access {
            Access::Ask { denied, at_most, .. } => *denied || at_most.is_some(),
            Access::Closed { .. } => true,
        })
    }
}

fn access(area: &Area, permissions: &Permissions, now: Now, rules: &Rules) -> Access {
    let name = &area.name;
    if area.kind == AreaKind::KeepOut {
        return Access::Closed { reason: format!("keep-out area {name}: it cannot be reached without entering it") };
    }
    let at_most = permissions.longest_grant(name);
    match permissions.standing(name) {
        Standing::Open => Access::Ask { wait_s: rules.config.expected_wait_s.get(), denied: false, at_most },
        Standing::DeniedOnce { retry_at, .. } => Access::Ask {
            wait_s: (retry_at - now.time).as_secs_f64() + rules.config.expected_wait_after_denial_s.get(),
            denied: true,
            at_most,
        },
        Standing::DeniedForGood { reason } => Access::Closed { reason: format!("area {name}: {reason}") },
    }
}
