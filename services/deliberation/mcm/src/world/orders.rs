//! What operators have ordered.

use domain::contingency::{OPERATOR_ABORT, OPERATOR_LAND, OPERATOR_PAUSE, OPERATOR_RETURN};
use domain::geometry::Ned;
use domain::wire::InvalidMessage;
use kittiwake_proto::v1;
use node::Answers;

/// The rows behind the verbs; the newest order replaces the one before it.
pub(super) const ORDERS: [&str; 4] = [OPERATOR_ABORT, OPERATOR_RETURN, OPERATOR_LAND, OPERATOR_PAUSE];

pub(super) const SOURCE: &str = "operator";

#[derive(Debug, Default)]
pub(super) struct Operator {
    pub(super) has_started: bool,
    /// For `operator_land`.
    pub(super) landing_site: Option<Ned>,
    pub(super) answers: Answers<v1::OperatorReply>,
}

impl TryFrom<&v1::StoredOrders> for Operator {
    type Error = InvalidMessage;

    fn try_from(orders: &v1::StoredOrders) -> Result<Operator, InvalidMessage> {
        let landing_site = orders.landing_site.map(Ned::try_from).transpose()?;
        Ok(Operator { has_started: orders.started, landing_site, answers: Answers::default() })
    }
}

pub(super) fn is_order(flag: &str) -> bool {
    ORDERS.contains(&flag)
}
