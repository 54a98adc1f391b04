//! Permissions.

use kittiwake_proto::v1;

use super::{InvalidMessage, duration, not_empty, out_of_range};
use crate::area::Extent;
use crate::permission::{Permission, PermissionState};

impl From<PermissionState> for v1::PermissionState {
    fn from(state: PermissionState) -> v1::PermissionState {
        match state {
            PermissionState::Requested => v1::PermissionState::Requested,
            PermissionState::Granted => v1::PermissionState::Granted,
            PermissionState::Denied => v1::PermissionState::Denied,
            PermissionState::Revoked => v1::PermissionState::Revoked,
            PermissionState::Expired => v1::PermissionState::Expired,
        }
    }
}

impl TryFrom<v1::PermissionState> for PermissionState {
    type Error = InvalidMessage;
    fn try_from(state: v1::PermissionState) -> Result<PermissionState, InvalidMessage> {
        match state {
            v1::PermissionState::Unspecified => Err(InvalidMessage::Missing("state")),
            v1::PermissionState::Requested => Ok(PermissionState::Requested),
            v1::PermissionState::Granted => Ok(PermissionState::Granted),
            v1::PermissionState::Denied => Ok(PermissionState::Denied),
            v1::PermissionState::Revoked => Ok(PermissionState::Revoked),
            v1::PermissionState::Expired => Ok(PermissionState::Expired),
        }
    }
}

impl From<Permission> for v1::Permission {
    fn from(permission: Permission) -> v1::Permission {
        v1::Permission {
            area: permission.area,
            state: v1::PermissionState::from(permission.state) as i32,
            reason: permission.reason,
            expires_utc_ms: permission.expires_utc_ms,
            valid_for_s: permission.valid_for.as_secs_f64(),
            request_id: permission.request_id,
            decision: permission.decision,
            signature: permission.signature,
            vehicle: permission.vehicle,
            flight: permission.flight,
            extent: permission.extent.map(Into::into),
            // The vehicle knows by itself what it has entered.
            entered_because: String::new(),
        }
    }
}

impl From<Extent> for v1::AreaExtent {
    fn from(extent: Extent) -> v1::AreaExtent {
        let Extent { outline, floor_tenth_mm, ceiling_tenth_mm } = extent;
        v1::AreaExtent { outline: outline.to_vec(), floor_tenth_mm, ceiling_tenth_mm }
    }
}

impl TryFrom<v1::AreaExtent> for Extent {
    type Error = InvalidMessage;
    fn try_from(extent: v1::AreaExtent) -> Result<Extent, InvalidMessage> {
        let v1::AreaExtent { outline, floor_tenth_mm, ceiling_tenth_mm } = extent;
        let bytes = outline.len();
        let outline = outline.try_into();
        let outline =
            outline.map_err(|_| out_of_range("outline", format_args!("{bytes} bytes"), "a SHA-256, 32 bytes"))?;
        Ok(Extent { outline, floor_tenth_mm, ceiling_tenth_mm })
    }
}

impl TryFrom<v1::Permission> for Permission {
    type Error = InvalidMessage;
    fn try_from(permission: v1::Permission) -> Result<Permission, InvalidMessage> {
        Ok(Permission {
            state: permission.state().try_into()?,
            area: not_empty("area", permission.area)?,
            reason: permission.reason,
            expires_utc_ms: permission.expires_utc_ms,
            valid_for: duration("valid_for_s", permission.valid_for_s)?,
            request_id: permission.request_id,
            decision: permission.decision,
            signature: permission.signature,
            vehicle: permission.vehicle,
            flight: permission.flight,
            extent: permission.extent.map(Extent::try_from).transpose()?,
        })
    }
}

/// Every permission of a ledger.
///
/// # Errors
/// If one of them makes no sense; a ledger is accepted or refused as a whole.
pub fn ledger(ledger: v1::PermissionLedger) -> Result<Vec<Permission>, InvalidMessage> {
    ledger.permissions.into_iter().map(Permission::try_from).collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::generators::name;
    use super::*;

    fn permission() -> impl Strategy<Value = Permission> {
        use PermissionState::*;
        let state = prop::sample::select(vec![Requested, Granted, Denied, Revoked, Expired]);
        let extent = any::<Option<([u8; 32], Option<i64>, Option<i64>)>>();
        let whom = (name(), name(), extent);
        (name(), state, name(), any::<i64>(), 0..1_000_000u32, name(), any::<(u64, [u8; 4])>(), whom).prop_map(
            |(area, state, reason, expires_utc_ms, valid_ms, request_id, (decision, signature), whom)| {
                let (vehicle, flight, extent) = whom;
                Permission {
                    area,
                    state,
                    reason,
                    expires_utc_ms,
                    // Whole milliseconds are not changed by a floating-point number of seconds.
                    valid_for: Duration::from_millis(valid_ms.into()),
                    request_id,
                    decision,
                    signature: signature.to_vec(),
                    vehicle,
                    flight,
                    extent: extent.map(|(outline, floor_tenth_mm, ceiling_tenth_mm)| Extent {
                        outline,
                        floor_tenth_mm,
                        ceiling_tenth_mm,
                    }),
                }
            },
        )
    }

    proptest! {
        #[test]
        fn permissions_survive_the_wire(permission in permission()) {
            prop_assert_eq!(Permission::try_from(v1::Permission::from(permission.clone())), Ok(permission));
        }
    }

    #[test]
    fn a_ledger_with_a_line_that_makes_no_sense_is_refused_whole() {
        #[track_caller]
        fn check(change: fn(&mut v1::Permission)) {
            let good = v1::Permission { area: "A".into(), state: 2, valid_for_s: 1.0, ..Default::default() };
            let mut bad = good.clone();
            change(&mut bad);
            assert!(ledger(v1::PermissionLedger { permissions: vec![good.clone()], ..Default::default() }).is_ok());
            assert!(ledger(v1::PermissionLedger { permissions: vec![good, bad], ..Default::default() }).is_err());
        }
        check(|permission| permission.area.clear());
        check(|permission| permission.state = 77);
        check(|permission| permission.valid_for_s = f64::NAN);
        check(|permission| permission.valid_for_s = -1.0);
        check(|permission| permission.extent = Some(v1::AreaExtent::default()));
    }
}
