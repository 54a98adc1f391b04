//! Whether the audit trail's files are as they were written: every line follows the one before, across files.

use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::bounds::MAX_LINE;
use super::chain::{self, Begun, Hash, Line, Link};
use super::day_files;
use super::found::{CutOff, Fault, Misdated, Place, Trail};
use super::given::{self, Given};
use crate::access::to_hex;

/// Checks a file, or every file of the audit trail in a folder.
///
/// # Errors
/// What cannot be read, or the first line that breaks the chain.
pub fn verify(path: &Path) -> Result<Trail, Fault> {
    let unreadable = |cause| Fault::Unreadable(path.to_owned(), cause);
    let given = || if path.is_dir() { given::in_folder(path).map(Some) } else { Ok(None) };
    let before = given().map_err(unreadable)?;
    let mut found = read(path)?;
    if matches!(before, Some(Given::Number(given)) if found.last < given) {
        // A gateway that lives writes a record just after it has given the number: it is there by now.
        found = read(path)?;
    }
    if let (Some(before), Some(after)) = (before, given().map_err(unreadable)?) {
        compare_end(&mut found, before, after);
    }
    if found.missing == 0 && found.unfinished.as_ref().is_some_and(|it| it.is_beginning) {
        // Without a number that says so, too: what there is only the beginning of was a record.
        found.missing = 1;
    }
    Ok(found)
}

fn read(path: &Path) -> Result<Trail, Fault> {
    let unreadable = |cause| Fault::Unreadable(path.to_owned(), cause);
    let files = if path.is_dir() { day_files::list(path).map_err(unreadable)? } else { vec![path.to_owned()] };
    if files.is_empty() {
        return Err(Fault::Empty(path.to_owned()));
    }
    let mut reading = Reading::default();
    for file in &files {
        reading.file(file)?;
    }
    reading.end()
}

/// The numbers that were given after that of the last record; or why that is not known. A gateway may have given more while the files
/// were read: what it gave before is in them, and what is in them it has given after. A record of which there is only the beginning is
/// missing: a gateway that was killed leaves it so, and so does somebody who cuts it.
fn compare_end(found: &mut Trail, before: Given, after: Given) {
    if let Given::Number(given) = before {
        found.missing += given.saturating_sub(found.last);
    }
    found.open_end = match after {
        Given::Number(given) if given < found.last => {
            Some(format!("says {given}, less than the last record's number {}", found.last))
        }
        Given::Number(_) => None,
        // As a gateway leaves it that has recorded nothing.
        Given::Absent if found.last == 0 => None,
        Given::Absent => Some("is missing or empty, though there are records".to_owned()),
        Given::Garbled => Some("is not a number".to_owned()),
    };
}

/// The lines so far.
#[derive(Default)]
struct Reading {
    found: Trail,
    hash: Option<Hash>,
    /// Whether the line that was read last ends with a line feed.
    has_feed: bool,
    /// The lines just before that are not whole: several, if the disk was full when the gateway started again.
    cut_off: Vec<CutOff>,
    /// The day in the name of the file that is read, until a record contradicts it.
    day: Option<String>,
}

impl Reading {
    fn file(&mut self, path: &Path) -> Result<(), Fault> {
        let unreadable = |cause| Fault::Unreadable(path.to_owned(), cause);
        let mut reader = BufReader::new(regular_file::open(path).map_err(unreadable)?);
        self.found.files += 1;
        self.day = day_files::day_of(path);
        let mut bytes = Vec::new();
        for line in 1.. {
            bytes.clear();
            let place = Place { path: path.to_owned(), line };
            let read = reader.by_ref().take(MAX_LINE).read_until(b'\n', &mut bytes).map_err(unreadable)?;
            if read == 0 {
                break;
            }
            let has_feed = bytes.pop_if(|it| *it == b'\n').is_some();
            if !has_feed && bytes.len() as u64 == MAX_LINE {
                return Err(Fault::Broken(place, format!("the line has more than {MAX_LINE} bytes")));
            }
            self.has_feed = has_feed;
            self.line(place, &bytes)?;
        }
        Ok(())
    }

    fn line(&mut self, place: Place, line: &[u8]) -> Result<(), Fault> {
        let link = match chain::read(line) {
            Line::Record(link) => link,
            Line::Part => {
                self.cut_off.push(CutOff { place, is_beginning: chain::is_beginning(line) });
                self.hash = Some(chain::hash(line));
                return Ok(());
            }
            Line::Foreign => return Err(Fault::Broken(place, "it is not a record".to_owned())),
        };
        if !link.is_unchanged {
            let why = "it does not have the hash that it carries: the line was changed".to_owned();
            return Err(Fault::Broken(place, why));
        }
        if !link.after_torn {
            self.follows_whole(&place)?;
        }
        self.follows(&link).map_err(|why| Fault::Broken(place.clone(), why))?;
        if self.found.first == 0 {
            self.found.first = link.number;
        } else {
            self.found.missing += link.number - self.found.last - 1;
        }
        self.found.missing += u64::from(link.in_place_of_lost);
        self.compare_day(&place, &link);
        if link.begun == Some(Begun::Lost) {
            self.found.lost.push(place);
        }
        self.found.torn.append(&mut self.cut_off);
        (self.found.last, self.hash) = (link.number, Some(chain::hash(line)));
        Ok(())
    }

    /// Whether a record follows from what was read before it; if not, why.
    fn follows(&self, link: &Link) -> Result<(), String> {
        // What rotation has removed ends with a whole file.
        if self.found.first == 0 && link.begun.is_none() {
            return Err(
                "it is the first record and not the first one of a file: what was before it in the file is gone".into(),
            );
        }
        let expected = self.hash.unwrap_or(if link.number == 1 { Hash::default() } else { link.previous });
        if link.previous != expected && link.begun == Some(Begun::Lost) {
            return Err(
                "the records before it were in a file that was removed or renamed while the gateway wrote to it".into(),
            );
        }
        if link.previous != expected {
            return Err("it does not carry the hash of the line before: one of the two was changed, or lines between them are gone".into());
        }
        if self.found.first != 0 && link.number <= self.found.last {
            return Err(format!("record {} comes after record {}", link.number, self.found.last));
        }
        Ok(())
    }

    /// A file has the name of the day on which it was begun. A clock that is set back begins no file, but one that goes on does, except for
    /// the record of a line that was cut off.
    fn compare_day(&mut self, place: &Place, link: &Link) {
        let is_later = |day: &String| *day < link.day && !link.after_torn;
        let is_earlier = |day: &String| link.day < *day && link.begun.is_some();
        if self.day.take_if(|day| is_later(day) || is_earlier(day)).is_some() {
            self.found.misdated.push(Misdated { place: place.clone(), day: link.day.clone() });
        }
    }

    /// Only a record that says so follows a line that is not whole.
    fn follows_whole(&self, place: &Place) -> Result<(), Fault> {
        match self.cut_off.first() {
            None => Ok(()),
            Some(CutOff { place: cut_off, .. }) => {
                let why = format!("it is not a record, and {place} does not say that it was cut off");
                Err(Fault::Broken(cut_off.clone(), why))
            }
        }
    }

    fn end(mut self) -> Result<Trail, Fault> {
        // Only the last bytes of all can be a line of which the rest is not written yet.
        if let Some(CutOff { place, .. }) = self.cut_off.pop_if(|_| self.has_feed) {
            let why = "it is not a record, and not cut off: it ends with a line feed";
            return Err(Fault::Broken(place, why.to_owned()));
        }
        self.found.unfinished = self.cut_off.pop();
        self.found.torn.append(&mut self.cut_off);
        self.found.hash = self.hash.map(|it| to_hex(&it)).unwrap_or_default();
        Ok(self.found)
    }
}
