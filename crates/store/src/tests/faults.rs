//! Every operation of a sequence of saves fails once, and for ever, in every way; the process dies there, or the power
//! is lost: the state afterwards is the old or the new one.

use super::flaky::{Failure, Files, Flaky};
use crate::{Loaded, Store};

const FAILURES: [Failure; 3] = [Failure::Refused, Failure::Half, Failure::Done];
/// Saved before, so that what fails is not the first generation; a second and a third follow.
const SAVES: u8 = 5;

fn open(files: Files) -> (Store<Flaky>, Loaded) {
    Store::over(Flaky::of(files), "mcm", "uav1", 1).unwrap()
}

/// The state, and whether it claims to be the last.
fn read(files: Files) -> Option<(u8, bool)> {
    match open(files).1 {
        Loaded::Nothing => None,
        Loaded::Newest(state) => Some((state.bytes[0], true)),
        Loaded::Behind(state, _) => Some((state.bytes[0], false)),
        Loaded::Unusable(trouble) => panic!("unusable: {trouble}"),
    }
}

/// How often it works: the number of operations that `SAVES` saves need.
fn operations() -> usize {
    let (mut store, _) = open(Files::new());
    (1..=SAVES).for_each(|it| store.save(&[it]).unwrap());
    store.medium.operations
}

#[test]
fn a_process_that_dies_at_any_operation_leaves_the_old_state_or_the_new_one() {
    for k in 1..=operations() {
        for failure in FAILURES {
            let (mut store, _) = open(Files::new());
            (store.medium.fails, store.medium.dies_after) = (Some((k, 1, failure)), Some(k));
            let under_way = (1..=SAVES).find(|it| store.save(&[*it]).is_err()).expect("it dies in one of them");
            for (what, files) in [("killed", &store.medium.files), ("powerless", &store.medium.durable)] {
                let found = read(files.clone());
                let is_fine = match found {
                    None => under_way == 1,
                    Some((state, _)) => state == under_way || state + 1 == under_way,
                };
                assert!(is_fine, "{what} at operation {k} ({failure:?}) of save {under_way}: {found:?}");
            }
        }
    }
}

#[test]
fn after_a_save_that_failed_no_old_state_claims_to_be_the_last() {
    for k in 1..=operations() {
        for failure in FAILURES {
            let (mut store, _) = open(Files::new());
            store.medium.fails = Some((k, 1, failure));
            let failed = (1..=SAVES).find(|it| store.save(&[*it]).is_err()).expect("one of them fails");
            for (what, files) in [("killed", &store.medium.files), ("powerless", &store.medium.durable)] {
                let found = read(files.clone());
                let is_fine = match found {
                    // Before the first state there is no old one to be mistaken for it.
                    None => failed == 1,
                    Some((state, is_newest)) => state == failed || (state + 1 == failed && !is_newest),
                };
                assert!(is_fine, "{what} after operation {k} failed ({failure:?}) in save {failed}: {found:?}");
            }
            // The next one works, and all is as if nothing had been.
            store.save(&[100]).unwrap();
            assert_eq!(read(store.medium.durable.clone()), Some((100, true)), "operation {k}, {failure:?}");
            store.save(&[101]).unwrap();
            assert_eq!(read(store.medium.durable.clone()), Some((101, true)), "operation {k}, {failure:?}");
        }
    }
}

#[test]
fn a_medium_that_never_works_again_keeps_the_old_state() {
    for k in 1..=operations() {
        let (mut store, _) = open(Files::new());
        store.medium.fails = Some((k, usize::MAX, Failure::Refused));
        let failed = (1..=SAVES).find(|it| store.save(&[*it]).is_err()).expect("one of them fails");
        for later in failed + 1..failed + 4 {
            store.save(&[later]).expect_err("nothing works");
        }
        let found = read(store.medium.files.clone()).map(|(state, _)| state);
        let old = (1 < failed).then(|| failed - 1);
        assert!(found == old || found == Some(failed), "operation {k}: {found:?}");
    }
}

#[test]
fn what_was_saved_twice_outlives_either_file_and_a_second_time_that_fails_takes_nothing_away() {
    let saved = || {
        let (mut store, _) = open(Files::new());
        (1..=SAVES).for_each(|it| store.save(&[it]).unwrap());
        store
    };
    let operations = {
        let mut store = saved();
        let before = store.medium.operations;
        store.save_again(&[SAVES]);
        let made = store.medium.operations - before;
        store.save_again(&[SAVES]);
        assert_eq!(store.medium.operations - before, made, "twice is enough");
        for file in ["mcm.0", "mcm.1"] {
            let mut files = store.medium.durable.clone();
            files.insert(file.to_owned(), b"garbled".to_vec());
            assert_eq!(read(files), Some((SAVES, false)), "without {file}");
        }
        made
    };
    assert!(0 < operations);
    for k in 1..=operations {
        for failure in FAILURES {
            let mut store = saved();
            store.medium.fails = Some((store.medium.operations + k, 1, failure));
            store.save_again(&[SAVES]);
            for (what, files) in [("killed", &store.medium.files), ("powerless", &store.medium.durable)] {
                assert_eq!(read(files.clone()), Some((SAVES, true)), "{what} after operation {k} failed ({failure:?})");
            }
            store.save(&[100]).unwrap();
            assert_eq!(read(store.medium.durable.clone()), Some((100, true)), "operation {k}, {failure:?}");
        }
    }
}

#[test]
fn a_repair_that_is_interrupted_anywhere_still_tells_that_something_was_lost() {
    let (mut store, _) = open(Files::new());
    (1..=4).for_each(|it| store.save(&[it]).unwrap());
    let whole = store.medium.files.clone();
    for broken in [&["mcm.0"][..], &["mcm.1"], &["mcm.0", "mcm.1"]] {
        let mut files = whole.clone();
        broken.iter().for_each(|it| drop(files.insert((*it).to_owned(), b"garbled".to_vec())));
        for k in 1.. {
            let (mut store, loaded) = open(files.clone());
            assert!(matches!(loaded, Loaded::Behind(..) | Loaded::Unusable(_)), "{broken:?}: {loaded:?}");
            store.medium.dies_after = Some(k);
            if store.save(&[9]).is_ok() {
                assert_eq!(read(store.medium.durable.clone()), Some((9, true)), "{broken:?}");
                let kept = store.medium.files.values().filter(|it| *it == b"garbled").count();
                assert_eq!(kept, broken.len(), "what could not be used is still there");
                break;
            }
            for left in [store.medium.files, store.medium.durable] {
                let loaded = open(left).1;
                let is_fine = match &loaded {
                    Loaded::Nothing => false,
                    Loaded::Newest(state) => state.bytes == [9],
                    Loaded::Behind(..) | Loaded::Unusable(_) => true,
                };
                assert!(is_fine, "{broken:?}, dead at operation {k}: {loaded:?}");
            }
        }
    }
}
