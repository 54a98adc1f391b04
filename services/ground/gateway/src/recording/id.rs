//! The name of a recording: when it began and of which vehicle, safe as a file name and in a URL.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::recording::capture::RecordingHeader;
use crate::view;

/// The extension of the file.
const SUFFIX: &str = "mcap";
/// The longest name, in characters.
const MAX_LENGTH: usize = 100;

/// Letters, digits, `-` and `_`: nothing that has a meaning in a file system.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RecordingId(String);

impl RecordingId {
    /// The name of a recording; `attempt` counts from 1 while the name exists already.
    pub(crate) fn of(header: &RecordingHeader, attempt: usize) -> RecordingId {
        let began: String = view::utc(header.began.utc_ms).chars().filter(|it| it.is_ascii_alphanumeric()).collect();
        let vehicle = safe_name(&header.vehicle);
        let again = if attempt == 1 { String::new() } else { format!("-{attempt}") };
        RecordingId(format!("{began}-{vehicle}{again}"))
    }

    /// The name of a file in the folder; `None` if it is not named like a recording.
    pub(crate) fn of_file(path: &Path) -> Option<RecordingId> {
        if path.extension()? != SUFFIX {
            return None;
        }
        path.file_stem()?.to_str()?.parse().ok()
    }

    /// The file in `folder`.
    pub(crate) fn path_in(&self, folder: &Path) -> PathBuf {
        folder.join(self.file_name())
    }

    /// The file's name.
    pub(crate) fn file_name(&self) -> String {
        format!("{}.{SUFFIX}", self.0)
    }

    /// Whether a gateway made the name for a recording of `vehicle`.
    pub(crate) fn is_of(&self, vehicle: &str) -> bool {
        let named = self.0.split_once('-').map_or("", |(_, rest)| rest);
        let again = named.strip_prefix(safe_name(vehicle).as_str());
        let is_attempt = |it: &str| it.strip_prefix('-').is_some_and(|it| it.parse::<usize>().is_ok());
        self.is_ours() && again.is_some_and(|it| it.is_empty() || is_attempt(it))
    }

    /// Whether a gateway made the name: other files are shown and never removed.
    pub(crate) fn is_ours(&self) -> bool {
        let shape = "ddddddddTdddddddddZ-";
        let fits = |(it, shape): (char, char)| if shape == 'd' { it.is_ascii_digit() } else { it == shape };
        shape.len() < self.0.len() && self.0.chars().zip(shape.chars()).all(fits)
    }
}

impl FromStr for RecordingId {
    type Err = String;
    fn from_str(text: &str) -> Result<RecordingId, String> {
        if !text.is_empty() && text.len() <= MAX_LENGTH && text.chars().all(is_safe) {
            Ok(RecordingId(text.to_owned()))
        } else {
            Err(format!("found a name that no recording has, expected 1 to {MAX_LENGTH} letters, digits, `-` and `_`"))
        }
    }
}

impl fmt::Display for RecordingId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A vehicle's name as it stands in that of a file.
fn safe_name(vehicle: &str) -> String {
    vehicle.chars().take(MAX_LENGTH / 2).map(|it| if is_safe(it) { it } else { '_' }).collect()
}

fn is_safe(it: char) -> bool {
    it.is_ascii_alphanumeric() || it == '-' || it == '_'
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::time::{Now, Time};

    fn header(vehicle: &str) -> RecordingHeader {
        let began = Now { time: Time::ZERO, utc_ms: 1_767_225_600_123 };
        RecordingHeader { number: 1, vehicle: vehicle.into(), began, speed: 1.0 }
    }

    #[test]
    fn a_name_says_when_and_whose_and_is_one_of_ours() {
        #[track_caller]
        fn check(vehicle: &str, attempt: usize, expected: &str) {
            let id = RecordingId::of(&header(vehicle), attempt);
            assert_eq!(id.to_string(), expected);
            assert_eq!(expected.parse(), Ok(id.clone()));
            assert_eq!(RecordingId::of_file(&id.path_in(Path::new("/x"))), Some(id.clone()));
            assert!(id.is_ours());
        }
        check("uav1", 1, "20260101T000000123Z-uav1");
        check("uav1", 2, "20260101T000000123Z-uav1-2");
        check("../ä\n", 1, "20260101T000000123Z-_____");
        check(&"x".repeat(200), 1, &format!("20260101T000000123Z-{}", "x".repeat(50)));
    }

    #[test]
    fn a_name_says_whose_recording_it_is() {
        let id = |attempt| RecordingId::of(&header("uav 1"), attempt);
        assert!(id(1).is_of("uav 1") && id(2).is_of("uav 1"));
        for other in ["uav", "uav 12", "uav 1-2", ""] {
            assert!(!id(1).is_of(other), "{other}");
        }
        assert!(!"flight-uav1".parse::<RecordingId>().unwrap().is_of("uav1"), "a file of somebody else");
    }

    #[test]
    fn a_text_that_could_lead_elsewhere_is_no_name() {
        for text in ["", ".", "..", "a/b", "../a", "a.b", "a\\b", "%2e", "a b", "a\0", "ä", &"a".repeat(101)] {
            assert!(text.parse::<RecordingId>().is_err(), "{text}");
        }
        for file in ["/x/a.txt", "/x/.mcap", "/x/a", "/x/a.b.mcap", "/x/a.mcap.part"] {
            assert_eq!(RecordingId::of_file(Path::new(file)), None, "{file}");
        }
        for others in ["flight", "20260101", "20260101T00000012Z-uav1", "20260101T000000123Z"] {
            assert!(!others.parse::<RecordingId>().unwrap().is_ours(), "{others}");
        }
    }
}
