//! The text of each vehicle's `status` event, made once for all streams that send the same.
//!
//! A thousand streams twice a second are two thousand documents of some ten kilobytes; they differ only when the
//! state was renewed in between.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use kittiwake_proto::json::to_json;
use kittiwake_proto::v1::CommandAuthority;
use node::VehicleId;

use crate::fleet::Snapshot;
use crate::view::Ages;
use crate::view::vehicle::vehicle;

/// The newest text of each vehicle.
#[derive(Debug, Default)]
pub(crate) struct StatusCache(Mutex<BTreeMap<VehicleId, Made>>);

#[derive(Debug)]
struct Made {
    /// The state that the text was made from.
    snapshot: Arc<Snapshot>,
    authority: CommandAuthority,
    text: Arc<str>,
}

impl StatusCache {
    /// The text; `None` if the vehicle was never seen.
    pub(crate) fn text(
        &self,
        snapshot: &Arc<Snapshot>,
        name: &VehicleId,
        ages: Ages,
        authority: &CommandAuthority,
    ) -> Option<Arc<str>> {
        // The data are whole even if a thread panicked while it held the lock. A stream that waits for the lock waits
        // for the text that it needs.
        let mut made = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(known) = made.get(name)
            && Arc::ptr_eq(&known.snapshot, snapshot)
            && known.authority == *authority
        {
            return Some(known.text.clone());
        }
        let text: Arc<str> = to_json(&vehicle(snapshot, name, ages, authority)?).to_string().into();
        let newest = Made { snapshot: snapshot.clone(), authority: authority.clone(), text: text.clone() };
        made.insert(name.clone(), newest);
        Some(text)
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
    fn one_text_serves_all_until_the_state_or_the_commander_changes() {
        let seconds = Duration::from_secs;
        let ages = Ages { pace: Pace::REAL_TIME, stale_after: seconds(2), status_period: seconds(1) };
        let at = |s: u64| {
            let now = Now { time: Time::after(seconds(s)), utc_ms: 0 };
            let mut snapshot = Snapshot { now, ..Snapshot::default() };
            let message = v1::VehicleStatus::default().into();
            snapshot.fleet.fold(now, Event::Message { vehicle: "uav1".into(), message }, &mut Vec::new());
            Arc::new(snapshot)
        };
        let (statuses, first, second) = (StatusCache::default(), at(1), at(2));
        let eve = CommandAuthority { holder: Some("eve".into()), offered_to: None };
        let nobody = CommandAuthority::default();
        let text = |snapshot, authority| statuses.text(snapshot, &"uav1".into(), ages, authority).unwrap();
        let one = text(&first, &nobody);
        assert!(Arc::ptr_eq(&one, &text(&first, &nobody)));
        assert_ne!(one, text(&second, &nobody));
        assert!(text(&second, &eve).contains("eve"));
        assert_eq!(statuses.text(&second, &"uav2".into(), ages, &eve), None);
    }
}
