//! What waits for a person, whichever vehicle the operator looks at.

use domain::contingency::AUTOPILOT_PREEMPTS;
use kittiwake_proto::v1;

/// A control tower that decides by itself has answered by then, in mission seconds.
const ANSWERED_S: f64 = 2.0;

/// The decisions that a vehicle waits for: first those with a time limit, the shortest at the front.
pub(crate) fn waits_for(mcm: &v1::McmStatus) -> Vec<v1::WaitsFor> {
    let ends = |what: String, until_s: f64, default: &str| v1::WaitsFor {
        what,
        until_s: Some(until_s.max(0.0)),
        default: default.to_owned(),
    };
    let lasts = |what: String| v1::WaitsFor { what, until_s: None, default: String::new() };
    let approval = mcm.plan_approval.as_ref().map(|it| {
        let revision = it.plan.as_ref().map_or(0, |plan| plan.revision);
        let default = if it.approved_by_default { "approved" } else { "rejected" };
        ends(format!("approval of plan {revision}"), it.left_s, default)
    });
    let asked = mcm.awaited.iter().filter(|it| ANSWERED_S < it.waited_s);
    let permissions =
        asked.map(|it| ends(format!("permission for area {}", it.area), it.limit_s - it.waited_s, "denied"));
    let mut waits: Vec<v1::WaitsFor> = approval.into_iter().chain(permissions).collect();
    waits.sort_by(|a, b| a.until_s.partial_cmp(&b.until_s).unwrap_or(std::cmp::Ordering::Equal));
    if !mcm.uninspected_crash.is_empty() {
        let crash = &mcm.uninspected_crash;
        waits.push(lasts(format!("an inspection: the vehicle has crashed, {crash}; then order `inspected`")));
    } else if mcm.start_awaited {
        waits.push(lasts("the operator's start".to_owned()));
    } else if mcm.paused {
        waits.push(lasts("the operator to resume".to_owned()));
    } else if mcm.contingencies.iter().any(|it| it.flag == AUTOPILOT_PREEMPTS) {
        waits.push(lasts("the autopilot to end its own failsafe, or an operator's order".to_owned()));
    }
    waits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_an_end_comes_first_and_what_answers_by_itself_needs_nobody() {
        #[track_caller]
        fn check(mcm: &v1::McmStatus, expected: &[&str]) {
            let words = |it: v1::WaitsFor| match it.until_s {
                Some(until_s) => format!("{}; {} in {until_s} s", it.what, it.default),
                None => it.what,
            };
            assert_eq!(waits_for(mcm).into_iter().map(words).collect::<Vec<_>>(), expected);
        }
        let asked = |waited_s| v1::AwaitedPermission { area: "A".into(), waited_s, limit_s: 30.0 };
        let plan = Some(v1::Plan { revision: 3, ..Default::default() });
        let approval = v1::PlanApproval { plan, left_s: 40.0, approved_by_default: false };
        let mut mcm = v1::McmStatus { awaited: vec![asked(1.0)], ..Default::default() };
        check(&mcm, &[]);
        mcm = v1::McmStatus { awaited: vec![asked(5.0)], plan_approval: Some(approval), paused: true, ..mcm };
        let both = ["permission for area A; denied in 25 s", "approval of plan 3; rejected in 40 s"];
        check(&mcm, &[&both[..], &["the operator to resume"]].concat());
        mcm = v1::McmStatus { start_awaited: true, ..mcm };
        check(&mcm, &[&both[..], &["the operator's start"]].concat());
    }
}
