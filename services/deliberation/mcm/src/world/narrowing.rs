//! What is forbidden while flags are up, whatever is flown: the rule is [`domain::contingency::narrowing`], and everything here that
//! chooses a way, a speed or a place asks what it says.

use std::sync::Arc;
use std::time::Duration;

use domain::airspace::{Breach, Grants, Motion};
use domain::contingency::narrowing::{Narrowing, Narrows};
use domain::contingency::{Phase, Severity};
use domain::decision::DecisionKind;
use domain::geometry::Ned;
use domain::route::WORTH_FLYING_M;
use domain::skill::Goal;
use domain::speeds::Speeds;
use domain::time::Time;
use domain::way::FlightLimits;

use super::World;
use super::ground::SAME_SITE_M;
use crate::journal::{CONTINGENCY, Cause, Said};
use crate::permits::held_for;

/// What a step waits for, while flags forbid the rest of it.
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
    /// What is narrowed since the flags were taken in last.
    pub(crate) fn narrowing(&self) -> Narrowing {
        self.decision.narrowing
    }

    /// Records what is forbidden from now on, and what no longer is.
    pub(super) fn say_narrowing(&mut self, before: Narrowing) {
        let now = self.decision.narrowing;
        if before == now {
            return;
        }
        let here = self.vehicle.map(|it| it.position);
        self.no_landing_at = now.no_landing_here.and(self.no_landing_at.or(here));
        for what in Narrows::ALL {
            match (before.by(what), now.by(what)) {
                (None, Some(row)) => self.say_narrowed(what, row),
                (Some(_), None) => {
                    let text = format!("`{}` is over: no flag asks for it any more", what.name());
                    self.record(Said::new(CONTINGENCY, DecisionKind::Note, text).led_to_by(Cause::Nothing));
                }
                (None, None) | (Some(_), Some(_)) => {}
            }
        }
    }

    /// Whether a response is under way that brings the vehicle down.
    pub(super) fn comes_down(&self) -> bool {
        self.actions_left().first().is_some_and(|it| Severity::Return <= it.severity)
    }

    fn say_narrowed(&mut self, what: Narrows, row: usize) {
        let meaning = match what {
            Narrows::NoNewArea => "no area is entered in which the vehicle is not already".to_owned(),
            Narrows::NoLandingHere => "no landing where the vehicle is".to_owned(),
            Narrows::Slow => format!("no faster than {:.1} m/s", self.limits.slow_speed_m_s),
        };
        let text = format!("`{}`: {}, {meaning}", self.flags.name(row), what.name());
        let said = Said::new(CONTINGENCY, DecisionKind::Note, text).about(row).led_to_by(Cause::Raised(row));
        self.record(said.taking(what.name(), meaning));
    }

    /// Speeds, heights and distances of a flight without a plan, as they are narrowed now.
    pub(crate) fn flight_limits(&self) -> FlightLimits {
        let flight = self.limits.flight;
        let cruise_m_s = self.slowed(flight.speeds.cruise_m_s);
        FlightLimits { speeds: Speeds { cruise_m_s, ..flight.speeds }, ..flight }
    }

    /// This speed over ground, or less while a flag slows the vehicle, in metres per second.
    pub(super) fn slowed(&self, speed_m_s: f64) -> f64 {
        match self.decision.narrowing.slow {
            Some(_) => speed_m_s.min(self.limits.slow_speed_m_s),
            None => speed_m_s,
        }
    }

    /// Lets a response that brings the vehicle down, and that no landing is in reach of otherwise, enter areas whose permission is held
    /// although a flag forbids it: what was granted counts until it expires, and to ditch or to land anywhere is worse.
    pub(super) fn look_for_held_areas(&mut self) {
        if !self.comes_down() {
            self.need_held_areas(false);
            return;
        }
        if self.needs_held_areas {
            return;
        }
        let (held, usable) = (held_for(&self.permits().grants, self.limits.permission_margin), self.enterable());
        let areas: Vec<String> = held.into_iter().filter(|it| !usable.contains(it)).collect();
        if areas.is_empty() || self.landing_in_reach().is_some() {
            return;
        }
        self.need_held_areas(true);
        let Some(place) = self.landing_in_reach() else {
            self.need_held_areas(false);
            return;
        };
        let (areas, row) = (areas.join(", "), self.decision.narrowing.no_new_area);
        let although = match row {
            Some(row) => format!("`{}` is up", self.flags.name(row)),
            None => "the tower has not decided about it again since the start".to_owned(),
        };
        let text =
            format!("area {areas} may be entered although {although}: it is held, and else no landing can be reached");
        let said = Said::new(CONTINGENCY, DecisionKind::Note, text);
        let said = match row {
            Some(row) => said.about(row).led_to_by(Cause::Raised(row)),
            None => said.led_to_by(Cause::Response),
        };
        self.record(said.taking(place, "with the permissions that are held".to_owned()));
    }

    /// The permissions that a response could use from here on, also one that is not under way.
    pub(super) fn permits_of_responses(&self) -> Grants {
        if self.comes_down() { self.permits().to_begin() } else { self.permits().with_all_held() }
    }

    fn need_held_areas(&mut self, needs: bool) {
        self.needs_held_areas = needs;
        self.permits.take();
    }

    /// The flag because of which no landing may begin at `place`, if there is one.
    pub(crate) fn landing_forbidden_by(&self, place: Ned) -> Option<&Arc<str>> {
        let (row, at) = (self.decision.narrowing.no_landing_here?, self.no_landing_at?);
        (place.horizontal_distance_m(at) < SAME_SITE_M).then(|| self.flags.name(row))
    }

    /// The goal of the present step as it may be flown now: slower, or as a hold before what flags forbid. `present`: what the
    /// vehicle holds before already; it does so until that is allowed again, even if it has drifted over the border.
    pub(crate) fn narrowed(&self, wanted: Goal, present: Option<&Barrier>) -> NarrowedGoal {
        let goal = match wanted {
            Goal::Position { target, speed_limit_m_s, yaw_rad, hold_at_target } => {
                Goal::Position { target, speed_limit_m_s: self.slowed(speed_limit_m_s), yaw_rad, hold_at_target }
            }
            Goal::Land | Goal::Takeoff { .. } | Goal::Stop | Goal::Velocity { .. } | Goal::Release { .. } => wanted,
        };
        let Some(here) = self.vehicle.filter(|it| it.flying).map(|it| it.position) else {
            return NarrowedGoal { goal, barrier: None };
        };
        match self.barrier(here, goal, present) {
            None => NarrowedGoal { goal, barrier: None },
            Some((barrier, at)) => NarrowedGoal {
                goal: Goal::Position {
                    target: at,
                    speed_limit_m_s: self.flight_limits().speeds.cruise_m_s,
                    yaw_rad: None,
                    hold_at_target: true,
                },
                barrier: Some(barrier),
            },
        }
    }

    /// What forbids the rest of the way to `goal`, and where to hold before it.
    fn barrier(&self, here: Ned, goal: Goal, present: Option<&Barrier>) -> Option<(Barrier, Ned)> {
        if goal == Goal::Land && self.landing_forbidden_by(here).is_some() {
            return Some((Barrier::Landing, here));
        }
        self.decision.narrowing.no_new_area?;
        let utc_ms = self.now.utc_ms;
        if let Some(Barrier::Area(name)) = present
            && self.planner.areas().iter().any(|it| it.name == *name && it.is_active(utc_ms))
        {
            return Some((Barrier::Area(name.clone()), here));
        }
        let (to, speeds) = match goal {
            Goal::Position { target, speed_limit_m_s, .. } => {
                (target, Speeds { cruise_m_s: speed_limit_m_s, ..self.limits.flight.speeds })
            }
            Goal::Land => {
                let (step, ..) = self.planner.step()?;
                (here.at_height(step.reaches.position.height_m()), self.limits.flight.speeds)
            }
            Goal::Takeoff { .. } | Goal::Stop | Goal::Velocity { .. } | Goal::Release { .. } => return None,
        };
        let motion = Motion { begins: Duration::ZERO, speeds, airborne: true };
        let grants = self.permits().to_begin();
        let breach = self.airspace(&grants, self.limits.leave_lead).first_breach(here, to, motion)?;
        let at = match goal {
            Goal::Land => here,
            _ => self.before(here, to, &breach).unwrap_or(here),
        };
        Some((Barrier::Area(breach.area), at))
    }

    /// Where to stop on the way from `here` to `target`, before this breach; `None`: that is not worth flying.
    pub(super) fn before(&self, here: Ned, target: Ned, breach: &Breach) -> Option<Ned> {
        let allowed_m = here.distance_m(breach.at) - self.limits.transition.stand_off_m;
        (WORTH_FLYING_M <= allowed_m).then(|| here.towards(target, allowed_m / here.distance_m(target)))
    }

    /// Records that a step holds before what a flag forbids, or goes on.
    pub(crate) fn say_held(&mut self, barrier: Option<&Barrier>) {
        let by = match barrier {
            None => return self.say("step", "goes on: no flag forbids it any more"),
            Some(Barrier::Area(area)) => (self.decision.narrowing.no_new_area, format!("before area {area}")),
            Some(Barrier::Landing) => {
                (self.decision.narrowing.no_landing_here, "over the place of the landing".to_owned())
            }
        };
        let (Some(row), place) = by else { return };
        let text = format!("holds {place} while `{}` is up", self.flags.name(row));
        self.record(Said::new("step", DecisionKind::Note, text).about(row).led_to_by(Cause::Raised(row)));
    }

    /// A step has held before this for as long as it may: why it fails. The next plan does without the area.
    pub(crate) fn give_up_before(&mut self, barrier: &Barrier) -> String {
        let (row, what) = match barrier {
            Barrier::Area(area) => (self.decision.narrowing.no_new_area, format!("area {area} is not entered")),
            Barrier::Landing => (self.decision.narrowing.no_landing_here, "no landing here".to_owned()),
        };
        let why = row.map_or_else(String::new, |row| format!("`{}` is up", self.flags.name(row)));
        if let Barrier::Area(area) = barrier {
            self.permissions.withhold(area, why.clone());
        }
        format!("{what}: {why}, for {} s", self.limits.barrier_limit.as_secs_f64())
    }

    /// When a step that holds before what a flag forbids from now on is given up.
    pub(crate) fn barrier_ends(&self) -> Time {
        self.now.time + self.limits.barrier_limit
    }

    /// Straight up by the configured height, no higher than a flight without a plan may be; `None`: it is as high, or on the ground.
    ///
    /// # Errors
    /// Why that may not be flown.
    pub(crate) fn climb(&self) -> Result<Option<Goal>, String> {
        let vehicle = self.vehicle.ok_or("the vehicle's position is not known")?;
        let (here, limits) = (vehicle.position, self.flight_limits());
        let height_m = (here.height_m() + self.limits.climb_by_m).min(limits.highest_m);
        if self.flight_phase() == Phase::OnGround || height_m - here.height_m() < WORTH_FLYING_M {
            return Ok(None);
        }
        let target = here.at_height(height_m);
        let speed_limit_m_s = limits.speeds.cruise_m_s;
        match self.breach_on_way(here, target, speed_limit_m_s) {
            Some(breach) => Err(breach.to_string()),
            None => Ok(Some(Goal::Position { target, speed_limit_m_s, yaw_rad: None, hold_at_target: false })),
        }
    }
}
