//! Decisions, until they are published as decision records.

use domain::contingency::Contingencies;
use domain::time::Time;
use kittiwake_proto::v1;

use crate::flags::Flags;
use crate::repeats::Repeats;
use crate::world::Waits;

/// The topic of what rises, falls and waits, which may do so faster than anybody reads.
const CONTINGENCY: &str = "contingency";

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
    repeats: Repeats,
}

impl Journal {
    /// Records a decision.
    pub(crate) fn decided(&mut self, at: Time, decision: Decision) {
        self.pending.push((at, decision));
    }

    /// The records of the decisions since the last call, in words. Of contingencies the same words come a few times only within some
    /// seconds.
    pub(crate) fn records(&mut self, now: Time, flags: &Flags, table: &Contingencies) -> Vec<v1::DecisionRecord> {
        let over = self.repeats.over(now).into_iter().map(|text| (now, CONTINGENCY, text));
        let mut said: Vec<(Time, &'static str, String)> = over.collect();
        for (at, decision) in self.pending.drain(..) {
            let (topic, text) = in_words(decision, flags, table);
            if topic != CONTINGENCY || self.repeats.is_said(at, &text) {
                said.push((at, topic, text));
            }
        }
        let mut records = Vec::with_capacity(said.len());
        for (at, topic, text) in said {
            self.published += 1;
            let (at_s, topic, sequence) = (at.as_secs_f64(), topic.to_owned(), self.published);
            records.push(v1::DecisionRecord { at_s, topic, text, sequence });
        }
        records
    }
}

fn in_words(decision: Decision, flags: &Flags, table: &Contingencies) -> (&'static str, String) {
    match decision {
        Decision::Said(topic, text) => (topic, text),
        Decision::Raised(row, reason) => (CONTINGENCY, format!("flag `{}` raised: {reason}", flags.name(row))),
        Decision::Responding(row) => {
            let first = table.rows()[row].actions.first().map_or("nothing", |it| it.tree.as_str());
            (CONTINGENCY, format!("`{}`: {first}", flags.name(row)))
        }
        Decision::Waits(row, Waits::Behind(other)) => {
            (CONTINGENCY, format!("`{}` waits behind `{}`", flags.name(row), flags.name(other)))
        }
        Decision::Waits(row, Waits::Until(phase)) => {
            (CONTINGENCY, format!("`{}` does not count {phase}", flags.name(row)))
        }
    }
}
