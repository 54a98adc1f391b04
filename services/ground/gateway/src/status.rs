//! The text of each vehicle's `status` event, made once for all streams that send the same.
//!
//! A thousand streams twice a second are two thousand documents of some ten kilobytes; what differs
//! between them is only whether the state has been renewed in between.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use node::VehicleId;

use crate::helm::Helm;
use crate::state::Snapshot;
use crate::view::{self, Ages};

/// The newest text of each vehicle.
#[derive(Debug, Default)]
pub struct Statuses(Mutex<BTreeMap<VehicleId, Made>>);

#[derive(Debug)]
struct Made {
    /// What it was made of.
    snapshot: Arc<Snapshot>,
    helm: Helm,
    text: Arc<str>,
}

impl Statuses {
    /// The text; `None` if the vehicle was never seen.
    pub fn text(&self, snapshot: &Arc<Snapshot>, vehicle: &VehicleId, ages: Ages, helm: &Helm) -> Option<Arc<str>> {
        // Plain data: a thread that panicked while it held the lock has left it whole. Whoever waits here
        // waits for the text it needs.
        let mut made = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(it) = made.get(vehicle)
            && Arc::ptr_eq(&it.snapshot, snapshot)
            && it.helm == *helm
        {
            return Some(it.text.clone());
        }
        let text: Arc<str> = view::vehicle(snapshot, vehicle, ages, helm)?.to_string().into();
        let newest = Made { snapshot: snapshot.clone(), helm: helm.clone(), text: text.clone() };
        made.insert(vehicle.clone(), newest);
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
    fn a_text_serves_all_until_the_state_or_the_holder_changes() {
        let ages = Ages { pace: Pace::REAL_TIME, stale_after: Duration::from_secs(2) };
        let at = |s: u64| {
            let now = Now { time: Time::after(Duration::from_secs(s)), utc_ms: 0 };
            let mut snapshot = Snapshot { now, ..Snapshot::default() };
            let message = v1::VehicleStatus::default().into();
            snapshot.fleet.fold(now, Event::Message { vehicle: "uav1".into(), message }, &mut Vec::new());
            Arc::new(snapshot)
        };
        let (statuses, first, second) = (Statuses::default(), at(1), at(2));
        let held = Helm { holder: Some("eve".into()), offered_to: None };
        let text = |snapshot, helm: &Helm| statuses.text(snapshot, &"uav1".into(), ages, helm).unwrap();
        let one = text(&first, &Helm::default());
        assert!(Arc::ptr_eq(&one, &text(&first, &Helm::default())));
        assert_ne!(one, text(&second, &Helm::default()));
        assert!(text(&second, &held).contains("eve"));
        assert_eq!(statuses.text(&second, &"uav2".into(), ages, &held), None);
    }
}
