//! A node of the bus that can be looked into from outside: what it has saved, and what is true in its world.

use std::cell::{Ref, RefCell};
use std::fmt;
use std::rc::Rc;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Service, Topic};
use node::{Effect, Event, Node, Token};

/// One node; a copy shows the same.
pub(crate) struct Shared<N>(Rc<RefCell<N>>);

impl<N> Shared<N> {
    pub(crate) fn of(node: N) -> Shared<N> {
        Shared(Rc::new(RefCell::new(node)))
    }

    /// The node as it is now.
    pub(crate) fn look(&self) -> Ref<'_, N> {
        self.0.borrow()
    }
}

impl<N: fmt::Debug> fmt::Debug for Shared<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<N> Clone for Shared<N> {
    fn clone(&self) -> Shared<N> {
        Shared(self.0.clone())
    }
}

impl<N: Node> Node for Shared<N> {
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

    fn answers_later(&self, token: Token) -> bool {
        self.0.borrow().answers_later(token)
    }

    fn deadline(&self) -> Option<Time> {
        self.0.borrow().deadline()
    }

    fn is_over(&self) -> bool {
        self.0.borrow().is_over()
    }
}
