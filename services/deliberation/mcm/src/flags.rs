//! Which flags are up. Events raise them; only the row of a flag takes it down again.
//!
//! A flag is found by the number of its row: the tree asks every row at every tick while any flag is up, and the
//! answers must be quick when the first flag comes.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use domain::contingency::Contingencies;
use domain::measured::Measured;
use domain::time::Time;

/// The flags of the table's rows, most urgent first.
#[derive(Debug, Default)]
pub(crate) struct Flags {
    /// For each row, apart from the rest: a tick without a flag reads no more than this.
    up: Vec<bool>,
    rows: Vec<(Arc<str>, Option<Flag>)>,
    numbers: HashMap<Arc<str>, usize>,
}

/// A flag that is up.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Flag {
    pub(crate) since: Time,
    /// Why it was raised.
    pub(crate) reason: String,
    /// The value that it was raised by. A restart of the manager forgets it: the reason has it in words.
    pub(crate) measured: Option<Measured>,
    /// The sources that say that its condition still holds, each once.
    pub(crate) sources: Vec<String>,
    /// An operator.
    pub(crate) acknowledged_by: Option<String>,
    /// It was up when an operator last ordered something with override.
    pub(crate) overridden: bool,
    /// It is an order with override.
    pub(crate) overrides: bool,
}

impl Flag {
    /// Whether any of its sources says that its condition still holds.
    pub(crate) fn holds(&self) -> bool {
        !self.sources.is_empty()
    }
}

impl Flags {
    /// All down.
    pub(crate) fn of(table: &Contingencies) -> Flags {
        let rows: Vec<(Arc<str>, _)> = table.rows().iter().map(|it| (it.flag.as_str().into(), None)).collect();
        let numbers = rows.iter().enumerate().map(|(number, (name, _))| (name.clone(), number)).collect();
        Flags { up: vec![false; rows.len()], rows, numbers }
    }

    /// The number of a flag's row; `None` if it has none.
    pub(crate) fn number(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    /// The name of a row's flag.
    pub(crate) fn name(&self, row: usize) -> &Arc<str> {
        &self.rows[row].0
    }

    /// Raises a row's flag; true if it was down.
    pub(crate) fn raise(
        &mut self,
        now: Time,
        row: usize,
        source: String,
        reason: String,
        measured: Option<Measured>,
    ) -> bool {
        let rose = !std::mem::replace(&mut self.up[row], true);
        let fresh = || Flag { since: now, reason, measured, ..Flag::default() };
        let flag = self.rows[row].1.get_or_insert_with(fresh);
        if !flag.sources.contains(&source) {
            flag.sources.push(source);
        }
        rose
    }

    /// Raises a row's flag again as it was before a restart of the manager.
    pub(crate) fn restore(&mut self, row: usize, flag: Flag) {
        self.up[row] = true;
        self.rows[row].1 = Some(flag);
    }

    /// By `source` the flag's condition no longer holds; the flag stays up until its row takes it down.
    pub(crate) fn condition_gone(&mut self, name: &str, source: &str) {
        if let Some(flag) = self.get_mut(name) {
            flag.sources.retain(|it| it != source);
        }
    }

    /// An operator has acknowledged the flag.
    pub(crate) fn acknowledge(&mut self, name: &str, by: &str) {
        if let Some(flag) = self.get_mut(name) {
            flag.acknowledged_by = Some(by.to_owned());
        }
    }

    /// Takes a flag down.
    pub(crate) fn lower(&mut self, name: &str) {
        if let Some(row) = self.number(name) {
            self.up[row] = false;
            self.rows[row].1 = None;
        }
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Flag> {
        self.rows[self.number(name)?].1.as_ref()
    }

    pub(crate) fn is_up(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Whether a row's flag is up.
    pub(crate) fn row_is_up(&self, row: usize) -> bool {
        self.up[row]
    }

    /// Whether a row's flag was up when an operator last ordered something with override.
    pub(crate) fn is_overridden(&self, row: usize) -> bool {
        self.rows[row].1.as_ref().is_some_and(|it| it.overridden)
    }

    /// Whether a row's flag is that of an order with override.
    pub(crate) fn overrides(&self, row: usize) -> bool {
        self.rows[row].1.as_ref().is_some_and(|it| it.overrides)
    }

    /// An operator orders what the flag of `row` stands for with override, and knows of every flag that is up.
    pub(crate) fn override_all(&mut self, row: usize) {
        for (number, (_, flag)) in self.rows.iter_mut().enumerate() {
            let Some(flag) = flag else { continue };
            (flag.overridden, flag.overrides) = (true, number == row);
        }
    }

    /// The order is taken back; by no source the flag's condition holds any more.
    pub(crate) fn take_back(&mut self, name: &str) {
        if let Some(flag) = self.get_mut(name) {
            flag.sources.clear();
            flag.overrides = false;
        }
    }

    /// Whether any flag is up.
    pub(crate) fn any_is_up(&self) -> bool {
        self.up.contains(&true)
    }

    /// The rows whose flags are up, most urgent first.
    pub(crate) fn rows_up(&self) -> impl Iterator<Item = usize> + Clone {
        self.up.iter().enumerate().filter(|(_, up)| **up).map(|(row, _)| row)
    }

    /// The flags that are up with their names, most urgent first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, &Flag)> {
        let up = self.up.iter().zip(&self.rows).filter(|(up, _)| **up);
        up.filter_map(|(_, (name, flag))| Some((&**name, flag.as_ref()?)))
    }

    fn get_mut(&mut self, name: &str) -> Option<&mut Flag> {
        let row = self.number(name)?;
        self.rows[row].1.as_mut()
    }
}

/// How long the flag has been up, in seconds.
pub(crate) fn age_s(flag: &Flag, now: Time) -> f64 {
    let age: Duration = now - flag.since;
    age.as_secs_f64()
}
