//! Every permission of one vehicle, and the requests that were received.
//!
//! The ledger knows when a decision or an expiry is due; the decision itself comes from the policy or from
//! an operator. It never forgets an area: a vehicle that asks again is the same vehicle.

use std::collections::{BTreeMap, VecDeque};

use domain::time::{Now, Time};
use kittiwake_proto::v1;

use crate::numbers::Numbers;
use crate::permission::{self, Expiry, Next, NotGranted, Ruling, Standing};
use crate::policy::Answer;

/// More areas than any mission has; requests for more are refused, so that they do not fill the memory.
const MAX_AREAS: usize = 256;
/// Requests remembered, so that a repeated one is recognised: far more than can still be repeated.
const REMEMBERED_REQUESTS: usize = 1024;

/// Longer names than any mission has; they come from the network and are stored.
const MAX_AREA_BYTES: usize = 256;

/// The permissions of one vehicle.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    /// By area.
    permissions: BTreeMap<String, Permission>,
    /// Oldest first: request id and area.
    requests: VecDeque<(String, String)>,
    changed: bool,
}

/// What is known about one area, and what of it the vehicle may know.
#[derive(Debug)]
struct Permission {
    line: Line,
    /// As it was published last; a grant is published only once it is given for good, see [`Ledger::settle`].
    shown: Option<Line>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    pub(crate) standing: Standing,
    pub(crate) request_id: String,
    pub(crate) plan_revision: u64,
    pub(crate) decision: u64,
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
    /// Its name is too long to be kept.
    #[error("`area` has {bytes} bytes, more than the {MAX_AREA_BYTES} that are served")]
    LongName { bytes: usize },
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
        numbers: &mut Numbers,
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
        let before = self.permissions.get(area).map(|it| it.line.standing.clone());
        let line = self.line(area);
        line.take(permission::on_request(before, now.time, fresh, answer), || numbers.next(now));
        line.request_id.clone_from(request_id);
        line.plan_revision = request.plan_revision;
        Ok(())
    }

    /// Takes a decision by an operator; see [`permission::on_ruling`].
    pub(crate) fn rule(
        &mut self,
        now: Now,
        numbers: &mut Numbers,
        area: &str,
        ruling: Ruling,
        may_be_granted: bool,
    ) -> Result<(), Refusal> {
        self.accept_area(area)?;
        let before = self.permissions.get(area).map(|it| &it.line.standing);
        let next = permission::on_ruling(before, ruling, may_be_granted)?;
        self.line(area).take(next, || numbers.next(now));
        Ok(())
    }

    /// Makes the decisions that are due, and ends the grants that expire.
    pub(crate) fn advance(&mut self, now: Now, numbers: &mut Numbers, fresh: Expiry) {
        for Permission { line, .. } in self.permissions.values_mut() {
            if let Some(next) = permission::on_time(&line.standing, now.time, fresh) {
                line.take(next, || numbers.next(now));
            }
        }
    }

    /// Asks the policy about each request that nothing is going to answer.
    pub(crate) fn ask_again(&mut self, now: Now, mut answer: impl FnMut() -> Option<Answer>) {
        for Permission { line, .. } in self.permissions.values_mut() {
            if let Some(next) = permission::on_question(&line.standing, now.time, &mut answer) {
                line.standing = next.standing;
            }
        }
    }

    /// Publishes with the next ledger what has been decided, but of the grants only those whose number `is_for_good`: the
    /// vehicle goes by what it was given before until then.
    pub(crate) fn settle(&mut self, is_for_good: impl Fn(u64) -> bool) {
        for Permission { line, shown } in self.permissions.values_mut() {
            let is_grant = matches!(line.standing, Standing::Granted { .. });
            if shown.as_ref() != Some(line) && (!is_grant || is_for_good(line.decision)) {
                *shown = Some(line.clone());
                self.changed = true;
            }
        }
    }

    /// Every area with what is known about it.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (&String, &Line)> {
        self.permissions.iter().map(|(area, it)| (area, &it.line))
    }

    /// As a process before knew it.
    pub(crate) fn of_lines(lines: impl IntoIterator<Item = (String, Line)>) -> Ledger {
        let permissions = lines.into_iter().map(|(area, line)| (area, Permission { line, shown: None }));
        Ledger { permissions: permissions.collect(), ..Ledger::default() }
    }

    /// When [`Ledger::advance`] will next change something.
    pub(crate) fn deadline(&self) -> Option<Time> {
        self.permissions.values().filter_map(|it| permission::deadline(&it.line.standing)).min()
    }

    /// Whether no area was ever requested or decided about.
    pub(crate) fn is_empty(&self) -> bool {
        self.permissions.is_empty()
    }

    /// Whether something has changed since the last call.
    pub(crate) fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// What may be published, as it is sent at `now`.
    pub(crate) fn to_wire(&self, now: Time) -> Vec<v1::Permission> {
        let shown = self.permissions.iter().filter_map(|(area, it)| Some((area, it.shown.as_ref()?)));
        shown.map(|(area, line)| line.to_wire(area, now)).collect()
    }

    fn accept_area(&self, area: &str) -> Result<(), Refusal> {
        if area.is_empty() {
            return Err(Refusal::NoArea);
        }
        if MAX_AREA_BYTES < area.len() {
            return Err(Refusal::LongName { bytes: area.len() });
        }
        if self.permissions.len() == MAX_AREAS && !self.permissions.contains_key(area) {
            return Err(Refusal::TooManyAreas);
        }
        Ok(())
    }

    fn line(&mut self, area: &str) -> &mut Line {
        let unknown = || {
            let standing = Standing::Requested { due: None };
            let line = Line { standing, request_id: String::new(), plan_revision: 0, decision: 0 };
            Permission { line, shown: None }
        };
        &mut self.permissions.entry(area.to_owned()).or_insert_with(unknown).line
    }
}

impl Line {
    fn take(&mut self, next: Next, number: impl FnOnce() -> u64) {
        self.standing = next.standing;
        if next.decided {
            self.decision = number();
        }
    }

    pub(crate) fn to_wire(&self, area: &str, now: Time) -> v1::Permission {
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
            decision: self.decision,
            plan_revision: self.plan_revision,
            signature: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::policy::Verdict;
    use domain::time::Pace;
    use std::time::Duration;

    fn ask(ledger: &mut Ledger, id: &str, area: &str) -> Result<(), Refusal> {
        let request = v1::PermissionRequest { request_id: id.into(), area: area.into(), step_id: 1, plan_revision: 1 };
        let fresh = Expiry::after(Now::default(), Duration::from_secs(900), Pace::REAL_TIME);
        let answer = || Some(Answer { after: Duration::ZERO, verdict: Verdict::Grant });
        let taken = ledger.request(Now::default(), &mut Numbers::default(), &request, fresh, answer);
        ledger.settle(|_| true);
        taken
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
    fn a_grant_is_not_shown_before_it_is_given_for_good_and_everything_else_at_once() {
        let mut ledger = Ledger::default();
        let mut numbers = Numbers::default();
        let now = Now::default();
        let expiry = |s| Expiry::after(now, Duration::from_secs(s), Pace::REAL_TIME);
        let shown = |ledger: &Ledger| {
            let lines = ledger.to_wire(now.time).into_iter();
            lines.map(|it| (it.state().as_str_name().to_owned(), it.valid_for_s, it.decision)).collect::<Vec<_>>()
        };
        let mut rule = |ledger: &mut Ledger, ruling, stored: u64| {
            ledger.rule(now, &mut numbers, "a", ruling, false).unwrap();
            ledger.settle(|number| number <= stored);
        };
        rule(&mut ledger, Ruling::Grant { expiry: expiry(60) }, 0);
        assert_eq!(shown(&ledger), []);
        ledger.settle(|number| number <= 1);
        assert_eq!(shown(&ledger), [("PERMISSION_STATE_GRANTED".to_owned(), 60.0, 1)]);
        rule(&mut ledger, Ruling::Grant { expiry: expiry(90) }, 1);
        assert_eq!(shown(&ledger), [("PERMISSION_STATE_GRANTED".to_owned(), 60.0, 1)], "the one before holds");
        rule(&mut ledger, Ruling::Revoke { reason: String::new() }, 1);
        assert_eq!(shown(&ledger), [("PERMISSION_STATE_REVOKED".to_owned(), 0.0, 3)]);
    }

    #[test]
    fn expiry_is_published_in_utc_of_the_wall_clock() {
        let now = Now { time: Time::after(Duration::from_secs(100)), utc_ms: 1_000_000 };
        let expiry = Expiry::after(now, Duration::from_secs(900), Pace::new(20.0).unwrap());
        assert_eq!(expiry.at, Time::after(Duration::from_secs(1000)));
        assert_eq!(expiry.utc_ms, 1_045_000);
    }
}
