//! What is done to files: of persisted state, and of the disk that they are on.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::trouble::{Garbling, Victim};

/// Garbles every generation of the state of a process's nodes; the number of files.
pub(super) fn garble_all(state: &Path, victim: Victim, garbling: Garbling) -> usize {
    let entries = std::fs::read_dir(state).into_iter().flatten().flatten();
    let is_state = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        victim.nodes().iter().any(|node| name.strip_prefix(node).is_some_and(|it| matches!(it, ".0" | ".1")))
    };
    let files: Vec<PathBuf> = entries.map(|it| it.path()).filter(is_state).collect();
    let garbled = files.iter().filter(|path| {
        let spoilt = std::fs::read(path).map(|bytes| spoil(bytes, garbling));
        spoilt.and_then(|bytes| std::fs::write(path, bytes)).is_ok()
    });
    garbled.count()
}

fn spoil(mut bytes: Vec<u8>, garbling: Garbling) -> Vec<u8> {
    let middle = bytes.len() / 2;
    match garbling {
        Garbling::Flipped => bytes.iter_mut().skip(middle).take(8).for_each(|it| *it ^= 0x5a),
        Garbling::Cut => bytes.truncate(middle),
        Garbling::Emptied => bytes.clear(),
    }
    bytes
}

/// Fills the disk of a folder for a while.
pub(super) fn fill(folder: &Path, time: Duration) -> io::Result<()> {
    let path = folder.join("filler");
    let mut file = std::fs::File::create(&path)?;
    // To the last byte.
    for length in [65_536, 4096, 1] {
        while file.write_all(&vec![0; length]).is_ok() {}
    }
    std::thread::sleep(time);
    std::fs::remove_file(&path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_spoilt_differs_in_the_way_that_was_drawn() {
        let good: Vec<u8> = (0..100).collect();
        let flipped = spoil(good.clone(), Garbling::Flipped);
        assert_eq!((flipped.len(), flipped.iter().zip(&good).filter(|(a, b)| a != b).count()), (100, 8));
        assert_eq!(spoil(good.clone(), Garbling::Cut), good[..50]);
        assert!(spoil(good, Garbling::Emptied).is_empty());
    }
}
