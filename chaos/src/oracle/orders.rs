//! Whether orders are obeyed, in time, and only those that were given.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use domain::time::{Pace, Time};
use kittiwake_proto::v1;

use super::Violation;
use crate::trouble::{Order, Trouble, Victim};

/// In mission time from the order to the ground: down from return height, or home from the farthest area first.
const ABORT_LIMIT: Duration = Duration::from_secs(150);
const RETURN_LIMIT: Duration = Duration::from_secs(300);
/// Wall time within which an order is obeyed or never: half a second by the vehicle's clock (see `bus::freshness`), and what a
/// busy machine takes to carry it out and to say so.
const FRESH: Duration = Duration::from_secs(3);

/// The orders of a run.
#[derive(Debug)]
pub(super) struct Orders {
    pace: Pace,
    /// Mission time that the death of a process may take.
    interruption: Duration,
    /// What must be obeyed, until when.
    in_force: Option<(Order, Time)>,
    /// When each was last given, accepted or not.
    given: BTreeMap<Order, Time>,
    accepted: BTreeSet<Order>,
    /// Obeyed late, while its sender still waits for the answer: the answer decides.
    undecided: BTreeMap<Order, Violation>,
    /// Orders whose giver waits.
    waiting: BTreeMap<Order, u32>,
    /// Which the vehicle was seen to obey.
    obeyed: BTreeSet<Order>,
    /// When the manager was heard for the last time.
    heard: Time,
}

/// By the flags of which orders a vehicle may be seen to obey one: a return before the lift-off ends the mission on the ground,
/// as an abort does.
fn seen_as(order: Order) -> &'static [Order] {
    match order {
        Order::Abort => &[Order::Abort],
        Order::Return => &[Order::Return, Order::Abort],
    }
}

impl Orders {
    pub(super) fn new(pace: Pace, interruption: Duration) -> Orders {
        Orders {
            pace,
            interruption,
            in_force: None,
            given: BTreeMap::new(),
            accepted: BTreeSet::new(),
            undecided: BTreeMap::new(),
            waiting: BTreeMap::new(),
            obeyed: BTreeSet::new(),
            heard: Time::ZERO,
        }
    }

    pub(super) fn given(&mut self, now: Time, order: Order) {
        for &it in seen_as(order) {
            self.given.insert(it, now);
            *self.waiting.entry(it).or_default() += 1;
        }
    }

    /// Its sender has an answer. Without acceptance what was obeyed late is a violation.
    pub(super) fn answered(&mut self, order: Order, is_accepted: bool) -> Option<Violation> {
        let mut violation = None;
        for &it in seen_as(order) {
            let waiting = self.waiting.entry(it).or_default();
            *waiting = waiting.saturating_sub(1);
            if is_accepted {
                self.undecided.remove(&it);
            }
            if *waiting == 0 {
                violation = violation.or(self.undecided.remove(&it));
            }
        }
        violation
    }

    pub(super) fn accepted(&mut self, now: Time, order: Order, is_airborne: bool) {
        self.accepted.extend(seen_as(order));
        if is_airborne {
            self.in_force(now, order);
        }
    }

    /// From now on it must bring the vehicle to the ground in time.
    pub(super) fn in_force(&mut self, now: Time, order: Order) {
        let limit = match order {
            Order::Abort => ABORT_LIMIT,
            Order::Return => RETURN_LIMIT,
        };
        self.in_force = Some((order, now + limit + self.interruption));
    }

    /// A trouble begins: an order may take longer, or is lost with its state, which the system reports. While the link
    /// is lost the vehicle may hold.
    pub(super) fn troubled(&mut self, trouble: &Trouble) {
        let is_forgotten =
            matches!(trouble, Trouble::GarbledState(Victim::Mcm | Victim::Onboard, _) | Trouble::FullDisk(_));
        let more = self.interruption * trouble.interruptions() + self.pace.wall(trouble.link_is_faulty_for());
        self.in_force = self.in_force.filter(|_| !is_forgotten).map(|(order, by)| (order, by + more));
    }

    /// A new vehicle stands at home.
    pub(super) fn forget(&mut self) {
        self.in_force = None;
    }

    /// The manager says what it does. What it did not do when it was last heard, it began to do after that.
    pub(super) fn obeyed(&mut self, now: Time, manager: &v1::McmStatus) -> Vec<Violation> {
        let before = std::mem::replace(&mut self.heard, now);
        let mut late = Vec::new();
        for order in [Order::Abort, Order::Return] {
            let is_up = manager.contingencies.iter().any(|it| it.flag == order.flag());
            if !is_up || !self.obeyed.insert(order) || self.accepted.contains(&order) {
                continue;
            }
            let given = self.given.get(&order).copied();
            if given.is_none_or(|it| it + self.pace.wall(FRESH) < before) {
                let violation = Violation::ObeyedLate { order, at: now, given };
                match self.waiting.get(&order) {
                    Some(1..) => drop(self.undecided.insert(order, violation)),
                    _ => late.push(violation),
                }
            }
        }
        late
    }

    /// The vehicle flies, or does not.
    pub(super) fn flies(&mut self, at: Time, is_airborne: bool) -> Option<Violation> {
        let (order, by) = self.in_force.take_if(|(_, by)| !is_airborne || *by < at)?;
        is_airborne.then_some(Violation::Disobeyed { order, at: by })
    }
}
