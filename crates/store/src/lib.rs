//! Stores the state of one process so that it survives the process, and a loss of power.
//!
//! The last two generations of the state are kept, each in a file of its own with a checksum, a format version and the
//! name of its owner. A new generation is written to a temporary file, synced and renamed over the older one, so at
//! every moment one complete generation is on the disk. [`Store::save_again`] makes the other one the same. Reading takes
//! the newest good generation and says whether a newer one may be lost: [`Loaded::Behind`] and [`Loaded::Unusable`] are
//! never the same as [`Loaded::Nothing`].
//!
//! Nothing is written without the lock, also not where the folder was replaced and with it the lock, and nothing into what belongs to
//! another owner. A file that cannot be used is renamed before its name is used again, not removed.
//!
//! The contents are bytes: what they mean is the caller's business.

use std::fs::{File, TryLockError};
use std::path::Path;

mod folder;
mod medium;
mod record;
mod trouble;

#[cfg(test)]
mod tests;

pub use folder::Folder;
pub use medium::Medium;
pub use trouble::Trouble;

use record::Record;

/// The files of the two generations: generation `n` is in number `n % 2`.
const SLOTS: [&str; 2] = ["0", "1"];
/// A generation is written here first.
const UNFINISHED: &str = "unfinished";
/// Exists from a failed write, or a repair that was begun, until the next write that succeeds.
const BEHIND: &str = "behind";
/// Names for files that cannot be used; the last one is replaced.
const MOST_UNUSABLE: u32 = 9;

/// What was found when a store was opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Loaded {
    /// Nothing has been saved here yet.
    Nothing,
    /// The state that was saved last.
    Newest(State),
    /// A state, but a newer one may have been lost: it garbled, or it could not be written.
    Behind(State, Trouble),
    /// There is a state, and it cannot be used; or it cannot be found out whether there is one.
    Unusable(Trouble),
}

/// A saved state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// As it was handed to [`Store::save`].
    pub bytes: Vec<u8>,
    /// The format version with which it was saved: the store's own or an older one.
    pub version: u32,
}

/// Another process uses the same state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the state `{name}` of `{owner}` in {place} is in use by another process: end that one, or name another folder"
)]
pub struct InUse {
    name: String,
    owner: String,
    place: String,
}

/// What a file holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
enum Content {
    #[default]
    Missing,
    /// This generation.
    Good(u64),
    Bad(Trouble),
}

impl Content {
    fn trouble(&self) -> Option<&Trouble> {
        if let Content::Bad(trouble) = self { Some(trouble) } else { None }
    }
}

/// The state of one process in a folder.
#[derive(Debug)]
pub struct Store<M = Folder> {
    medium: M,
    name: String,
    owner: String,
    version: u32,
    /// The newest generation on the disk; 0 before the first.
    generation: u64,
    slots: [Content; 2],
    behind: Content,
    is_locked: bool,
    /// Both generations hold what was saved last.
    is_in_both: bool,
}

impl Store {
    /// Opens the state `name` of `owner` in `folder`, and locks it for as long as the store lives. `version` is the
    /// format of what will be saved: it grows by one whenever older programs could misunderstand the contents.
    ///
    /// The folder is made if it is missing. A folder that cannot be used is not an error here, but
    /// [`Loaded::Unusable`], or [`Trouble`] of the first [`Store::save`]: the caller may have to go on without.
    ///
    /// # Errors
    /// If another process has it open; nothing was changed then.
    pub fn open(folder: &Path, name: &str, owner: &str, version: u32) -> Result<(Store, Loaded), InUse> {
        Store::over(Folder::new(folder), name, owner, version)
    }

    /// Whether nobody has the state `name` of `owner` in `folder` open now; nothing is changed.
    ///
    /// # Errors
    /// If another process has.
    pub fn check_free(folder: &Path, name: &str, owner: &str) -> Result<(), InUse> {
        let is_taken = |file: File| matches!(file.try_lock(), Err(TryLockError::WouldBlock));
        if !File::open(folder.join(format!("{name}.lock"))).is_ok_and(is_taken) {
            return Ok(());
        }
        Err(InUse { name: name.to_owned(), owner: owner.to_owned(), place: folder.display().to_string() })
    }
}

impl<M: Medium> Store<M> {
    /// The same over another medium, for tests of media that fail.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn over(mut medium: M, name: &str, owner: &str, version: u32) -> Result<(Store<M>, Loaded), InUse> {
        let prepared = medium.prepare();
        let (name, owner) = (name.to_owned(), owner.to_owned());
        let is_locked = match prepared.is_ok().then(|| medium.lock(&format!("{name}.lock"))) {
            Some(Ok(false)) => return Err(InUse { name, owner, place: medium.path("").display().to_string() }),
            Some(Ok(true)) => true,
            // Nothing can be written then either, which the first attempt reports.
            Some(Err(_)) | None => false,
        };
        let (slots, behind) = Default::default();
        let (generation, is_in_both) = (0, false);
        let mut store = Store { medium, name, owner, version, generation, slots, behind, is_locked, is_in_both };
        let loaded = match prepared {
            Ok(()) => store.load(),
            Err(cause) => Loaded::Unusable(Trouble::of_writing(store.medium.path(""), &cause)),
        };
        Ok((store, loaded))
    }

    fn load(&mut self) -> Loaded {
        let mut records = Vec::new();
        self.slots = SLOTS.map(|slot| self.look_at(slot, &mut records));
        self.behind = self.look_at(BEHIND, &mut records);
        if let Err(foreign) = self.refuse_foreign() {
            return Loaded::Unusable(foreign);
        }
        let trouble = self.contents().into_iter().find_map(Content::trouble).cloned();
        let newest = records.into_iter().max_by_key(|it| it.generation);
        let Some(newest) = newest else { return trouble.map_or(Loaded::Nothing, Loaded::Unusable) };
        self.generation = newest.generation;
        let state = State { bytes: newest.contents, version: newest.version };
        match trouble.or_else(|| self.gap()) {
            None => Loaded::Newest(state),
            Some(trouble) => Loaded::Behind(state, trouble),
        }
    }

    /// Why the newest good generation may not be the last that was saved, although every file is good.
    fn gap(&self) -> Option<Trouble> {
        if self.behind != Content::Missing {
            return Some(Trouble::Outdated { file: self.path(BEHIND) });
        }
        let [newest, other] = [self.generation, self.generation + 1].map(|it| it as usize % 2);
        let before = if self.generation == 1 { Content::Missing } else { Content::Good(self.generation - 1) };
        let is_complete = self.slots[newest] == Content::Good(self.generation) && self.slots[other] == before;
        (!is_complete).then(|| Trouble::Missing { file: self.path(SLOTS[other]) })
    }

    fn look_at(&mut self, part: &str, records: &mut Vec<Record>) -> Content {
        let file = self.path(part);
        match self.medium.read(&self.file(part)) {
            Ok(None) => Content::Missing,
            Ok(Some(bytes)) => match Record::parse(&bytes, &file, &self.owner, self.version) {
                Ok(record) => {
                    let generation = record.generation;
                    records.push(record);
                    Content::Good(generation)
                }
                Err(trouble) => Content::Bad(trouble),
            },
            Err(cause) => Content::Bad(Trouble::of_reading(file, &cause)),
        }
    }

    /// Saves a state; when this returns, it survives a loss of power.
    ///
    /// # Errors
    /// Why that did not work; then what was saved before is still there, or already the new state, and
    /// [`Loaded::Behind`] says so to the next process unless the medium refuses even to rename a file. It may be tried
    /// again at any time.
    pub fn save(&mut self, contents: &[u8]) -> Result<(), Trouble> {
        self.is_in_both = false;
        let saved = self.write(contents).and_then(|()| {
            // After the first generation and after a repair, the second file is written as well: from then on a
            // missing file means a loss.
            if !self.slots.contains(&Content::Missing) {
                return Ok(());
            }
            self.write(contents)?;
            self.is_in_both = true;
            Ok(())
        });
        if saved.is_err() {
            self.mark_behind();
        }
        saved
    }

    /// Saves what was saved last as the next generation too, unless both generations hold it already. Either file may be lost then. If this
    /// fails, the first copy is still there.
    pub fn save_again(&mut self, contents: &[u8]) {
        if !self.is_in_both {
            self.is_in_both = self.write(contents).is_ok();
        }
    }

    /// The newest generation on the disk; 0 before the first.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    fn write(&mut self, contents: &[u8]) -> Result<(), Trouble> {
        self.refuse_foreign()?;
        self.lock()?;
        self.check_lock()?;
        let generation = self.generation + 1;
        let target = generation as usize % 2;
        let record = Record { generation, version: self.version, contents: contents.to_owned() };
        let unfinished = self.file(UNFINISHED);
        self.medium.prepare().map_err(|it| Trouble::of_writing(self.medium.path(""), &it))?;
        self.medium.write(&unfinished, &record.to_bytes(&self.owner)).map_err(|it| self.not_written(UNFINISHED, it))?;
        // A disk may have taken its time.
        self.check_lock()?;
        if matches!(self.slots[target], Content::Bad(_)) {
            // From here until the end of the repair, `behind` tells that this store is not untouched.
            match self.behind {
                Content::Missing => self.rename(SLOTS[target], BEHIND)?,
                _ => self.set_aside(SLOTS[target])?,
            }
        }
        self.medium.rename(&unfinished, &self.file(SLOTS[target])).map_err(|it| self.not_written(SLOTS[target], it))?;
        self.slots[target] = Content::Good(generation);
        self.medium.sync_folder().map_err(|it| self.not_written(SLOTS[target], it))?;
        self.generation = generation;
        self.end_repair(1 - target)
    }

    /// The newest generation is on the disk: what could not be used, or was marked as outdated, goes out of its way.
    fn end_repair(&mut self, other: usize) -> Result<(), Trouble> {
        let is_repair = matches!(self.slots[other], Content::Bad(_)) || self.behind != Content::Missing;
        if !is_repair {
            return Ok(());
        }
        if matches!(self.slots[other], Content::Bad(_)) {
            self.set_aside(SLOTS[other])?;
        }
        match &self.behind {
            Content::Missing => {}
            Content::Good(before) if before + 1 == self.generation => self.rename(BEHIND, SLOTS[other])?,
            _ => self.set_aside(BEHIND)?,
        }
        self.medium.sync_folder().map_err(|it| self.not_written(BEHIND, it))
    }

    /// The newest generation is not the last any more. Renaming needs no space on a disk that is full.
    fn mark_behind(&mut self) {
        if self.check_lock().is_err() {
            return;
        }
        let newest = self.generation as usize % 2;
        if self.behind == Content::Missing && matches!(self.slots[newest], Content::Good(_)) && 0 < self.generation {
            // Where this fails as well, the caller knows from the error of the write; a later process may not.
            let _ = self.rename(SLOTS[newest], BEHIND).map(|()| self.medium.sync_folder());
        }
    }

    fn refuse_foreign(&self) -> Result<(), Trouble> {
        let foreign = self.contents().into_iter().filter_map(Content::trouble).find(|it| it.is_foreign());
        foreign.map_or(Ok(()), |it| Err(it.clone()))
    }

    fn contents(&self) -> [&Content; 3] {
        [&self.slots[0], &self.slots[1], &self.behind]
    }

    fn lock(&mut self) -> Result<(), Trouble> {
        if !self.is_locked {
            self.medium.prepare().map_err(|it| Trouble::of_writing(self.medium.path(""), &it))?;
            let lock = self.file("lock");
            self.is_locked = self.medium.lock(&lock).map_err(|it| self.not_written("lock", it))?;
        }
        if self.is_locked { Ok(()) } else { Err(Trouble::InUse { file: self.path("lock") }) }
    }

    /// What stands in the place of a folder that was replaced is not written to.
    fn check_lock(&mut self) -> Result<(), Trouble> {
        match self.medium.has_lock(&self.file("lock")) {
            Ok(true) => Ok(()),
            Ok(false) => Err(Trouble::Replaced { lock: self.path("lock") }),
            Err(cause) => Err(self.not_written("lock", cause)),
        }
    }

    fn rename(&mut self, from: &str, to: &str) -> Result<(), Trouble> {
        self.medium.rename(&self.file(from), &self.file(to)).map_err(|it| self.not_written(to, it))?;
        let moved = self.content(from).map(std::mem::take);
        if let (Some(moved), Some(to)) = (moved, self.content(to)) {
            *to = moved;
        }
        Ok(())
    }

    fn set_aside(&mut self, part: &str) -> Result<(), Trouble> {
        let mut names = (1..=MOST_UNUSABLE).map(|number| format!("unusable-{number}"));
        let free = names.clone().find(|it| !self.medium.exists(&self.file(it)));
        let name = free.or_else(|| names.next_back()).unwrap_or_default();
        self.rename(part, &name)
    }

    fn content(&mut self, part: &str) -> Option<&mut Content> {
        match part {
            BEHIND => Some(&mut self.behind),
            _ => SLOTS.iter().position(|it| *it == part).map(|it| &mut self.slots[it]),
        }
    }

    fn not_written(&self, part: &str, cause: std::io::Error) -> Trouble {
        Trouble::of_writing(self.path(part), &cause)
    }

    fn file(&self, part: &str) -> String {
        format!("{}.{part}", self.name)
    }

    fn path(&self, part: &str) -> std::path::PathBuf {
        self.medium.path(&self.file(part))
    }
}
