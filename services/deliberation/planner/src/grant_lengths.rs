//! For how long the permissions that a plan asks for must hold: the flight from the asking to the last metre inside the
//! area, later than planned by as much as the airspace rule allows for, and the way out.

use std::time::Duration;

use domain::airspace::{latest, soonest, stays};
use domain::plan::Step;

use crate::airspace::{Access, Airspace};
use crate::plan::{flight_time, free_time_to, way_to_keep_free};
use crate::rules::Rules;

/// Sets the length of every permission that `steps` ask for, were the first of them begun now.
pub(crate) fn set(steps: &mut [Step], airspace: &Airspace, rules: &Rules) {
    let mut begins = Duration::ZERO;
    for index in 0..steps.len() {
        let lengths: Vec<Duration> =
            steps[index].ask.iter().map(|need| length(&need.area, &steps[index..], begins, airspace, rules)).collect();
        for (need, lasts) in steps[index].ask.iter_mut().zip(lengths) {
            need.lasts = lasts;
        }
        begins = begins.saturating_add(duration(&steps[index], airspace, rules));
    }
}

/// The area of the first permission of `steps` that is not granted for long enough, as far as is known, and why, for the mission report.
pub(crate) fn too_short(steps: &[Step], airspace: &Airspace) -> Option<(String, String)> {
    let needs = steps.iter().flat_map(|step| &step.ask);
    needs.into_iter().find_map(|need| {
        let Access::Ask { at_most: Some(granted), .. } = airspace.zone(&need.area)?.access else { return None };
        (granted < need.lasts).then(|| {
            let (area, granted_s, needed_s) = (&need.area, granted.as_secs(), need.lasts.as_secs());
            let reason = format!("the permission for area {area} holds for {granted_s} s, {needed_s} s are needed");
            (area.clone(), reason)
        })
    })
}

/// For how long the permission for `area` must hold if it is asked for during the first of `steps`, which begins then.
fn length(area: &str, steps: &[Step], begins: Duration, airspace: &Airspace, rules: &Rules) -> Duration {
    let Some(zone) = airspace.zone(area) else { return Duration::ZERO };
    let (mut flown, mut left) = (Duration::ZERO, Duration::ZERO);
    for (index, step) in steps.iter().enumerate() {
        if 0 < index && step.asks_for(area) {
            break;
        }
        let (from, to) = way_to_keep_free(step);
        if let Some(stay) = stays(zone.area, from, to, airspace.rule.vertical_margin_m).last() {
            let inside = match step.releases() {
                // The load may begin to fall at the end of the step.
                true => flight_time(step, rules).saturating_add(free_time_to(step, stay.leaves, rules)),
                false => flight_time(step, rules).mul_f64(stay.leaves),
            };
            left = flown.saturating_add(inside);
        }
        flown = flown.saturating_add(duration(step, airspace, rules));
    }
    let until = match airspace.rule.applies(zone.area) {
        // Of several windows the stay may lie in a later one.
        Some((_, Some(closes))) if zone.area.hours.is_none() => {
            latest(left).min(closes.saturating_sub(soonest(begins)))
        }
        _ => latest(left),
    };
    until.saturating_add(airspace.rule.lead)
}

/// The flight of `step`, and the wait for what it asks for.
pub(crate) fn duration(step: &Step, airspace: &Airspace, rules: &Rules) -> Duration {
    let waits = step.ask.iter().filter_map(|need| match airspace.zone(&need.area)?.access {
        Access::Ask { wait_s, .. } => Some(wait_s),
        Access::Closed { .. } => None,
    });
    let wait = Duration::try_from_secs_f64(waits.fold(0.0, f64::max)).unwrap_or(Duration::MAX);
    flight_time(step, rules).saturating_add(wait)
}
