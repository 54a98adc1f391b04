//! How the flight goes on, as only the mission manager can tell: where its leg leads, how long a skill takes, who is waited for. Rules of
//! the contingency table read it ([`domain::contingency::snapshot`]); nothing is decided here.

use domain::contingency::Severity;
use domain::geometry::Ned;
use domain::headway::{Headway, STRETCH};
use domain::skill::Goal;
use domain::speeds::Speeds;
use domain::time::Time;
use domain::trust::To;
use kittiwake_proto::v1;

use super::World;
use crate::decide::{Activity, Awaited, Decision};

/// What a leg takes on top of its distance at a steady speed, in seconds: to speed up, to slow down and to settle. (ENG: 5 s from 10 m/s
/// to rest at `braking_m_s2`, as long to get there again.)
const START_AND_STOP_S: f64 = 10.0;

/// A vehicle that comes no farther than this stays where it is, in metres. (ENG: a wind and an estimate move a vehicle that holds by less.)
const PLACE_M: f64 = 20.0;

/// The leg that is flown, and since when something is waited for.
#[derive(Debug, Default)]
pub(super) struct FlightWatch {
    leg: Option<WatchedLeg>,
    /// Over all legs since it began to fly to places.
    headway: Option<Headway>,
    held: Option<Held>,
    was_paused: bool,
    plan_since: Option<Time>,
    /// Since when the wind is faster than it flies.
    pub(super) blown_since: Option<Time>,
}

/// It holds in the air, or has come no farther than [`PLACE_M`].
#[derive(Debug, Clone, Copy)]
struct Held {
    place: Ned,
    since: Time,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct WatchedLeg {
    skill_id: u64,
    from: Ned,
    /// Where it can come to rest first: it turns no sooner.
    turn: Ned,
    to: Ned,
    intended: Speeds,
    /// Whether it is flown to hold at its end.
    holds: bool,
}

impl WatchedLeg {
    /// How far `here` is from its straight lines over ground, in metres: climbs and descents have a speed of their own.
    fn deviation_m(&self, here: Ned) -> f64 {
        let direct = [(self.from, self.to), (self.from, self.turn), (self.turn, self.to)];
        direct.map(|(from, to)| here.horizontal_distance_to_line_m(from, to)).into_iter().fold(f64::INFINITY, f64::min)
    }
}

impl World {
    /// Looks at the leg and at what is waited for.
    pub(super) fn watch_progress(&mut self) {
        let leg = self.present_leg();
        let here = self.seen.vehicle.map(|it| it.position).unwrap_or_default();
        let headway = match (leg, self.skills.present()) {
            (Some(leg), _) => Some(self.headway_of(&leg, here)).filter(|_| !leg.holds),
            // Between two legs.
            (None, None | Some((Goal::Position { .. }, _))) => self.watch.progress.headway,
            (None, Some(_)) => None,
        };
        let watch = &mut self.watch.progress;
        watch.headway = headway;
        if watch.leg.map(|it| (it.skill_id, it.to)) != leg.map(|it| (it.skill_id, it.to)) {
            watch.leg = leg;
        }
        let now = self.now.time;
        let since = |before: Option<Time>, holds: bool| holds.then(|| before.unwrap_or(now));
        let Decision { activity, wait, .. } = *self.decision();
        let holds = |row: usize| self.setup.table.rows()[row].severity() == Severity::Hold;
        let lacks_a_way = wait.is_some_and(|it| matches!(it.what, Awaited::Answer | Awaited::Retry | Awaited::Vehicle));
        let has_no_plan = matches!(activity, Activity::Begin | Activity::Bridge) && lacks_a_way;
        let waits_for_operator = self.is_paused() || !self.memory.source().permits(To::Plan);
        let waits_for_plan = self.is_flying() && has_no_plan && !waits_for_operator;
        let is_held = match activity {
            Activity::Respond(row) => holds(row),
            _ => waits_for_operator || has_no_plan,
        };
        let does_a_task = matches!(self.skills.present(), Some((Goal::Task(_), _)));
        let is_asked_for = does_a_task || wait.is_some_and(|it| matches!(it.what, Awaited::Stay | Awaited::Approval));
        let is_lost = self.position_is_missing().is_some();
        let paused = self.is_paused();
        let is_resumed = std::mem::replace(&mut self.watch.progress.was_paused, paused) && !paused;
        self.watch.progress.held = match self.watch.progress.held {
            // Who resumes has decided.
            _ if !self.is_flying() || is_asked_for || is_resumed => None,
            // A position that is not believed shows no progress.
            Some(held) if is_held || is_lost || held.place.distance_m(here) < PLACE_M => Some(held),
            _ => Some(Held { place: here, since: now }),
        };
        self.watch.progress.plan_since = since(self.watch.progress.plan_since, waits_for_plan);
        let is_blown = self.is_flying() && !self.holds_in_wind();
        self.watch.progress.blown_since = since(self.watch.progress.blown_since, is_blown);
    }

    /// How it comes forward, on this leg from `here` on.
    fn headway_of(&self, leg: &WatchedLeg, here: Ned) -> Headway {
        let (now, left_s) = (self.now.time, leg.intended.time_s(here, leg.to));
        match (&self.watch.progress.leg, self.watch.progress.headway) {
            (Some(before), Some(headway)) if before.to == leg.to => headway.seen(now, left_s),
            (_, Some(headway)) => headway.turned(left_s, START_AND_STOP_S),
            (_, None) => Headway::begins(now, left_s + START_AND_STOP_S, STRETCH),
        }
    }

    /// The leg of the skill that executes, as if it began here and now.
    fn present_leg(&self) -> Option<WatchedLeg> {
        let vehicle = self.seen.vehicle.filter(|it| it.flying)?;
        let (goal, skill_id) = self.skills.present().filter(|_| self.skills.has_shown_its_mode())?;
        let &Goal::Position { target, speed_limit_m_s, hold_at_target, .. } = goal else { return None };
        let Speeds { climb_m_s, descent_m_s, .. } = self.setup.limits.flight.speeds;
        let intended = Speeds::calm(speed_limit_m_s, climb_m_s, descent_m_s);
        let (from, velocity) = (vehicle.position, vehicle.velocity);
        let braking_s =
            velocity.north_m_s.hypot(velocity.east_m_s) / (2.0 * self.setup.limits.config.braking_m_s2.get());
        let turn = Ned::new(
            from.north_m + velocity.north_m_s * braking_s,
            from.east_m + velocity.east_m_s * braking_s,
            from.down_m,
        );
        Some(WatchedLeg { skill_id, from, turn, to: target, intended, holds: hold_at_target })
    }

    /// Where the mission leads next, and how fast, also while a response flies.
    fn leads_next(&self) -> Option<(Ned, f64)> {
        let goal = self
            .planner
            .flight
            .step()
            .map(|(step, ..)| step.nominal.goal.clone())
            .or_else(|| self.planner.flight.interrupted().map(|it| it.nominal.goal.clone()));
        let Some(Goal::Position { target, speed_limit_m_s, .. }) = goal else { return None };
        Some((target, speed_limit_m_s))
    }

    /// What rules read; `None` on the ground.
    pub(super) fn told_progress(&self) -> Option<v1::FlightProgress> {
        let vehicle = self.seen.vehicle.filter(|it| it.flying)?;
        let (watch, now) = (&self.watch.progress, self.now.time);
        let since_s = |it: Option<Time>| it.map_or(0.0, |since| (now - since).as_secs_f64());
        let goal = self.leads_next();
        Some(v1::FlightProgress {
            path_deviation_m: watch.leg.map(|it| it.deviation_m(vehicle.position)),
            pace: watch.headway.and_then(|it| it.pace()),
            cancel_s: since_s(self.skills.cancelling_since()),
            operator_s: since_s(watch.held.map(|it| it.since)),
            plan_s: since_s(watch.plan_since),
            goal: goal.map(|(goal, _)| goal.into()),
            goal_speed_m_s: goal.map_or(0.0, |(_, speed_m_s)| speed_m_s),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_is_left_sideways() {
        let leg = WatchedLeg {
            skill_id: 1,
            from: Ned::new(0.0, 0.0, -10.0),
            turn: Ned::new(0.0, 0.0, -10.0),
            to: Ned::new(300.0, 400.0, -50.0),
            intended: Speeds::calm(10.0, 3.0, 1.5),
            holds: false,
        };
        #[track_caller]
        fn check(leg: &WatchedLeg, here: Ned, expected_m: f64) {
            assert!((leg.deviation_m(here) - expected_m).abs() < 1e-9, "{}", leg.deviation_m(here));
        }
        check(&leg, Ned::new(30.0, 40.0, -40.0), 0.0);
        check(&leg, Ned::new(34.0, 37.0, -10.0), 5.0);
        // Before its begin and behind its end.
        check(&leg, Ned::new(-3.0, -4.0, -10.0), 5.0);
        check(&leg, Ned::new(306.0, 408.0, -10.0), 10.0);
        // One that flies another way at first turns where it comes to rest.
        let turns = WatchedLeg { turn: Ned::new(-15.0, -20.0, -10.0), ..leg };
        check(&turns, Ned::new(-12.0, -16.0, -10.0), 0.0);
        check(&turns, Ned::new(-18.0, -24.0, -10.0), 5.0);
        // A leg straight up has no line over ground.
        check(&WatchedLeg { to: leg.from.at_height(60.0), ..leg }, Ned::new(3.0, 4.0, -30.0), 5.0);
    }
}
