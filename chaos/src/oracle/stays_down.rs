//! Whether a vehicle that was ordered to come down stays down.
//!
//! An abort and a return both end the mission, and nothing that a campaign orders flies it on. So neither a touchdown nor a loss of
//! power ends the watch, nor a memory that is lost: what was forgotten waits for an operator, and never takes off
//! (docs/decisions.md, "A lost memory waits for an operator").

use std::time::Duration;

use domain::time::Time;

use crate::trouble::{Order, Trouble};

/// Watches from the first such order on.
#[derive(Debug)]
pub(super) struct StaysDown {
    /// A takeoff that is under way when an order is accepted may still lift off within this time.
    under_way: Duration,
    /// Mission time that the death of a process may take.
    interruption: Duration,
    accepted: Option<Accepted>,
    /// Until then a process may be dead that would stop a takeoff.
    troubled_until: Time,
}

/// A lift-off after an order to come down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LiftOff {
    /// Of a takeoff that was under way when the order was accepted: the order brings it down again.
    UnderWay(Order),
    /// It was to stay on the ground.
    Forbidden(Order),
}

#[derive(Debug)]
struct Accepted {
    order: Order,
    /// Until then a takeoff may be one that was under way.
    under_way_until: Time,
    /// The vehicle was seen on the ground since.
    stood: bool,
    /// How many statuses of the manager have said since that it can save.
    saved: u8,
}

/// The first one may have been under way when a save failed.
const SURELY_SAVED: u8 = 2;

impl StaysDown {
    pub(super) fn new(under_way: Duration, interruption: Duration) -> StaysDown {
        StaysDown { under_way, interruption, accepted: None, troubled_until: Time::ZERO }
    }

    /// An order to come down is accepted. A later one changes nothing.
    pub(super) fn accepted(&mut self, now: Time, order: Order) {
        let under_way_until = self.troubled_until.max(now + self.under_way);
        self.accepted.get_or_insert(Accepted { order, under_way_until, stood: false, saved: 0 });
    }

    /// A trouble begins: a takeoff that is under way may be stopped later.
    pub(super) fn troubled(&mut self, now: Time, trouble: &Trouble) {
        let interruptions = trouble.interruptions();
        if interruptions == 0 {
            return;
        }
        self.troubled_until = self.troubled_until.max(now) + self.interruption * interruptions;
        if let Some(it) = self.accepted.as_mut().filter(|it| now <= it.under_way_until) {
            it.under_way_until = it.under_way_until.max(self.troubled_until);
        }
    }

    /// A new vehicle stands at home: what was under way is so no more.
    pub(super) fn power_lost(&mut self, now: Time) {
        self.troubled_until = now;
        if let Some(it) = &mut self.accepted {
            it.under_way_until = it.under_way_until.min(now);
        }
    }

    /// The manager says whether it can save. What is saved once stays so, also when the disk fails later.
    pub(super) fn saves(&mut self, can_save: bool) {
        if let Some(it) = self.accepted.as_mut().filter(|it| it.saved < SURELY_SAVED) {
            it.saved = if can_save { it.saved + 1 } else { 0 };
        }
    }

    /// The manager ended while it could not save: an order that was never saved is forgotten.
    pub(super) fn forget_what_is_not_saved(&mut self) {
        self.accepted.take_if(|it| it.saved < SURELY_SAVED);
    }

    /// The vehicle is on the ground.
    pub(super) fn stands(&mut self) {
        if let Some(it) = &mut self.accepted {
            it.stood = true;
        }
    }

    /// The vehicle flies, and not just by a land detector that is stuck; its lift-off, once.
    pub(super) fn flies(&mut self, at: Time) -> Option<LiftOff> {
        let accepted = self.accepted.as_mut()?;
        if !std::mem::take(&mut accepted.stood) {
            return None;
        }
        Some(match accepted.under_way_until < at {
            true => LiftOff::Forbidden(accepted.order),
            false => LiftOff::UnderWay(accepted.order),
        })
    }
}
