//! Permissions to enter areas, as in the control tower's ledger.

use std::fmt;
use std::time::Duration;

/// The state of a permission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PermissionState {
    /// Requested, not decided yet.
    Requested,
    /// The area may be entered until the permission expires.
    Granted,
    /// Denied.
    Denied,
    /// Granted and revoked afterwards.
    Revoked,
    /// Granted, and expired.
    Expired,
}

/// One line of the ledger.
#[derive(Debug, Clone, PartialEq)]
pub struct Permission {
    /// The area.
    pub area: String,
    /// Its state.
    pub state: PermissionState,
    /// Why it was denied or revoked.
    pub reason: String,
    /// When it expires, in milliseconds since the Unix epoch, UTC.
    pub expires_utc_ms: i64,
    /// The same as mission time from the moment of sending, for receivers whose clock differs.
    pub valid_for: Duration,
    /// The request that was answered.
    pub request_id: String,
    /// The number of the last decision on this area, zero before the first; a later one has a higher number.
    pub decision: u64,
    /// The revision of the plan for which it was requested last; zero if it was decided without a request.
    pub plan_revision: u64,
    /// The tower's signature; empty without one. See the crate `signed-permissions`.
    pub signature: Vec<u8>,
}

/// As in a decision record.
impl fmt::Display for Permission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let area = &self.area;
        let because = if self.reason.is_empty() { String::new() } else { format!(" ({})", self.reason) };
        match self.state {
            PermissionState::Granted => write!(f, "area {area}: granted"),
            PermissionState::Denied => write!(f, "area {area}: denied{because}"),
            PermissionState::Revoked => write!(f, "area {area}: revoked{because}"),
            PermissionState::Expired => write!(f, "area {area}: expired"),
            PermissionState::Requested => write!(f, "area {area}: requested"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decision_without_a_reason_has_no_empty_brackets() {
        #[track_caller]
        fn check(state: PermissionState, reason: &str, expected: &str) {
            let permission = Permission {
                area: "A".into(),
                state,
                reason: reason.into(),
                expires_utc_ms: 0,
                valid_for: Duration::ZERO,
                request_id: String::new(),
                decision: 1,
                plan_revision: 0,
                signature: Vec::new(),
            };
            assert_eq!(permission.to_string(), expected);
        }
        check(PermissionState::Denied, "", "area A: denied");
        check(PermissionState::Revoked, "a crane", "area A: revoked (a crane)");
    }
}
