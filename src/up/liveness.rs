//! Which child hangs: it has been on the bus, and has not said for a while that its loop turns.
//!
//! Time is the launcher's wall time since its start, as a value.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::up::supervise::Child;

/// A launcher that has not looked for this time was itself held up, and has received nothing.
const HELD_UP: Duration = Duration::from_secs(1);
/// While one child is heard within this time, the router passes on what children say: four heartbeats.
const ROUTER_TURNS: Duration = Duration::from_secs(1);

/// When each service was last heard.
#[derive(Debug)]
pub struct Liveness {
    limit: Duration,
    heard: BTreeMap<Child, Duration>,
    looked: Duration,
}

impl Liveness {
    /// Nobody has been heard yet; who is silent for `limit` hangs.
    pub fn new(limit: Duration) -> Liveness {
        Liveness { limit, heard: BTreeMap::new(), looked: Duration::ZERO }
    }

    /// A service appeared on the bus, or says that its loop turns. Before that it is starting and may take its time.
    pub fn heard(&mut self, child: Child, now: Duration) {
        self.heard.insert(child, now);
    }

    /// A child has ended: nothing is expected of it before it is heard again.
    pub fn ended(&mut self, child: Child) {
        self.heard.remove(&child);
    }

    /// The children that hang; they count as ended. If nobody at all is heard any more, it is the router that hangs.
    pub fn hung(&mut self, now: Duration) -> Vec<Child> {
        let was_held_up = HELD_UP <= now.saturating_sub(std::mem::replace(&mut self.looked, now));
        if was_held_up {
            self.heard.values_mut().for_each(|at| *at = now);
        }
        let Some(newest) = self.heard.values().max().copied() else { return Vec::new() };
        if newest + self.limit <= now {
            self.heard.clear();
            return vec![Child::Router];
        }
        if newest + ROUTER_TURNS <= now {
            return Vec::new();
        }
        let limit = self.limit;
        self.heard.extract_if(.., |_, at| *at + limit <= now).map(|(child, _)| child).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::Service;

    const PLANNER: Child = Child::Service(Service::Planner);
    const MCM: Child = Child::Service(Service::Mcm);
    const LIMIT: Duration = Duration::from_secs(3);

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// Looks every 100 ms up to `until_ms`, while each child is heard every 250 ms until its time; who hangs, and when.
    #[track_caller]
    fn check(turns_until_ms: &[(Child, u64)], until_ms: u64, expected: &[(u64, Child)]) {
        let mut liveness = Liveness::new(LIMIT);
        let mut hung = Vec::new();
        for now in (0..=until_ms).step_by(50) {
            for (child, _) in turns_until_ms.iter().filter(|(_, until)| now <= *until && now % 250 == 0) {
                liveness.heard(*child, ms(now));
            }
            hung.extend(liveness.hung(ms(now)).into_iter().map(|child| (now, child)));
        }
        assert_eq!(hung, expected, "{turns_until_ms:?}");
    }

    #[test]
    fn one_that_is_silent_for_the_limit_hangs_and_is_named_once() {
        check(&[(PLANNER, 99_000), (MCM, 99_000)], 20_000, &[]);
        check(&[(PLANNER, 5_000), (MCM, 99_000)], 20_000, &[(8_000, PLANNER)]);
        check(&[(PLANNER, 5_000), (MCM, 6_000)], 7_950, &[]);
    }

    #[test]
    fn if_nobody_is_heard_it_is_the_router() {
        check(&[(PLANNER, 5_000), (MCM, 5_250)], 20_000, &[(8_250, Child::Router)]);
        check(&[(PLANNER, 5_000)], 20_000, &[(8_000, Child::Router)]);
        check(&[], 20_000, &[]);
    }

    #[test]
    fn who_has_ended_or_starts_is_not_expected_to_say_anything() {
        let mut liveness = Liveness::new(LIMIT);
        liveness.heard(PLANNER, ms(0));
        liveness.ended(PLANNER);
        for now in (0..10_000).step_by(100) {
            liveness.heard(MCM, ms(now));
            assert_eq!(liveness.hung(ms(now)), []);
        }
    }

    #[test]
    fn a_launcher_that_was_held_up_accuses_nobody() {
        let mut liveness = Liveness::new(LIMIT);
        liveness.heard(PLANNER, ms(0));
        liveness.heard(MCM, ms(0));
        assert_eq!(liveness.hung(ms(100)), []);
        assert_eq!(liveness.hung(ms(60_000)), []);
        liveness.heard(MCM, ms(60_100));
        assert_eq!(liveness.hung(ms(60_100)), []);
    }
}
