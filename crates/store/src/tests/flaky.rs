//! A medium in memory whose k-th operation fails, and that can lose its power.

use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;

use crate::Medium;

/// How an operation fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Failure {
    /// Nothing happens but the error.
    Refused,
    /// It happens by half: a file is cut short.
    Half,
    /// It happens, and the error comes nevertheless.
    Done,
}

pub(super) type Files = BTreeMap<String, Vec<u8>>;

/// Counts its operations. Everything is shared with nobody: a restart is a new one over the files of the old one.
#[derive(Debug, Default)]
pub(super) struct Flaky {
    /// As a process sees them.
    pub(super) files: Files,
    /// As they are after a loss of power, at worst: names are on the disk only once they are synced.
    pub(super) durable: Files,
    pub(super) operations: usize,
    /// The first operation that fails, how many in sequence, and how.
    pub(super) fails: Option<(usize, usize, Failure)>,
    /// The process has died after this operation: no later one does anything.
    pub(super) dies_after: Option<usize>,
}

impl Flaky {
    pub(super) fn of(files: Files) -> Flaky {
        Flaky { durable: files.clone(), files, ..Flaky::default() }
    }

    fn failure(&mut self) -> Option<Failure> {
        self.operations += 1;
        if self.dies_after.is_some_and(|it| it < self.operations) {
            return Some(Failure::Refused);
        }
        let (first, count, failure) = self.fails?;
        (first <= self.operations && self.operations - first < count).then_some(failure)
    }

    /// Does what of `act` the failure lets happen.
    fn perform(&mut self, act: impl FnOnce(&mut Flaky, bool)) -> io::Result<()> {
        match self.failure() {
            None => {
                act(self, false);
                return Ok(());
            }
            Some(Failure::Done) => act(self, false),
            Some(Failure::Half) => act(self, true),
            Some(Failure::Refused) => {}
        }
        Err(io::Error::other("injected"))
    }
}

impl Medium for Flaky {
    fn prepare(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn lock(&mut self, _: &str) -> io::Result<bool> {
        Ok(true)
    }

    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>> {
        Ok(self.files.get(name).cloned())
    }

    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.perform(|it, is_half| {
            let length = if is_half { bytes.len() / 2 } else { bytes.len() };
            it.files.insert(name.to_owned(), bytes[..length].to_vec());
        })
    }

    fn rename(&mut self, from: &str, to: &str) -> io::Result<()> {
        let Some(moved) = self.files.get(from).cloned() else { return Err(io::ErrorKind::NotFound.into()) };
        // There is no half rename: it is atomic.
        self.perform(|it, is_half| {
            if !is_half {
                it.files.remove(from);
                it.files.insert(to.to_owned(), moved);
            }
        })
    }

    fn sync_folder(&mut self) -> io::Result<()> {
        self.perform(|it, is_half| {
            if !is_half {
                it.durable = it.files.clone();
            }
        })
    }

    fn exists(&mut self, name: &str) -> bool {
        self.files.contains_key(name)
    }

    fn path(&self, name: &str) -> PathBuf {
        name.into()
    }
}
