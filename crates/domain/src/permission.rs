//! Permissions to enter areas, as in the control tower's ledger.

use std::fmt;
use std::time::Duration;

use crate::area::Extent;

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
    /// Why it was denied or revoked, or what a grant waits for.
    pub reason: String,
    /// When it expires, in milliseconds since the Unix epoch, UTC.
    pub expires_utc_ms: i64,
    /// The same as mission time from the moment of sending, for receivers whose clock differs.
    pub valid_for: Duration,
    /// The request that was answered.
    pub request_id: String,
    /// The number of the last decision on this area, zero before the first; a later one has a higher number.
    pub decision: u64,
    /// The tower's signature; empty without one. See the crate `signed-permissions`.
    pub signature: Vec<u8>,
    /// The vehicle that may enter.
    pub vehicle: String,
    /// The flight that it was requested for; empty before the first request.
    pub flight: String,
    /// Where the area was by that request.
    pub extent: Option<Extent>,
}

/// An entry that needs a grant, and the newest decision about its area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry<'a> {
    /// The vehicle.
    pub vehicle: &'a str,
    /// Its present flight.
    pub flight: &'a str,
    /// The name of the area.
    pub area: &'a str,
    /// Where the area is; `None`: nobody can say, so no grant is for it.
    pub extent: Option<Extent>,
    /// The highest number of a decision about the area that was heard.
    pub latest: u64,
}

/// Why a permission does not allow an entry.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum NotForIt {
    /// It was denied, revoked or not decided.
    #[error("it is not granted")]
    NotGranted,
    /// It was given to somebody else.
    #[error("it was given to vehicle `{0}`")]
    OtherVehicle(String),
    /// It was given for another flight, most often the one before.
    #[error("it was given for another flight, `{found}`, and this is `{present}`")]
    OtherFlight {
        /// The flight that it names.
        found: String,
        /// The present one.
        present: String,
    },
    /// It was given for another area.
    #[error("it was given for area {0}")]
    OtherArea(String),
    /// It was given for an area of this name that lies elsewhere.
    #[error("it was given for another area of the same name")]
    OtherOutline,
    /// It was given for other heights.
    #[error("it was given for other heights of this area")]
    OtherBand,
    /// The tower has decided again since.
    #[error("a later decision than number {found} is known: {latest}")]
    Replayed {
        /// Its number.
        found: u64,
        /// The highest one that is known.
        latest: u64,
    },
    /// Its time is over.
    #[error("it expired {since_s} s ago")]
    Expired {
        /// Seconds.
        since_s: u64,
    },
}

impl Permission {
    /// Whether this permission allows `entry` while this much of its time is left: the one rule, wherever a grant is accepted, taken
    /// from memory or flown by.
    ///
    /// # Errors
    /// Why it does not.
    pub fn allows(&self, entry: &Entry<'_>, left_ms: i64) -> Result<(), NotForIt> {
        let outline = |it: Option<Extent>| it.map(|it| it.outline);
        if self.state != PermissionState::Granted {
            Err(NotForIt::NotGranted)
        } else if self.vehicle != entry.vehicle {
            Err(NotForIt::OtherVehicle(self.vehicle.clone()))
        } else if self.flight != entry.flight {
            Err(NotForIt::OtherFlight { found: self.flight.clone(), present: entry.flight.to_owned() })
        } else if self.area != entry.area {
            Err(NotForIt::OtherArea(self.area.clone()))
        } else if entry.extent.is_none() || outline(self.extent) != outline(entry.extent) {
            Err(NotForIt::OtherOutline)
        } else if self.extent != entry.extent {
            Err(NotForIt::OtherBand)
        } else if self.decision < entry.latest {
            Err(NotForIt::Replayed { found: self.decision, latest: entry.latest })
        } else if left_ms <= 0 {
            Err(NotForIt::Expired { since_s: left_ms.unsigned_abs() / 1000 })
        } else {
            Ok(())
        }
    }
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
            PermissionState::Requested => write!(f, "area {area}: requested{because}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

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
                signature: Vec::new(),
                vehicle: String::new(),
                flight: String::new(),
                extent: None,
            };
            assert_eq!(permission.to_string(), expected);
        }
        check(PermissionState::Denied, "", "area A: denied");
        check(PermissionState::Revoked, "a crane", "area A: revoked (a crane)");
        check(PermissionState::Requested, "the rotor still turns", "area A: requested (the rotor still turns)");
    }

    fn extent() -> impl Strategy<Value = Extent> {
        let height = || prop::option::of(-3..3i64);
        (0..3u8, height(), height()).prop_map(|(outline, floor_tenth_mm, ceiling_tenth_mm)| Extent {
            outline: [outline; 32],
            floor_tenth_mm,
            ceiling_tenth_mm,
        })
    }

    proptest! {
        /// From few values, so that two drawn ones are often the same.
        #[test]
        fn a_grant_allows_what_it_names_and_nothing_else(
            (vehicle, flight, area) in ("[ab]", "[ab]", "[ab]"),
            (other_vehicle, other_flight, other_area) in ("[ab]", "[ab]", "[ab]"),
            (at, other_at) in (extent(), prop::option::of(extent())),
            (decision, latest, left_ms) in (0..3u64, 0..3u64, -2..3i64),
            is_granted in prop::bool::weighted(0.9),
        ) {
            let permission = Permission {
                area,
                state: if is_granted { PermissionState::Granted } else { PermissionState::Revoked },
                reason: String::new(),
                expires_utc_ms: 0,
                valid_for: Duration::ZERO,
                request_id: String::new(),
                decision,
                signature: Vec::new(),
                vehicle,
                flight,
                extent: Some(at),
            };
            let Permission { vehicle, flight, area, .. } = &permission;
            let own = Entry { vehicle, flight, area, extent: Some(at), latest: decision };
            prop_assert_eq!(permission.allows(&own, 1).is_ok(), is_granted);
            let entries = [
                Entry { vehicle: &other_vehicle, ..own },
                Entry { flight: &other_flight, ..own },
                Entry { area: &other_area, ..own },
                Entry { extent: other_at, ..own },
                Entry { latest, ..own },
                Entry { vehicle: &other_vehicle, flight: &other_flight, area: &other_area, extent: other_at, latest },
            ];
            for entry in entries {
                let is_own = Entry { latest: decision, ..entry } == own && entry.latest <= decision;
                let allowed = permission.allows(&entry, left_ms).is_ok();
                prop_assert_eq!(allowed, is_granted && is_own && 0 < left_ms, "{:?}", entry);
            }
            let nowhere = Permission { extent: None, ..permission.clone() };
            for entry in [own, Entry { extent: None, ..own }] {
                prop_assert!(nowhere.allows(&entry, 1).is_err());
            }
        }
    }
}
