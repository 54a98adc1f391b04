//! Judges a run by where the vehicle is, not by what the system claims: a pure function of what passed by and when.

use std::time::Duration;

use domain::geometry::Ned;
use domain::time::{Now, Pace, Time};
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use witness::{Limits, Witness};

use crate::trouble::{Order, Trouble};

mod orders;
mod violation;

use orders::Orders;
pub use violation::Violation;

/// Moving less than this is resting.
const REST_RADIUS_M: f64 = 5.0;
/// One that rests for this mission time, and this wall time, holds.
const HOLDS: (Duration, Duration) = (Duration::from_secs(40), Duration::from_secs(8));

/// How the vehicle is.
#[derive(Debug, Clone, PartialEq)]
pub enum State {
    /// In the air, on its way.
    Flies,
    /// In the air, at rest for a while, for this reason; none if it is empty.
    Holds(String),
    /// On the ground, and stays there until an operator wants otherwise, for this reason.
    Waits(String),
    /// On the ground after the end of the mission.
    Over(v1::MissionOutcome),
    /// On the ground, and about to do something.
    Stands,
}

/// Takes in what passes by.
#[derive(Debug)]
pub struct Oracle {
    pace: Pace,
    /// Mission time that the death of a process may take.
    interruption: Duration,
    witness: Witness,
    violations: Vec<Violation>,
    manager: v1::McmStatus,
    /// When the mission manager was last heard, or nothing was to be expected of it.
    manager_heard: Time,
    position: Option<Ned>,
    position_heard: Time,
    rest: Option<(Ned, Time)>,
    path_m: f64,
    orders: Orders,
}

impl Oracle {
    /// For a system at that pace, in which a dead process may be away for `interruption` of wall time.
    pub fn new(pace: Pace, interruption: Duration) -> Oracle {
        let interruption = pace.wall(interruption);
        Oracle {
            pace,
            interruption,
            witness: Witness::with(limits(pace, interruption)),
            violations: Vec::new(),
            manager: v1::McmStatus::default(),
            manager_heard: Time::ZERO,
            position: None,
            position_heard: Time::ZERO,
            rest: None,
            path_m: 0.0,
            orders: Orders::new(pace, interruption),
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
                (self.manager, self.manager_heard) = (it.clone(), now.time);
            }
            Message::VehicleLocalPosition(it) => {
                if let Some(Ok(position)) = it.position.map(Ned::try_from) {
                    self.moved(now.time, position);
                }
            }
            _ => {}
        }
    }

    fn moved(&mut self, at: Time, position: Ned) {
        if let Some(before) = self.position.replace(position).filter(|_| self.witness.is_airborne()) {
            self.path_m += before.distance_m(position);
        }
        // While nothing is heard at all, the router is away, and the silence of the manager says nothing.
        let was_deaf = self.position_heard + self.pace.wall(Duration::from_secs(1)) < at;
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
    }

    /// A trouble begins: an order may take longer, or is forgotten with the state that held it, aloud.
    pub fn troubled(&mut self, trouble: &Trouble) {
        self.orders.troubled(trouble);
    }

    /// An operator gives an order; it is not known yet what comes of it.
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
    }

    /// An operator's order was not accepted, though it was given again and again.
    pub fn refused(&mut self, order: Order, said: &str) {
        if self.witness.is_airborne() && self.manager.report.is_none() {
            self.violations.push(Violation::Refused { order, said: said.to_owned() });
        }
    }

    /// Everything has lost its power, the vehicle as well: the simulator's next one stands at home. What was over stays over.
    pub fn power_lost(&mut self, now: Now) {
        self.witness = Witness::with(limits(self.pace, self.interruption));
        if self.manager.report.is_some() {
            self.witness.take_in(now, &self.manager.clone().into());
        }
        self.orders.forget();
        (self.position, self.rest, self.manager_heard) = (None, None, now.time);
    }

    /// The mission is over with this outcome, and the vehicle on the ground.
    pub fn over(&mut self, outcome: v1::MissionOutcome) {
        if outcome == v1::MissionOutcome::Crash {
            self.violations.push(Violation::Crashed);
        }
    }

    /// The launcher has ended with this exit code.
    pub fn ended(&mut self, code: Option<i32>, last_words: &str) {
        match code {
            // It ends only once the vehicle is on the ground.
            Some(0 | 3 | 4) => {}
            Some(6) => self.violations.push(Violation::Crashed),
            _ => self.violations.push(Violation::NotKeptUp(last_words.to_owned())),
        }
    }

    /// The time of the run is up.
    pub fn never_ended(&mut self) {
        let how = format!("{:?}, mission {:?}", self.state(self.position_heard), self.manager.phase());
        self.violations.push(Violation::NeverEnded(how));
    }

    /// How the vehicle is.
    pub fn state(&self, now: Time) -> State {
        let reason = if self.manager.start_awaited { "waits for an operator" } else { self.manager.acting.as_str() };
        let (mission, wall) = HOLDS;
        let rests = self.rest.is_some_and(|(_, since)| since + mission.max(self.pace.wall(wall)) < now);
        match (self.witness.is_airborne(), rests) {
            (true, true) => State::Holds(reason.to_owned()),
            (true, false) => State::Flies,
            (false, true) if self.manager.report.is_some() => {
                State::Over(self.manager.report.as_ref().map(v1::MissionReport::outcome).unwrap_or_default())
            }
            (false, true) if !reason.is_empty() => State::Waits(reason.to_owned()),
            (false, _) => State::Stands,
        }
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
        notice: usual.notice + interruption,
        hears: usual.hears.max(pace.wall(Duration::from_secs(1))) + interruption,
    }
}

#[cfg(test)]
mod tests;
