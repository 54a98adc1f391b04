//! Ways of plans: the search of [`domain::way`], told what it takes to get each permission, and why there is no way.

use std::time::Duration;

use domain::area::{Area, AreaKind};
use domain::geometry::Ned;
use domain::way::{self, Among, Asked, Entry, TimedWay, Trip};

use crate::airspace::{Access, Airspace, Zone};
use crate::back_chaining::NoChain;
use crate::rules::Rules;

/// Why a goal cannot be reached, for the mission report.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct NoWay(pub String);

impl From<NoChain> for NoWay {
    fn from(why: NoChain) -> NoWay {
        NoWay(why.to_string())
    }
}

/// What is opened by force to find out what is in the way: nothing, closed permission areas, everything.
const FORCED: [fn(&Area) -> bool; 3] = [|_| false, |area| area.kind == AreaKind::Permission, |_| true];

/// The cheapest way from `from`, where the vehicle is in the air after `begins`, to `to`, for a plan that has asked for
/// `asked` before.
pub(crate) fn find(
    from: Ned,
    to: Ned,
    begins: Duration,
    airspace: &Airspace,
    asked: &Asked,
    rules: &Rules,
) -> Result<TimedWay, NoWay> {
    let (trip, limits) = (Trip { from, to, begins, lands_from_m: None }, rules.flight_limits());
    let mut why = "no way keeps clear of every area";
    for (tried, is_forced) in FORCED.into_iter().enumerate() {
        let entries: Vec<Entry> = airspace.zones.iter().map(|it| entry(it, is_forced)).collect();
        let Airspace { rule, map, legs_left, .. } = airspace;
        match way::find(trip, Among { rule: *rule, map, entries: &entries, asked, limits: &limits, legs_left }) {
            Ok(way) if tried == 0 => return Ok(way),
            Ok(way) => {
                let closed = way.entered.into_iter().find_map(|zone| match &airspace.zones[zone].access {
                    Access::Closed { reason } => Some(reason.clone()),
                    Access::Ask { .. } => None,
                });
                if let Some(reason) = closed {
                    return Err(NoWay(reason));
                }
            }
            Err(way::NoWay::GaveUp) => {
                why = "no way was found: too many areas are in the way, or they have too many corners";
            }
            Err(way::NoWay::Closed) => {}
        }
    }
    Err(NoWay(why.into()))
}

fn entry(zone: &Zone, is_forced: fn(&Area) -> bool) -> Entry {
    match zone.access {
        Access::Ask { wait_s, .. } => Entry::Ask { wait_s },
        Access::Closed { .. } if is_forced(zone.area) => Entry::Forced,
        Access::Closed { .. } => Entry::Closed,
    }
}
