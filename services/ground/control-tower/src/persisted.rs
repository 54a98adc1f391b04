//! The persisted state of the tower: what it has decided, so that another process goes on with it.
//!
//! Where the state is stored is the shell's business. A request that is not decided yet is kept without its due decision:
//! the policy is asked again.

use std::collections::BTreeMap;
use std::time::Duration;

use domain::area::Extent;
use domain::time::{Now, Pace};
use domain::wire::{InvalidMessage, duration, not_empty};
use kittiwake_proto::v1;
use node::VehicleId;

use crate::ledger::{Ledger, Line};
use crate::numbers::Numbers;
use crate::permission::{By, Expiry, Standing};
use crate::texts::{MAX_REASON_BYTES, MAX_REQUEST_ID_BYTES, shortened};

/// The ledger of a vehicle as it is stored.
pub(crate) fn to_memory(vehicle: &VehicleId, ledger: &Ledger, numbers: &Numbers) -> v1::LedgerMemory {
    let permissions = ledger.lines().map(|(area, line)| line_to_memory(area, line)).collect();
    v1::LedgerMemory { vehicle: vehicle.to_string(), permissions, last_decision: numbers.last() }
}

fn line_to_memory(area: &str, line: &Line) -> v1::PermissionMemory {
    let (by, granted_for) = match &line.standing {
        Standing::Granted { by, expiry } => (*by, expiry.granted_for),
        Standing::Denied { by, .. } | Standing::Revoked { by, .. } => (*by, Duration::ZERO),
        Standing::Requested { .. } | Standing::Expired => (By::Policy, Duration::ZERO),
    };
    // The time that is left is not stored: it passes, and what is stored changes only with a decision.
    let permission = v1::Permission { valid_for_s: 0.0, ..line.to_wire(area, Now::default().time) };
    v1::PermissionMemory {
        permission: Some(permission),
        by_operator: by == By::Operator,
        granted_for_s: granted_for.as_secs_f64(),
    }
}

/// The ledgers that were stored.
///
/// # Errors
/// What makes no sense in them.
pub(crate) fn restored(
    now: Now,
    pace: Pace,
    ledgers: &[v1::LedgerMemory],
) -> Result<BTreeMap<VehicleId, (Ledger, Numbers)>, InvalidMessage> {
    let ledger = |it: &v1::LedgerMemory| {
        let lines: Result<Vec<_>, _> = it.permissions.iter().map(|it| line(now, pace, it)).collect();
        let known = (Ledger::of_lines(lines?), Numbers::after(it.last_decision));
        Ok((not_empty("vehicle", it.vehicle.clone())?.into(), known))
    };
    ledgers.iter().map(ledger).collect()
}

fn line(now: Now, pace: Pace, memory: &v1::PermissionMemory) -> Result<(String, Line), InvalidMessage> {
    use v1::PermissionState as S;
    let it = memory.permission.as_ref().ok_or(InvalidMessage::Missing("permission"))?;
    let by = if memory.by_operator { By::Operator } else { By::Policy };
    let granted_for = duration("granted_for_s", memory.granted_for_s)?;
    // Older towers took longer texts, which they could not publish.
    let reason = || shortened(&it.reason, MAX_REASON_BYTES);
    let request_id = shortened(&it.request_id, MAX_REQUEST_ID_BYTES);
    let standing = match it.state() {
        S::Unspecified => return Err(InvalidMessage::Missing("state")),
        S::Requested => Standing::Requested { due: None, missing: String::new() },
        S::Granted => Standing::Granted { expiry: Expiry::restored(now, it.expires_utc_ms, granted_for, pace), by },
        S::Denied => Standing::Denied { reason: reason(), by },
        S::Revoked => Standing::Revoked { reason: reason(), by },
        S::Expired => Standing::Expired,
    };
    let extent = it.extent.clone().map(Extent::try_from).transpose()?;
    let (flight, decision, entered_because) = (it.flight.clone(), it.decision, it.entered_because.clone());
    let line = Line { standing, request_id, decision, flight, extent, entered_because };
    Ok((not_empty("area", it.area.clone())?, line))
}
