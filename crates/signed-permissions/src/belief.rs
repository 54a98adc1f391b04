//! What a vehicle believes of the ledgers that it hears.
//!
//! A line is believed if its signature is the tower's and it is this vehicle's, and if no later decision about its area was heard (also before
//! a restart). What a grant allows is one rule, [`Permission::allows`]: it is asked when a grant is heard, and each time that somebody wants to
//! fly by it, since the mission, and with it the place that a name stands for, may change in between. So a grant of an earlier flight, or for
//! another area of the same name, lets nobody in, also where it was heard or stored before.
//!
//! A grant never lasts longer than its signed window, by the wall clock when the grant was heard first, nor longer than
//! any earlier copy of the grant said.
//!
//! A restart in flight forgets no grant: it is believed until its end, or until the tower decides again. The remaining
//! time is computed by the wall clock, since no other clock goes on between two processes; a clock that was set
//! meanwhile is wrong only until the tower is heard. The tower may have revoked the grant meanwhile, and a message with
//! the grant's number may be a recording: the source of [`Belief::decided`] tells that, and the tower is to be asked.
//!
//! A denial or revocation with a lower number than is known is not believed either: it may be a recording, and the later grant holds.
//! But where a grant is held, it may also be the word of a tower that has lost its numbers and whose clock was set back. It is reported as
//! outdated, and the vehicle asks the tower again, a few times, naming the highest number that it knows: what the tower answers is above
//! that. A recording achieves a question, and an answer that may renew the grant.
//!
//! Without a key no signature is verified; everything else counts all the same.
//!
//! Where there is no room for another area, the one that was decided about longest ago and is not granted is forgotten. Numbers
//! of decisions rise over all areas, so no grant of an area that is not known is believed that is as old as what was forgotten.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use domain::area::{Area, Extent};
use domain::permission::{Entry, NotForIt, Permission, PermissionState};
use domain::time::{Now, Pace, Time};
use domain::trust::Known;

use crate::key::PublicKey;

/// More areas than any mission has, and than a tower serves; the names come from the network.
const MAX_AREAS: usize = 1024;

/// What one vehicle believes.
#[derive(Debug)]
pub struct Belief {
    vehicle: String,
    flight: String,
    /// The mission's areas, as far as they are known, and where each name lies: nowhere for certain if two areas of that name differ.
    areas: Arc<[Area]>,
    extents: BTreeMap<String, Option<Extent>>,
    key: Option<PublicKey>,
    /// Live once this process has heard it, also with a number from before the start.
    lines: BTreeMap<String, Known<Line>>,
    /// The highest number of a decision by area. Live once the tower has decided since the start: a line with a restored number may be a
    /// recording.
    latest: BTreeMap<String, Known<u64>>,
    /// The highest number of a decision that was forgotten.
    forgotten: Option<u64>,
    /// Restored grants, until the first moment is known.
    stored: BTreeMap<String, StoredGrant>,
}

/// What is believed about an area.
#[derive(Debug, Clone, PartialEq)]
struct Line {
    permission: Permission,
    expires: Time,
    /// As it is to be stored if it is a grant.
    stored: StoredGrant,
}

/// A grant as the next process needs it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredGrant {
    /// Until when it is believed, by this machine's clock.
    pub until_utc_ms: i64,
    /// Its remaining mission time when it was heard first. It never has more later, whatever a clock says.
    pub longest: Duration,
    /// The flight that it was given for.
    pub flight: String,
    /// Where the area was that it was given for.
    pub extent: Option<Extent>,
}

/// A stored end that differs by less is kept, so that the state is not written with every ledger. (ENG: the way of a ledger takes
/// some milliseconds, now more, now fewer.)
const SAME_END_MS: u64 = 1000;
/// Longer than any grant; a longer one could not be reckoned with.
const LONGEST: Duration = Duration::from_secs(1 << 32);

/// Why a line is not believed.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Refusal {
    /// A key is configured, and the line has no signature.
    #[error("it is not signed")]
    Unsigned,
    /// Somebody has changed it, or signed it in the tower's place.
    #[error("its signature is not the tower's")]
    NotTheTowers,
    /// It is not for what this vehicle may need a grant for.
    #[error(transparent)]
    NotForIt(#[from] NotForIt),
    /// The areas of this vehicle are too many to be kept.
    #[error("{MAX_AREAS} areas are granted already")]
    TooMany,
}

/// What came of a ledger.
#[derive(Debug, Default, PartialEq)]
pub struct Taken {
    /// Decisions that are new, and requests of which the tower says something new about what their grant waits for.
    pub decided: Vec<Permission>,
    /// Areas whose line was refused.
    pub refused: Vec<(String, Refusal)>,
    /// Lines about which the tower is to be asked: what they say counts only if it says so again, with a higher number.
    pub to_ask: Vec<ToAsk>,
}

/// A line about which the tower is to be asked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ToAsk {
    /// The area.
    pub area: String,
    /// The number of the line.
    pub decision: u64,
    /// Why the line settles nothing.
    pub why: Why,
}

/// Why a line settles nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// It grants in advance: the tower has not said yet where the area is.
    InAdvance,
    /// It grants with a number from before the start: it may be a recording of a grant that was revoked since.
    BeforeTheStart,
    /// It denies or revokes what is granted, with a lower number than the highest one that is known about the area.
    SaysNo {
        /// The highest number.
        latest: u64,
    },
}

impl Belief {
    /// Of `vehicle` in `flight`, which verifies with `key`.
    pub fn new(vehicle: &str, flight: String, key: Option<PublicKey>) -> Belief {
        Belief {
            vehicle: vehicle.to_owned(),
            flight,
            areas: Arc::default(),
            extents: BTreeMap::new(),
            key,
            lines: BTreeMap::new(),
            latest: BTreeMap::new(),
            forgotten: None,
            stored: BTreeMap::new(),
        }
    }

    /// Believes only what this key verifies from now on.
    pub fn verify_with(&mut self, key: PublicKey) {
        self.key = Some(key);
    }

    /// The present flight.
    pub fn flight(&self) -> &str {
        &self.flight
    }

    /// Another flight begins, or goes on after a restart: no grant of any other one counts.
    pub fn begin_flight(&mut self, flight: String) {
        self.flight = flight;
    }

    /// The mission's areas, as they are known now: no grant counts for a place that it does not name.
    pub fn know_areas(&mut self, areas: &Arc<[Area]>) {
        if Arc::ptr_eq(&self.areas, areas) {
            return;
        }
        self.areas = areas.clone();
        self.extents.clear();
        for area in &**areas {
            let extent = Some(area.extent());
            let known = self.extents.entry(area.name.clone()).or_insert(extent);
            *known = known.filter(|it| Some(*it) == extent);
        }
    }

    /// Where `area` is; `None` if that is not known for certain.
    pub fn extent(&self, area: &str) -> Option<Extent> {
        self.extents.get(area).copied().flatten()
    }

    /// The highest number of a decision about any area; zero before the first.
    pub fn highest(&self) -> u64 {
        self.latest.values().map(|it| it.value).chain(self.forgotten).max().unwrap_or_default()
    }

    /// The number of the last decision about `area`.
    pub fn decided(&self, area: &str) -> Option<Known<u64>> {
        self.latest.get(area).copied()
    }

    /// The last decision on each area, with its grant if it is one: to be stored, and restored at the next start.
    pub fn stored(&self) -> impl Iterator<Item = (String, u64, Option<StoredGrant>)> {
        self.latest.iter().map(|(area, decision)| (area.clone(), decision.value, self.stored_grant(area)))
    }

    fn stored_grant(&self, area: &str) -> Option<StoredGrant> {
        let granted = |it: &&Known<Line>| it.value.permission.state == PermissionState::Granted;
        let line = self.lines.get(area).filter(granted);
        line.map(|it| &it.value.stored).or_else(|| self.stored.get(area)).cloned()
    }

    /// Continues after a restart with a decision on `area`. A grant counts from [`Belief::begin`] on.
    pub fn restore(&mut self, area: String, decision: u64, grant: Option<StoredGrant>) {
        if self.latest.len() < MAX_AREAS {
            self.stored.extend(grant.map(|it| (area.clone(), it)));
            self.latest.insert(area, Known::restored(decision));
        }
    }

    /// The first moment of this process: what remains of the grants from before is known now.
    pub fn begin(&mut self, now: Now, pace: Pace) {
        for (area, grant) in std::mem::take(&mut self.stored) {
            let left_ms = u64::try_from(grant.until_utc_ms.saturating_sub(now.utc_ms)).unwrap_or_default();
            let valid_for = pace.wall(Duration::from_millis(left_ms).min(LONGEST)).min(grant.longest);
            let permission = Permission {
                area: area.clone(),
                state: PermissionState::Granted,
                reason: String::new(),
                expires_utc_ms: grant.until_utc_ms,
                valid_for,
                request_id: String::new(),
                decision: self.latest.get(&area).map_or(0, |it| it.value),
                signature: Vec::new(),
                vehicle: self.vehicle.clone(),
                flight: grant.flight.clone(),
                extent: grant.extent,
            };
            let expires = now.time + valid_for;
            self.lines.entry(area).or_insert(Known::restored(Line { permission, expires, stored: grant }));
        }
        if MAX_AREAS <= self.latest.len() {
            // The process before may have forgotten others; they were decided about before those that it kept without a grant.
            self.forgotten = self.least_needed(now).and_then(|it| self.decided(&it)).map(|it| it.value);
        }
    }

    /// Takes in a ledger.
    pub fn take(&mut self, now: Now, pace: Pace, ledger: Vec<Permission>) -> Taken {
        let mut taken = Taken::default();
        for permission in ledger {
            match self.judge(now, &permission) {
                Ok(Judgement::Old) => taken.to_ask.extend(self.outdated(now, &permission)),
                Ok(Judgement::InAdvance) => {
                    let Permission { area, decision, .. } = permission;
                    if self.extent(&area).is_some() && self.remaining(&area, now.time).is_none() {
                        taken.to_ask.push(ToAsk { area, decision, why: Why::InAdvance });
                    }
                }
                Ok(Judgement::Believed) => {
                    let (area, decision) = (permission.area.clone(), permission.decision);
                    taken.decided.extend(self.believe(now, pace, permission));
                    let is_restored = self.decided(&area).is_some_and(|it| !it.is_live());
                    if is_restored && self.remaining(&area, now.time).is_some() {
                        taken.to_ask.push(ToAsk { area, decision, why: Why::BeforeTheStart });
                    }
                }
                Err(refusal) => taken.refused.push((permission.area, refusal)),
            }
        }
        taken
    }

    /// How long `area`, as it is now, may be entered in this flight; `None`: no grant allows it.
    pub fn remaining(&self, area: &str, now: Time) -> Option<Duration> {
        let line = &self.lines.get(area)?.value;
        let left = line.expires - now;
        let left_ms = i64::try_from(left.as_millis()).unwrap_or(i64::MAX);
        line.permission.allows(&self.entry(area, self.extent(area)), left_ms).is_ok().then_some(left)
    }

    fn entry<'a>(&'a self, area: &'a str, extent: Option<Extent>) -> Entry<'a> {
        let latest = self.decided(area).map_or(0, |it| it.value);
        Entry { vehicle: &self.vehicle, flight: &self.flight, area, extent, latest }
    }

    /// What is known of `area`.
    pub fn permission(&self, area: &str) -> Option<&Permission> {
        self.lines.get(area).map(|it| &it.value.permission)
    }

    /// The areas that the tower has denied or revoked last, each with the number of that decision. After a restart only the numbers of such
    /// decisions are known: until the tower is heard, an area without a grant counts as closed.
    pub fn closed(&self) -> impl Iterator<Item = (&str, u64)> {
        let is_closed = move |area: &String| match self.lines.get(area) {
            Some(line) => matches!(line.value.permission.state, PermissionState::Denied | PermissionState::Revoked),
            None => !self.stored.contains_key(area),
        };
        let closed = self.latest.iter().filter(move |(area, decision)| 0 < decision.value && is_closed(area));
        closed.map(|(area, decision)| (area.as_str(), decision.value))
    }

    /// Whether this process has heard what the tower has decided about `area`.
    pub fn is_heard(&self, area: &str) -> bool {
        self.lines.get(area).is_some_and(Known::is_live)
    }

    /// The areas about which something is known.
    pub fn areas(&self) -> impl Iterator<Item = &String> {
        self.lines.keys()
    }

    fn judge(&self, now: Now, permission: &Permission) -> Result<Judgement, Refusal> {
        let Permission { area, decision, vehicle, expires_utc_ms, .. } = permission;
        let is_grant = permission.state == PermissionState::Granted;
        if let Some(key) = self.key {
            if permission.signature.is_empty() {
                return Err(Refusal::Unsigned);
            }
            if !key.verifies(permission) {
                return Err(Refusal::NotTheTowers);
            }
        }
        if *vehicle != self.vehicle {
            return Err(NotForIt::OtherVehicle(vehicle.clone()).into());
        }
        let latest = self.decided(area).map(|it| it.value);
        if is_grant && permission.extent.is_none() {
            // It is for nothing yet: the tower says for what once it was asked.
            return Ok(if latest.is_none_or(|it| it <= *decision) { Judgement::InAdvance } else { Judgement::Old });
        } else if is_grant {
            // Where an area is that is not known yet is asked once the grant is needed.
            let extent = self.extents.get(area).copied().unwrap_or(permission.extent);
            let left_ms = expires_utc_ms.saturating_sub(now.utc_ms);
            // That a grant which is known ends is nothing to refuse: it ends here as well.
            let is_same = |it: &Known<Line>| it.is_live() && it.value.permission.decision == *decision;
            match permission.allows(&self.entry(area, extent), left_ms) {
                Err(NotForIt::Expired { .. }) if self.lines.get(area).is_some_and(is_same) => {
                    return Ok(Judgement::Old);
                }
                allowed => allowed?,
            }
        } else if latest.is_some_and(|it| *decision < it) {
            // It does no harm: two connections may swap two messages.
            return Ok(Judgement::Old);
        }
        if latest.is_none() {
            if let Some(latest) = self.forgotten.filter(|it| decision <= it) {
                let found = *decision;
                return if is_grant { Err(NotForIt::Replayed { found, latest }.into()) } else { Ok(Judgement::Old) };
            }
            if MAX_AREAS <= self.latest.len() && self.least_needed(now).is_none() {
                return Err(Refusal::TooMany);
            }
        }
        Ok(Judgement::Believed)
    }

    /// Whether the line says no to what is granted, with a lower number.
    fn outdated(&self, now: Now, permission: &Permission) -> Option<ToAsk> {
        let &Permission { ref area, state, decision, .. } = permission;
        let latest = self.decided(area).map(|it| it.value).filter(|it| decision < *it)?;
        let says_no = matches!(state, PermissionState::Denied | PermissionState::Revoked);
        let is_granted = self.remaining(area, now.time).is_some();
        (says_no && is_granted).then(|| ToAsk { area: area.clone(), decision, why: Why::SaysNo { latest } })
    }

    /// The area that was decided about longest ago of those that are not granted.
    fn least_needed(&self, now: Now) -> Option<String> {
        let holds_nothing =
            |it: &Known<Line>| it.value.permission.state != PermissionState::Granted || it.value.expires <= now.time;
        let not_granted = self.latest.iter().filter(|(area, _)| self.lines.get(*area).is_none_or(holds_nothing));
        not_granted.min_by_key(|(_, decision)| decision.value).map(|(area, _)| area.clone())
    }

    fn make_room(&mut self, area: &str, now: Now) {
        if MAX_AREAS <= self.latest.len()
            && !self.latest.contains_key(area)
            && let Some(least_needed) = self.least_needed(now)
        {
            self.lines.remove(&least_needed);
            self.forgotten = self.forgotten.max(self.latest.remove(&least_needed).map(|it| it.value));
        }
    }

    /// Returns the permission if it is a new decision, or says something new about what a grant waits for.
    fn believe(&mut self, now: Now, pace: Pace, permission: Permission) -> Option<Permission> {
        // The end of one that was not heard since the start is reckoned by a clock that may have been set: it limits nothing.
        let before = self.lines.get(&permission.area).filter(|it| it.is_live()).map(|it| &it.value);
        let mut expires = now.time + permission.valid_for;
        let same = before.filter(|it| it.was_granted() && it.permission.decision == permission.decision);
        if let Some(same) = same {
            // The window was reckoned with when it was heard first. From then on the clock of this process counts, which goes on evenly:
            // a wall clock that is wrong for a moment cuts no grant.
            expires = expires.min(same.expires);
        } else {
            let left_ms = u64::try_from(permission.expires_utc_ms.saturating_sub(now.utc_ms)).unwrap_or_default();
            expires = expires.min(now.time + pace.wall(Duration::from_millis(left_ms)));
        }
        let stored = stored(now, pace, &permission, expires, same.map(|it| it.stored.clone()));
        // That it is requested is news only with what a grant waits for.
        let is_requested = permission.state == PermissionState::Requested;
        let state = |it: &Permission| (it.state, it.decision, is_requested.then(|| it.reason.clone()));
        let is_new = before.is_none_or(|it| state(&it.permission) != state(&permission));
        let is_new = is_new && !(is_requested && permission.reason.is_empty());
        self.make_room(&permission.area, now);
        let (area, decision) = (permission.area.clone(), permission.decision);
        let known = self.decided(&area).filter(|it| it.value == decision);
        self.latest.insert(area.clone(), known.unwrap_or(Known::live(decision, now.time)));
        let line = Line { permission: permission.clone(), expires, stored };
        self.lines.insert(area, Known::live(line, now.time));
        Some(permission).filter(|_| is_new)
    }
}

/// A grant that ends at `expires` as it is to be stored; `before`: as it was.
fn stored(now: Now, pace: Pace, permission: &Permission, expires: Time, before: Option<StoredGrant>) -> StoredGrant {
    let left = (expires - now.time).min(LONGEST);
    let left_ms = i64::try_from(pace.to_wall(left).as_millis()).unwrap_or(i64::MAX);
    let until_utc_ms = now.utc_ms.saturating_add(left_ms);
    match before {
        Some(before) if before.until_utc_ms.abs_diff(until_utc_ms) < SAME_END_MS => before,
        // The clock was set, or less is left than was said at first.
        Some(before) => StoredGrant { until_utc_ms, ..before },
        None => {
            let Permission { flight, extent, .. } = permission.clone();
            StoredGrant { until_utc_ms, longest: left, flight, extent }
        }
    }
}

impl Line {
    /// Whether its decision was a grant, which may have expired since.
    fn was_granted(&self) -> bool {
        matches!(self.permission.state, PermissionState::Granted | PermissionState::Expired)
    }
}

enum Judgement {
    /// Neither wrong nor news.
    Old,
    InAdvance,
    Believed,
}

#[cfg(test)]
mod tests;
