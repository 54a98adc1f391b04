//! One generation as bytes: a line with the checksum of all that follows, a line of JSON that says whose it is, the
//! contents. `tail -n +3` prints the contents alone.

use std::fmt::Write;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::Trouble;

const MAGIC: &[u8] = b"kittiwake-state-";
/// Of these two lines; grows when they change.
const ENVELOPE: u32 = 1;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Record {
    pub(crate) generation: u64,
    pub(crate) version: u32,
    pub(crate) contents: Vec<u8>,
}

#[derive(Serialize, Deserialize)]
struct Header {
    owner: String,
    version: u32,
    generation: u64,
}

impl Record {
    pub(crate) fn to_bytes(&self, owner: &str) -> Vec<u8> {
        let header = Header { owner: owner.to_owned(), version: self.version, generation: self.generation };
        let mut body = serde_json::json!(header).to_string().into_bytes();
        body.push(b'\n');
        body.extend(&self.contents);
        let mut bytes = MAGIC.to_vec();
        bytes.extend(format!("{ENVELOPE} {}\n", checksum(&body)).into_bytes());
        bytes.extend(body);
        bytes
    }

    /// Whose it is counts before whether it can be understood, and both only if it is intact.
    pub(crate) fn parse(bytes: &[u8], file: &Path, owner: &str, version: u32) -> Result<Record, Trouble> {
        let garbled = |what: &str| Trouble::Garbled { file: file.to_owned(), what: what.to_owned() };
        let newer = |found| Trouble::Newer { file: file.to_owned(), found, known: version };
        if bytes.is_empty() {
            return Err(garbled("it is empty"));
        }
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| garbled("it does not begin as a state does"))?;
        let (first, body) = split_line(rest).ok_or_else(|| garbled("it ends in its first line"))?;
        let (envelope, sum) = first.split_once(' ').ok_or_else(|| garbled("it has no checksum"))?;
        match envelope.parse::<u32>() {
            // `01` is not what was written.
            Ok(ENVELOPE) if envelope == ENVELOPE.to_string() => {}
            Ok(other) if ENVELOPE < other => return Err(newer(other)),
            _ => return Err(garbled("its format is unknown")),
        }
        if sum != checksum(body) {
            return Err(garbled("its checksum does not match"));
        }
        let (header, contents) = split_line(body).ok_or_else(|| garbled("it ends in its second line"))?;
        let header: Header = serde_json::from_str(header).map_err(|it| garbled(&it.to_string()))?;
        if header.owner != owner {
            return Err(Trouble::Foreign { file: file.to_owned(), owner: header.owner, expected: owner.to_owned() });
        }
        if version < header.version {
            return Err(newer(header.version));
        }
        Ok(Record { generation: header.generation, version: header.version, contents: contents.to_owned() })
    }
}

fn split_line(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let end = bytes.iter().position(|it| *it == b'\n')?;
    Some((std::str::from_utf8(&bytes[..end]).ok()?, &bytes[end + 1..]))
}

fn checksum(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut text, byte| {
        // Writing to a string does not fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}
