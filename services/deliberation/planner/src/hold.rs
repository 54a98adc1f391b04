//! Holding: until an area that was denied may be asked for again, until one that is closed is over, and on the ground until a
//! grant that is too short has ended and a new one can be had.

use std::time::Duration;

use domain::plan::Step;
use domain::time::Time;

use crate::communication::SAME_PLACE_M;
use crate::permissions::Permissions;
use crate::plan::{asking, flight_time};
use crate::rules::Rules;

/// Waiting for an area's back-off to end.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hold {
    pub area: String,
    /// When the hold began.
    pub since: Time,
    /// How long it lasts, in mission time.
    pub wait: Duration,
    /// For the operator.
    pub reason: String,
    /// It lasts until a grant that is too short has ended, so that what is known of that is void then.
    pub outlasts_grant: bool,
}

/// The place of the first of `steps` that would ask for an area before its back-off is over, if they were begun
/// `now`, and the hold that avoids it. Permission is asked for when a step begins, so only the flight before it counts.
pub(crate) fn too_early(steps: &[Step], permissions: &Permissions, now: Time, rules: &Rules) -> Option<(usize, Hold)> {
    let mut flown = Duration::ZERO;
    for (position, step) in steps.iter().enumerate() {
        for area in step.ask.iter().map(|need| &need.area) {
            let Some((back_off, reason)) = permissions.back_off(area, now) else { continue };
            if flown < back_off {
                let reason = format!("area {area}: {reason}; asked once more");
                let hold =
                    Hold { area: area.clone(), since: now, wait: back_off - flown, reason, outlasts_grant: false };
                return Some((position, hold));
            }
        }
        let (from, to) = step.way();
        if from.distance_m(to) < SAME_PLACE_M {
            // It ends at once.
            continue;
        }
        flown = flown.saturating_add(flight_time(step, rules));
    }
    None
}

/// The steps before the one at `position`, or, if that is the first, that one without its asking.
pub(crate) fn without_asking_at(mut steps: Vec<Step>, position: usize) -> Vec<Step> {
    steps.truncate(position.max(1));
    // What they ask for ahead may be needed by a step that is left out.
    steps.iter_mut().for_each(|it| it.ask_ahead.clear());
    if position == 0 { steps.into_iter().map(|it| asking(it, Vec::new())).collect() } else { steps }
}
