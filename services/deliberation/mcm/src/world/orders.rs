//! What operators have ordered.

use domain::contingency::{OPERATOR_ABORT, OPERATOR_LAND, OPERATOR_PAUSE, OPERATOR_RETURN};
use domain::geometry::Ned;
use kittiwake_proto::v1;
use node::Answers;

/// The rows behind the verbs; the newest order replaces the one before it.
pub(super) const ORDERS: [&str; 4] = [OPERATOR_ABORT, OPERATOR_RETURN, OPERATOR_LAND, OPERATOR_PAUSE];

/// The source of these flags.
pub(super) const SOURCE: &str = "operator";

/// What operators have ordered.
#[derive(Debug, Default)]
pub(super) struct Operator {
    pub(super) has_started: bool,
    pub(super) landing_site: Option<Ned>,
    pub(super) overriding: Option<String>,
    pub(super) answers: Answers<v1::OperatorReply>,
}

impl Operator {
    /// Its persisted part.
    pub(super) fn restored(has_started: bool, landing_site: Option<Ned>, overriding: Option<String>) -> Operator {
        Operator { has_started, landing_site, overriding, answers: Answers::default() }
    }

    /// After the order that begins the flight after `last`: answers are remembered, so that a repeated order begins nothing again.
    pub(super) fn of_next_flight(last: Operator) -> Operator {
        Operator { has_started: true, answers: last.answers, ..Operator::default() }
    }

    /// The flag of an order with override.
    pub(super) fn overriding(&self) -> Option<&str> {
        self.overriding.as_deref()
    }

    /// Whether `flag` is that of an order with override.
    pub(super) fn overrides(&self, flag: &str) -> bool {
        self.overriding() == Some(flag)
    }

    /// `flag` is down, or no longer ordered.
    pub(super) fn no_longer_overrides(&mut self, flag: &str) {
        self.overriding = self.overriding.take().filter(|it| it != flag);
    }

    /// Whether the operator has started the mission.
    pub(super) fn has_started(&self) -> bool {
        self.has_started
    }

    /// The operator's landing site, for `operator_land`.
    pub(super) fn landing_site(&self) -> Option<Ned> {
        self.landing_site
    }
}

/// Whether `flag` is that of an operator's order.
pub(super) fn is_order(flag: &str) -> bool {
    ORDERS.contains(&flag)
}
