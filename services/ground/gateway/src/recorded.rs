//! What is in a recording, without a gateway.

use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;

use crate::recording::index;
use crate::recording::reading::{Found, read_each};

/// What a recording has of one topic.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded<M> {
    /// In the order in which they were recorded.
    pub messages: Vec<M>,
    /// What is wrong with the file, which was read up to there; `None` if it was read to its end.
    pub problem: Option<String>,
}

/// Why a file is not a recording.
#[derive(Debug, thiserror::Error)]
pub enum NoRecording {
    /// It cannot be opened.
    #[error("{}: cannot be opened: {cause}", .path.display())]
    Closed {
        /// The file.
        path: PathBuf,
        /// Why not.
        cause: io::Error,
    },
    /// It holds no message of a mission.
    #[error(
        "{}: is not a recording: {problem}; expected an MCAP file that a gateway has made, in the folder that `kittiwake up` \
         prints as `recordings`",
        .path.display()
    )]
    Other {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
}

/// Reads the decisions in a file, as far as it can be read.
///
/// # Errors
/// If nothing in it is a recording.
pub fn decisions(path: &Path) -> Result<Recorded<v1::DecisionRecord>, NoRecording> {
    read(path, Topic::DecisionRecord, |message| match message {
        Message::DecisionRecord(it) => Some(it),
        _ => None,
    })
}

/// Reads the pictures in a file, as far as it can be read.
///
/// # Errors
/// If nothing in it is a recording.
pub fn pictures(path: &Path) -> Result<Recorded<v1::Picture>, NoRecording> {
    read(path, Topic::Picture, |message| match message {
        Message::Picture(it) => Some(it),
        _ => None,
    })
}

/// `of` gets each message of the topic.
fn read<M>(path: &Path, wanted: Topic, of: impl Fn(Message) -> Option<M>) -> Result<Recorded<M>, NoRecording> {
    let file = regular_file::open(path).map_err(|cause| NoRecording::Closed { path: path.to_owned(), cause })?;
    let (mut messages, mut is_recording) = (Vec::new(), false);
    let problem = read_each(BufReader::new(file), |found| {
        let Found::Message { topic, bytes, .. } = found else { return };
        is_recording = true;
        // A message that is malformed was never taken in by anybody.
        if topic == wanted
            && let Ok(message) = Message::decode(topic, bytes)
        {
            messages.extend(of(message));
        }
    });
    if is_recording {
        return Ok(Recorded { messages, problem });
    }
    let problem = problem.unwrap_or_else(|| "none of its messages belongs to a mission".to_owned());
    Err(NoRecording::Other { path: path.to_owned(), problem })
}

/// The recordings in a folder, newest first; none if there is no folder yet.
///
/// # Errors
/// If the folder cannot be read.
pub fn newest_first(folder: &Path) -> io::Result<Vec<PathBuf>> {
    index::newest_first(folder)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::recording::capture::RecordedMessage;
    use crate::recording::encoder::Encoder;

    /// A file with these messages, a second apart.
    fn recording(messages: Vec<Message>) -> Vec<u8> {
        let mut encoder = Encoder::new(BTreeMap::new()).unwrap();
        for (second, message) in (1..).zip(messages) {
            let (topic, bytes) = (message.topic(), message.encode());
            encoder.add(&RecordedMessage { topic, utc_ms: 1000 * second, bytes }).unwrap();
        }
        let mut file = encoder.take_bytes().unwrap();
        file.extend(encoder.finish(BTreeMap::new()).unwrap());
        file
    }

    fn decision(sequence: u64, utc_ms: i64) -> v1::DecisionRecord {
        v1::DecisionRecord { sequence, utc_ms, ..Default::default() }
    }

    /// What is read of a file with these bytes, or the end of the error.
    #[track_caller]
    fn check(bytes: &[u8], expected: Result<(Vec<v1::DecisionRecord>, bool), &str>) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        match (decisions(file.path()), expected) {
            (Ok(found), Ok((decisions, is_whole))) => {
                assert_eq!((found.messages, found.problem.is_none()), (decisions, is_whole));
            }
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{error}"),
            (found, expected) => panic!("{found:?}, expected {expected:?}"),
        }
    }

    #[test]
    fn the_decisions_are_read_with_the_time_of_their_arrival_where_they_have_none() {
        let messages = vec![decision(1, 1000).into(), v1::McmStatus::default().into(), decision(2, 77).into()];
        let whole = recording(messages);
        check(&whole, Ok((vec![decision(1, 1000), decision(2, 77)], true)));
        // Without its end, as a gateway leaves it that was killed.
        check(&whole[..whole.len() - 8], Ok((vec![decision(1, 1000), decision(2, 77)], false)));
        check(&recording(vec![v1::McmStatus::default().into()]), Ok((Vec::new(), true)));
    }

    #[test]
    fn the_pictures_are_read_and_nothing_else() {
        let taken = |number| v1::Picture { number, ..Default::default() };
        let file = tempfile::NamedTempFile::new().unwrap();
        let messages = vec![taken(0).into(), decision(1, 77).into(), taken(1).into()];
        std::fs::write(file.path(), recording(messages)).unwrap();
        let found = pictures(file.path()).unwrap();
        assert_eq!(found, Recorded { messages: vec![taken(0), taken(1)], problem: None });
    }

    #[test]
    fn a_file_that_is_no_recording_is_refused_with_what_was_expected() {
        check(b"", Err("is not a recording: "));
        check(b"name = \"mission\"\n", Err("expected an MCAP file"));
        check(&recording(Vec::new()), Err("none of its messages belongs to a mission"));
        let missing = decisions(Path::new("/nothing/here.mcap")).unwrap_err().to_string();
        assert!(missing.starts_with("/nothing/here.mcap: cannot be opened: "), "{missing}");
        let folder = tempfile::tempdir().unwrap();
        assert!(decisions(folder.path()).is_err(), "a folder");
    }

    #[test]
    fn the_newest_recording_is_the_one_that_began_last() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(newest_first(folder.path()).unwrap(), Vec::<PathBuf>::new());
        for name in ["20260101T000000123Z-uav1.mcap", "20260102T000000123Z-uav1.mcap", "notes.txt"] {
            std::fs::write(folder.path().join(name), "x").unwrap();
        }
        // Foreign files do not count as "the newest".
        std::fs::write(folder.path().join("zebra.mcap"), "x").unwrap();
        assert_eq!(newest_first(folder.path()).unwrap()[0], folder.path().join("20260102T000000123Z-uav1.mcap"));
        assert_eq!(newest_first(&folder.path().join("missing")).unwrap(), Vec::<PathBuf>::new());
    }
}
