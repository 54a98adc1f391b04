//! Whether the flight comes forward.

use std::collections::VecDeque;
use std::time::Duration;

use domain::geometry::Ned;
use domain::time::Time;
use kittiwake_proto::v1::{self, SkillKind};

use super::View;
use super::reach::Reach;

pub(super) const IN_WORDS: &str = "does not stay within 30 m in the air for 660 s, but at a place where a stay is asked for, by an operator's pause, and \
     while a response waits and no place to land at is in reach (the table's `operator_silent`, the longest that anybody is waited for, 600 s, and a minute to come to rest and to leave); does not fly on for 120 s at less than 3.4 m/s, a third of its \
     speed, while no flag is up (issue 44, P4)";

const PLACE_M: f64 = 30.0;
const LONG: Duration = Duration::from_secs(660);
/// A third of the cruise speed, and for how long. (A transition is flown at 4 m/s, a narrowed flight at 5.)
const SLOW_M_S: f64 = 3.4;
const SLOW_FOR: Duration = Duration::from_secs(120);
/// A goal nearer than this is nearly reached.
const NEAR_M: f64 = 50.0;

#[derive(Debug, Default)]
pub(super) struct Progress {
    hold: Option<Hold>,
    longest: Duration,
    /// Where it was in the last two minutes of flying to one goal, the oldest first.
    track: VecDeque<(Time, Ned)>,
}

#[derive(Debug)]
struct Hold {
    place: Ned,
    since: Time,
    told: bool,
}

impl Progress {
    pub(super) fn longest_hold_s(&self) -> f64 {
        self.longest.as_secs_f64()
    }

    pub(super) fn see(&mut self, view: &View<'_>, reach: &Reach) -> Option<String> {
        if !view.heard.flies_itself || view.truth.standing {
            (self.hold, self.track) = (None, VecDeque::new());
            return None;
        }
        self.stays(view, reach).or_else(|| self.is_slow(view))
    }

    fn stays(&mut self, view: &View<'_>, reach: &Reach) -> Option<String> {
        let (now, place, manager) = (view.heard.now.time, view.truth.position, view.heard.manager);
        let new = || Hold { place, since: now, told: false };
        let hold = self.hold.get_or_insert_with(new);
        // What cannot be undone comes last: it waits for as long as there is energy.
        let waits_for_way = !manager.acting.is_empty() && reach.best.is_none();
        // A task has its own limit.
        let does_a_task = manager.skill() == SkillKind::Task;
        let is_excused = manager.paused || manager.plan_approval.is_some() || waits_for_way || does_a_task;
        if PLACE_M < hold.place.distance_m(place) || is_excused {
            *hold = new();
            return None;
        }
        self.longest = self.longest.max(now - hold.since);
        let stay_s = stay_s(view.mission, hold.place);
        let is_long = hold.since + LONG + Duration::from_secs_f64(stay_s) < now;
        let reason = if manager.acting.is_empty() { &view.mission.hold } else { &manager.acting };
        let told = is_long && !std::mem::replace(&mut hold.told, is_long);
        told.then(|| {
            format!(
                "it has been within {PLACE_M} m of ({}) for {} s: `{reason}`",
                hold.place,
                (now - hold.since).as_secs()
            )
        })
    }

    fn is_slow(&mut self, view: &View<'_>) -> Option<String> {
        let (now, place, manager) = (view.heard.now.time, view.truth.position, view.heard.manager);
        let flies_on = manager.skill() == SkillKind::Offboard && NEAR_M < manager.distance_left_m;
        if !flies_on || !manager.contingencies.is_empty() || !view.mission.hold.is_empty() || manager.in_transition {
            self.track.clear();
            return None;
        }
        self.track.push_back((now, place));
        let (since, from) = *self.track.front()?;
        if now - since < SLOW_FOR {
            return None;
        }
        // Along the track, so that a turn is not a stop.
        let flown_m: f64 = self.track.iter().zip(self.track.iter().skip(1)).map(|(a, b)| a.1.distance_m(b.1)).sum();
        self.track.clear();
        let speed_m_s = flown_m / (now - since).as_secs_f64();
        (speed_m_s < SLOW_M_S).then(|| format!("it flew on at {speed_m_s:.1} m/s from ({from}), and no flag said so"))
    }
}

/// The longest stay that is asked for here, or so near that it began before the vehicle was there.
fn stay_s(mission: &v1::MissionStatus, here: Ned) -> f64 {
    let is_here = |it: &&v1::Objective| {
        it.position.is_some_and(|at| (at.north_m - here.north_m).hypot(at.east_m - here.east_m) < 2.0 * PLACE_M)
    };
    mission.objectives.iter().filter(is_here).map(|it| it.dwell_s).fold(0.0, f64::max)
}
