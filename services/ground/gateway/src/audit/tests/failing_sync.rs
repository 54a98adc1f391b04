//! The audit trail on a disk that takes bytes into memory, and then fails to keep them.

use std::fs::File;
use std::os::unix::fs::OpenOptionsExt as _;

use super::super::writer::{LOOK_PERIOD, Unsynced, sync_each};
use super::*;

/// A file that the system does not bring to the disk: it knows where the file is, and may do nothing with it.
fn unsyncable(path: &Path) -> File {
    File::options().read(true).custom_flags(nix::libc::O_PATH).open(path).unwrap()
}

/// Waits until the disk has taken everything, as it says.
#[track_caller]
fn check_well_again(audit: &Audit, records_in_doubt: &str) {
    wait_for("the trail to be well", || (audit.state() == "ok").then_some(()));
    check_in_doubt(audit, records_in_doubt);
}

#[track_caller]
fn check_in_doubt(audit: &Audit, records: &str) {
    assert_eq!((audit.problems(), audit.lost()), (in_doubt(records), 0));
}

fn in_doubt(records: &str) -> Vec<String> {
    let why = "may not be on the disk, and would be lost with the power, all or some: Bad file descriptor (os error 9)";
    vec![format!("gateway: audit records {records} {why}")]
}

#[test]
fn a_disk_that_failed_to_take_a_record_is_failing_until_it_has_a_later_one_and_the_record_stays_in_doubt() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    audit.ask("pause");
    let path = folder.path().join(&names(folder.path())[0]);
    let fail = |number| {
        let (to_sync, unsynced) = sync_channel(1);
        let files = vec![unsyncable(&path), unsyncable(&path)];
        to_sync.send(Unsynced { number, files }).unwrap_or_else(|_| panic!("there is room"));
        drop(to_sync);
        sync_each(&audit.orders, &unsynced);
    };
    fail(1);
    assert_eq!(audit.state(), "failing");
    check_in_doubt(&audit, "1 to 1");
    audit.ask("abort");
    check_well_again(&audit, "1 to 1");
    // Again, and it is not forgotten which was the first.
    fail(2);
    assert_eq!(audit.state(), "failing");
    audit.ask("land");
    check_well_again(&audit, "1 to 2");
}

#[test]
fn a_file_of_a_former_day_that_the_disk_failed_to_take_is_told() {
    let folder = written(&["2020-01-01", "2020-01-01"], 9);
    let audit = Audit::open(folder.path(), 9).unwrap();
    audit.change_files(|files| files.hold(unsyncable(files.newest_path())));
    // It is in the next day's file before the former one is brought to the disk, which may take as long as the disk likes.
    assert_eq!(audit.ask("pause"), 3);
    wait_for("the disk to fail", || (audit.problems() == in_doubt("2 to 3")).then_some(()));
    assert_eq!(audit.ask("land"), 4);
    check_well_again(&audit, "2 to 3");
    assert_eq!((intact(folder.path()).last, names(folder.path()).len()), (4, 2));
}

#[test]
fn what_a_gateway_left_that_was_killed_is_brought_to_the_disk_without_an_order() {
    let (_folder, audit) = loop {
        let begin = Instant::now();
        let folder = written(&["2020-01-01", "2020-01-01"], 9);
        let audit = Audit::open(folder.path(), 9).unwrap();
        audit.change_files(|files| files.hold(unsyncable(files.newest_path())));
        // Else the first look may have come before, on a machine that is too busy.
        if begin.elapsed() < LOOK_PERIOD {
            break (folder, audit);
        }
    };
    wait_for("the first look", || (audit.state() == "failing").then_some(()));
    check_in_doubt(&audit, "2 to 2");
}
