//! Between standing and flying: nothing is flown to but the ground (docs/decisions.md, "Near the ground there is one way to go").

use domain::decision::DecisionKind;
use domain::fmu::FlightMode;
use domain::situation::Situation;
use domain::time::Time;

use super::World;
use crate::journal::{CONTINGENCY, Said};
use crate::vehicle::Vehicle;

impl World {
    /// Whether the vehicle flies, and has hardly lifted off, or touches the ground at the end of a landing.
    pub(crate) fn is_near_ground(&self) -> bool {
        self.is_flying() && self.situation().is_near_ground()
    }

    /// Whether the vehicle touches the ground in landing mode, no matter which landing it is: nothing else may be commanded then.
    pub(crate) fn touches_in_landing(&self) -> bool {
        self.is_near_ground() && self.vehicle.is_some_and(|it| it.mode == Some(FlightMode::Land))
    }

    /// Whether the vehicle stands with its motors on in the takeoff mode, and must not take off before an operator says so.
    pub(super) fn is_about_to_lift_off(&self) -> bool {
        let takes_off = |it: &Vehicle| !it.flying && it.armed && it.mode == Some(FlightMode::Takeoff);
        self.unplanned_landing.is_some() && self.vehicle.as_ref().is_some_and(takes_off)
    }

    /// A landing touches the ground: it is flown to its end, whatever else is to be flown.
    pub(crate) fn touches_down(&self) -> bool {
        self.situation() == Situation::TouchingDown
    }

    /// A manager that was just started and has not seen the vehicle yet does not know whether it touches the ground. It looks first, until
    /// the monitor counts as lost; where that speaks and does not know either, until its sources have had their time: a land detector
    /// that waits for its turn is the slowest.
    pub(super) fn looks_first_until(&self) -> Option<Time> {
        let speaks = self.monitor_spoke.is_some_and(|at| self.now.time < at + self.limits.introspection);
        let limit = if speaks { self.limits.land_detector } else { self.limits.introspection };
        let until = self.watches_since? + limit;
        (self.vehicle.is_none() && self.now.time < until).then_some(until)
    }

    /// Whether nothing is to be flown to but the ground: near it; and once the vehicle has stood after the end of the mission, which the report is
    /// made for, where the land detector says the ground and nothing moves. Then a height that drifts looks like a flight, and a vehicle that stands
    /// must not lift off.
    pub(crate) fn lands_where_it_is(&self) -> bool {
        let may_stand = self.vehicle.is_some_and(|it| it.flying && it.may_have_drifted);
        self.is_near_ground() || (self.mission.report.is_some() && may_stand)
    }

    /// The response lands where the vehicle is, instead of flying elsewhere.
    pub(crate) fn say_it_lands_at_once(&mut self) {
        if let Some(row) = self.response_row() {
            let flag = self.flags.name(row).clone();
            let text = format!("`{flag}`: lands where it is: it has hardly lifted off, or touches the ground");
            self.record(Said::new(CONTINGENCY, DecisionKind::Note, text).about(row));
        }
    }
}
