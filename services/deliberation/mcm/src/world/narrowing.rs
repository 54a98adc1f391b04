//! What is forbidden while flags are up, whatever is flown: the rule is [`domain::contingency::narrowing`], and everything here that
//! chooses a way, a speed or a place asks what it says.

use domain::airspace::{Breach, Motion};
use domain::contingency::Phase;
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::route::WORTH_FLYING_M;
use domain::skill::Goal;
use domain::speeds::Speeds;
use domain::time::Time;

use super::World;
use crate::decide::Awaited;
use crate::journal::{Cause, Said};

/// A vehicle that is slower over ground rests. (ENG: it stops within a quarter of a metre.)
pub(super) const MOVES_M_S: f64 = 1.0;

/// What a step waits for, while flags forbid the remaining way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Barrier {
    /// An area that may not be entered now.
    Area(String),
    /// A place at which no landing may begin now.
    Landing,
}

/// A goal of a step as it may be flown now.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NarrowedGoal {
    pub(crate) goal: Goal,
    /// It is a hold before this.
    pub(crate) barrier: Option<Barrier>,
}

impl World {
    /// The goal of the present step as it may be flown now: slower, or as a hold before what flags forbid. `present`: what the
    /// vehicle holds before already; it does so until that is allowed again, even if it has drifted over the border.
    pub(crate) fn narrowed(&self, wanted: Goal, present: Option<&Barrier>) -> NarrowedGoal {
        let mut goal = wanted;
        if let Goal::Position { speed_limit_m_s, .. } = &mut goal {
            *speed_limit_m_s = self.slowed(*speed_limit_m_s);
        }
        let Some(here) = self.seen.vehicle.filter(|it| it.flying).map(|it| it.position) else {
            return NarrowedGoal { goal, barrier: None };
        };
        match self.barrier(here, &goal, present) {
            None => NarrowedGoal { goal, barrier: None },
            Some((barrier, at)) => {
                NarrowedGoal { goal: Goal::hold_at(at, self.flight_limits().speeds.cruise_m_s), barrier: Some(barrier) }
            }
        }
    }

    /// What forbids the rest of the way to `goal`, and where to hold before it.
    fn barrier(&self, here: Ned, goal: &Goal, present: Option<&Barrier>) -> Option<(Barrier, Ned)> {
        if goal.lands() && self.landing_forbidden_by(here).is_some() {
            return Some((Barrier::Landing, here));
        }
        self.narrowing().no_new_area?;
        let utc_ms = self.now.utc_ms;
        if let Some(Barrier::Area(name)) = present
            && self.planner.areas().iter().any(|it| it.name == *name && it.is_active(utc_ms))
        {
            return Some((Barrier::Area(name.clone()), here));
        }
        let (to, speeds) = match *goal {
            Goal::Position { target, speed_limit_m_s, .. } => {
                (target, Speeds { cruise_m_s: speed_limit_m_s, ..self.setup.limits.flight.speeds })
            }
            Goal::Land | Goal::LandOnTarget => {
                let (step, ..) = self.planner.flight.step()?;
                (here.at_height(step.reaches.position.height_m()), self.setup.limits.flight.speeds)
            }
            Goal::Takeoff { .. } | Goal::Stop | Goal::Velocity { .. } | Goal::Release { .. } | Goal::Task(_) => {
                return None;
            }
        };
        let motion = Motion::in_air(speeds);
        let grants = self.permits().to_enter();
        let breach = self.airspace(&grants, self.setup.limits.leave_lead).first_breach(here, to, motion)?;
        let at = match goal {
            Goal::Land | Goal::LandOnTarget => here,
            _ => self.before(here, to, &breach).unwrap_or(here),
        };
        Some((Barrier::Area(breach.area), at))
    }

    /// Where to stop on the way from `here` to `target`, before this breach; `None`: that is not worth flying.
    pub(super) fn before(&self, here: Ned, target: Ned, breach: &Breach) -> Option<Ned> {
        let allowed_m = here.distance_m(breach.at) - self.setup.limits.aircraft.flight.stand_off_m.get();
        (WORTH_FLYING_M <= allowed_m).then(|| here.towards(target, allowed_m / here.distance_m(target)))
    }

    /// Records that a step holds before what a flag forbids, or goes on.
    pub(crate) fn say_held(&mut self, barrier: Option<&Barrier>) {
        let by = match barrier {
            None => return self.say("step", "goes on: no flag forbids it any more"),
            Some(Barrier::Area(area)) => (self.narrowing().no_new_area, format!("before area {area}")),
            Some(Barrier::Landing) => (self.narrowing().no_landing_here, "over the place of the landing".to_owned()),
        };
        let (Some(row), place) = by else { return };
        let text = format!("holds {place} while `{}` is up", self.flags.name(row));
        self.record(Said::new("step", DecisionKind::Note, text).about(row).led_to_by(Cause::Raised(row)));
    }

    /// A step has held before this for as long as it may: why it fails. The next plan does without the area.
    pub(crate) fn give_up_before(&mut self, barrier: &Barrier) -> String {
        let (row, what) = match barrier {
            Barrier::Area(area) => (self.narrowing().no_new_area, format!("area {area} is not entered")),
            Barrier::Landing => (self.narrowing().no_landing_here, "no landing here".to_owned()),
        };
        let why = row.map_or_else(String::new, |row| format!("`{}` is up", self.flags.name(row)));
        if let Barrier::Area(area) = barrier {
            self.permissions.withhold(area, why.clone());
        }
        format!("{what}: {why}, for {} s", self.setup.limits.config.barrier_limit_s.seconds().as_secs_f64())
    }

    /// When a step that holds before what a flag forbids from now on is given up.
    pub(crate) fn barrier_ends(&self) -> Time {
        self.now.time + self.setup.limits.config.barrier_limit_s.seconds()
    }

    /// Straight up by the configured height, no higher than a flight without a plan may be; out of a landing to where that began, so that the
    /// next one is no longer. `None`: it is as high, or on the ground.
    ///
    /// # Errors
    /// Why that may not be flown.
    pub(crate) fn climb(&self) -> Result<Option<Goal>, String> {
        let vehicle = self.seen.vehicle.ok_or("the vehicle's position is not known")?;
        let (here, limits) = (vehicle.position, self.flight_limits());
        let landing = self.planner.flight.interrupted().filter(|it| it.nominal.goal.lands());
        let by_m = || here.height_m() + self.setup.limits.config.climb_by_m.get();
        let height_m = landing.map_or_else(by_m, |it| it.from.height_m()).min(limits.highest_m);
        if self.flight_phase() == Phase::OnGround || height_m - here.height_m() < WORTH_FLYING_M {
            return Ok(None);
        }
        let target = here.at_height(height_m);
        let speed_limit_m_s = limits.speeds.cruise_m_s;
        match self.breach_on_way(here, target, speed_limit_m_s) {
            Some(breach) => Err(breach.to_string()),
            None => Ok(Some(Goal::fly_to(target, speed_limit_m_s))),
        }
    }

    /// Whether the straight way between these is high enough over the ground.
    pub(super) fn is_clear(&self, from: Ned, to: Ned) -> bool {
        self.planner.mission.ground.why_too_low((from, to), &self.setup.limits.flight).is_none()
    }

    /// Whether there is no plan for longer than the planner takes to answer: it lets the mission wait, is asked later, or an operator is.
    pub(crate) fn rests_without_plan(&self) -> bool {
        self.decision_now().wait.is_some_and(|it| it.what != Awaited::Answer)
    }

    /// The goal while there is no plan. A vehicle that moves goes on towards the step that failed until the planner has answered, slower,
    /// and only as far as the next border that may not be crossed; otherwise it stops. `None` on the ground, but for a takeoff that the
    /// autopilot has ended and would go on with.
    ///
    /// The position goal holds at its target, so that a transition never ends by itself.
    pub(crate) fn transition_goal(&self) -> Option<Goal> {
        let vehicle = self.seen.vehicle?;
        if self.is_about_to_lift_off() || self.touches_in_landing() {
            return Some(Goal::Land);
        }
        let here = Some(vehicle).filter(|it| it.flying)?.position;
        let moves = MOVES_M_S < vehicle.velocity.ground_speed_m_s();
        let onward = self.planner.flight.interrupted().filter(|_| moves && !self.rests_without_plan());
        let onward = onward.map(|it| it.nominal.goal.clone());
        let Some(Goal::Position { target, speed_limit_m_s, yaw_rad, .. }) = onward else {
            return Some(Goal::Stop);
        };
        let speed_m_s = self.slowed(self.setup.limits.config.transition_speed_m_s.get().min(speed_limit_m_s));
        let target = match self.breach_on_way(here, target, speed_m_s) {
            Some(breach) => self.before(here, target, &breach),
            None => Some(target).filter(|it| WORTH_FLYING_M <= here.distance_m(*it) && self.is_clear(here, *it)),
        };
        let Some(target) = target else { return Some(Goal::Stop) };
        Some(Goal::Position { target, speed_limit_m_s: speed_m_s, yaw_rad, hold_at_target: true })
    }
}
