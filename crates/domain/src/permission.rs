//! Permissions to enter areas, as the control tower's ledger has them.

use std::fmt;
use std::time::Duration;

/// Where a permission stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PermissionState {
    /// Asked for, and not decided.
    Requested,
    /// The area may be entered until the permission expires.
    Granted,
    /// Refused.
    Denied,
    /// Granted and taken back.
    Revoked,
    /// Granted until a moment that has passed.
    Expired,
}

/// One line of the ledger.
#[derive(Debug, Clone, PartialEq)]
pub struct Permission {
    /// For which area.
    pub area: String,
    /// Where it stands.
    pub state: PermissionState,
    /// Why it was denied or revoked.
    pub reason: String,
    /// When it expires, in milliseconds since the Unix epoch, UTC.
    pub expires_utc_ms: i64,
    /// The same from the moment of sending on, in mission time; for receivers whose clock differs.
    pub valid_for: Duration,
    /// The request that was answered.
    pub request_id: String,
    /// Decisions on this area so far; a new decision has a higher number.
    pub decision: u64,
}

/// As a decision record has it.
impl fmt::Display for Permission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (area, reason) = (&self.area, &self.reason);
        match self.state {
            PermissionState::Granted => write!(f, "area {area}: granted"),
            PermissionState::Denied => write!(f, "area {area}: denied ({reason})"),
            PermissionState::Revoked => write!(f, "area {area}: revoked ({reason})"),
            PermissionState::Expired => write!(f, "area {area}: expired"),
            PermissionState::Requested => write!(f, "area {area}: requested"),
        }
    }
}
