//! Rows that the mission manager can tell apart by nothing but name and place in the order.
//!
//! It reads nothing else of them, so a flight with one shows what it does with each. Their order is tried without flying
//! ([`super::sets`]).

use domain::contingency::{
    AREA_BREACHED, Contingencies, ENDED_IN_AIR, INTROSPECTION_LOST, MEMORY_UNUSABLE, MEMORY_UNWRITABLE, OPERATOR_ABORT,
    OPERATOR_LAND, OPERATOR_PAUSE, OPERATOR_RETURN, Row, TRANSITION_FAILED,
};

/// Flags that the manager knows by name.
const KNOWN: [&str; 10] = [
    TRANSITION_FAILED,
    INTROSPECTION_LOST,
    AREA_BREACHED,
    ENDED_IN_AIR,
    MEMORY_UNUSABLE,
    MEMORY_UNWRITABLE,
    OPERATOR_ABORT,
    OPERATOR_RETURN,
    OPERATOR_LAND,
    OPERATOR_PAUSE,
];

/// The rows of each class by their numbers, in the order of the table.
pub fn classes(table: &Contingencies) -> Vec<Vec<usize>> {
    let mut classes: Vec<Vec<usize>> = Vec::new();
    let rows = table.rows();
    for (number, row) in rows.iter().enumerate() {
        match classes.iter_mut().find(|it| it.first().is_some_and(|first| are_equal(&rows[*first], row))) {
            Some(class) => class.push(number),
            None => classes.push(vec![number]),
        }
    }
    classes
}

fn are_equal(a: &Row, b: &Row) -> bool {
    let is_known = |row: &Row| KNOWN.contains(&row.flag.as_str());
    !is_known(a)
        && !is_known(b)
        && a.actions == b.actions
        && a.phases == b.phases
        && a.narrows == b.narrows
        && (a.clears, a.then, a.label) == (b.clears, b.then, b.label)
        && (a.is_watched(), a.takes_away()) == (b.is_watched(), b.takes_away())
}
