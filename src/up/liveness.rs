//! Which child hangs: it has been on the bus, and has not said for a while that its loop turns.
//!
//! Time is the launcher's own since its start, as a value.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::up::supervise::Child;

/// While one child is heard within this time, the router passes on what children say: four heartbeats.
const ROUTER_TURNS: Duration = Duration::from_secs(1);
/// Children try to reach a new router twice a second. (ENG: ten tries, for a machine with too much to do.)
const RECONNECT: Duration = Duration::from_secs(5);
/// That time is doubled no more often than this. (ENG: to 80 s.)
const MOST_DOUBLINGS: u32 = 4;

/// When each service was last heard.
#[derive(Debug)]
pub struct Liveness {
    limit: Duration,
    heard: BTreeMap<Child, Duration>,
    /// Nobody could be heard before; silence counts from then.
    asked_from: Duration,
    /// How often the router was found to hang since anybody was heard.
    routers_in_vain: u32,
}

impl Liveness {
    /// Nobody has been heard yet; who is silent for `limit` hangs.
    pub fn new(limit: Duration) -> Liveness {
        Liveness { limit, heard: BTreeMap::new(), asked_from: Duration::ZERO, routers_in_vain: 0 }
    }

    /// A service appeared on the bus, or says that its loop turns. Before that it is starting and may take its time.
    pub fn heard(&mut self, child: Child, now: Duration) {
        self.heard.insert(child, now);
        self.routers_in_vain = 0;
        // Who is heard has found the router: the others do not need more than the usual time.
        self.asked_from = self.asked_from.min(now + RECONNECT);
    }

    /// A child has ended: it may be silent until it is heard again.
    pub fn ended(&mut self, child: Child) {
        self.heard.remove(&child);
    }

    /// The router listens again: everybody has to find it first. If starting it again did not help, that takes longer than thought, or is
    /// not the router's fault.
    pub fn router_listens(&mut self, now: Duration) {
        let doublings = self.routers_in_vain.saturating_sub(1).min(MOST_DOUBLINGS);
        self.asked_from = self.asked_from.max(now + RECONNECT * 2u32.pow(doublings));
    }

    /// The launcher was held up or is not on the bus, and has heard nobody meanwhile.
    pub fn held_up(&mut self, now: Duration) {
        self.asked_from = self.asked_from.max(now);
    }

    /// The children that hang; they count as ended. If nobody at all is heard any more, it is the router that hangs. The others stay expected
    /// then: one of them may hang as well, and is known by not coming back. While no router listens nobody is asked for anything.
    pub fn hung(&mut self, now: Duration, router_listens: bool) -> Vec<Child> {
        let (limit, asked_from) = (self.limit, self.asked_from);
        let silent_for = |at: Duration| now.saturating_sub(at.max(asked_from));
        let newest = self.heard.values().max().copied();
        let Some(newest) = newest.filter(|_| router_listens) else { return Vec::new() };
        if limit <= silent_for(newest) {
            self.routers_in_vain = self.routers_in_vain.saturating_add(1);
            return vec![Child::Router];
        }
        if ROUTER_TURNS <= silent_for(newest) {
            return Vec::new();
        }
        self.heard.extract_if(.., |_, at| limit <= silent_for(*at)).map(|(child, _)| child).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::Service;
    use crate::up::own_time::OwnTime;

    const PLANNER: Child = Child::Service(Service::Planner);
    const MCM: Child = Child::Service(Service::Mcm);
    const LIMIT: Duration = Duration::from_secs(3);

    const fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// A router that listens at `starts_ms`, and passes nothing on from `hangs_ms` until it listens again.
    #[derive(Default)]
    struct Router<'a> {
        hangs_ms: &'a [u64],
        starts_ms: &'a [u64],
    }

    /// Looks every 50 ms up to `until_ms`, while each child is heard every 250 ms until its time; who hangs, and when.
    #[track_caller]
    fn check_with(router: &Router<'_>, turns_until_ms: &[(Child, u64)], until_ms: u64, expected: &[(u64, Child)]) {
        let mut liveness = Liveness::new(LIMIT);
        let mut hung = Vec::new();
        let (mut listens, mut passes_on) = (true, true);
        for now in (0..=until_ms).step_by(50) {
            passes_on &= !router.hangs_ms.contains(&now);
            if router.starts_ms.contains(&now) {
                (listens, passes_on) = (true, !router.hangs_ms.contains(&now));
                liveness.router_listens(ms(now));
            }
            let turns = |it: &&(Child, u64)| passes_on && now <= it.1 && now % 250 == 0;
            turns_until_ms.iter().filter(turns).for_each(|it| liveness.heard(it.0, ms(now)));
            let found = liveness.hung(ms(now), listens);
            // As the launcher does: it is killed.
            listens &= !found.contains(&Child::Router);
            hung.extend(found.into_iter().map(|child| (now, child)));
        }
        assert_eq!(hung, expected, "{turns_until_ms:?}");
    }

    #[track_caller]
    fn check(turns_until_ms: &[(Child, u64)], until_ms: u64, expected: &[(u64, Child)]) {
        check_with(&Router::default(), turns_until_ms, until_ms, expected);
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
    fn one_that_began_to_hang_while_the_router_was_away_is_known_once_it_is_back() {
        let router = Router { hangs_ms: &[5_000], starts_ms: &[20_000] };
        let killed = (7_750, Child::Router);
        check_with(&router, &[(PLANNER, 99_000), (MCM, 99_000)], 40_000, &[killed]);
        // Before it hung, with it, and before it was back.
        for until in [4_500, 6_000, 19_000] {
            let found = [killed, (28_000, MCM)];
            check_with(&router, &[(PLANNER, 99_000), (MCM, until)], 40_000, &found);
        }
    }

    #[test]
    fn a_router_that_hangs_again_before_anybody_is_heard_is_killed_again() {
        let router = Router { hangs_ms: &[5_000, 10_000], starts_ms: &[10_000, 20_000] };
        let killed = [(7_750, Child::Router), (18_000, Child::Router)];
        check_with(&router, &[(PLANNER, 99_000), (MCM, 99_000)], 40_000, &killed);
    }

    #[test]
    fn a_router_gets_more_time_each_time_that_nobody_is_heard_after_its_restart() {
        let mut liveness = Liveness::new(LIMIT);
        liveness.heard(PLANNER, ms(0));
        let mut now = ms(3_000);
        assert_eq!(liveness.hung(now, true), [Child::Router]);
        for reconnect_s in [5, 10, 20, 40, 80, 80, 80] {
            liveness.router_listens(now);
            now += Duration::from_secs(reconnect_s) + LIMIT;
            assert_eq!(liveness.hung(now - ms(1), true), []);
            assert_eq!(liveness.hung(now, true), [Child::Router]);
        }
        // Once anybody is heard the others have the usual time, and so has the next router.
        liveness.router_listens(now);
        liveness.heard(PLANNER, now);
        now += RECONNECT + LIMIT;
        assert_eq!(liveness.hung(now - ms(1), true), []);
        assert_eq!(liveness.hung(now, true), [Child::Router]);
        liveness.router_listens(now);
        assert_eq!(liveness.hung(now + RECONNECT + LIMIT, true), [Child::Router]);
    }

    /// The smallest limit that may be set.
    const SMALLEST_LIMIT: Duration = Duration::from_secs(2);

    #[test]
    fn a_launcher_that_is_stopped_while_it_waits_kills_nobody_however_small_the_limit_and_however_long_the_pause() {
        for pause_ms in (0..5_000).step_by(10) {
            let (mut liveness, mut time) = (Liveness::new(SMALLEST_LIMIT), OwnTime::default());
            // It turns every 200 ms, its children are heard every 250 ms, and each once more some time after the pause.
            let heard_last = ms(0);
            liveness.heard(PLANNER, heard_last);
            liveness.heard(MCM, heard_last);
            assert!(!time.begin_turn(ms(250)));
            let back = ms(250 + pause_ms);
            // Awake, and what was said meanwhile has not been read yet.
            assert_eq!(liveness.hung(time.at(back), true), [], "{pause_ms}");
            if time.begin_turn(back) {
                liveness.held_up(time.at(back));
            }
            let next = back + ms(200);
            assert_eq!(liveness.hung(time.at(next), true), [], "{pause_ms}");
        }
    }

    #[test]
    fn who_has_ended_or_starts_is_not_expected_to_say_anything() {
        let mut liveness = Liveness::new(LIMIT);
        liveness.heard(PLANNER, ms(0));
        liveness.ended(PLANNER);
        for now in (0..10_000).step_by(100) {
            liveness.heard(MCM, ms(now));
            assert_eq!(liveness.hung(ms(now), true), []);
        }
    }

    #[test]
    fn a_launcher_that_was_held_up_accuses_nobody() {
        let mut liveness = Liveness::new(LIMIT);
        liveness.heard(PLANNER, ms(0));
        liveness.heard(MCM, ms(0));
        assert_eq!(liveness.hung(ms(100), true), []);
        liveness.held_up(ms(60_000));
        assert_eq!(liveness.hung(ms(60_000), true), []);
        liveness.heard(MCM, ms(60_100));
        assert_eq!(liveness.hung(ms(60_100), true), []);
        liveness.heard(MCM, ms(63_000));
        assert_eq!(liveness.hung(ms(63_000), true), [PLANNER]);
    }
}
