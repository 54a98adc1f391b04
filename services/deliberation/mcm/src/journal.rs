//! Decisions, until they are published as decision records.

use domain::contingency::{Contingencies, Phase};
use domain::decision::{DecisionKind, DecisionRecord, Rejected};
use domain::measured::Measured;
use domain::time::Now;

use crate::decide::Waits;
use crate::flags::Flags;
use crate::repeats::Repeats;

mod numbers;
mod said;
mod threads;

use numbers::Numbers;
pub(crate) use said::{Cause, Said};
use threads::Threads;

/// The topic of what rises, falls and waits, which may do so faster than anybody reads.
pub(crate) const CONTINGENCY: &str = "contingency";

/// What the journal notes. Those on the way from a flag to its action are put into words later, so that they do not delay the
/// action.
#[derive(Debug)]
pub(crate) enum Entry {
    /// In words already.
    Said(Said),
    /// The flag of this row was raised for this reason, by this value.
    Raised(usize, String, Option<Measured>),
    /// This row responds from here on, and these rows, whose flags are up, do not.
    Responding(usize, Vec<(usize, Passed)>),
    /// The flag of this row is up and not answered.
    Waits(usize, Waits),
}

/// Why a row whose flag is up does not respond when another one begins to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Passed {
    /// It does not count in this phase.
    OutOfPhase(Phase),
    /// Its first action is less severe.
    LessSevere,
    /// An operator's order comes before it.
    Overridden,
    /// It is as severe, and comfort behind one of safety.
    Optional,
    /// It is as severe and lower in the table.
    LessUrgent,
}

/// The decisions of this wake, and what later ones may follow from.
#[derive(Debug, Default)]
pub(crate) struct Journal {
    /// Those of this process lie above those of the process before.
    pub(crate) numbers: Numbers,
    pending: Vec<(Now, Entry)>,
    repeats: Repeats,
    threads: Threads,
}

impl Journal {
    pub(crate) fn decided(&mut self, at: Now, entry: Entry) {
        self.pending.push((at, entry));
    }

    /// The records of the decisions since the last call. Of contingencies the same comes a few times only within some seconds.
    pub(crate) fn records(&mut self, now: Now, flags: &Flags, table: &Contingencies) -> Vec<DecisionRecord> {
        let Journal { numbers, pending, repeats, threads } = self;
        let mut records = Vec::new();
        let mut add = |at: Now, said: Said| {
            let (number, parent) = (numbers.take_next(), threads.parent(&said));
            threads.follow(&said, number);
            records.push(record(number, at, said, parent, flags));
        };
        for text in repeats.over(now.time) {
            add(now, Said::new(CONTINGENCY, DecisionKind::Note, text).led_to_by(Cause::Nothing));
        }
        for (at, entry) in pending.drain(..) {
            // What a restored state has to say is said before there is a time.
            let at = if at == Now::default() { now } else { at };
            let said = in_words(entry, flags, table);
            if said.topic != CONTINGENCY || repeats.is_said(at.time, &about(&said), &said.text) {
                add(at, said);
            }
        }
        records
    }
}

/// What counts as the same when it repeats itself: that a flag is up or waits, with whatever value and behind whichever other, or the
/// same words.
fn about(said: &Said) -> String {
    match (said.kind, said.row) {
        (DecisionKind::ContingencyRaised | DecisionKind::ContingencyWaits, Some(row)) => {
            format!("{:?} {row}", said.kind)
        }
        _ => said.text.clone(),
    }
}

fn record(number: u64, at: Now, said: Said, parent: Option<u64>, flags: &Flags) -> DecisionRecord {
    DecisionRecord {
        number,
        at_s: at.time.as_secs_f64(),
        utc_ms: at.utc_ms,
        topic: said.topic.to_owned(),
        kind: said.kind,
        text: said.text,
        flag: said.row.map_or_else(String::new, |row| flags.name(row).to_string()),
        measured: said.measured,
        response: said.response,
        response_reason: said.response_reason,
        rejected: said.rejected,
        parent,
    }
}

fn in_words(entry: Entry, flags: &Flags, table: &Contingencies) -> Said {
    let said = |kind, text: String| Said::new(CONTINGENCY, kind, text);
    match entry {
        Entry::Said(said) => said,
        Entry::Raised(row, reason, measured) => {
            let text = format!("flag `{}` raised: {reason}", flags.name(row));
            said(DecisionKind::ContingencyRaised, text).about(row).led_to_by(Cause::Nothing).measuring(measured)
        }
        Entry::Responding(row, passed) => {
            let first = first_action(table, row);
            let rejected = passed.into_iter().map(|(other, why)| rejected(other, why, row, flags, table)).collect();
            said(DecisionKind::ContingencyAnswered, format!("`{}`: {first}", flags.name(row)))
                .about(row)
                .led_to_by(Cause::Raised(row))
                .measuring(flags.get(flags.name(row)).and_then(|flag| flag.measured))
                .taking(first, String::new())
                .rejecting(rejected)
        }
        Entry::Waits(row, waits) => {
            let flag = flags.name(row);
            let text = match waits {
                Waits::Behind(other) => format!("`{flag}` waits behind `{}`", flags.name(other)),
                Waits::Until(phase) => format!("`{flag}` does not count {phase}"),
                Waits::ForTouchdown => format!("`{flag}` waits until the vehicle stands on the ground"),
                Waits::ForFirstSight => format!("`{flag}` waits until the vehicle is seen"),
            };
            said(DecisionKind::ContingencyWaits, text).about(row).led_to_by(Cause::Raised(row))
        }
    }
}

/// The action that the row `other` asks for, and why it is not flown when `row` responds.
fn rejected(other: usize, why: Passed, row: usize, flags: &Flags, table: &Contingencies) -> Rejected {
    let asks = format!("`{}` asks for it", flags.name(other));
    let why = match why {
        Passed::OutOfPhase(phase) => format!("{asks} and does not count {phase}"),
        Passed::LessSevere => format!("{asks}, which is less severe than {}", first_action(table, row)),
        Passed::Overridden => format!("{asks} and is overridden by an operator"),
        Passed::Optional => format!("{asks} and is comfort, and `{}` is not", flags.name(row)),
        Passed::LessUrgent => format!("{asks} and is less urgent than `{}`", flags.name(row)),
    };
    Rejected { what: first_action(table, other).to_owned(), why }
}

fn first_action(table: &Contingencies, row: usize) -> &str {
    table.rows()[row].actions.first().map_or("nothing", |it| it.tree.as_str())
}
