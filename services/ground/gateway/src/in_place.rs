//! Whether a file that is being written is still the one at its path: somebody may have removed, renamed or replaced it, and
//! what is written then goes where nobody finds it.

use std::fs::File;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// Whether `file` is at `path`.
pub(crate) fn is_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), std::fs::metadata(path)) {
        (Ok(own), Ok(there)) => (own.dev(), own.ino()) == (there.dev(), there.ino()),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_removed_renamed_or_replaced_is_not_in_place() {
        #[track_caller]
        fn check(change: impl FnOnce(&Path), expected: bool) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("file");
            let file = File::create(&path).unwrap();
            change(&path);
            assert_eq!(is_at(&file, &path), expected);
        }
        check(|_| (), true);
        check(|path| std::fs::write(path, "more").unwrap(), true);
        check(|path| std::fs::remove_file(path).unwrap(), false);
        check(|path| std::fs::rename(path, path.with_extension("1")).unwrap(), false);
        check(
            |path| {
                std::fs::rename(path, path.with_extension("1")).unwrap();
                std::fs::write(path, "another").unwrap();
            },
            false,
        );
        check(|path| std::fs::remove_dir_all(path.parent().unwrap()).unwrap(), false);
    }
}
