//! What a real folder contains, and what the store makes from that.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::sync::LazyLock;

use proptest::prelude::*;
use tempfile::TempDir;

use crate::{InUse, Loaded, State, Store, Trouble};

fn open(folder: &Path) -> (Store, Loaded) {
    Store::open(folder, "mcm", "uav1", 3).unwrap()
}

/// Two generations, `old` and `new`; the newest is in `mcm.0`.
fn saved() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut store = open(folder.path()).0;
    for state in ["first", "old", "new"] {
        store.save(state.as_bytes()).unwrap();
    }
    assert_eq!(store.generation(), 4);
    folder
}

fn state(text: &str) -> State {
    State { bytes: text.as_bytes().to_vec(), version: 3 }
}

#[test]
fn what_was_saved_last_is_read_and_before_that_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("made/on/demand");
    let (mut store, loaded) = open(&inner);
    assert_eq!(loaded, Loaded::Nothing);
    store.save(b"first").unwrap();
    drop(store);
    assert_eq!(open(&inner).1, Loaded::Newest(state("first")));
    assert_eq!(open(saved().path()).1, Loaded::Newest(state("new")));
    let folder = saved();
    let (text, lines) = (fs::read_to_string(folder.path().join("mcm.0")).unwrap(), 3);
    assert_eq!((text.lines().count(), text.lines().last()), (lines, Some("new")), "an engineer can read it");
}

#[test]
fn each_thing_in_place_of_the_newest_generation_has_a_name_of_its_own_and_is_not_removed() {
    #[track_caller]
    fn check(put: impl Fn(&Path), expected: fn(&Trouble) -> bool) {
        let folder = saved();
        let newest = folder.path().join("mcm.0");
        fs::remove_file(&newest).unwrap();
        put(&newest);
        let (mut store, loaded) = open(folder.path());
        let Loaded::Behind(older, trouble) = loaded else { panic!("{loaded:?}") };
        assert!(older == state("old") && expected(&trouble), "{trouble:?}");
        let was_there = newest.symlink_metadata().is_ok();
        store.save(b"next").unwrap();
        drop(store);
        assert_eq!(folder.path().join("mcm.unusable-1").symlink_metadata().is_ok(), was_there);
        assert_eq!(open(folder.path()).1, Loaded::Newest(state("next")));
    }
    check(|_| {}, |it| matches!(it, Trouble::Missing { .. }));
    check(|it| fs::write(it, "").unwrap(), |it| matches!(it, Trouble::Garbled { .. }));
    check(|it| fs::write(it, "{}").unwrap(), |it| matches!(it, Trouble::Garbled { .. }));
    check(|it| fs::create_dir_all(it.join("full")).unwrap(), |it| matches!(it, Trouble::WrongKind { .. }));
    check(|it| symlink("/dev/full", it).unwrap(), |it| matches!(it, Trouble::WrongKind { .. }));
    check(|it| symlink("nowhere", it).unwrap(), |it| matches!(it, Trouble::Unreadable { .. }));
    check(
        |it| {
            let mut store = Store::open(it.parent().unwrap(), "later", "uav1", 4).unwrap().0;
            store.save(b"new").unwrap();
            fs::copy(it.with_file_name("later.1"), it).unwrap();
        },
        |it| matches!(it, Trouble::Newer { found: 4, known: 3, .. }),
    );
}

#[test]
fn both_generations_unusable_is_not_the_same_as_nothing() {
    let folder = saved();
    for slot in ["mcm.0", "mcm.1"] {
        fs::write(folder.path().join(slot), "").unwrap();
    }
    let (mut store, loaded) = open(folder.path());
    assert!(matches!(loaded, Loaded::Unusable(Trouble::Garbled { .. })), "{loaded:?}");
    store.save(b"next").unwrap();
    drop(store);
    assert_eq!(open(folder.path()).1, Loaded::Newest(state("next")));
}

#[test]
fn an_older_format_is_read_and_named() {
    let folder = saved();
    let (_store, loaded) = Store::open(folder.path(), "mcm", "uav1", 7).unwrap();
    assert_eq!(loaded, Loaded::Newest(state("new")));
}

#[test]
fn the_folder_of_another_vehicle_is_left_as_it_is() {
    let folder = saved();
    let content = || {
        let mut all: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|it| it.unwrap().path()).collect();
        all.sort();
        all.into_iter().map(|it| (fs::read(&it).unwrap(), it)).collect::<Vec<_>>()
    };
    let before = content();
    let (mut store, loaded) = Store::open(folder.path(), "mcm", "uav2", 3).unwrap();
    assert!(matches!(&loaded, Loaded::Unusable(it) if it.is_foreign()), "{loaded:?}");
    assert!(store.save(b"mine").unwrap_err().is_foreign());
    assert_eq!(content(), before);
}

#[test]
fn two_processes_do_not_share_a_state() {
    let folder = saved();
    let (first, _) = open(folder.path());
    let refused: InUse = Store::open(folder.path(), "mcm", "uav1", 3).unwrap_err();
    assert!(refused.to_string().starts_with("the state `mcm` of `uav1` in "), "{refused}");
    assert_eq!(Store::check_free(folder.path(), "mcm", "uav1"), Err(refused));
    assert_eq!(Store::check_free(folder.path(), "planner", "uav1"), Ok(()));
    let (_another, loaded) = Store::open(folder.path(), "planner", "uav1", 3).unwrap();
    assert_eq!(loaded, Loaded::Nothing, "each name is a state of its own");
    drop(first);
    assert_eq!(Store::check_free(folder.path(), "mcm", "uav1"), Ok(()));
    assert_eq!(open(folder.path()).1, Loaded::Newest(state("new")));
}

#[test]
fn a_folder_that_was_replaced_is_left_to_the_process_that_has_it_now() {
    let parent = tempfile::tempdir().unwrap();
    let place = parent.path().join("state");
    let mut first = open(&place).0;
    first.save(b"of the first").unwrap();
    fs::remove_dir_all(&place).unwrap();
    let replaced = |first: &mut Store| first.save(b"of the first, later").unwrap_err();
    let trouble = replaced(&mut first);
    assert!(trouble.to_string().starts_with("the state folder was replaced: "), "{trouble}");
    assert!(!place.exists(), "nothing is made in its place");
    let (mut second, loaded) = open(&place);
    assert_eq!(loaded, Loaded::Nothing);
    second.save(b"of the second").unwrap();
    assert!(matches!(replaced(&mut first), Trouble::Replaced { .. }));
    second.save(b"of the second, later").unwrap();
    drop((first, second));
    assert_eq!(open(&place).1, Loaded::Newest(state("of the second, later")));
}

#[test]
fn a_lock_that_was_removed_or_replaced_is_no_lock_any_more() {
    #[track_caller]
    fn check(replace: impl Fn(&Path)) {
        let folder = saved();
        let mut store = open(folder.path()).0;
        replace(&folder.path().join("mcm.lock"));
        assert!(matches!(store.save(b"lost"), Err(Trouble::Replaced { .. })));
        assert!(!folder.path().join("mcm.behind").exists(), "the other's state is not renamed");
    }
    check(|lock| fs::remove_file(lock).unwrap());
    check(|lock| {
        fs::write(lock.with_extension("other"), "")
            .and_then(|()| fs::rename(lock.with_extension("other"), lock))
            .unwrap()
    });
}

#[test]
fn a_folder_that_cannot_be_used_is_reported_at_once_and_used_once_it_can_be() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("state");
    fs::write(&place, "").unwrap();
    let (mut store, loaded) = open(&place);
    assert!(matches!(loaded, Loaded::Unusable(Trouble::WrongKind { .. })), "{loaded:?}");
    assert!(matches!(store.save(b"x"), Err(Trouble::WrongKind { .. })));
    fs::remove_file(&place).unwrap();
    store.save(b"x").unwrap();
    drop(store);
    assert_eq!(open(&place).1, Loaded::Newest(state("x")));
}

#[test]
fn what_stands_in_the_way_of_writing_is_reported_and_the_state_is_outdated() {
    let folder = saved();
    let (mut store, _) = open(folder.path());
    let in_the_way = folder.path().join("mcm.unfinished");
    fs::create_dir(&in_the_way).unwrap();
    store.save(b"lost").unwrap_err();
    drop(store);
    let (mut store, loaded) = open(folder.path());
    assert!(matches!(&loaded, Loaded::Behind(it, Trouble::Outdated { .. }) if *it == state("new")), "{loaded:?}");
    fs::remove_dir(in_the_way).unwrap();
    store.save(b"next").unwrap();
    drop(store);
    assert_eq!(open(folder.path()).1, Loaded::Newest(state("next")));
}

#[test]
fn a_digit_too_many_before_the_checksum_is_noticed() {
    let folder = saved();
    let path = folder.path().join("mcm.0");
    let text = String::from_utf8(fs::read(&path).unwrap()).unwrap();
    fs::write(&path, text.replacen("kittiwake-state-1 ", "kittiwake-state-01 ", 1)).unwrap();
    assert!(!matches!(open(folder.path()).1, Loaded::Newest(_)));
}

/// The files of `saved`, made once: a sync takes its time.
static SAVED: LazyLock<[Vec<u8>; 2]> = LazyLock::new(|| {
    let folder = saved();
    ["mcm.0", "mcm.1"].map(|it| fs::read(folder.path().join(it)).unwrap())
});

proptest! {
    /// Bytes that are changed, cut off or added in either file: the state is the one before, or the same.
    #[test]
    fn no_garbled_state_is_believed(newest: bool, at: prop::sample::Index, what in 0..3, byte: u8) {
        let (broken, other) = if newest { (0, 1) } else { (1, 0) };
        let mut bytes = SAVED[broken].clone();
        let at = at.index(bytes.len());
        match what {
            0 => bytes[at] = byte,
            1 => bytes.truncate(at),
            _ => bytes.insert(at, byte),
        }
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(format!("mcm.{broken}")), &bytes).unwrap();
        fs::write(folder.path().join(format!("mcm.{other}")), &SAVED[other]).unwrap();
        let is_whole = bytes == SAVED[broken];
        let expected = state(if newest && !is_whole { "old" } else { "new" });
        let loaded = open(folder.path()).1;
        let is_fine = match &loaded {
            Loaded::Newest(it) => is_whole && *it == expected,
            Loaded::Behind(it, _) => !is_whole && *it == expected,
            Loaded::Nothing | Loaded::Unusable(_) => false,
        };
        prop_assert!(is_fine, "{:?}", loaded);
    }
}

#[test]
fn a_state_that_could_not_be_read_back_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = open(folder.path()).0;
    store.save(b"old").unwrap();
    let trouble = store.save(&vec![b' '; 16 << 20]).unwrap_err().to_string();
    assert!(trouble.contains("more than the 16777216 that are read back"), "{trouble}");
    drop(store);
    assert!(matches!(open(folder.path()).1, Loaded::Behind(it, _) if it == state("old")), "and the next process knows");
}
