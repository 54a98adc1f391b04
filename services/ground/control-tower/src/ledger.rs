//! Every permission of one vehicle, and which requests have been heard.
//!
//! The ledger knows when a decision or an expiry is due; what the decision is comes from the
//! policy or from a hand. It never forgets an area: a vehicle that asks again is the same vehicle.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use domain::time::{Now, Pace, Time};
use kittiwake_proto::v1;

use crate::permission::{self, Expiry, Next, NotGranted, Ruling, Standing};
use crate::policy::Answer;

/// More areas than any mission has; a vehicle that asks for more is refused, not served until memory ends.
const MOST_AREAS: usize = 256;
/// Requests remembered, so that a repeated one is recognised: far more than can be repeated still.
const REMEMBERED_REQUESTS: usize = 1024;

/// The permissions of one vehicle.
#[derive(Debug, Default)]
pub struct Ledger {
    entries: BTreeMap<String, Entry>,
    /// The requests heard, oldest first: request id and area.
    heard: VecDeque<(String, String)>,
    changed: bool,
}

#[derive(Debug)]
struct Entry {
    standing: Standing,
    request_id: String,
    decisions: u64,
}

/// Why a request or a ruling was not taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It names no area.
    #[error("`area` is missing")]
    NoArea,
    /// Without an id a repetition could not be told from a new request.
    #[error("`request_id` is missing")]
    NoRequestId,
    /// The id came before, for something else.
    #[error("request `{id}` asked for area `{first}` before, and now for `{now}`")]
    OtherArea {
        /// The id.
        id: String,
        /// What it asked for first.
        first: String,
        /// What it asks for now.
        now: String,
    },
    /// The vehicle has asked for too many areas.
    #[error("the vehicle has asked for {MOST_AREAS} areas already")]
    TooManyAreas,
    /// There is nothing to take back.
    #[error(transparent)]
    NotGranted(#[from] NotGranted),
}

impl Ledger {
    /// Takes a request; one whose id was heard before changes nothing. `answer` asks the policy,
    /// `fresh` is the expiry of a grant given now.
    pub fn request(
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
        if let Some((_, first)) = self.heard.iter().find(|(id, _)| id == request_id) {
            return if first == area {
                Ok(())
            } else {
                Err(Refusal::OtherArea { id: request_id.clone(), first: first.clone(), now: area.clone() })
            };
        }
        if self.heard.len() == REMEMBERED_REQUESTS {
            self.heard.pop_front();
        }
        self.heard.push_back((request_id.clone(), area.clone()));
        let before = self.entries.get(area).map(|it| it.standing.clone());
        self.enter(area, permission::on_request(before, now.time, fresh, answer), Some(request_id));
        Ok(())
    }

    /// Takes a decision by hand.
    pub fn rule(&mut self, area: &str, ruling: Ruling) -> Result<(), Refusal> {
        self.accept_area(area)?;
        let next = permission::on_ruling(self.entries.get(area).map(|it| &it.standing), ruling)?;
        self.enter(area, next, None);
        Ok(())
    }

    /// Gives the decisions that are due and ends the grants whose time is up.
    pub fn advance(&mut self, now: Now, fresh: Expiry) {
        for entry in self.entries.values_mut() {
            if let Some(next) = permission::on_time(&entry.standing, now.time, fresh) {
                entry.take(next);
                self.changed = true;
            }
        }
    }

    /// When [`Ledger::advance`] will next change something.
    pub fn deadline(&self) -> Option<Time> {
        self.entries.values().filter_map(|it| permission::deadline(&it.standing)).min()
    }

    /// Whether no area was ever asked for or decided about.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Whether something has changed since this was last asked.
    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// The ledger as it is sent at `now`.
    pub fn to_wire(&self, now: Time) -> v1::PermissionLedger {
        v1::PermissionLedger { permissions: self.entries.iter().map(|(area, it)| it.to_wire(area, now)).collect() }
    }

    fn accept_area(&self, area: &str) -> Result<(), Refusal> {
        if area.is_empty() {
            return Err(Refusal::NoArea);
        }
        if self.entries.len() == MOST_AREAS && !self.entries.contains_key(area) {
            return Err(Refusal::TooManyAreas);
        }
        Ok(())
    }

    fn enter(&mut self, area: &str, next: Next, request_id: Option<&str>) {
        let entry = self.entries.entry(area.to_owned()).or_insert_with(|| Entry {
            standing: Standing::Requested { due: None },
            request_id: String::new(),
            decisions: 0,
        });
        entry.take(next);
        if let Some(id) = request_id {
            entry.request_id = id.to_owned();
        }
        self.changed = true;
    }
}

impl Entry {
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

/// The end of a grant given now that holds for `valid` mission time.
pub fn expiry(now: Now, valid: Duration, pace: Pace) -> Expiry {
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
    fn requests_that_make_no_sense_are_refused() {
        let mut ledger = Ledger::default();
        assert_eq!(ask(&mut ledger, "", "a"), Err(Refusal::NoRequestId));
        assert_eq!(ask(&mut ledger, "1", ""), Err(Refusal::NoArea));
        ask(&mut ledger, "1", "a").unwrap();
        let refusal = ask(&mut ledger, "1", "b").unwrap_err();
        assert_eq!(refusal.to_string(), "request `1` asked for area `a` before, and now for `b`");
    }

    #[test]
    fn the_ledger_does_not_grow_without_end() {
        let mut ledger = Ledger::default();
        for n in 0..2 * REMEMBERED_REQUESTS {
            let expected = if n < MOST_AREAS { Ok(()) } else { Err(Refusal::TooManyAreas) };
            assert_eq!(ask(&mut ledger, &format!("new {n}"), &format!("area {n}")), expected);
            assert_eq!(ask(&mut ledger, &format!("again {n}"), "area 0"), Ok(()));
        }
        assert_eq!(ledger.heard.len(), REMEMBERED_REQUESTS);
    }

    #[test]
    fn expiry_is_told_in_utc_of_the_wall_clock() {
        let now = Now { time: Time::after(Duration::from_secs(100)), utc_ms: 1_000_000 };
        let expiry = expiry(now, Duration::from_secs(900), Pace::new(20.0).unwrap());
        assert_eq!(expiry.at, Time::after(Duration::from_secs(1000)));
        assert_eq!(expiry.utc_ms, 1_045_000);
    }
}
