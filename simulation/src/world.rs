//! The simulated vehicle and the world around it, as a node of the bus that judges may look into.

use std::cell::RefCell;
use std::rc::Rc;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Service, Topic};
use node::{Effect, Event, Node};
use vehicle_sim::VehicleSim;
use vehicle_sim::truth::Truth;

/// One world; a copy shows the same.
#[derive(Debug, Clone)]
pub(crate) struct World(Rc<RefCell<VehicleSim>>);

impl World {
    pub(crate) fn new(vehicle: VehicleSim) -> World {
        World(Rc::new(RefCell::new(vehicle)))
    }

    /// What is true by now.
    pub(crate) fn truth(&self, now: Time) -> Truth {
        self.0.borrow().truth(now)
    }
}

impl Node for World {
    fn name(&self) -> &'static str {
        self.0.borrow().name()
    }

    fn subscriptions(&self) -> &'static [Topic] {
        self.0.borrow().subscriptions()
    }

    fn serves(&self) -> &'static [Service] {
        self.0.borrow().serves()
    }

    fn on(&mut self, now: Now, event: Event, effects: &mut Vec<Effect>) {
        self.0.borrow_mut().on(now, event, effects);
    }

    fn act(&mut self, now: Now, effects: &mut Vec<Effect>) {
        self.0.borrow_mut().act(now, effects);
    }

    fn deadline(&self) -> Option<Time> {
        self.0.borrow().deadline()
    }
}
