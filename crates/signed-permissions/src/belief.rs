//! What a vehicle believes of the ledgers that it hears.
//!
//! A line is believed if its signature is the tower's under this vehicle's name, if no later decision about its area was heard
//! (also before a restart), if its window has not ended, and if it was not given for a plan that this vehicle has never made.
//! A grant never lasts longer than its signed window, nor longer than any earlier sending of it said.
//!
//! Without a key nothing is verified; the order of decisions counts all the same.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::permission::{Permission, PermissionState};
use domain::time::{Now, Pace, Time};

use crate::key::PublicKey;

/// More areas than any mission has, and than a tower serves; the names come from the network.
const MAX_AREAS: usize = 1024;

/// What one vehicle believes.
#[derive(Debug)]
pub struct Belief {
    vehicle: String,
    key: Option<PublicKey>,
    lines: BTreeMap<String, Line>,
    /// The highest number of a decision by area, also from before a restart.
    latest: BTreeMap<String, u64>,
}

/// What is believed about an area.
#[derive(Debug, Clone, PartialEq)]
struct Line {
    permission: Permission,
    expires: Time,
}

/// Why a line is not believed.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Refusal {
    /// A key is configured, and the line has no signature.
    #[error("it is not signed")]
    Unsigned,
    /// Somebody has changed it, or it is another vehicle's, or signed by somebody else.
    #[error("its signature is not the tower's for this vehicle")]
    NotTheTowers,
    /// A grant, repeated after a later decision.
    #[error("a later decision than number {found} is known: {latest}")]
    Replayed {
        /// Its number.
        found: u64,
        /// The highest one that is known.
        latest: u64,
    },
    /// A grant whose window has ended.
    #[error("it expired {since_s} s ago")]
    Expired {
        /// Wall seconds.
        since_s: u64,
    },
    /// A grant for a plan of the future.
    #[error("it was given for plan {found}, and the newest is {newest}")]
    UnknownPlan {
        /// The revision for which it was given.
        found: u64,
        /// The newest revision.
        newest: u64,
    },
    /// The areas of this vehicle are too many to be kept.
    #[error("{MAX_AREAS} areas are known already")]
    TooMany,
}

/// What came of a ledger.
#[derive(Debug, Default, PartialEq)]
pub struct Taken {
    /// Decisions that are new.
    pub decided: Vec<Permission>,
    /// Areas whose line was refused.
    pub refused: Vec<(String, Refusal)>,
}

impl Belief {
    /// Of `vehicle`, which verifies with `key`.
    pub fn new(vehicle: &str, key: Option<PublicKey>) -> Belief {
        Belief { vehicle: vehicle.to_owned(), key, lines: BTreeMap::new(), latest: BTreeMap::new() }
    }

    /// Believes only what this key verifies from now on.
    pub fn verify_with(&mut self, key: PublicKey) {
        self.key = Some(key);
    }

    /// The highest number of a decision by area: to be stored, and restored at the next start.
    pub fn latest(&self) -> &BTreeMap<String, u64> {
        &self.latest
    }

    /// Continues after a restart.
    pub fn restore(&mut self, latest: impl IntoIterator<Item = (String, u64)>) {
        self.latest = latest.into_iter().take(MAX_AREAS).collect();
    }

    /// Takes in a ledger. `newest_plan` is the highest revision of a plan that this vehicle has made.
    pub fn take(&mut self, now: Now, pace: Pace, newest_plan: u64, ledger: Vec<Permission>) -> Taken {
        let mut taken = Taken::default();
        for permission in ledger {
            match self.judge(now, newest_plan, &permission) {
                Ok(Judgement::Old) => {}
                Ok(Judgement::Believed) => taken.decided.extend(self.believe(now, pace, permission)),
                Err(refusal) => taken.refused.push((permission.area, refusal)),
            }
        }
        taken
    }

    /// How long the grant for `area` is believed from now on; `None`: there is none.
    pub fn remaining(&self, area: &str, now: Time) -> Option<Duration> {
        let line = self.lines.get(area).filter(|it| it.permission.state == PermissionState::Granted)?;
        Some(line.expires - now).filter(|it| !it.is_zero())
    }

    /// What is known of `area`.
    pub fn permission(&self, area: &str) -> Option<&Permission> {
        self.lines.get(area).map(|it| &it.permission)
    }

    /// The areas about which something is known.
    pub fn areas(&self) -> impl Iterator<Item = &String> {
        self.lines.keys()
    }

    fn judge(&self, now: Now, newest_plan: u64, permission: &Permission) -> Result<Judgement, Refusal> {
        let Permission { area, decision, plan_revision, expires_utc_ms, .. } = permission;
        let is_grant = permission.state == PermissionState::Granted;
        if let Some(key) = self.key {
            if permission.signature.is_empty() {
                return Err(Refusal::Unsigned);
            }
            if !key.verifies(&self.vehicle, permission) {
                return Err(Refusal::NotTheTowers);
            }
        }
        let latest = self.latest.get(area).copied();
        if let Some(latest) = latest.filter(|it| decision < it) {
            // What is no grant does no harm: two connections may swap two messages.
            return if is_grant { Err(Refusal::Replayed { found: *decision, latest }) } else { Ok(Judgement::Old) };
        }
        if self.key.is_some() && is_grant {
            if newest_plan < *plan_revision {
                return Err(Refusal::UnknownPlan { found: *plan_revision, newest: newest_plan });
            }
            if *expires_utc_ms <= now.utc_ms {
                // That a grant which is known ends is nothing to refuse: it ends here as well.
                let is_known = self.lines.get(area).is_some_and(|it| it.permission.decision == *decision);
                let since_s = now.utc_ms.abs_diff(*expires_utc_ms) / 1000;
                return if is_known { Ok(Judgement::Old) } else { Err(Refusal::Expired { since_s }) };
            }
        }
        if latest.is_none() && MAX_AREAS <= self.latest.len() {
            return Err(Refusal::TooMany);
        }
        Ok(Judgement::Believed)
    }

    /// Returns the permission if it is a new decision.
    fn believe(&mut self, now: Now, pace: Pace, permission: Permission) -> Option<Permission> {
        let before = self.lines.get(&permission.area);
        let mut expires = now.time + permission.valid_for;
        if self.key.is_some() {
            let left_ms = u64::try_from(permission.expires_utc_ms.saturating_sub(now.utc_ms)).unwrap_or_default();
            expires = expires.min(now.time + pace.wall(Duration::from_millis(left_ms)));
        }
        if let Some(same) = before.filter(|it| it.was_granted() && it.permission.decision == permission.decision) {
            expires = expires.min(same.expires);
        }
        let state = |it: &Permission| (it.state, it.decision);
        let is_new = before.is_none_or(|it| state(&it.permission) != state(&permission));
        self.latest.insert(permission.area.clone(), permission.decision);
        self.lines.insert(permission.area.clone(), Line { expires, permission: permission.clone() });
        Some(permission).filter(|it| is_new && it.state != PermissionState::Requested)
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
    Believed,
}

#[cfg(test)]
mod tests;
