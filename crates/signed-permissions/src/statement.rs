//! What the tower signs: one line of a vehicle's ledger, as bytes that mean nothing else.

use domain::area::Extent;
use domain::permission::{Permission, PermissionState};

/// Begins every statement, so that a signature under something else is invalid for a permission. The number is the
/// format's.
const DOMAIN: &[u8] = b"kittiwake permission 2\0";

/// `permission` in a fixed form: numbers in eight bytes, the lowest first; texts after their length; after the byte 1 what may be absent,
/// and the byte 0 where it is.
///
/// Two values are left out: the signature, and `valid_for`, which is counted from each sending. The window that is
/// signed, `expires_utc_ms`, bounds it.
pub(crate) fn bytes(permission: &Permission) -> Vec<u8> {
    let Permission { area, state, reason, expires_utc_ms, valid_for: _, request_id, .. } = permission;
    let Permission { decision, signature: _, vehicle, flight, extent, .. } = permission;
    let mut bytes = DOMAIN.to_vec();
    for text in [vehicle, flight, area, reason, request_id] {
        bytes.extend((text.len() as u64).to_le_bytes());
        bytes.extend(text.as_bytes());
    }
    bytes.push(code(*state));
    bytes.extend(expires_utc_ms.to_le_bytes());
    bytes.extend(decision.to_le_bytes());
    bytes.push(extent.is_some().into());
    if let Some(Extent { outline, floor_tenth_mm, ceiling_tenth_mm }) = extent {
        bytes.extend(outline);
        for height in [floor_tenth_mm, ceiling_tenth_mm] {
            bytes.push(height.is_some().into());
            bytes.extend(height.iter().flat_map(|it| it.to_le_bytes()));
        }
    }
    bytes
}

/// Part of the format: never another number for a state.
fn code(state: PermissionState) -> u8 {
    match state {
        PermissionState::Requested => 1,
        PermissionState::Granted => 2,
        PermissionState::Denied => 3,
        PermissionState::Revoked => 4,
        PermissionState::Expired => 5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn the_form_is_fixed() {
        let permission = Permission {
            area: "A".into(),
            state: PermissionState::Granted,
            reason: String::new(),
            expires_utc_ms: -1,
            valid_for: Duration::from_secs(900),
            request_id: "r".into(),
            decision: 258,
            signature: vec![7],
            vehicle: "uav1".into(),
            flight: "f".into(),
            extent: Some(Extent { outline: [9; 32], floor_tenth_mm: None, ceiling_tenth_mm: Some(-2) }),
        };
        let mut expected = b"kittiwake permission 2\0".to_vec();
        expected.extend(b"\x04\0\0\0\0\0\0\0uav1\x01\0\0\0\0\0\0\0f");
        expected.extend(b"\x01\0\0\0\0\0\0\0A\0\0\0\0\0\0\0\0\x01\0\0\0\0\0\0\0r");
        expected.extend(b"\x02\xff\xff\xff\xff\xff\xff\xff\xff\x02\x01\0\0\0\0\0\0\x01");
        expected.extend([9; 32]);
        expected.extend(b"\0\x01\xfe\xff\xff\xff\xff\xff\xff\xff");
        assert_eq!(bytes(&permission), expected);
    }

    #[test]
    fn no_text_can_be_moved_from_one_field_to_the_next() {
        let of = |vehicle: &str, area: &str| {
            let permission = Permission {
                area: area.into(),
                state: PermissionState::Granted,
                reason: String::new(),
                expires_utc_ms: 0,
                valid_for: Duration::ZERO,
                request_id: String::new(),
                decision: 1,
                signature: Vec::new(),
                vehicle: vehicle.into(),
                flight: String::new(),
                extent: None,
            };
            bytes(&permission)
        };
        assert_ne!(of("uav1", "2A"), of("uav12", "A"));
    }
}
