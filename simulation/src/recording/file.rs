//! A recording as a file: a line that says what it is, then a compressed stream of entries, each with its length, and an end mark with
//! their number. Whatever is missing or foreign is found when it is read, with its place.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;

use super::content::{Entry, Header};

/// The first word of the first line.
const MARK: &str = "kittiwake-inputs";
/// The form of what follows; a file of another one is not read.
const FORMAT: u32 = 3;
/// Longer than any entry: a mission's files, 32 MiB.
const LONGEST: u32 = 64 << 20;
/// In place of a length: the end.
const END: u32 = u32::MAX;

/// Why a file is not a recording that can be replayed.
#[derive(Debug, thiserror::Error)]
#[error("{}: {what}", path.display())]
pub struct Unreadable {
    path: PathBuf,
    what: String,
}

/// Writes a recording.
pub struct Writer<W: Write> {
    to: DeflateEncoder<W>,
    entries: u64,
}

impl<W: Write> Writer<W> {
    /// Begins one.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(mut to: W, header: &Header) -> io::Result<Writer<W>> {
        writeln!(to, "{MARK} {FORMAT}")?;
        let mut writer = Writer { to: DeflateEncoder::new(to, Compression::best()), entries: 0 };
        writer.put(&header.encode())?;
        Ok(writer)
    }

    /// Appends an entry.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, entry: &Entry) -> io::Result<()> {
        self.entries += 1;
        self.put(&entry.encode())
    }

    /// Ends it: without the end mark a file counts as cut off.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn end(mut self) -> io::Result<W> {
        self.to.write_all(&END.to_be_bytes())?;
        self.to.write_all(&self.entries.to_be_bytes())?;
        self.to.finish()
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.to.write_all(&(bytes.len() as u32).to_be_bytes())?;
        self.to.write_all(bytes)
    }
}

/// Reads a whole recording.
///
/// # Errors
/// If it is not one, is of another format, is cut off, or makes no sense; with the place.
pub fn read(path: &Path) -> Result<(Header, Vec<Entry>), Unreadable> {
    let unreadable = |what: String| Unreadable { path: path.to_owned(), what };
    let file = regular_file::open(path).map_err(|it| unreadable(format!("cannot be read: {it}")))?;
    let mut reader = BufReader::new(file);
    let mut first = Vec::new();
    let line = reader.by_ref().take(64).read_until(b'\n', &mut first);
    line.map_err(|it| unreadable(format!("cannot be read: {it}")))?;
    let first = String::from_utf8_lossy(&first).into_owned();
    match first.trim_end().split_once(' ') {
        Some((MARK, format)) if format == FORMAT.to_string() => {}
        Some((MARK, format)) => {
            return Err(unreadable(format!(
                "a recording of format {format}, expected {FORMAT}: record the flight again"
            )));
        }
        _ => return Err(unreadable(format!("no recording of inputs: it does not begin with `{MARK} {FORMAT}`"))),
    }
    let mut reader = DeflateDecoder::new(reader);
    let header = match next(&mut reader) {
        Ok(Next::Entry(bytes)) => {
            Header::decode(&bytes).ok_or_else(|| unreadable("its header makes no sense".into()))?
        }
        _ => return Err(unreadable("it is cut off in its header".into())),
    };
    let mut entries = Vec::new();
    loop {
        let number = entries.len() + 1;
        match next(&mut reader) {
            Ok(Next::Entry(bytes)) => {
                let entry = Entry::decode(&bytes);
                entries.push(entry.ok_or_else(|| unreadable(format!("entry {number} makes no sense")))?);
            }
            Ok(Next::End(count)) if count == entries.len() as u64 => return Ok((header, entries)),
            Ok(Next::End(count)) => {
                return Err(unreadable(format!("it has {} entries, and says that it has {count}", entries.len())));
            }
            Err(_) => {
                let at = entries.iter().rev().find_map(|it| match it {
                    Entry::Given { now, .. } => Some(now.time.as_secs_f64()),
                    Entry::Did { .. } => None,
                });
                let at = at.unwrap_or_default();
                return Err(unreadable(format!("it is cut off after entry {}, {at:.1} s into the flight", number - 1)));
            }
        }
    }
}

enum Next {
    Entry(Vec<u8>),
    End(u64),
}

fn next(reader: &mut impl Read) -> io::Result<Next> {
    let mut length = [0; 4];
    reader.read_exact(&mut length)?;
    let length = u32::from_be_bytes(length);
    if length == END {
        let mut count = [0; 8];
        reader.read_exact(&mut count)?;
        return Ok(Next::End(u64::from_be_bytes(count)));
    }
    if LONGEST < length {
        return Err(io::ErrorKind::InvalidData.into());
    }
    let mut bytes = vec![0; length as usize];
    reader.read_exact(&mut bytes)?;
    Ok(Next::Entry(bytes))
}
