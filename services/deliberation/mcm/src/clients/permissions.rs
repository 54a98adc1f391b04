//! Permissions as the control tower's ledger has them, and the requests for them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use domain::airspace::Grants;
use domain::area::{Area, AreaKind, Extent};
use domain::permission::{Permission, PermissionState};
use domain::plan::{Denial, DenialKind, PermissionNeed, StepId};
use domain::time::{Now, Pace, Time};
use domain::trust::{Doubt, Known, Source, To};
use domain::wire::InvalidMessage;
use kittiwake_proto::topics::Request;
use kittiwake_proto::v1;
use node::CallError;
use signed_permissions::belief::{Belief, Refusal, StoredGrant, Taken, ToAsk, Why};
use signed_permissions::key::PublicKey;

use crate::config::Limits;
use crate::outbox::{Outbox, Purpose};

mod ahead;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Asking {
    /// Not answered yet; when the answer is overdue.
    Awaited(Time),
    /// Neither held nor asked for any more.
    Lost,
    Granted,
    /// Denied, never answered, or not used; [`Permissions::take_denials`] has the reason.
    Denied,
}

/// What is believed of the ledgers, and the requests that are under way.
#[derive(Debug)]
pub(crate) struct Permissions {
    limits: Limits,
    belief: Belief,
    requests: BTreeMap<String, PermissionRequest>,
    /// Areas that were asked for ahead of the step that needs them; it has not begun.
    asked_ahead: BTreeSet<String>,
    /// Areas that were asked for again in flight; no further request before this time.
    renewals: BTreeMap<String, Time>,
    last_request: u64,
    /// The start of the tower whose ledger came last, zero before the first, and since when it is this tower. Live once a ledger in one part
    /// was heard, which is all that the tower knows.
    tower: Known<u64>,
    /// Until when the tower may confirm what was restored; `None` before the first moment.
    confirms_until: Option<Time>,
    /// Areas with why a line of the ledger was refused: each is said once.
    refused: BTreeSet<(String, Refusal)>,
    /// Areas about which the tower was asked because of a line that settles nothing, and whether that says no: the highest number of such a line, and
    /// how often it was asked.
    doubted: BTreeMap<(String, bool), (u64, u32)>,
    /// Makes request ids and flights unique among starts of this process.
    instance: u64,
    /// How many flights this process has begun.
    flights: u64,
    revision: u64,
}

/// Refusals that are said one by one; what a forger invents beyond that is only counted.
const MAX_REFUSALS: usize = 64;

/// Wall time after the start of the process within which a tower that can be heard is heard. (ENG: a ledger comes once a second of wall
/// time, and a link to the ground is there within another.)
const FIRST_LEDGER: Duration = Duration::from_secs(3);

/// A grant that is shorter by up to this much, because of its way here, counts as long enough.
const GRANT_AGE: Duration = Duration::from_secs(2);

/// The life of a request for an area.
#[derive(Debug)]
enum PermissionRequest {
    /// Sent this many times, and not answered yet.
    Sent { tries: u32, answer_by: Time, after_decision: u64, by: StepId, undelivered: Option<CallError> },
    /// Denied; kept until the failed step has been reported.
    Denied(Denial),
}

impl Permissions {
    /// Of `vehicle`; `instance` makes request ids and flights unique among restarts.
    pub(crate) fn new(vehicle: &str, instance: u64, limits: Limits) -> Permissions {
        Permissions {
            limits,
            belief: Belief::new(vehicle, flight(instance, 0), None),
            requests: BTreeMap::new(),
            asked_ahead: BTreeSet::new(),
            renewals: BTreeMap::new(),
            last_request: 0,
            tower: Known::restored(0),
            confirms_until: None,
            refused: BTreeSet::new(),
            doubted: BTreeMap::new(),
            instance,
            flights: 0,
            revision: 0,
        }
    }

    /// The present flight, as requests and grants name it.
    pub(crate) fn flight(&self) -> &str {
        self.belief.flight()
    }

    pub(crate) fn begin_flight(&mut self) {
        self.flights += 1;
        self.belief.begin_flight(flight(self.instance, self.flights));
    }

    /// After a restart this flight goes on.
    pub(crate) fn go_on_with(&mut self, flight: String) {
        self.belief.begin_flight(flight);
    }

    pub(crate) fn know_areas(&mut self, areas: &Arc<[Area]>) {
        self.belief.know_areas(areas);
    }

    /// Only what this key verifies is believed from now on.
    pub(crate) fn verify_with(&mut self, key: PublicKey) {
        self.belief.verify_with(key);
    }

    /// The last decision on each area: to be stored, and restored at the next start.
    pub(crate) fn stored(&self) -> Vec<v1::AreaDecision> {
        let decision = |(area, decision, grant)| {
            let Some(StoredGrant { until_utc_ms, longest, flight, extent }) = grant else {
                return v1::AreaDecision { area, decision, ..Default::default() };
            };
            v1::AreaDecision {
                area,
                decision,
                granted_until_utc_ms: until_utc_ms,
                granted_for_ms: longest.as_millis() as u64,
                flight,
                extent: extent.map(Into::into),
            }
        };
        self.belief.stored().map(decision).collect()
    }

    /// Continues after a restart with the tower's decisions: by the grants among them only what [`Permissions::go_on_with`] names is flown.
    ///
    /// # Errors
    /// If a stored grant is invalid. Its number counts nevertheless.
    pub(crate) fn restore(&mut self, decisions: Vec<v1::AreaDecision>) -> Result<(), InvalidMessage> {
        let mut outcome = Ok(());
        for it in decisions {
            let grant = stored_grant(&it);
            outcome = outcome.and(grant.clone().map(drop));
            self.belief.restore(it.area, it.decision, grant.unwrap_or_default());
        }
        outcome
    }

    /// The present moment: the first one begins what was restored.
    pub(crate) fn pass(&mut self, now: Now, pace: Pace) {
        if self.confirms_until.is_none() {
            self.confirms_until = Some(now.time + pace.wall(FIRST_LEDGER));
            self.belief.begin(now, pace);
        }
    }

    /// Where the permission for `area` is from. A restored one may have been revoked since.
    pub(crate) fn source(&self, area: &str, now: Time) -> Source {
        self.unless_overdue(self.belief.decided(area).map_or(Source::Live, |it| it.source), now)
    }

    /// Whether what the tower has decided is still to be heard after the start: until then nobody knows that a permission is missing.
    pub(crate) fn awaits_first_ledger(&self, now: Time) -> bool {
        self.unless_overdue(self.tower.source, now) == Source::Restored
    }

    /// Whether what the tower has decided about `area` is still to be heard: a ledger may come in several parts.
    pub(crate) fn awaits_first_line(&self, area: &str, now: Time) -> bool {
        self.awaits_first_ledger(now) && !self.belief.is_heard(area)
    }

    /// What the tower has not confirmed in time is doubted.
    fn unless_overdue(&self, source: Source, now: Time) -> Source {
        match source {
            Source::Restored if self.confirms_until.is_none_or(|until| until <= now) => {
                Source::Doubted(Doubt::Unconfirmed)
            }
            _ => source,
        }
    }

    /// Whether `area` may be entered and stayed in now, with a margin before the expiry.
    pub(crate) fn holds(&self, area: &str, now: Time, margin: Duration) -> bool {
        self.belief.remaining(area, now).is_some_and(|remaining| margin < remaining)
    }

    /// How long each permission is held from now on.
    pub(crate) fn grants(&self, now: Time) -> Grants {
        self.belief.areas().filter_map(|area| Some((area.clone(), self.belief.remaining(area, now)?))).collect()
    }

    /// What the tower has denied or revoked last; of these areas, where it was not heard since the start, all that take a permission.
    pub(crate) fn closed(&self, areas: &[Area]) -> Vec<v1::ClosedArea> {
        let is_heard = self.tower.value != 0;
        let unheard = areas.iter().filter(|it| !is_heard && it.kind == AreaKind::Permission);
        let mut closed: BTreeMap<&str, u64> = unheard.map(|it| (it.name.as_str(), 0)).collect();
        closed.extend(self.belief.closed());
        closed.into_iter().map(|(area, decision)| v1::ClosedArea { area: area.to_owned(), decision }).collect()
    }

    /// Counts decisions that changed something, so that a plan that waits for one notices it.
    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// Why the tower is to be asked again about `area`, if it is held by a decision that is older than what is known of the tower.
    pub(crate) fn why_to_confirm(&self, area: &str, now: Time) -> Option<&'static str> {
        let decided = self.belief.decided(area).filter(|it| it.since < self.tower.since)?;
        self.belief.remaining(area, now)?;
        Some(match decided.is_live() {
            true => "because the control tower was started again",
            false => "since it was granted before the start",
        })
    }

    /// Hears which tower there is, in a ledger that is whole or has several parts; returns whether it is another one than before, which
    /// may know less. Where no ledger is whole, [`FIRST_LEDGER`] alone ends the wait for the first.
    pub(crate) fn on_tower(&mut self, now: Time, start: u64, is_whole: bool) -> bool {
        let Known { value: before, source, since } = self.tower;
        self.tower = Known {
            value: start,
            source: if is_whole { Source::Live } else { source },
            since: if start == before { since } else { now },
        };
        ![0, start].contains(&before)
    }

    /// Takes in a ledger. Returns the tower's decisions since the last one, and what is not believed.
    pub(crate) fn on_ledger(&mut self, now: Now, pace: Pace, ledger: Vec<Permission>) -> Taken {
        let taken = self.belief.take(now, pace, ledger);
        self.revision += taken.decided.len() as u64;
        taken
    }

    /// Whether a refusal is to be said: each one once for an area, and not more of them than [`MAX_REFUSALS`].
    pub(crate) fn is_news(&mut self, area: &str, refusal: &Refusal) -> bool {
        self.refused.len() < MAX_REFUSALS && self.refused.insert((area.to_owned(), refusal.clone()))
    }

    /// Asks for `area`, unless a request is under way already.
    pub(crate) fn ask(&mut self, now: Time, area: &str, by: StepId, outbox: &mut Outbox) {
        if !matches!(self.requests.get(area), Some(PermissionRequest::Sent { .. })) {
            let after_decision = self.belief.permission(area).map_or(0, |it| it.decision);
            let request = PermissionRequest::Sent { tries: 0, answer_by: now, after_decision, by, undelivered: None };
            self.requests.insert(area.to_owned(), request);
        }
        self.send_if_overdue(now, area, outbox);
    }

    /// Asks the tower about a line that settles nothing; returns whether that is new. A few requests are enough: what is only a recording comes
    /// again and again.
    pub(crate) fn doubt(&mut self, now: Time, line: &ToAsk, by: StepId, outbox: &mut Outbox) -> bool {
        let key = (line.area.clone(), matches!(line.why, Why::SaysNo { .. }));
        let (highest, tries) = self.doubted.get(&key).copied().unwrap_or_default();
        let tries = if highest < line.decision { 0 } else { tries };
        let is_enough = line.decision < highest || self.limits.permission_tries <= tries;
        if is_enough || !self.renew(now, &line.area, by, outbox) {
            return false;
        }
        self.doubted.insert(key, (line.decision, tries + 1));
        tries == 0
    }

    /// Asks again for `area`, whose permission is held and will expire, or is to be confirmed, or doubted; returns whether a request was
    /// sent. Answers are overdue as for any other request, but silence is not a denial here: the flight reacts to the
    /// expiry itself.
    pub(crate) fn renew(&mut self, now: Time, area: &str, by: StepId, outbox: &mut Outbox) -> bool {
        if self.requests.contains_key(area) || self.renewals.get(area).is_some_and(|until| now < *until) {
            return false;
        }
        self.renewals.insert(area.to_owned(), now + self.limits.permission_answer);
        self.send(area, "", by, outbox);
        true
    }

    /// The state of the request for a permission; sends the request again when the answer is overdue.
    pub(crate) fn asking(&mut self, now: Time, need: &PermissionNeed, outbox: &mut Outbox) -> Asking {
        let PermissionNeed { area, lasts } = need;
        if self.meets(need, now) {
            return Asking::Granted;
        }
        let Some(request) = self.requests.get(area) else { return Asking::Lost };
        let &PermissionRequest::Sent { tries, answer_by, after_decision, undelivered, .. } = request else {
            return Asking::Denied;
        };
        let decided = self.belief.permission(area).filter(|permission| after_decision < permission.decision);
        let (kind, reason) = match decided.map(|permission| (permission.state, permission)) {
            Some((PermissionState::Denied | PermissionState::Revoked, permission)) => {
                let given = Some(&permission.reason).filter(|it| !it.is_empty());
                (DenialKind::Refused, given.map_or("denied without a reason", String::as_str).to_owned())
            }
            Some((PermissionState::Granted, permission)) => {
                let (given_s, needed_s) = (permission.valid_for.as_secs(), lasts.as_secs());
                (DenialKind::TooShort, format!("granted for {given_s} s, {needed_s} s are needed"))
            }
            _ if now < answer_by => return Asking::Awaited(answer_by),
            _ if tries < self.limits.permission_tries => {
                self.send_if_overdue(now, area, outbox);
                return Asking::Awaited(now + self.limits.permission_answer);
            }
            _ => match self.waits_for(area) {
                // The tower is not silent: it says what is missing.
                Some(reason) => (DenialKind::Refused, reason.to_owned()),
                None if undelivered == Some(CallError::Unavailable) => {
                    (DenialKind::Silent, "the control tower is unavailable".to_owned())
                }
                None => (DenialKind::Silent, format!("no answer from the control tower after {tries} tries")),
            },
        };
        let denial = Denial { area: area.clone(), kind, reason };
        self.requests.insert(area.clone(), PermissionRequest::Denied(denial));
        Asking::Denied
    }

    /// What a grant of `area` waits for, as the tower says.
    fn waits_for(&self, area: &str) -> Option<&str> {
        let requested = self.belief.permission(area).filter(|it| it.state == PermissionState::Requested)?;
        Some(requested.reason.as_str()).filter(|it| !it.is_empty())
    }

    /// `area` is not entered although its permission may be held, for this reason: counts as denied for the step that failed.
    pub(crate) fn withhold(&mut self, area: &str, reason: String) {
        let denial = Denial { area: area.to_owned(), kind: DenialKind::Withheld, reason };
        self.requests.insert(area.to_owned(), PermissionRequest::Denied(denial));
    }

    /// Whether every permission that is needed is held, and enough to go on by.
    pub(crate) fn meets(&self, need: &PermissionNeed, now: Time) -> bool {
        let least = need.lasts.max(self.limits.permission_margin);
        // A grant is already a moment old when it arrives.
        let lasts = self.belief.remaining(&need.area, now).is_some_and(|remaining| least < remaining + GRANT_AGE);
        lasts && self.source(&need.area, now).permits(To::GoOn)
    }

    /// The request for `area` is given up, or has been answered; a late grant still counts.
    pub(crate) fn stop_asking(&mut self, area: &str) {
        if matches!(self.requests.get(area), Some(PermissionRequest::Sent { .. })) {
            self.requests.remove(area);
        }
    }

    /// The denials since the last call.
    pub(crate) fn take_denials(&mut self) -> Vec<Denial> {
        let denied = self.requests.extract_if(.., |_, request| matches!(request, PermissionRequest::Denied(_)));
        denied
            .filter_map(|(_, request)| if let PermissionRequest::Denied(it) = request { Some(it) } else { None })
            .collect()
    }

    pub(crate) fn denial(&self, area: &str) -> Option<&Denial> {
        let PermissionRequest::Denied(denial) = self.requests.get(area)? else { return None };
        Some(denial)
    }

    /// The areas that were asked for and not answered yet.
    pub(crate) fn awaited(&self, now: Time) -> Vec<v1::AwaitedPermission> {
        let (answer_s, limit) = (self.limits.permission_answer.as_secs_f64(), f64::from(self.limits.permission_tries));
        let awaited = |(area, request): (&String, &PermissionRequest)| {
            let PermissionRequest::Sent { tries, answer_by, .. } = request else { return None };
            let waited_s = (f64::from(*tries) * answer_s - (*answer_by - now).as_secs_f64()).max(0.0);
            Some(v1::AwaitedPermission { area: area.clone(), waited_s, limit_s: limit * answer_s })
        };
        self.requests.iter().filter_map(awaited).collect()
    }

    pub(crate) fn on_undelivered(&mut self, area: &str, error: CallError) {
        if let Some(PermissionRequest::Sent { undelivered, .. }) = self.requests.get_mut(area) {
            *undelivered = Some(error);
        }
    }

    /// The tower has refused the request: a denial, and no decision follows that could be waited for.
    pub(crate) fn on_refused(&mut self, area: &str, reason: String) {
        if let Some(request @ PermissionRequest::Sent { .. }) = self.requests.get_mut(area) {
            *request = PermissionRequest::Denied(Denial { area: area.to_owned(), kind: DenialKind::Refused, reason });
        }
    }

    fn send_if_overdue(&mut self, now: Time, area: &str, outbox: &mut Outbox) {
        let Some(PermissionRequest::Sent { tries, answer_by, by, .. }) = self.requests.get_mut(area) else { return };
        if now < *answer_by {
            return;
        }
        *tries += 1;
        *answer_by = now + self.limits.permission_answer;
        let by = *by;
        self.send(area, "", by, outbox);
    }

    /// Asks for `area`; tells the tower of an entry that does not wait for its answer, for the reason `entered_because`, if there is one.
    pub(crate) fn send(&mut self, area: &str, entered_because: &str, by: StepId, outbox: &mut Outbox) {
        self.last_request += 1;
        let request = v1::PermissionRequest {
            request_id: format!("mcm-{:x}-p{}", self.instance, self.last_request),
            area: area.to_owned(),
            step_id: by.0,
            latest_decision: self.belief.highest(),
            flight: self.flight().to_owned(),
            extent: self.belief.extent(area).map(Into::into),
            entered_because: entered_because.to_owned(),
        };
        outbox.call(Purpose::Permission(area.to_owned()), Request::Permission(request), self.limits.permission_answer);
    }
}

/// The grant of a stored decision, if it is one.
fn stored_grant(it: &v1::AreaDecision) -> Result<Option<StoredGrant>, InvalidMessage> {
    if it.granted_for_ms == 0 {
        return Ok(None);
    }
    Ok(Some(StoredGrant {
        until_utc_ms: it.granted_until_utc_ms,
        longest: Duration::from_millis(it.granted_for_ms),
        flight: it.flight.clone(),
        extent: it.extent.clone().map(Extent::try_from).transpose()?,
    }))
}

/// The name of a flight: no other process that was ever started has given it.
fn flight(instance: u64, number: u64) -> String {
    format!("{instance:x}-{number}")
}
