//! The areas as one request for a plan sees them: which apply, and what it takes to enter each now.

use std::collections::BTreeSet;

use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::route;
use domain::time::{Now, Pace};

use crate::config::Config;
use crate::permissions::{Permissions, Standing};

/// An area that applies.
#[derive(Debug, Clone)]
pub struct Zone<'a> {
    /// The area itself.
    pub area: &'a Area,
    /// What it takes to enter it.
    pub access: Access,
}

/// What it takes to enter an area now.
#[derive(Debug, Clone, PartialEq)]
pub enum Access {
    /// Nothing: its permission is held.
    Held,
    /// Asking for it, and a wait that is to be expected.
    Ask {
        /// In seconds.
        wait_s: f64,
        /// It was denied when it was last asked for.
        denied: bool,
    },
    /// It is not entered.
    Closed {
        /// For the mission report.
        reason: String,
    },
}

/// Zones that a plan has asked for in an earlier step, by their index.
pub type Asked = BTreeSet<usize>;

/// Every area that applies.
#[derive(Debug, Clone)]
pub struct Airspace<'a> {
    /// In the mission's order.
    pub zones: Vec<Zone<'a>>,
}

impl<'a> Airspace<'a> {
    /// The areas as they stand `now` for a vehicle that holds the permissions `held`.
    pub fn new(
        areas: &'a [Area],
        held: &BTreeSet<String>,
        permissions: &Permissions,
        now: Now,
        pace: Pace,
        config: &Config,
    ) -> Airspace<'a> {
        let look_ahead = pace.to_wall(config.window_look_ahead_s.seconds());
        let soon_utc_ms = now.utc_ms.saturating_add(look_ahead.as_millis() as i64);
        let applies = |it: &&Area| {
            it.is_active(now.utc_ms) || it.from_utc_ms.is_some_and(|from| now.utc_ms < from && from <= soon_utc_ms)
        };
        let zone = |area: &'a Area| Zone { area, access: access(area, held, permissions, now, config) };
        Airspace { zones: areas.iter().filter(applies).map(zone).collect() }
    }

    /// The zones that must not be entered yet by a plan that has asked for `asked`.
    pub fn barred(&self, asked: &Asked) -> impl Iterator<Item = (usize, &Zone<'a>)> {
        self.zones.iter().enumerate().filter(move |(index, it)| it.access != Access::Held && !asked.contains(index))
    }

    /// The barred zones that `point` is in.
    pub fn trespassed(&self, point: Ned, asked: &Asked) -> Vec<&Zone<'a>> {
        self.barred(asked).map(|(_, it)| it).filter(|it| it.area.contains(point)).collect()
    }

    /// Names of the areas that the way touches and that may be entered: those whose permission must
    /// not be lost on it. One that is only being left is not among them.
    pub fn needed(&self, from: Ned, to: Ned, asked: &Asked) -> Vec<String> {
        let allowed = |(index, it): &(usize, &Zone)| it.access == Access::Held || asked.contains(index);
        let touched = self.zones.iter().enumerate().filter(allowed).filter(|(_, it)| it.area.is_crossed(from, to));
        touched.map(|(_, it)| it.area.name.clone()).collect()
    }

    /// The barred zones entered on the straight way, each with the fraction at which it first is, in
    /// the order in which they are.
    pub fn first_entries(&self, from: Ned, to: Ned, asked: &Asked) -> Vec<(f64, usize)> {
        let mut found: Vec<_> = self
            .barred(asked)
            .filter_map(|(index, it)| Some((*route::entries(it.area, from, to).first()?, index)))
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    /// Whether the permission for `area` was refused and has not been granted since.
    pub fn was_denied(&self, area: &str) -> bool {
        self.zones.iter().filter(|it| it.area.name == area).any(|it| match it.access {
            Access::Held => false,
            Access::Ask { denied, .. } => denied,
            Access::Closed { .. } => true,
        })
    }

    /// The same airspace as if closed zones could be entered at a price nobody would pay for a
    /// detour; keep-out areas only if `keep_out_too`. For telling what is in the way.
    pub fn opened(&self, keep_out_too: bool) -> Airspace<'a> {
        const PROHIBITIVE_S: f64 = 1e7;
        let mut opened = self.clone();
        for zone in &mut opened.zones {
            let is_open = keep_out_too || zone.area.kind == AreaKind::Permission;
            if is_open && matches!(zone.access, Access::Closed { .. }) {
                zone.access = Access::Ask { wait_s: PROHIBITIVE_S, denied: true };
            }
        }
        opened
    }
}

fn access(area: &Area, held: &BTreeSet<String>, permissions: &Permissions, now: Now, config: &Config) -> Access {
    let name = &area.name;
    match area.kind {
        AreaKind::KeepOut => {
            Access::Closed { reason: format!("keep-out area {name}: it cannot be reached without entering it") }
        }
        AreaKind::Permission if held.contains(name) => Access::Held,
        AreaKind::Permission => match permissions.standing(name) {
            Standing::Open => Access::Ask { wait_s: config.expected_wait_s.get(), denied: false },
            Standing::DeniedOnce { retry_at, .. } => Access::Ask {
                wait_s: (retry_at - now.time).as_secs_f64() + config.expected_wait_after_denial_s.get(),
                denied: true,
            },
            Standing::DeniedForGood { reason } => Access::Closed { reason: format!("area {name}: {reason}") },
        },
    }
}
