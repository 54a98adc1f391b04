//! Every permission of one vehicle, and the requests that were received.
//!
//! The ledger knows when a decision or an expiry is due; the decision itself comes from the policy or from
//! an operator. It forgets an area only where there is no room for another one, and only one about which nothing holds any
//! more: a grant that has expired, or an answer of the policy that the vehicle gets again when it asks again. What is
//! denied or revoked by hand stays so.

use std::collections::BTreeMap;

use domain::area::Extent;
use domain::time::{Now, Time};
use domain::wire::{InvalidMessage, not_empty};
use kittiwake_proto::v1;
use node::Answers;

use crate::numbers::Numbers;
use crate::permission::{self, By, Expiry, Next, NotGranted, Ruling, Standing};
use crate::policy::Answer;
use crate::texts::{MAX_AREA_BYTES, MAX_FLIGHT_BYTES, MAX_REASON_BYTES, MAX_REQUEST_ID_BYTES, shortened};

mod parts;

/// More areas than any mission has; no more are kept, so that they do not fill the memory.
const MAX_AREAS: usize = 256;
/// Of these, at most this many that the vehicle has not asked for: decisions about areas that do not exist cannot take
/// the places of its own requests.
const MAX_UNASKED: usize = MAX_AREAS / 2;
/// Requests remembered, so that a repeated one is recognised: far more than can still be repeated.
const REMEMBERED_REQUESTS: usize = 1024;

/// The permissions of one vehicle.
#[derive(Debug, Default)]
pub(crate) struct Ledger {
    /// By area.
    permissions: BTreeMap<String, Permission>,
    /// The area of each request.
    requests: Answers<String, String, REMEMBERED_REQUESTS>,
    /// A line is gone since the last publication.
    has_forgotten: bool,
}

/// What is known about one area, and the part that the vehicle may know.
#[derive(Debug)]
struct Permission {
    line: Line,
    /// A grant that is not given for good yet. `line` may be a later one: a vehicle that asks faster than can be stored gets this one.
    waiting: Option<Line>,
    /// As it is published; a grant is published only once it is given for good, see [`Ledger::settle`].
    shown: Option<Shown>,
}

/// What is published about an area.
#[derive(Debug)]
struct Shown {
    line: Line,
    /// Since when there is a change of its area that was not said.
    since: Time,
    /// How often it was published since.
    said: u32,
    /// When anything about its area was published last; before that, when there was something to say.
    said_at: Time,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    pub(crate) standing: Standing,
    pub(crate) request_id: String,
    pub(crate) decision: u64,
    /// The flight, and where the area is, as requested last; empty and `None` as long as only people have decided.
    pub(crate) flight: String,
    pub(crate) extent: Option<Extent>,
    /// Why the vehicle entered without permission; empty: it asked last, and waits for the answer.
    pub(crate) entered_because: String,
}

/// Why a request or a ruling was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Refusal {
    /// It names no area.
    #[error("`area` is missing")]
    NoArea,
    /// Without an id a repetition would look like a new request.
    #[error("`request_id` is missing")]
    NoRequestId,
    /// Its flight is too long to be one, and for a ledger.
    #[error("`flight` has {bytes} bytes, more than the {MAX_FLIGHT_BYTES} that are served")]
    LongFlight { bytes: usize },
    /// It does not say for what flight, or where the area is: nothing could be granted by it.
    #[error(transparent)]
    Invalid(#[from] InvalidMessage),
    /// The id was used before, for another area.
    #[error("request `{id}` asked for area `{first}` before, and asks for `{now}` now")]
    OtherArea { id: String, first: String, now: String },
    /// Its name is too long to be kept.
    #[error("`area` has {bytes} bytes, more than the {MAX_AREA_BYTES} that are served")]
    LongName { bytes: usize },
    /// Its id is too long for a ledger.
    #[error("`request_id` has {bytes} bytes, more than the {MAX_REQUEST_ID_BYTES} that are served")]
    LongRequestId { bytes: usize },
    /// The reason is too long for a ledger.
    #[error("`reason` has {bytes} bytes, more than the {MAX_REASON_BYTES} that reach a vehicle: say it shorter")]
    LongReason { bytes: usize },
    /// None of the areas that are kept can be forgotten.
    #[error(
        "there is no room for another area: {MAX_AREAS} are kept for the vehicle, and each is requested, granted, or denied or \
         revoked by hand; grant one that is not needed any more for a second, it makes room once that has expired"
    )]
    TooManyAreas,
    /// Nor any of those about which only people have said anything.
    #[error(
        "there is no room for a decision about another area that the vehicle has not asked for: {MAX_UNASKED} of them are \
         kept, and each is granted, denied or revoked; grant one that is not needed any more for a second, it makes room \
         once that has expired"
    )]
    TooManyUnasked,
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
        if MAX_REQUEST_ID_BYTES < request_id.len() {
            return Err(Refusal::LongRequestId { bytes: request_id.len() });
        }
        check_name(area)?;
        let flight = not_empty("flight", request.flight.clone())?;
        if MAX_FLIGHT_BYTES < flight.len() {
            return Err(Refusal::LongFlight { bytes: flight.len() });
        }
        let extent = Some(request.extent.clone().ok_or(InvalidMessage::Missing("extent"))?.try_into()?);
        numbers.go_on_above(request.latest_decision);
        if let Some(first) = self.requests.get(request_id) {
            return if first == area {
                Ok(())
            } else {
                Err(Refusal::OtherArea { id: request_id.clone(), first: first.clone(), now: area.clone() })
            };
        }
        self.make_room(area, By::Policy, now.time)?;
        self.requests.remember(request_id.clone(), area.clone());
        // What a person has forbidden is forbidden by its name. All else holds for what it was requested for; an answer in advance for
        // whatever is requested first.
        let holds = |it: &Line| {
            let is_the_same = it.flight == flight && it.extent == extent;
            is_the_same || !it.was_asked_for() || it.standing.is_forbidden_by_hand()
        };
        let before = self.permissions.get(area).map(|it| &it.line).filter(|it| holds(it));
        let before = before.map(|it| it.standing.clone());
        let line = self.line(area);
        line.take(permission::on_request(before, now.time, fresh, answer), || numbers.next(now));
        line.request_id.clone_from(request_id);
        (line.flight, line.extent) = (flight, extent);
        line.entered_because = shortened(&request.entered_because, MAX_REASON_BYTES);
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
        check_name(area)?;
        check_reason(&ruling)?;
        let before = self.permissions.get(area).map(|it| &it.line.standing);
        let next = permission::on_ruling(before, now.time, ruling, may_be_granted)?;
        self.make_room(area, By::Operator, now.time)?;
        self.line(area).take(next, || numbers.next(now));
        Ok(())
    }

    /// Makes the decisions that are due, and ends the grants that expire, and those that hold no longer because something is missing.
    pub(crate) fn advance(
        &mut self,
        now: Now,
        numbers: &mut Numbers,
        fresh: Expiry,
        missing: impl Fn(&str, &Standing) -> Option<String>,
    ) {
        for (area, Permission { line, .. }) in &mut self.permissions {
            let missing = missing(area, &line.standing);
            if let Some(next) = permission::on_time(&line.standing, now.time, fresh, missing) {
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
    pub(crate) fn settle(&mut self, now: Time, is_for_good: impl Fn(u64) -> bool) {
        for permission in self.permissions.values_mut() {
            let is_grant = matches!(permission.line.standing, Standing::Granted { .. });
            let settled = if !is_grant || is_for_good(permission.line.decision) {
                permission.waiting = None;
                Some(permission.line.clone())
            } else {
                let settled = permission.waiting.take_if(|it| is_for_good(it.decision));
                permission.waiting.get_or_insert_with(|| permission.line.clone());
                settled
            };
            let is_news = |it: &Line| permission.shown.as_ref().is_none_or(|shown| shown.line != *it);
            if let Some(line) = settled.filter(is_news) {
                // Its turn is that of its area: a change that follows another one takes nobody else's.
                let before = permission.shown.as_ref();
                let since = before.filter(|it| it.said == 0).map_or(now, |it| it.since);
                let said_at = before.map_or(now, |it| it.said_at);
                permission.shown = Some(Shown { line, since, said: 0, said_at });
            }
        }
    }

    /// Every area with what is known about it.
    pub(crate) fn lines(&self) -> impl Iterator<Item = (&String, &Line)> + Clone {
        self.permissions.iter().map(|(area, it)| (area, &it.line))
    }

    /// As a process before knew it.
    pub(crate) fn of_lines(lines: impl IntoIterator<Item = (String, Line)>) -> Ledger {
        let permissions = lines.into_iter().map(|(area, line)| (area, Permission { line, waiting: None, shown: None }));
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

    /// Makes room for `area`, about which nothing is known: forgets what holds no more. What the vehicle has never asked for goes
    /// first, then what was decided longest ago.
    fn make_room(&mut self, area: &str, by: By, now: Time) -> Result<(), Refusal> {
        if self.permissions.contains_key(area) {
            return Ok(());
        }
        let unasked = self.permissions.values().filter(|it| !it.line.was_asked_for()).count();
        let is_unasked_full = by == By::Operator && MAX_UNASKED <= unasked;
        if !is_unasked_full && self.permissions.len() < MAX_AREAS {
            return Ok(());
        }
        let may_go = |line: &Line| line.standing.may_be_forgotten(now) && !(is_unasked_full && line.was_asked_for());
        let forgettable = self.permissions.iter().filter(|(_, it)| may_go(&it.line));
        let first = forgettable.min_by_key(|(_, it)| (it.line.was_asked_for(), it.line.decision));
        let refusal = if is_unasked_full { Refusal::TooManyUnasked } else { Refusal::TooManyAreas };
        let forgotten = first.map(|(area, _)| area.clone()).ok_or(refusal)?;
        self.permissions.remove(&forgotten);
        // Its answer may not have arrived: a repeated request gets another one.
        self.requests.retain(|area| *area != forgotten);
        self.has_forgotten = true;
        Ok(())
    }

    fn line(&mut self, area: &str) -> &mut Line {
        let unknown = || {
            let empty = String::new;
            let standing = Standing::Requested { due: None, missing: empty() };
            let (request_id, flight, entered_because) = (empty(), empty(), empty());
            let line = Line { standing, request_id, decision: 0, flight, extent: None, entered_because };
            Permission { line, waiting: None, shown: None }
        };
        &mut self.permissions.entry(area.to_owned()).or_insert_with(unknown).line
    }
}

/// Whether the name can be kept.
fn check_name(area: &str) -> Result<(), Refusal> {
    match area.len() {
        0 => Err(Refusal::NoArea),
        bytes if MAX_AREA_BYTES < bytes => Err(Refusal::LongName { bytes }),
        _ => Ok(()),
    }
}

/// Whether it can be published.
fn check_reason(ruling: &Ruling) -> Result<(), Refusal> {
    match ruling {
        Ruling::Deny { reason } | Ruling::Revoke { reason } if MAX_REASON_BYTES < reason.len() => {
            Err(Refusal::LongReason { bytes: reason.len() })
        }
        Ruling::Grant { .. } | Ruling::Deny { .. } | Ruling::Revoke { .. } => Ok(()),
    }
}

impl Line {
    /// By the vehicle; otherwise only people have decided about it.
    fn was_asked_for(&self) -> bool {
        !self.request_id.is_empty()
    }

    fn take(&mut self, next: Next, number: impl FnOnce() -> u64) {
        self.standing = next.standing;
        if next.decided {
            self.decision = number();
        }
    }

    pub(crate) fn to_wire(&self, area: &str, now: Time) -> v1::Permission {
        use v1::PermissionState as S;
        let (state, reason, expiry) = match &self.standing {
            Standing::Requested { missing, .. } => (S::Requested, missing.as_str(), None),
            Standing::Granted { expiry, .. } => (S::Granted, "", Some(expiry)),
            Standing::Denied { reason, .. } => (S::Denied, reason.as_str(), None),
            Standing::Revoked { reason, .. } => (S::Revoked, reason.as_str(), None),
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
            signature: Vec::new(),
            vehicle: String::new(),
            flight: self.flight.clone(),
            extent: self.extent.map(Into::into),
            entered_because: self.entered_because.clone(),
        }
    }
}

#[cfg(test)]
mod tests;
