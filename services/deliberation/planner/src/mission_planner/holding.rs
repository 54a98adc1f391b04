//! Waiting as a choice: where an area that is soon over costs a detour, the plan is drafted at later times as well, and the
//! vehicle waits where it is, on the ground or in the air, if it arrives sooner by that.
//!
//! What is compared is the time until the current objective is reached, waits included: the rest of the mission is the same behind
//! it. So a deadline that the way round keeps is kept by waiting too.

use std::collections::BTreeSet;
use std::time::Duration;

use domain::airspace::{Grants, soonest, stays};
use domain::area::Area;
use domain::geometry::Ned;
use domain::plan::Step;
use domain::quantity::Fraction;
use domain::state::State;
use domain::time::{Now, utc_text};

use super::{MissionPlanner, OVER, steps_to};
use crate::airspace::{Airspace, Closures};
use crate::energy;
use crate::grant_lengths::{self, duration};
use crate::hold::Hold;
use crate::plan::{free_time_to, way_to_keep_free};
use crate::survey::Via;

/// The ends of windows at which a plan is drafted: those of areas in the straight way first, and of these the earliest.
const MOST_ENDS: usize = 4;
/// A wait that gains less than this is not worth it, in seconds: the forecast of both plans is no better than that.
const LEAST_GAIN_S: f64 = 5.0;
/// Legs that all drafts at later times may look at together: as many as one search that may cost a tenth more.
pub(super) const MOST_LEGS: u32 = 20_000;

/// A plan that could be flown at once, and what it was made from.
#[derive(Clone, Copy)]
pub(super) struct PlanNow<'a> {
    /// First to fly first.
    pub(super) steps: &'a [Step],
    /// What it leads through.
    pub(super) ahead: &'a [Via],
    pub(super) state: &'a State,
    pub(super) airspace: &'a Airspace<'a>,
    /// The permissions that are held, from now on.
    pub(super) grants: &'a Grants,
    /// Areas that are of no use to this plan.
    pub(super) closures: &'a Closures,
    /// When it begins.
    pub(super) now: Now,
}

/// A plan that begins after a wait.
struct PlanLater {
    steps: Vec<Step>,
    wait: Duration,
    /// From now on until the objective is reached, in seconds.
    total_s: f64,
}

impl MissionPlanner {
    /// The wait after which the vehicle arrives sooner than by `plan`, if there is one.
    pub(super) fn worth_waiting(&self, plan: PlanNow) -> Option<Hold> {
        let PlanNow { state, airspace, now, .. } = plan;
        if state.flying && airspace.is_trespassed(state.position) {
            // Not to be waited in: out first.
            return None;
        }
        let now_s = self.duration_s(plan.steps, airspace);
        if now_s - self.straight_s(state, plan.ahead) < LEAST_GAIN_S {
            return None;
        }
        let mut legs_left = MOST_LEGS;
        let mut best: Option<(&Area, Duration, PlanLater)> = None;
        for (area, ends) in ends_that_matter(plan, now_s) {
            let Some(later) = self.after_end(area, ends, plan, &mut legs_left) else { continue };
            let beats = best.as_ref().is_none_or(|(_, _, other)| later.total_s < other.total_s);
            if beats && LEAST_GAIN_S <= now_s - later.total_s {
                best = Some((area, ends, later));
            }
        }
        let (area, ends, PlanLater { wait, total_s, .. }) = best?;
        let reason = format!(
            "area {} is closed for {:.0} s more: waits {:.0} s, until {}, and arrives {:.0} s sooner than by the way round it",
            area.name,
            ends.as_secs_f64(),
            wait.as_secs_f64(),
            utc_text(self.after(now, wait).utc_ms),
            now_s - total_s
        );
        Some(Hold { area: area.name.clone(), since: now.time, wait, reason, outlasts_grant: false })
    }

    /// The plan that is flown once `area` is over, after `ends`. It begins earlier by the flight to the border, which is taken as
    /// the airspace rule takes it: 20 % sooner than planned.
    fn after_end(&self, area: &Area, ends: Duration, plan: PlanNow, legs_left: &mut u32) -> Option<PlanLater> {
        let over = ends.saturating_add(OVER);
        let late = self.drafted_after(over, plan, legs_left);
        let steps = late.as_ref().map(|it| it.steps.as_slice())?;
        let flown_there = self.time_to_border(area, steps, plan.airspace);
        let shortened = over.saturating_sub(soonest(flown_there));
        let early = (Duration::ZERO < shortened && shortened < over)
            .then(|| self.drafted_after(shortened, plan, legs_left))
            .flatten();
        let may_be_flown = |it: &PlanLater| self.may_wait_for(area, it, plan);
        early.filter(may_be_flown).or_else(|| late.filter(may_be_flown))
    }

    /// The plan that would be made after `wait`, if there is one.
    fn drafted_after(&self, wait: Duration, plan: PlanNow, legs_left: &mut u32) -> Option<PlanLater> {
        let remaining = |(area, left): (&String, &Duration)| Some((area.clone(), left.checked_sub(wait)?));
        let grants: Grants = plan.grants.iter().filter_map(remaining).collect();
        let later = self.airspace(&grants, plan.closures, self.after(plan.now, wait));
        later.legs_left.set(*legs_left);
        let drafted = steps_to(plan.state, plan.ahead, None, self.tolerance(), &later, &self.rules);
        *legs_left = later.legs_left.get();
        let mut steps = drafted.ok()?;
        grant_lengths::set(&mut steps, &later, &self.rules);
        if grant_lengths::too_short(&steps, &later).is_some() {
            return None;
        }
        let total_s = wait.as_secs_f64() + self.duration_s(&steps, &later);
        Some(PlanLater { steps, wait, total_s })
    }

    /// Whether the vehicle may stay where it is until `later` begins, for the sake of `area`, and keeps its deadline and its reserve by
    /// that.
    fn may_wait_for(&self, area: &Area, later: &PlanLater, plan: PlanNow) -> bool {
        let PlanNow { state, airspace, now, .. } = plan;
        let PlanLater { steps, wait, .. } = later;
        let hover_wh = self.rules.stay_wh(state, wait.as_secs_f64());
        let charge =
            state.charge.and_then(|it| Fraction::try_from(self.rules.aircraft.energy.charge_after(it, hover_wh)).ok());
        let then = State { charge, ..state.clone() };
        // A forecast judges the mission as a whole, but what is hovered away is up to this choice.
        let takes_too_much = state.flying
            && charge.is_some_and(|it| energy::to_give_up(steps, &then, &self.objectives, it, &self.rules).is_some());
        self.permissions.may_still_hold(&area.name, *wait, &self.rules)
            && (!state.flying || airspace.rule.breach_at(state.position, *wait).is_none())
            && self.infeasible(steps, &then, self.after(now, *wait)).is_none()
            && !takes_too_much
    }

    /// How long `steps` take, waits that are to be expected included, in seconds.
    fn duration_s(&self, steps: &[Step], airspace: &Airspace) -> f64 {
        steps.iter().map(|it| duration(it, airspace, &self.rules).as_secs_f64()).sum()
    }

    fn straight_s(&self, state: &State, ahead: &[Via]) -> f64 {
        let froms = std::iter::once(state).chain(ahead.iter().map(|it| &it.state));
        froms.zip(ahead).map(|(from, to)| self.rules.hop(from, &to.state).time_s).sum()
    }

    /// How long after their beginning `steps` first enter `area`; none if they never do.
    fn time_to_border(&self, area: &Area, steps: &[Step], airspace: &Airspace) -> Duration {
        let mut begins = Duration::ZERO;
        for step in steps {
            let (from, to) = way_to_keep_free(step);
            if let Some(stay) = stays(area, from, to, airspace.rule.vertical_margin_m).first() {
                return begins.saturating_add(free_time_to(step, stay.enters, &self.rules));
            }
            begins = begins.saturating_add(duration(step, airspace, &self.rules));
        }
        Duration::ZERO
    }
}

/// The areas that are over before the `now_s` that `plan` takes, each with the time until then. Nothing is gained by waiting for any
/// other: no area is entered before it is over.
fn ends_that_matter<'a>(plan: PlanNow<'a>, now_s: f64) -> Vec<(&'a Area, Duration)> {
    let PlanNow { state, ahead, airspace, .. } = plan;
    let in_the_way = names_in_the_way(state, ahead, airspace);
    let limit = Duration::try_from_secs_f64(now_s - LEAST_GAIN_S).unwrap_or_default();
    first_ends(airspace.soon_over(limit), |area| in_the_way.contains(area.name.as_str()))
}

/// The first of these ends, those of areas that come first by `is_first` before others.
fn first_ends(mut ends: Vec<(&Area, Duration)>, is_first: impl Fn(&Area) -> bool) -> Vec<(&Area, Duration)> {
    ends.sort_by_cached_key(|&(area, left)| (!is_first(area), left));
    // One moment is tried once, however many areas end then.
    ends.dedup_by_key(|it| it.1);
    ends.truncate(MOST_ENDS);
    ends
}

/// Of the areas that are over `soon`, those in the straight way, the earliest first.
pub(super) fn ends_in_the_way<'a>(
    state: &State,
    ahead: &[Via],
    airspace: &Airspace,
    soon: &[(&'a Area, Duration)],
) -> Vec<(&'a Area, Duration)> {
    let in_the_way = names_in_the_way(state, ahead, airspace);
    let ends = soon.iter().copied().filter(|(area, _)| in_the_way.contains(area.name.as_str()));
    first_ends(ends.collect(), |_| true)
}

/// The areas that the straight way through all that is `ahead` touches, whether or not they apply.
fn names_in_the_way<'a>(state: &State, ahead: &[Via], airspace: &'a Airspace) -> BTreeSet<&'a str> {
    let places: Vec<Ned> = std::iter::once(state.position).chain(ahead.iter().map(|it| it.state.position)).collect();
    let along = places.windows(2).flat_map(|leg| airspace.map.along(leg[0], leg[1]));
    along.map(|it| airspace.zones[it].area.name.as_str()).collect()
}
