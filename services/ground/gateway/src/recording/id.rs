//! The name of a recording: when it began and whose it is, safe as a file's name and in a path.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::recording::tracks::Take;
use crate::view;

/// What follows the name.
const SUFFIX: &str = "mcap";
/// Characters of a name.
const LONGEST: usize = 100;

/// Letters, digits, `-` and `_`, and nothing that means anything to a file system.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Id(String);

impl Id {
    /// Of a recording that is begun for the `attempt`th time, counted from 1.
    pub fn of(take: &Take, attempt: usize) -> Id {
        let began: String = view::utc(take.began.utc_ms).chars().filter(|it| it.is_ascii_alphanumeric()).collect();
        let safe = |it: char| if is_safe(it) { it } else { '_' };
        let vehicle: String = take.vehicle.chars().take(LONGEST / 2).map(safe).collect();
        let again = if attempt == 1 { String::new() } else { format!("-{attempt}") };
        Id(format!("{began}-{vehicle}{again}"))
    }

    /// Of a file in the folder; `None` if it is no recording by its name.
    pub fn of_file(path: &Path) -> Option<Id> {
        if path.extension()? != SUFFIX {
            return None;
        }
        path.file_stem()?.to_str()?.parse().ok()
    }

    /// The file in `folder`.
    pub fn path_in(&self, folder: &Path) -> PathBuf {
        folder.join(self.file_name())
    }

    /// The file's name.
    pub fn file_name(&self) -> String {
        format!("{}.{SUFFIX}", self.0)
    }

    /// Whether the gateway gave it: others' files are shown, and never removed.
    pub fn is_ours(&self) -> bool {
        let shape = "ddddddddTdddddddddZ-";
        let fits = |(it, shape): (char, char)| if shape == 'd' { it.is_ascii_digit() } else { it == shape };
        shape.len() < self.0.len() && self.0.chars().zip(shape.chars()).all(fits)
    }
}

impl FromStr for Id {
    type Err = String;
    fn from_str(text: &str) -> Result<Id, String> {
        if !text.is_empty() && text.len() <= LONGEST && text.chars().all(is_safe) {
            Ok(Id(text.to_owned()))
        } else {
            Err(format!("a recording is named by 1 to {LONGEST} letters, digits, `-` and `_`"))
        }
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

fn is_safe(it: char) -> bool {
    it.is_ascii_alphanumeric() || it == '-' || it == '_'
}

#[cfg(test)]
mod tests {
    use super::*;
    use domain::time::{Now, Time};

    fn take(vehicle: &str) -> Take {
        let began = Now { time: Time::ZERO, utc_ms: 1_767_225_600_123 };
        Take { number: 1, vehicle: vehicle.into(), began, speed: 1.0 }
    }

    #[test]
    fn a_name_tells_when_and_whose_and_is_one_of_ours() {
        #[track_caller]
        fn check(vehicle: &str, attempt: usize, expected: &str) {
            let id = Id::of(&take(vehicle), attempt);
            assert_eq!(id.to_string(), expected);
            assert_eq!(expected.parse(), Ok(id.clone()));
            assert_eq!(Id::of_file(&id.path_in(Path::new("/x"))), Some(id.clone()));
            assert!(id.is_ours());
        }
        check("uav1", 1, "20260101T000000123Z-uav1");
        check("uav1", 2, "20260101T000000123Z-uav1-2");
        check("../ä\n", 1, "20260101T000000123Z-_____");
        check(&"x".repeat(200), 1, &format!("20260101T000000123Z-{}", "x".repeat(50)));
    }

    #[test]
    fn what_could_lead_elsewhere_is_no_name() {
        for text in ["", ".", "..", "a/b", "../a", "a.b", "a\\b", "%2e", "a b", "a\0", "ä", &"a".repeat(101)] {
            assert!(text.parse::<Id>().is_err(), "{text}");
        }
        for file in ["/x/a.txt", "/x/.mcap", "/x/a", "/x/a.b.mcap", "/x/a.mcap.part"] {
            assert_eq!(Id::of_file(Path::new(file)), None, "{file}");
        }
        for others in ["flight", "20260101", "20260101T00000012Z-uav1", "20260101T000000123Z"] {
            assert!(!others.parse::<Id>().unwrap().is_ours(), "{others}");
        }
    }
}
