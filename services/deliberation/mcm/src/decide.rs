//! What is decided at a tick: one pure function of the flags that are up, the table and the moment.

use std::collections::BTreeMap;

use domain::contingency::narrowing::{Narrowing, narrowing};
use domain::contingency::{Moment, Phase, Raised, Row, responder};
use domain::situation::Situation;

/// Which flag is answered, what is forbidden, and what waits. The leaves of one tick all act by the same decision.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Decision {
    /// For which it was decided.
    pub(crate) moment: Moment,
    /// The row that responds; `None`: the nominal flight continues.
    pub(crate) responder: Option<usize>,
    /// What the flags that are up forbid, whatever is flown.
    pub(crate) narrowing: Narrowing,
    /// The rows whose flags are up and not answered, and what each waits for.
    pub(crate) waits: BTreeMap<usize, Waits>,
}

/// What a flag that is up and not answered waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Waits {
    /// Another row responds.
    Behind(usize),
    /// It does not count in this phase.
    Until(Phase),
    /// The vehicle is about to stand on the ground.
    ForTouchdown,
    /// The vehicle has not been seen yet.
    ForFirstSight,
}

impl Default for Decision {
    /// Before the first tick: nothing is seen, and no flag is up.
    fn default() -> Decision {
        decide(&[], &[], Moment { situation: Situation::Unseen, phase: Phase::Cruise })
    }
}

/// Decides; `raised` has the rows whose flags are up, the most urgent one first.
pub(crate) fn decide(rows: &[Row], raised: &[Raised], moment: Moment) -> Decision {
    let responds = responder(rows, raised.iter().copied(), moment);
    let waits = raised.iter().filter_map(|it| Some((it.row, waits(rows.get(it.row)?, it.row, responds, moment)?)));
    Decision {
        moment,
        responder: responds,
        narrowing: narrowing(rows, raised.iter().copied(), moment.phase),
        waits: waits.collect(),
    }
}

/// What `row`, whose number is `number` and whose flag is up, waits for. Nothing waits after the end: flags are reported then.
fn waits(row: &Row, number: usize, responder: Option<usize>, moment: Moment) -> Option<Waits> {
    if row.only_slows() || responder == Some(number) || moment.situation == Situation::Ended {
        return None;
    }
    let may_begin = row.situations.contains(&moment.situation);
    Some(match (responder, moment.situation) {
        (Some(other), _) => Waits::Behind(other),
        (None, Situation::Unseen) => Waits::ForFirstSight,
        (None, Situation::TouchingDown) if !may_begin && row.phases.contains(&moment.phase) => Waits::ForTouchdown,
        (None, _) => Waits::Until(moment.phase),
    })
}
