//! Which flags are up. Events raise them; only the row of a flag takes it down again.
//!
//! Those that are up lie together, and nothing else is read to find one of them: a flag comes when the caches belong to other processes, and
//! a table has many rows.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use domain::contingency::Contingencies;
use domain::measured::Measured;
use domain::time::Time;

/// The flags of the table's rows.
#[derive(Debug, Default)]
pub(crate) struct Flags {
    /// Those that are up with the numbers of their rows, most urgent first.
    up: Vec<(usize, Flag)>,
    names: Vec<Arc<str>>,
    numbers: HashMap<Arc<str>, usize>,
}

/// A flag that is up.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Flag {
    pub(crate) since: Time,
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
    pub(crate) fn of(table: &Contingencies) -> Flags {
        let names: Vec<Arc<str>> = table.rows().iter().map(|it| it.flag.as_str().into()).collect();
        let numbers = names.iter().cloned().zip(0..).collect();
        Flags { up: Vec::new(), names, numbers }
    }

    /// The number of a flag's row; `None` if it has none.
    pub(crate) fn number(&self, name: &str) -> Option<usize> {
        self.numbers.get(name).copied()
    }

    pub(crate) fn name(&self, row: usize) -> &Arc<str> {
        &self.names[row]
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
        match self.place(row) {
            Ok(place) => {
                let sources = &mut self.up[place].1.sources;
                if !sources.contains(&source) {
                    sources.push(source);
                }
                false
            }
            Err(place) => {
                let flag = Flag { since: now, reason, measured, sources: vec![source], ..Flag::default() };
                self.up.insert(place, (row, flag));
                true
            }
        }
    }

    /// Raises a row's flag again as it was before a restart of the manager.
    pub(crate) fn restore(&mut self, row: usize, flag: Flag) {
        match self.place(row) {
            Ok(place) => self.up[place].1 = flag,
            Err(place) => self.up.insert(place, (row, flag)),
        }
    }

    /// By `source` the flag's condition no longer holds; the flag stays up until its row takes it down.
    pub(crate) fn condition_gone(&mut self, name: &str, source: &str) {
        if let Some(flag) = self.get_mut(name) {
            flag.sources.retain(|it| it != source);
        }
    }

    pub(crate) fn lower(&mut self, name: &str) {
        self.up.retain(|(row, _)| *self.names[*row] != *name);
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Flag> {
        self.iter().find(|(other, _)| *other == name).map(|(_, flag)| flag)
    }

    pub(crate) fn of_row(&self, row: usize) -> Option<&Flag> {
        self.place(row).ok().map(|place| &self.up[place].1)
    }

    pub(crate) fn is_up(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Whether a row's flag is that of an order with override.
    pub(crate) fn overrides(&self, row: usize) -> bool {
        self.of_row(row).is_some_and(|it| it.overrides)
    }

    /// An operator orders what the flag of `row` stands for, without the override of the order before.
    pub(crate) fn override_nothing(&mut self, row: usize) {
        if let Ok(place) = self.place(row) {
            self.up[place].1.overrides = false;
        }
    }

    /// An operator orders what the flag of `row` stands for with override, and knows of every flag that is up.
    pub(crate) fn override_all(&mut self, row: usize) {
        self.up.iter_mut().for_each(|(number, flag)| (flag.overridden, flag.overrides) = (true, *number == row));
    }

    /// The order is taken back; by no source the flag's condition holds any more.
    pub(crate) fn take_back(&mut self, name: &str) {
        if let Some(flag) = self.get_mut(name) {
            flag.sources.clear();
            flag.overrides = false;
        }
    }

    /// The rows whose flags are up, most urgent first.
    pub(crate) fn rows_up(&self) -> impl Iterator<Item = usize> + Clone {
        self.up.iter().map(|(row, _)| *row)
    }

    /// The flags that are up with the numbers of their rows, most urgent first.
    pub(crate) fn up(&self) -> impl Iterator<Item = (usize, &Flag)> {
        self.up.iter().map(|(row, flag)| (*row, flag))
    }

    /// The same with their names.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, &Flag)> {
        self.up.iter().map(|(row, flag)| (&*self.names[*row], flag))
    }

    /// Where a row's flag is among those that are up, or would be.
    fn place(&self, row: usize) -> Result<usize, usize> {
        self.up.binary_search_by_key(&row, |(row, _)| *row)
    }

    pub(crate) fn get_mut(&mut self, name: &str) -> Option<&mut Flag> {
        let names = &self.names;
        self.up.iter_mut().find(|(row, _)| *names[*row] == *name).map(|(_, flag)| flag)
    }
}

/// How long the flag has been up, in seconds.
pub(crate) fn age_s(flag: &Flag, now: Time) -> f64 {
    let age: Duration = now - flag.since;
    age.as_secs_f64()
}
