//! Dates by clocks that are set, as the dates that were meant.
//!
//! A permission holds for as long as the tower meant when it decided, whatever a clock is set to afterwards: its date is
//! corrected by how wrong the tower's clock was when the decision was first heard. The window of an area is by the vehicle's
//! clock as it is now. Hours of the week are left as they are: no campaign's mission has any.

use std::collections::BTreeMap;

use kittiwake_proto::topics::Message;

/// How far clocks are ahead of the true one, in milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Ahead {
    /// That of the aircraft.
    pub aircraft_ms: i64,
    /// That of the ground.
    pub ground_ms: i64,
}

/// The decisions that were heard.
#[derive(Debug, Default)]
pub struct TrueTime {
    /// When each expires, by area and number.
    expiries: BTreeMap<(String, u64), i64>,
}

impl TrueTime {
    /// The message with true dates.
    pub fn of(&mut self, ahead: Ahead, mut message: Message) -> Message {
        match &mut message {
            Message::PermissionLedger(ledger) => {
                for it in &mut ledger.permissions {
                    let expires = it.expires_utc_ms.saturating_sub(ahead.ground_ms);
                    it.expires_utc_ms = *self.expiries.entry((it.area.clone(), it.decision)).or_insert(expires);
                }
            }
            Message::MissionStatus(status) => {
                for date in status.areas.iter_mut().flat_map(|it| [&mut it.from_utc_ms, &mut it.until_utc_ms]) {
                    *date = date.map(|it| it.saturating_sub(ahead.aircraft_ms));
                }
            }
            _ => {}
        }
        message
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::v1;

    fn expires(true_time: &mut TrueTime, ground_ms: i64, decision: u64, expires_utc_ms: i64) -> i64 {
        let permission = v1::Permission { area: "A".into(), decision, expires_utc_ms, ..Default::default() };
        let ledger = v1::PermissionLedger { permissions: vec![permission], ..Default::default() };
        match true_time.of(Ahead { ground_ms, aircraft_ms: 7 }, ledger.into()) {
            Message::PermissionLedger(it) => it.permissions[0].expires_utc_ms,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_permission_is_neither_extended_nor_cut_by_a_clock_that_is_set_later() {
        let mut true_time = TrueTime::default();
        assert_eq!(expires(&mut true_time, 0, 1, 60_000), 60_000);
        assert_eq!(expires(&mut true_time, 3_600_000, 1, 60_000), 60_000, "the same decision");
        assert_eq!(expires(&mut true_time, 3_600_000, 2, 3_690_000), 90_000, "one by the current clock");
    }

    #[test]
    fn a_window_is_by_the_vehicle_s_clock() {
        let area = v1::Area { from_utc_ms: Some(10_000), until_utc_ms: None, ..Default::default() };
        let status = v1::MissionStatus { areas: vec![area], ..Default::default() };
        let ahead = Ahead { aircraft_ms: 4_000, ground_ms: 0 };
        let Message::MissionStatus(status) = TrueTime::default().of(ahead, status.into()) else {
            panic!("the same kind")
        };
        assert_eq!((status.areas[0].from_utc_ms, status.areas[0].until_utc_ms), (Some(6_000), None));
    }
}
