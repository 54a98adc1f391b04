//! Which permissions a plan asks for before the step that needs them, so that the answer is there when the border is.
//!
//! A step that asks begins on the way to the border. Where that way is short, the vehicle would stop at the border until the
//! control tower has answered; so the permission is asked for during a step before. Nothing is asked for that the plan would not ask
//! for anyway, and nothing earlier than the lead time before its border: a grant is not to be spent on the way.

use std::time::Duration;

use domain::plan::{AskAhead, PermissionNeed, Step};

use crate::airspace::{Access, Airspace};
use crate::plan::flight_time;
use crate::rules::Rules;

/// Sets what each of `steps` asks for ahead, were the first of them begun now. The lengths of what they ask for are known: see
/// [`crate::grant_lengths`].
///
/// Counted from the planned flight alone: a vehicle that waits for something else on the way has more time for the answer.
pub(crate) fn set(steps: &mut [Step], airspace: &Airspace, rules: &Rules) {
    steps.iter_mut().for_each(|step| step.ask_ahead.clear());
    let begins = beginnings(steps, rules);
    for later in 1..steps.len() {
        let border_at = begins[later].saturating_add(flight_time(&steps[later], rules));
        let asked_at = border_at.saturating_sub(rules.config.ask_ahead_s.seconds());
        if begins[later] <= asked_at {
            // It asks early enough itself.
            continue;
        }
        let earlier = begins[later].saturating_sub(asked_at);
        // The first one begins at zero, so at least one has begun by then.
        let during = begins[..later].partition_point(|begin| *begin <= asked_at).saturating_sub(1);
        let after = asked_at.saturating_sub(begins[during]);
        let ahead: Vec<AskAhead> = steps[later]
            .ask
            .iter()
            .map(|need| PermissionNeed { area: need.area.clone(), lasts: need.lasts.saturating_add(earlier) })
            .filter(|need| is_of_use(need, asked_at, &steps[..later], airspace))
            .map(|need| AskAhead { need, after })
            .collect();
        steps[during].ask_ahead.extend(ahead);
    }
}

/// When each of `steps` begins, without waits.
fn beginnings(steps: &[Step], rules: &Rules) -> Vec<Duration> {
    let mut at = Duration::ZERO;
    let begin = |step: &Step| {
        let begins = at;
        at = at.saturating_add(flight_time(step, rules));
        begins
    };
    steps.iter().map(begin).collect()
}

/// Whether asking for `need` at that time helps a step that follows `before`. Not if it is held for long enough, or asked for
/// anyway; not if the control tower has refused it, which then is asked once more, and no earlier than it may be; and not if it grants
/// for less time, so that the grant would end before it has served.
fn is_of_use(need: &PermissionNeed, asked_at: Duration, before: &[Step], airspace: &Airspace) -> bool {
    let held = airspace.rule.grants.get(&need.area);
    let is_held = held.is_some_and(|remaining| asked_at.saturating_add(need.lasts) <= *remaining);
    let may_help = airspace.zone(&need.area).is_some_and(|zone| match &zone.access {
        Access::Ask { denied, at_most, .. } => !denied && at_most.is_none_or(|longest| need.lasts <= longest),
        Access::Closed { .. } => false,
    });
    may_help && !is_held && !before.iter().any(|step| step.asks_for(&need.area))
}
