//! Each vehicle's `status` event, made once for all streams that send the same.
//!
//! A thousand streams twice a second are two thousand documents of some ten kilobytes; they differ only when the
//! state was renewed in between.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use axum::body::Bytes;
use kittiwake_proto::json::to_json;
use kittiwake_proto::v1::CommandAuthority;
use node::VehicleId;

use crate::fleet::Snapshot;
use crate::http::events;
use crate::view::Ages;
use crate::view::vehicle::vehicle;

/// The newest event of each vehicle.
#[derive(Debug, Default)]
pub(crate) struct StatusCache(Mutex<BTreeMap<VehicleId, Made>>);

#[derive(Debug)]
struct Made {
    /// The state that the event was made from.
    snapshot: Arc<Snapshot>,
    authority: CommandAuthority,
    frame: Bytes,
}

impl StatusCache {
    /// The event; `None` if the vehicle was never seen.
    pub(crate) fn frame(
        &self,
        snapshot: &Arc<Snapshot>,
        name: &VehicleId,
        ages: Ages,
        authority: &CommandAuthority,
    ) -> Option<Bytes> {
        // The data are whole even if a thread panicked while it held the lock. A stream that waits for the lock waits
        // for the event that it needs.
        let mut made = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(known) = made.get(name)
            && Arc::ptr_eq(&known.snapshot, snapshot)
            && known.authority == *authority
        {
            return Some(known.frame.clone());
        }
        let text = to_json(&vehicle(snapshot, name, ages, authority)?).to_string();
        let frame = events::frame(None, "status", &text);
        let newest = Made { snapshot: snapshot.clone(), authority: authority.clone(), frame: frame.clone() };
        made.insert(name.clone(), newest);
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::time::{Now, Pace, Time};
    use kittiwake_proto::v1;
    use node::Event;
    use std::time::Duration;

    #[test]
    fn one_event_serves_all_until_the_state_or_the_commander_changes() {
        let seconds = Duration::from_secs;
        let ages = Ages { pace: Pace::REAL_TIME, stale_after: seconds(2), status_period: seconds(1) };
        let at = |s: u64| {
            let now = Now { time: Time::after(seconds(s)), utc_ms: 1000 * s as i64 };
            let mut snapshot = Snapshot { now, ..Snapshot::default() };
            let message = v1::VehicleStatus::default().into();
            snapshot.fleet.fold(now, Event::Message { vehicle: "uav1".into(), message }, &mut Vec::new());
            Arc::new(snapshot)
        };
        let (statuses, first, second) = (StatusCache::default(), at(1), at(2));
        let eve = CommandAuthority { holder: Some("eve".into()), offered_to: None };
        let nobody = CommandAuthority::default();
        let frame = |snapshot, authority| statuses.frame(snapshot, &"uav1".into(), ages, authority).unwrap();
        let one = frame(&first, &nobody);
        assert_eq!(one.as_ptr(), frame(&first, &nobody).as_ptr());
        assert_ne!(one, frame(&second, &nobody));
        assert!(String::from_utf8_lossy(&frame(&second, &eve)).contains("eve"));
        assert_eq!(statuses.frame(&second, &"uav2".into(), ages, &eve), None);
    }
}
