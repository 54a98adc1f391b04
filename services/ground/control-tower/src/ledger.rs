//! Every permission of one vehicle, and the requests that were received.
//!
//! The ledger knows when a decision or an expiry is due; the decision itself comes from the policy or from
//! an operator. It never forgets an area: a vehicle that asks again is the same vehicle.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::v1;

use crate::permission::{self, Expiry, Next, NotGranted, Ruling, Standing};
use crate::policy::Answer;

/// More areas than any mission has; requests for more are refused, so that they do not fill the memory.
const MAX_AREAS: usize = 256;
/// Requests remembered, so that a repeated one is recognised: far more than can still be repeated.
const REMEMBERED_REQUESTS: usize = 1024;

/// The permissions of one vehicle.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    /// By area.
    permissions: BTreeMap<String, Permission>,
    /// Oldest first: request id and area.
    requests: VecDeque<(String, String)>,
    changed: bool,
}

#[derive(Debug)]
struct Permission {
    standing: Standing,
    request_id: String,
    decisions: u64,
}

/// Why a request or a ruling was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Refusal {
    /// It names no area.
    #[error("`area` is missing")]
    NoArea,
    /// Without an id a repetition would look like a new request.
    #[error("`request_id` is missing")]
    NoRequestId,
    /// The id was used before, for another area.
    #[error("request `{id}` asked for area `{first}` before, and asks for `{now}` now")]
    OtherArea { id: String, first: String, now: String },
    /// The vehicle has asked for too many areas.
    #[error("the vehicle has asked for {MAX_AREAS} areas already, the most that are served")]
    TooManyAreas,
    #[error(transparent)]
    NotGranted(#[from] NotGranted),
}

impl Ledger {
    /// Takes a request; one whose id is known changes nothing. `answer` asks the policy,
    /// `fresh` is the expiry of a grant given now.
    pub(crate) fn request(
        &mut self,
        now: Now,
        request: &v1::PermissionRequest,
        fresh: Expiry,
        answer: impl FnOnce() -> Option<Answer>,
    ) -> Result<(), Refusal> {
        let v1::PermissionRequest { request_id, area, .. } = request;
        if request_id.is_empty() {
            return Err(Refusal::NoRequestId);
        }
        self.accept_area(area)?;
        if let Some((_, first)) = self.requests.iter().find(|(id, _)| id == request_id) {
            return if first == area {
                Ok(())
            } else {
                Err(Refusal::OtherArea { id: request_id.clone(), first: first.clone(), now: area.clone() })
            };
        }
        if self.requests.len() == REMEMBERED_REQUESTS {
            self.requests.pop_front();
        }
        self.requests.push_back((request_id.clone(), area.clone()));
        let before = self.permissions.get(area).map(|it| it.standing.clone());
        self.enter(area, permission::on_request(before, now.time, fresh, answer), Some(request_id));
        Ok(())
    }

    /// Takes a decision by an operator.
    pub(crate) fn rule(&mut self, area: &str, ruling: Ruling) -> Result<(), Refusal> {
        self.accept_area(area)?;
        let next = permission::on_ruling(self.permissions.get(area).map(|it| &it.standing), ruling)?;
        self.enter(area, next, None);
        Ok(())
    }

    /// Makes the decisions that are due, and ends the grants that expire.
    pub(crate) fn advance(&mut self, now: Now, fresh: Expiry) {
        for known in self.permissions.values_mut() {
            if let Some(next) = permission::on_time(&known.standing, now.time, fresh) {
                known.take(next);
                self.changed = true;
            }
        }
    }

    /// When [`Ledger::advance`] will next change something.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.permissions.values().filter_map(|it| permission::deadline(&it.standing)).min()
    }

    /// Whether no area was ever requested or decided about.
    pub(crate) fn is_empty(&self) -> bool {
        self.permissions.is_empty()
    }

    /// Whether something has changed since the last call.
    pub(crate) fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// The ledger as it is sent at `now`.
    pub(crate) fn to_wire(&self, now: Time) -> v1::PermissionLedger {
        v1::PermissionLedger { permissions: self.permissions.iter().map(|(area, it)| it.to_wire(area, now)).collect() }
    }

    fn accept_area(&self, area: &str) -> Result<(), Refusal> {
        if area.is_empty() {
            return Err(Refusal::NoArea);
        }
        if self.permissions.len() == MAX_AREAS && !self.permissions.contains_key(area) {
            return Err(Refusal::TooManyAreas);
        }
        Ok(())
    }

    fn enter(&mut self, area: &str, next: Next, request_id: Option<&str>) {
        let known = self.permissions.entry(area.to_owned()).or_insert_with(|| Permission {
            standing: Standing::Requested { due: None },
            request_id: String::new(),
            decisions: 0,
        });
        known.take(next);
        if let Some(id) = request_id {
            known.request_id = id.to_owned();
        }
        self.changed = true;
    }
}

impl Permission {
    fn take(&mut self, next: Next) {
        self.standing = next.standing;
        self.decisions += u64::from(next.decided);
    }

    fn to_wire(&self, area: &str, now: Time) -> v1::Permission {
        use v1::PermissionState as S;
        let (state, reason, expiry) = match &self.standing {
            Standing::Requested { .. } => (S::Requested, "", None),
            Standing::Granted { expiry, .. } => (S::Granted, "", Some(expiry)),
            Standing::Denied { reason, .. } => (S::Denied, reason.as_str(), None),
            Standing::Revoked { reason } => (S::Revoked, reason.as_str(), None),
            Standing::Expired => (S::Expired, "", None),
        };
        v1::Permission {
            area: area.to_owned(),
            state: state as i32,
            reason: reason.to_owned(),
            expires_utc_ms: expiry.map_or(0, |it| it.utc_ms),
            valid_for_s: expiry.map_or(0.0, |it| (it.at - now).as_secs_f64()),
            request_id: self.request_id.clone(),
            decision: self.decisions,
        }
    }
}

/// The expiry of a grant given now that is valid for `valid` of mission time.
pub(crate) fn expiry(now: Now, valid: Duration, pace: Pace) -> Expiry {
    let wall_ms = i64::try_from(pace.to_wall(valid).as_millis()).unwrap_or(i64::MAX);
    Expiry { at: now.time + valid, utc_ms: now.utc_ms.saturating_add(wall_ms) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::policy::Verdict;

    fn ask(ledger: &mut Ledger, id: &str, area: &str) -> Result<(), Refusal> {
        let request = v1::PermissionRequest { request_id: id.into(), area: area.into(), step_id: 1 };
        let fresh = expiry(Now::default(), Duration::from_secs(900), Pace::REAL_TIME);
        let answer = || Some(Answer { after: Duration::ZERO, verdict: Verdict::Grant });
        ledger.request(Now::default(), &request, fresh, answer)
    }

    #[test]
    fn a_repeated_request_changes_nothing() {
        let mut ledger = Ledger::default();
        assert_eq!(ask(&mut ledger, "1", "a"), Ok(()));
        assert!(ledger.take_changed());
        assert_eq!(ask(&mut ledger, "1", "a"), Ok(()));
        assert!(!ledger.take_changed());
    }

    #[test]
    fn invalid_requests_are_refused_with_the_reason() {
        let mut ledger = Ledger::default();
        assert_eq!(ask(&mut ledger, "", "a"), Err(Refusal::NoRequestId));
        assert_eq!(ask(&mut ledger, "1", ""), Err(Refusal::NoArea));
        ask(&mut ledger, "1", "a").unwrap();
        let refusal = ask(&mut ledger, "1", "b").unwrap_err();
        assert_eq!(refusal.to_string(), "request `1` asked for area `a` before, and asks for `b` now");
    }

    #[test]
    fn the_ledger_does_not_grow_without_end() {
        let mut ledger = Ledger::default();
        for n in 0..2 * REMEMBERED_REQUESTS {
            let expected = if n < MAX_AREAS { Ok(()) } else { Err(Refusal::TooManyAreas) };
            assert_eq!(ask(&mut ledger, &format!("new {n}"), &format!("area {n}")), expected);
            assert_eq!(ask(&mut ledger, &format!("again {n}"), "area 0"), Ok(()));
        }
        assert_eq!(ledger.requests.len(), REMEMBERED_REQUESTS);
    }

    #[test]
    fn expiry_is_published_in_utc_of_the_wall_clock() {
        let now = Now { time: Time::after(Duration::from_secs(100)), utc_ms: 1_000_000 };
        let expiry = expiry(now, Duration::from_secs(900), Pace::new(20.0).unwrap());
        assert_eq!(expiry.at, Time::after(Duration::from_secs(1000)));
        assert_eq!(expiry.utc_ms, 1_045_000);
    }
}
