//! Nothing that the ground said a while ago is obeyed: what it says to a vehicle carries the moment at
//! which it was said, by the vehicle's own clock, and the vehicle refuses what is too old.
//!
//! Two machines' clocks have nothing to do with each other, so the ground reckons the vehicle's from
//! its heartbeats: each carries the vehicle's clock and arrives a little later. The heartbeat that came
//! quickest says most. A reckoned clock is behind the true one by that quickest passage, never ahead:
//! what was said seems older than it is, never younger. A vehicle that is not heard has no clock, and
//! nothing is said to it.

use std::collections::HashMap;
use std::time::Duration;

use node::VehicleId;

/// What was said longer ago than this is not obeyed. (ENG: over a link with a round trip of 200 ms an
/// order is obeyed within 150 ms; an operator who waits for half a second orders again.)
pub(crate) const OBEYED_WITHIN: Duration = Duration::from_millis(500);

/// How long a heartbeat speaks for a clock: two of these at most. Quartz drifts by a millisecond in that time.
const WINDOW: Duration = Duration::from_secs(5);

/// A clock that jumps back by more than any heartbeat is late has started again with its machine.
const RESTARTED: Duration = Duration::from_secs(10);

/// The most clocks that are kept, since anybody on the bus can make up names of vehicles. (ENG: four times as many as the gateway shows
/// vehicles.)
const MOST_CLOCKS: usize = 256;

/// The clocks of vehicles, as heard here.
#[derive(Debug, Default)]
pub(crate) struct Clocks(HashMap<VehicleId, Clock>);

/// How far a clock is ahead of ours, in nanoseconds, by the quickest heartbeats of the present and of
/// the last window.
#[derive(Debug, Clone, Copy)]
struct Clock {
    present: i128,
    last: Option<i128>,
    since_ns: u64,
    heard_ns: u64,
}

impl Clocks {
    /// A heartbeat of `vehicle` says `theirs` and arrived at `ours`; both in nanoseconds.
    pub(crate) fn heard(&mut self, vehicle: &VehicleId, theirs: u64, ours: u64) {
        let ahead = i128::from(theirs) - i128::from(ours);
        let fresh = Clock { present: ahead, last: None, since_ns: ours, heard_ns: ours };
        let window = WINDOW.as_nanos() as u64;
        if MOST_CLOCKS <= self.0.len() && !self.0.contains_key(vehicle) {
            self.0.retain(|_, it| ours.saturating_sub(it.heard_ns) <= 2 * window);
            if MOST_CLOCKS <= self.0.len() {
                return;
            }
        }
        let clock = self.0.entry(vehicle.clone()).or_insert(fresh);
        let silent = 2 * window < ours.saturating_sub(clock.heard_ns);
        if silent || ahead + (RESTARTED.as_nanos() as i128) < clock.best() {
            *clock = fresh;
        } else if window < ours.saturating_sub(clock.since_ns) {
            *clock = Clock { last: Some(clock.present), ..fresh };
        } else {
            clock.present = clock.present.max(ahead);
            clock.heard_ns = ours;
        }
    }

    /// `ours` by the vehicle's clock; `None` if it has not been heard for a while.
    pub(crate) fn theirs(&self, vehicle: &VehicleId, ours: u64, now: u64) -> Option<u64> {
        let clock = self.0.get(vehicle)?;
        let heard = now.saturating_sub(clock.heard_ns) <= 2 * WINDOW.as_nanos() as u64;
        // Zero stands for none on the wire; no machine is at the first nanosecond of its time.
        heard.then(|| u64::try_from(i128::from(ours) + clock.best()).ok()).flatten().filter(|it| *it != 0)
    }
}

impl Clock {
    fn best(&self) -> i128 {
        self.last.map_or(self.present, |it| it.max(self.present))
    }
}

/// Why something is not obeyed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Late {
    age: Duration,
}

impl std::fmt::Display for Late {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "said {:.2} s ago, obeyed for {:.2} s only", self.age.as_secs_f64(), OBEYED_WITHIN.as_secs_f64())
    }
}

/// Whether what was said at `said`, by our clock, may be obeyed `now`; zero: it comes from our own side.
pub(crate) fn check(said: u64, now: u64) -> Result<(), Late> {
    let limit = OBEYED_WITHIN.as_nanos() as u64;
    // What comes from the future was reckoned by another clock than ours.
    let age = now.abs_diff(said);
    if said == 0 || age < limit { Ok(()) } else { Err(Late { age: Duration::from_nanos(age) }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;
    const S: u64 = 1000 * MS;

    /// Hears heartbeats, each `(sent by their clock, passage)`, of a clock that is 1000 s ahead, and
    /// compares what is reckoned with the truth.
    #[track_caller]
    fn check_clock(heartbeats: &[(u64, u64)], behind: u64) {
        let (vehicle, mut clocks) = ("uav1".into(), Clocks::default());
        let mut now = 0;
        for (sent, passage) in heartbeats {
            now = sent - 1000 * S + passage;
            clocks.heard(&vehicle, *sent, now);
        }
        assert_eq!(clocks.theirs(&vehicle, now, now), Some(now + 1000 * S - behind));
    }

    #[test]
    fn the_quickest_heartbeat_tells_the_time_and_is_never_ahead_of_it() {
        check_clock(&[(2000 * S, 80 * MS)], 80 * MS);
        check_clock(&[(2000 * S, 80 * MS), (2001 * S, 5 * MS), (2002 * S, 900 * MS)], 5 * MS);
        check_clock(&[(2000 * S, 5 * MS), (2006 * S, 40 * MS), (2007 * S, 30 * MS)], 5 * MS);
        check_clock(&[(2000 * S, 5 * MS), (2006 * S, 40 * MS), (2012 * S, 30 * MS)], 30 * MS);
        check_clock(&[(2000 * S, 5 * MS), (2060 * S, 300 * MS)], 300 * MS);
    }

    #[test]
    fn a_machine_that_is_started_again_has_another_clock_at_once() {
        let (vehicle, mut clocks): (VehicleId, _) = ("uav1".into(), Clocks::default());
        clocks.heard(&vehicle, 5000 * S, S);
        clocks.heard(&vehicle, 20 * S, 2 * S);
        assert_eq!(clocks.theirs(&vehicle, 2 * S, 2 * S), Some(20 * S));
        assert_eq!(clocks.theirs(&vehicle, 2 * S, 13 * S), None, "not heard for eleven seconds");
        assert_eq!(clocks.theirs(&"uav2".into(), 2 * S, 2 * S), None);
    }

    #[test]
    fn no_more_clocks_are_kept_than_there_is_room_for_and_those_that_speak_keep_theirs() {
        let (known, mut clocks): (VehicleId, _) = ("uav1".into(), Clocks::default());
        let heard = |clocks: &mut Clocks, vehicle: &VehicleId, now: u64| clocks.heard(vehicle, 1000 * S + now, now);
        heard(&mut clocks, &known, S);
        (0..10 * MOST_CLOCKS).for_each(|it| heard(&mut clocks, &format!("stranger-{it}").as_str().into(), S));
        assert_eq!(clocks.0.len(), MOST_CLOCKS);
        let late: VehicleId = "uav2".into();
        heard(&mut clocks, &late, 2 * S);
        assert_eq!(clocks.theirs(&late, 2 * S, 2 * S), None, "there is no room");
        heard(&mut clocks, &known, 9 * S);
        heard(&mut clocks, &late, 12 * S);
        assert_eq!(clocks.theirs(&known, 12 * S, 12 * S), Some(1012 * S));
        assert_eq!(clocks.theirs(&late, 12 * S, 12 * S), Some(1012 * S), "the strangers have fallen silent");
    }

    #[test]
    fn what_is_old_is_not_obeyed() {
        #[track_caller]
        fn check_age(said: u64, now: u64, expected: bool) {
            assert_eq!(check(said, now).is_ok(), expected, "said {said}, now {now}");
        }
        check_age(10 * S, 10 * S + 499 * MS, true);
        check_age(10 * S, 10 * S + 500 * MS, false);
        check_age(10 * S, 70 * S, false);
        check_age(70 * S, 10 * S, false);
        check_age(0, 70 * S, true);
        assert_eq!(check(10 * S, 12 * S).unwrap_err().to_string(), "said 2.00 s ago, obeyed for 0.50 s only");
    }
}
