//! Judges a run by where the vehicle is, not by what the system claims: a pure function of what passed by and when.

use std::time::Duration;

use domain::area::Area;
use domain::geometry::Ned;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use witness::{Limits, Witness};

use crate::trouble::{Order, Trouble, Victim};

mod comes_back;
mod orders;
mod state;
mod stays_down;
mod violation;

use comes_back::ComesBack;
use orders::Orders;
pub use state::State;
use stays_down::{LiftOff, StaysDown};
pub use violation::Violation;

/// Moving less than this is resting.
const REST_RADIUS_M: f64 = 5.0;
/// Who hears nothing at all for longer than this wall time is not on the bus, and knows of nobody whether it is there.
const DEAF: Duration = Duration::from_secs(1);

/// Wall time by which the word of a busy machine may be late on a busy bus.
const LATE: Duration = Duration::from_secs(2);
/// Mission time to come to rest from the mission's speed, at the configured braking (10 m/s, 3 m/s²), and to be told to.
const BRAKING: Duration = Duration::from_secs(5);

/// A vehicle that was not heard for longer than this wall time before its launcher's end may have landed meanwhile: its last
/// message is up to a second old, and its simulator ends while the launcher takes down the rest.
const LAST_HEARD: Duration = Duration::from_secs(2);

/// Takes in what passes by.
#[derive(Debug)]
pub struct Oracle {
    pace: Pace,
    /// Mission time that the death of a process may take.
    interruption: Duration,
    /// Of the mission's file.
    areas: Vec<Area>,
    witness: Witness,
    violations: Vec<Violation>,
    manager: v1::McmStatus,
    /// When the mission manager said that; nothing since the power came.
    manager_said: Option<Time>,
    /// What it said of the end of the mission before the power was lost.
    over: Option<v1::McmStatus>,
    /// When the mission manager was last heard, or last not expected to speak.
    manager_heard: Time,
    position: Option<Ned>,
    position_heard: Time,
    rest: Option<(Ned, Time)>,
    path_m: f64,
    orders: Orders,
    stays_down: StaysDown,
    comes_back: ComesBack,
}

impl Oracle {
    /// For a system at that pace that flies a mission with these areas, in which a dead process may be away for `interruption` of
    /// wall time.
    pub fn new(pace: Pace, interruption: Duration, areas: Vec<Area>) -> Oracle {
        let interruption = pace.wall(interruption);
        Oracle {
            pace,
            interruption,
            witness: Witness::with(limits(pace, interruption)).expecting(areas.clone()),
            areas,
            violations: Vec::new(),
            manager: v1::McmStatus::default(),
            manager_said: None,
            over: None,
            manager_heard: Time::ZERO,
            position: None,
            position_heard: Time::ZERO,
            rest: None,
            path_m: 0.0,
            orders: Orders::new(pace, interruption),
            stays_down: StaysDown::new(limits(pace, interruption).under_way, interruption),
            comes_back: ComesBack::new(pace, interruption),
        }
    }

    /// Of the system that it watches.
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// Mission time that the death of a process may take.
    pub fn interruption(&self) -> Duration {
        self.interruption
    }

    /// A message passes by.
    pub fn hears(&mut self, now: Now, message: &Message) {
        let known = self.witness.breaches().len();
        self.witness.take_in(now, message);
        self.violations.extend(self.witness.breaches().iter().skip(known).cloned().map(Violation::Breach));
        match message {
            Message::McmStatus(it) => {
                self.violations.extend(self.orders.obeyed(now.time, it));
                (self.manager, self.manager_said, self.manager_heard) = (it.clone(), Some(now.time), now.time);
                self.stays_down.saves(!self.manager_cannot_save());
            }
            Message::VehicleLocalPosition(it) => {
                if let Some(Ok(position)) = it.position.map(Ned::try_from) {
                    self.moved(now.time, position);
                }
            }
            Message::Heartbeat(it) => self.violations.extend(self.comes_back.beats(now.time, it)),
            _ => {}
        }
    }

    fn moved(&mut self, at: Time, position: Ned) {
        if let Some(before) = self.position.replace(position).filter(|_| self.witness.is_airborne()) {
            self.path_m += before.distance_m(position);
        }
        // While nothing is heard at all, the router is away, and the silence of the manager says nothing.
        let was_deaf = self.position_heard + self.pace.wall(DEAF) < at;
        self.position_heard = at;
        if was_deaf || !self.witness.is_airborne() {
            self.manager_heard = self.manager_heard.max(at);
        }
        if self.manager_heard + self.interruption < at {
            self.violations.push(Violation::NobodyInCharge { at, silent_for: at - self.manager_heard });
            self.manager_heard = at;
        }
        let rests = |(place, _): &(Ned, Time)| place.distance_m(position) < REST_RADIUS_M;
        self.rest = self.rest.filter(rests).or(Some((position, at)));
        self.violations.extend(self.orders.flies(at, self.witness.is_airborne()));
        self.stayed_down(at);
    }

    fn stayed_down(&mut self, at: Time) {
        if !self.witness.is_airborne() {
            self.stays_down.stands();
        }
        let lift_off = self.witness.has_lifted_off().then(|| self.stays_down.flies(at)).flatten();
        match lift_off {
            Some(LiftOff::Forbidden(order)) => self.violations.push(Violation::TookOffAfter { order, at }),
            Some(LiftOff::UnderWay(order)) => self.orders.in_force(at, order),
            None => {}
        }
    }

    /// A trouble begins: an order may take longer, or is lost with its state, which the system reports.
    pub fn troubled(&mut self, now: Now, trouble: &Trouble) {
        self.orders.troubled(trouble);
        self.stays_down.troubled(now.time, trouble);
        self.comes_back.troubled(now.time, trouble);
        // A revocation does not pass meanwhile, or late.
        self.witness.disturbed(now.time, self.pace.wall(trouble.deafens_for()));
        if trouble.deaths().iter().any(|(it, _)| matches!(it, Victim::Mcm | Victim::Onboard)) {
            self.forgets_what_is_not_saved();
        }
    }

    /// The mission manager ends. An order is saved before it is answered as accepted, unless the manager has said that it cannot save.
    fn forgets_what_is_not_saved(&mut self) {
        if self.manager_cannot_save() {
            self.stays_down.forget_what_is_not_saved();
        }
    }

    fn manager_cannot_save(&self) -> bool {
        self.manager.memory.as_ref().is_some_and(|it| !it.failing.is_empty())
    }

    /// An operator gives an order; its outcome is not known yet.
    pub fn given(&mut self, now: Time, order: Order) {
        self.orders.given(now, order);
    }

    /// The sender of the order has an answer.
    pub fn answered(&mut self, order: Order, is_accepted: bool) {
        self.violations.extend(self.orders.answered(order, is_accepted));
    }

    /// An operator's order was accepted.
    pub fn ordered(&mut self, now: Time, order: Order) {
        self.orders.accepted(now, order, self.witness.is_airborne());
        self.stays_down.accepted(now, order);
    }

    /// An operator's order was not accepted, though it was given again and again.
    pub fn refused(&mut self, order: Order, said: &str) {
        if self.witness.is_airborne() && self.manager.report.is_none() {
            self.violations.push(Violation::Refused { order, said: said.to_owned() });
        }
    }

    /// A process is about to be killed or stopped.
    pub fn lost(&mut self, now: Time, victim: Victim, id: u32) {
        if victim != Victim::Gateway {
            self.witness.disturbed(now, self.interruption);
        }
        self.comes_back.lost(now, victim, id);
    }

    /// A stopped process goes on.
    pub fn continued(&mut self, now: Time, id: u32) {
        self.comes_back.continued(now, id);
    }

    /// Whether it is still open if a process that was lost comes back.
    pub fn awaits_somebody(&self) -> bool {
        self.comes_back.awaited().next().is_some()
    }

    /// Everything has lost its power, the vehicle as well: the simulator's next one stands at home. What was over stays over.
    pub fn power_lost(&mut self, now: Now) {
        self.witness = Witness::with(limits(self.pace, self.interruption)).expecting(self.areas.clone());
        if self.manager_said.is_some() {
            self.over = Some(self.manager.clone()).filter(|it| it.report.is_some());
        }
        if let Some(over) = self.over.clone() {
            self.witness.take_in(now, &over.into());
        }
        self.orders.forget();
        self.forgets_what_is_not_saved();
        self.stays_down.power_lost(now.time);
        self.comes_back.power_lost(now.time);
        // What it said is over with it: perhaps there is no manager any more that would say it again.
        (self.manager, self.manager_said) = (v1::McmStatus::default(), None);
        (self.position, self.rest, self.manager_heard) = (None, None, now.time);
    }

    /// The mission is over with this outcome, and the vehicle on the ground.
    pub fn over(&mut self, outcome: v1::MissionOutcome) {
        if outcome == v1::MissionOutcome::Crash {
            self.violations.push(Violation::Crashed);
        }
    }

    /// The launcher has ended with this exit code.
    pub fn ended(&mut self, now: Now, code: Option<i32>, last_words: &str) {
        let was_heard = now.time <= self.position_heard + self.pace.wall(LAST_HEARD);
        match code {
            // It must end only once the vehicle is on the ground.
            Some(0 | 3 | 4) if self.witness.is_airborne() && was_heard => {
                self.violations.push(Violation::LeftInFlight { at: self.position_heard });
            }
            Some(0 | 3 | 4) => {}
            Some(6) => self.violations.push(Violation::Crashed),
            _ => self.not_kept_up(last_words),
        }
    }

    /// The system that had begun to fly did not stay up, or did not come back, for this reason.
    pub fn not_kept_up(&mut self, why: &str) {
        self.violations.push(Violation::NotKeptUp(why.to_owned()));
    }

    /// Metres flown so far.
    pub fn path_m(&self) -> f64 {
        self.path_m
    }

    /// What it has against the run.
    pub fn violations(&self) -> &[Violation] {
        &self.violations
    }
}

/// The witness's, with the time that the death of a process takes.
fn limits(pace: Pace, interruption: Duration) -> Limits {
    let usual = Limits::default();
    Limits {
        under_way: usual.under_way.max(pace.wall(Duration::from_secs(1))),
        without_response: usual.without_response + interruption,
        hover: usual.hover + interruption,
        notice: usual.notice + pace.wall(LATE),
        heeds: BRAKING + pace.wall(LATE),
        hears: usual.hears.max(pace.wall(Duration::from_secs(1))) + interruption,
    }
}

#[cfg(test)]
mod tests;
