//! Decisions, until they are published as decision records.

use domain::contingency::Contingencies;
use domain::time::Time;
use kittiwake_proto::v1;

use crate::flags::Flags;
use crate::world::Waits;

/// A decision. Those on the way from a flag to its action are put into words later, so that they do not delay the
/// action.
#[derive(Debug)]
pub(crate) enum Decision {
    /// In words already, with its topic.
    Said(&'static str, String),
    /// The flag of this row was raised for this reason.
    Raised(usize, String),
    /// This row responds from here on.
    Responding(usize),
    /// The flag of this row is up and not answered.
    Waits(usize, Waits),
}

/// The decisions of this wake.
#[derive(Debug, Default)]
pub(crate) struct Journal {
    published: u64,
    pending: Vec<(Time, Decision)>,
}

impl Journal {
    /// Records a decision.
    pub(crate) fn decided(&mut self, at: Time, decision: Decision) {
        self.pending.push((at, decision));
    }

    /// The records of the decisions since the last call, in words.
    pub(crate) fn records(&mut self, flags: &Flags, table: &Contingencies) -> Vec<v1::DecisionRecord> {
        let mut records = Vec::with_capacity(self.pending.len());
        for (at, decision) in self.pending.drain(..) {
            self.published += 1;
            let (topic, text) = in_words(decision, flags, table);
            let (at_s, topic, sequence) = (at.as_secs_f64(), topic.to_owned(), self.published);
            records.push(v1::DecisionRecord { at_s, topic, text, sequence });
        }
        records
    }
}

fn in_words(decision: Decision, flags: &Flags, table: &Contingencies) -> (&'static str, String) {
    const TOPIC: &str = "contingency";
    match decision {
        Decision::Said(topic, text) => (topic, text),
        Decision::Raised(row, reason) => (TOPIC, format!("flag `{}` raised: {reason}", flags.name(row))),
        Decision::Responding(row) => {
            let first = table.rows()[row].actions.first().map_or("nothing", |it| it.tree.as_str());
            (TOPIC, format!("`{}`: {first}", flags.name(row)))
        }
        Decision::Waits(row, Waits::Behind(other)) => {
            (TOPIC, format!("`{}` waits behind `{}`", flags.name(row), flags.name(other)))
        }
        Decision::Waits(row, Waits::Until(phase)) => (TOPIC, format!("`{}` does not count {phase}", flags.name(row))),
    }
}
