//! Between standing and flying: nothing is flown to but the ground (docs/decisions.md, "Near the ground there is one way to go").

use std::time::Duration;

use domain::contingency::{AUTOPILOT_PREEMPTS, Phase, SOMEBODY_ELSE_FLIES};
use domain::fmu::FlightMode;
use domain::situation::{Seen, Sight, Situation};
use domain::skill::Goal;
use domain::time::Time;

use super::World;
use crate::vehicle::Vehicle;

/// The autopilot disarms by itself after a landing (PX4: 2 s, COM_DISARM_LAND); longer than this is not waited for it.
const DISARM_LIMIT: Duration = Duration::from_secs(10);

impl World {
    /// Whether the vehicle flies, and has hardly lifted off, or touches the ground at the end of a landing.
    pub(crate) fn is_near_ground(&self) -> bool {
        self.is_flying() && self.situation().is_near_ground()
    }

    /// Whether the vehicle touches the ground in landing mode, no matter which landing it is: nothing else may be commanded then.
    pub(crate) fn touches_in_landing(&self) -> bool {
        self.is_near_ground() && self.seen.vehicle.is_some_and(|it| it.mode == Some(FlightMode::Land))
    }

    /// Whether the vehicle stands with its motors on in the takeoff mode, and must not take off before an operator says so.
    pub(super) fn is_about_to_lift_off(&self) -> bool {
        let takes_off = |it: &Vehicle| !it.flying && it.armed && it.mode == Some(FlightMode::Takeoff);
        self.landings.unplanned.is_some() && self.seen.vehicle.as_ref().is_some_and(takes_off)
    }

    /// A landing touches the ground: it is flown to its end, whatever else is to be flown.
    pub(crate) fn touches_down(&self) -> bool {
        self.situation() == Situation::TouchingDown
    }

    /// A manager that was just started and has not seen the vehicle yet does not know whether it touches the ground. It looks first, until
    /// the monitor counts as lost; where that speaks and does not know either, until its sources have had their time: a land detector
    /// that waits for its turn is the slowest.
    pub(super) fn looks_first_until(&self) -> Option<Time> {
        let speaks = self.monitor.spoke.is_some_and(|at| self.now.time < at + self.setup.limits.introspection);
        let limit = if speaks { self.setup.limits.land_detector } else { self.setup.limits.introspection };
        let until = self.monitor.watches_since? + limit;
        (self.seen.vehicle.is_none() && self.now.time < until).then_some(until)
    }

    /// Whether nothing is to be flown to but the ground: near it; and once the vehicle has stood after the end of the mission, which the report is
    /// made for, where the land detector says the ground and nothing moves. Then a height that drifts looks like a flight, and a vehicle that stands
    /// must not lift off.
    pub(crate) fn lands_where_it_is(&self) -> bool {
        let may_stand = self.seen.vehicle.is_some_and(|it| it.flying && it.may_have_drifted);
        self.is_near_ground() || (self.report().is_some() && may_stand)
    }

    /// The phase of the flight. An unknown vehicle counts as in the air, on its way.
    pub(super) fn flight_phase(&self) -> Phase {
        let Some(vehicle) = self.seen.vehicle else { return Phase::Cruise };
        if !vehicle.flying {
            return Phase::OnGround;
        }
        match self.skills.present().map(|(goal, _)| goal) {
            Some(Goal::Land | Goal::LandOnTarget) => Phase::Landing,
            Some(Goal::Takeoff { .. }) => Phase::Takeoff,
            _ if self.watch.airspace.inside => Phase::InsideArea,
            Some(Goal::Position { .. } | Goal::Velocity { .. }) if !self.answer.in_transition => Phase::Cruise,
            Some(_) | None => Phase::Waiting,
        }
    }

    pub(crate) fn situation(&self) -> Situation {
        let skill_lands = || self.skills.present().is_some_and(|(goal, _)| goal.lands());
        let step_lands = || self.planner.flight.step().is_some_and(|(step, ..)| step.nominal.goal.lands());
        let (seen, near_ground, lands) = match self.seen.vehicle {
            None if self.looks_first_until().is_some() => (Seen::NotYet, false, false),
            None => (Seen::Never, false, false),
            Some(it) if it.flying => (Seen::InAir, it.near_ground, skill_lands()),
            Some(_) => (Seen::OnGround, false, self.landings.unplanned.is_none() && step_lands()),
        };
        Situation::of(Sight { seen, near_ground, lands, over: self.mission.over.is_some() })
    }

    /// Whether the vehicle has settled on the ground: with its motors off for long enough that every process has
    /// noticed, or with them on for longer than it takes to switch them off by itself.
    pub(crate) fn has_settled(&self) -> bool {
        let lasts = |since: Option<Time>, limit| since.is_some_and(|since| limit <= self.now.time - since);
        lasts(self.seen.at_rest_since, self.setup.limits.settle) || lasts(self.seen.armed_on_ground_since, DISARM_LIMIT)
    }

    /// Whether the autopilot flies a failsafe of its own, which nothing but a landing where the vehicle is, or an operator's order, may end:
    /// the skill manager refuses everything else.
    pub(crate) fn is_left_to_autopilot(&self) -> bool {
        self.flags.is_up(AUTOPILOT_PREEMPTS) && self.seen.vehicle.is_some_and(|it| it.flying)
    }

    pub(crate) fn is_flown_by_other(&self) -> bool {
        self.flags.is_up(SOMEBODY_ELSE_FLIES)
    }
}
