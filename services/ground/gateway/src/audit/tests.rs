//! The audit trail over days, restarts, a full disk and hands that change it.

use std::future::Future;
use std::io::Write as _;
use std::sync::mpsc::sync_channel;

use super::found::{Fault, Trail};
use super::full_pipe::wait_for;
use super::orders::MAX_ORDERS;
use super::verify::verify;
use super::writer::Job;
use super::*;

mod failing_sync;
mod hanging_disk;

fn order(what: &str) -> AuditRecord {
    AuditRecord { who: Some("anna".into()), what: what.into(), ..Default::default() }
}

fn block_on<T>(it: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap().block_on(it)
}

impl Audit {
    /// Records an order, and waits until that is in its file.
    fn ask(&self, what: &str) -> u64 {
        let number = block_on(self.asked(&order(what)));
        self.change_files(|_| ());
        number
    }

    /// Records the end of an order, and waits until that is in its file.
    fn end(&self, asked: u64, order: AuditRecord) {
        block_on(self.ended(asked, order));
        self.change_files(|_| ());
    }

    /// Does something with the files, and waits until everything before is done and they have been looked at.
    fn change_files(&self, change: impl FnOnce(&mut DayFiles) + Send + 'static) {
        let (done, is_done) = sync_channel(1);
        match &self.lock().queue {
            Some(queue) => queue.hand_over(Job::Change(Box::new(change), done)).expect("the writer takes it"),
            None => return,
        }
        is_done.recv().unwrap();
    }
}

/// A folder with files of one line for each of `days`.
fn written(days: &[&str], most: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut number = 0;
    for day in days {
        let utc = format!("{day}T12:00:00.000Z");
        // As a gateway that is started again each time.
        let mut files = DayFiles::open(folder.path(), most, &utc, 0).unwrap();
        number = number.max(files.newest_number()) + 1;
        files.append(&AuditRecord { utc, number, ..order("pause") }).unwrap();
    }
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let name = |it: PathBuf| it.file_name().unwrap().to_string_lossy().into_owned();
    day_files::list(folder).unwrap().into_iter().map(name).collect()
}

/// The path because of which the trail in `folder` cannot be opened.
fn unusable(folder: &Path) -> PathBuf {
    match Audit::open(folder, 9).unwrap_err() {
        OpenError::Unusable(path, _) => path,
        OpenError::InUse(refusal) => panic!("{refusal}"),
    }
}

fn intact(path: &Path) -> Trail {
    verify(path).unwrap_or_else(|fault| panic!("{fault}"))
}

/// Where and why the chain breaks after `change` was made to the lines of three days.
#[track_caller]
fn check_broken(change: impl FnOnce(&mut Vec<String>), expected: &str) {
    let folder = written(&["2026-01-01", "2026-01-01", "2026-01-02", "2026-01-02", "2026-01-03"], 9);
    let path = folder.path().join("audit-2026-01-02.jsonl");
    let mut lines: Vec<String> = std::fs::read_to_string(&path).unwrap().lines().map(str::to_owned).collect();
    change(&mut lines);
    std::fs::write(&path, lines.iter().map(|it| format!("{it}\n")).collect::<String>()).unwrap();
    let fault = verify(folder.path()).unwrap_err().to_string();
    assert_eq!(fault.replace(&format!("{}/", folder.path().display()), ""), expected);
}

#[test]
fn one_record_for_each_order_stays_in_memory() {
    let audit = Audit::in_memory();
    let count = MAX_ORDERS + 5;
    for n in 0..count {
        let asked = audit.ask(&n.to_string());
        audit.end(asked, AuditRecord { status: 200, ..order(&n.to_string()) });
    }
    let under_way = audit.ask("abort");
    let newest = audit.newest(2);
    let facts: Vec<_> = newest.iter().map(|it| (it.what.as_str(), it.stage(), it.asked)).collect();
    let last = (count - 1).to_string();
    let expected = [(last.as_str(), AuditStage::Ended, Some(under_way - 2)), ("abort", AuditStage::Asked, None)];
    assert_eq!(facts, expected);
    assert_eq!(audit.newest(usize::MAX).len(), MAX_ORDERS);
}

#[test]
fn a_chain_goes_on_over_restarts_and_days_and_the_oldest_days_go() {
    let days = ["2026-01-01", "2026-01-01", "2026-01-02", "2026-01-05"];
    let folder = written(&days, 9);
    let found = intact(folder.path());
    assert_eq!((found.files, found.first, found.last, found.missing, found.torn.len()), (3, 1, 4, 0, 0));
    let folder = written(&days, 2);
    assert_eq!(names(folder.path()), ["audit-2026-01-02.jsonl", "audit-2026-01-05.jsonl"]);
    assert_eq!((intact(folder.path()).first, intact(folder.path()).last), (3, 4));
    // Any of the files alone, too.
    assert_eq!(intact(&folder.path().join("audit-2026-01-05.jsonl")).first, 4);
}

#[test]
fn a_record_whose_arguments_cannot_be_told_is_written_without_them_and_others_follow() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    let mut arguments = kittiwake_proto::json::any(&serde_json::json!([])).unwrap();
    for _ in 0..127 {
        arguments = vec![arguments].into();
    }
    let asked = block_on(audit.asked(&AuditRecord { arguments: Some(arguments.clone()), ..order("pause") }));
    audit.end(asked, AuditRecord { arguments: Some(arguments), ..order("pause") });
    audit.ask("abort");
    let found = intact(folder.path());
    assert_eq!((found.last, found.missing, audit.lost(), audit.state()), (3, 0, 0, "ok"));
}

#[test]
fn texts_of_any_length_leave_a_trail_that_is_intact_and_a_memory_that_is_small() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    let long = "ä".repeat(1 << 20);
    let (who, vehicle) = (Some(long.clone()), long.clone());
    let asked = block_on(audit.asked(&AuditRecord { who, vehicle, ..order(&long) }));
    audit.end(asked, AuditRecord { request_id: long.clone(), outcome: long, ..order("pause") });
    audit.ask("abort");
    assert_eq!((intact(folder.path()).last, audit.lost()), (3, 0));
    let outcome = &audit.newest(2)[0].outcome;
    assert!(outcome.starts_with("ää") && outcome.ends_with("ä…") && outcome.len() < 2000, "{} bytes", outcome.len());
}

#[test]
fn a_clock_that_is_set_back_begins_no_file() {
    let folder = written(&["2026-01-02", "2025-12-31", "2026-01-03"], 9);
    assert_eq!(names(folder.path()), ["audit-2026-01-02.jsonl", "audit-2026-01-03.jsonl"]);
    assert_eq!(intact(folder.path()).last, 3);
}

#[test]
fn how_much_is_written_in_a_day_removes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 1).unwrap();
    for _ in 0..5000 {
        let asked = audit.ask("pause");
        audit.end(asked, order("pause"));
    }
    assert_eq!((intact(folder.path()).first, intact(folder.path()).last), (1, 10_000));
    assert_eq!((audit.lost(), audit.state()), (0, "ok"));
}

#[test]
fn a_line_that_was_cut_off_is_told_and_the_chain_goes_on() {
    let days = ["2026-01-01", "2026-01-02", "2026-01-02"];
    let whole = std::fs::read(written(&days, 9).path().join("audit-2026-01-02.jsonl")).unwrap();
    let first = whole.iter().position(|it| *it == b'\n').unwrap() + 1;
    // Killed after each byte of the second line, and once more while the gateway starts again.
    for end in first..=whole.len() {
        let folder = written(&days, 9);
        let path = folder.path().join("audit-2026-01-02.jsonl");
        std::fs::write(&path, &whole[..end]).unwrap();
        let is_cut = first < end && end < whole.len() - 1;
        assert_eq!(intact(folder.path()).unfinished.is_some(), is_cut, "at byte {end}");
        let utc = "2026-01-03T00:00:00.000Z".to_owned();
        let mut files = DayFiles::open(folder.path(), 9, &utc, 0).unwrap();
        let number = files.newest_number() + 1;
        files.append(&AuditRecord { utc, number, ..order("resume") }).unwrap();
        let found = intact(folder.path());
        assert_eq!(
            (found.torn.len(), found.unfinished, found.missing),
            (usize::from(is_cut), None, 0),
            "at byte {end}"
        );
        assert_eq!(found.last, number);
    }
}

#[test]
fn bytes_that_are_no_text_count_as_cut_off() {
    let folder = written(&["2026-01-01"], 9);
    let path = folder.path().join("audit-2026-01-01.jsonl");
    // What a file system leaves after a power loss.
    std::fs::OpenOptions::new().append(true).open(&path).unwrap().write_all(&[0; 4096]).unwrap();
    assert_eq!(intact(folder.path()).unfinished.map(|it| (it.place.line, it.is_beginning)), Some((2, false)));
    let mut files = DayFiles::open(folder.path(), 9, "2026-01-01T13:00:00.000Z", 0).unwrap();
    let (utc, number) = ("2026-01-01T13:00:00.000Z".into(), files.newest_number() + 1);
    files.append(&AuditRecord { utc, number, ..order("pause") }).unwrap();
    assert_eq!((intact(folder.path()).torn.len(), intact(folder.path()).last), (1, 3));
}

#[test]
fn the_first_line_that_was_changed_removed_or_inserted_is_named() {
    let previous =
        "it does not carry the hash of the line before: one of the two was changed, or lines between them are gone";
    let changed = "it does not have the hash that it carries: the line was changed";
    check_broken(|it| it[0] = it[0].replace("anna", "ben"), &format!("audit-2026-01-02.jsonl:1: {changed}"));
    check_broken(|it| it[1] = it[1].replace("anna", "ben"), &format!("audit-2026-01-02.jsonl:2: {changed}"));
    check_broken(|it| drop(it.remove(0)), &format!("audit-2026-01-02.jsonl:1: {previous}"));
    check_broken(|it| it.swap(0, 1), &format!("audit-2026-01-02.jsonl:1: {previous}"));
    check_broken(|it| it.insert(1, it[0].clone()), &format!("audit-2026-01-02.jsonl:2: {previous}"));
    check_broken(Vec::clear, &format!("audit-2026-01-03.jsonl:1: {previous}"));
    let unsaid = "it is not a record, and audit-2026-01-02.jsonl:2 does not say that it was cut off";
    check_broken(|it| it[0].truncate(20), &format!("audit-2026-01-02.jsonl:1: {unsaid}"));
    check_broken(|it| it[0] = "{}".into(), "audit-2026-01-02.jsonl:1: it is not a record");
    let long = "x".repeat(2 << 20);
    check_broken(|it| it[0] = long, "audit-2026-01-02.jsonl:1: the line has more than 1048576 bytes");
}

/// What is said of two records in one file after `change` was made to its text, and that it is said again after the gateway
/// has gone on with it.
#[track_caller]
fn check_end(change: impl FnOnce(&str) -> String, expected: &str) {
    let folder = written(&["2026-01-01", "2026-01-01"], 9);
    let path = folder.path().join("audit-2026-01-01.jsonl");
    std::fs::write(&path, change(&std::fs::read_to_string(&path).unwrap())).unwrap();
    let fault = || verify(folder.path()).unwrap_err().to_string();
    assert!(fault().contains(expected), "{}", fault());
    let utc = "2026-01-01T13:00:00.000Z".to_owned();
    let mut files = DayFiles::open(folder.path(), 9, &utc, 0).unwrap();
    let number = files.newest_number() + 1;
    files.append(&AuditRecord { utc, number, ..order("resume") }).unwrap();
    let again = verify(folder.path()).unwrap_err().to_string();
    assert!(again.contains(":1: ") || again.contains(":2: ") || again.contains(":3: "), "{again}");
}

#[test]
fn a_last_line_that_was_changed_is_a_break_and_not_one_that_was_cut_off() {
    let changed = "it does not have the hash that it carries";
    check_end(
        |text| format!("{}\n", text.trim_end().rsplit_once("pause").map(|(a, b)| format!("{a}abort{b}")).unwrap()),
        changed,
    );
    // A line feed is the last thing of a line that is written.
    check_end(|text| format!("{}\n", &text[..text.len() - 10]), ":2: it is not a record, and not cut off");
    check_end(|text| format!("{text}\0\0\0\n"), ":3: it is not a record, and not cut off");
    check_end(|text| format!("{text}{{}}\n"), ":3: it is not a record");
    // No beginning of a record is whole JSON.
    check_end(|text| format!("{text}{{}}"), ":3: it is not a record");
}

#[test]
fn the_oldest_file_begins_with_its_first_record() {
    let folder = written(&["2026-01-01", "2026-01-02", "2026-01-02", "2026-01-03"], 9);
    let path = |day: &str| folder.path().join(format!("audit-2026-01-{day}.jsonl"));
    // As rotation does.
    std::fs::remove_file(path("01")).unwrap();
    assert_eq!((intact(folder.path()).first, intact(folder.path()).last), (2, 4));
    let text = std::fs::read_to_string(path("02")).unwrap();
    std::fs::write(path("02"), text.split_once('\n').unwrap().1).unwrap();
    let gone = "it is the first record and not the first one of a file: what was before it in the file is gone";
    for trail in [folder.path(), &path("02")] {
        assert_eq!(verify(trail).unwrap_err().to_string(), format!("{}:1: {gone}", path("02").display()));
    }
    let single = written(&["2026-01-01", "2026-01-01"], 9);
    let path = single.path().join("audit-2026-01-01.jsonl");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.split_once('\n').unwrap().1).unwrap();
    assert!(verify(single.path()).unwrap_err().to_string().ends_with(gone));
}

#[test]
fn a_first_line_of_a_day_that_was_cut_off_keeps_the_numbers() {
    let folder = written(&["2026-01-01", "2026-01-01", "2026-01-02"], 9);
    let path = folder.path().join("audit-2026-01-02.jsonl");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, &text[..30]).unwrap();
    let utc = "2026-01-02T13:00:00.000Z".to_owned();
    let mut files = DayFiles::open(folder.path(), 9, &utc, 0).unwrap();
    let number = files.newest_number() + 1;
    files.append(&AuditRecord { utc, number, ..order("resume") }).unwrap();
    assert_eq!((number, intact(folder.path()).last, intact(folder.path()).torn.len()), (4, 4, 1));
    // And the file says where it begins.
    std::fs::remove_file(folder.path().join("audit-2026-01-01.jsonl")).unwrap();
    assert_eq!(intact(folder.path()).first, 3);
}

#[test]
fn a_file_that_is_gone_is_begun_again_with_the_chain_of_before_and_that_is_said() {
    #[track_caller]
    fn check(change: impl FnOnce(&Path), after: (u64, &str), verified: Result<(u64, usize), &str>) {
        let folder = tempfile::tempdir().unwrap();
        let audit = Audit::open(folder.path(), 9).unwrap();
        audit.ask("pause");
        audit.ask("resume");
        assert_eq!((audit.state(), audit.problems()), ("ok", vec![]));
        let file = folder.path().join(&names(folder.path())[0]);
        change(&file);
        audit.change_files(|_| ());
        assert_eq!(audit.state(), "failing", "it is known before the next order");
        let gone = format!("gateway: {} is gone, which the next order is to be recorded in", file.display());
        assert_eq!(audit.problems(), [gone]);
        assert_eq!(audit.ask("abort"), 3);
        assert_eq!((audit.lost(), audit.state()), after);
        // Either it has gone on elsewhere, or it cannot: one problem in both cases.
        let problems = audit.problems();
        let said = if after.0 == 0 { file.to_string_lossy().into_owned() } else { "without a record".to_owned() };
        assert!(problems.len() == 1 && problems[0].contains(&said), "{problems:?}");
        let found = verify(folder.path()).map(|it| (it.first, it.lost.len())).map_err(|it| it.to_string());
        match (found, verified) {
            (Err(found), Err(expected)) => assert!(found.contains(expected), "{found}"),
            (found, verified) => assert_eq!(found.unwrap(), verified.unwrap()),
        }
    }
    check(|file| std::fs::remove_file(file).unwrap(), (0, "ok"), Ok((3, 1)));
    check(|file| std::fs::rename(file, file.with_extension("jsonl.1")).unwrap(), (0, "ok"), Ok((3, 1)));
    // A file with the same lines goes on, as after an editor that saves by renaming; also if its end is missing.
    let again = |file: &Path, cut: usize| {
        let text = std::fs::read_to_string(file).unwrap();
        std::fs::rename(file, file.with_extension("1")).unwrap();
        std::fs::write(file, &text[..text.len() - cut]).unwrap();
    };
    check(|file| again(file, 0), (0, "ok"), Ok((1, 0)));
    check(|file| again(file, 1), (0, "ok"), Ok((1, 0)));
    check(|file| again(file, 20), (0, "ok"), Err(":2: it is not a record"));
    check(|file| std::fs::remove_dir_all(file.parent().unwrap()).unwrap(), (1, "failing"), Err("No such file"));
    check(
        |file| {
            std::fs::remove_file(file).unwrap();
            std::fs::create_dir(file).unwrap();
        },
        (1, "failing"),
        Err("it is a folder, not a regular file"),
    );
}

#[test]
fn a_pipe_or_a_device_is_no_audit_trail_and_holds_nothing_up() {
    assert!(verify(Path::new("/dev/zero")).unwrap_err().to_string().contains("not a regular file"));
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("audit-2026-01-01.jsonl");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for trail in [folder.path(), &pipe] {
        assert!(verify(trail).unwrap_err().to_string().contains("not a regular file"));
    }
    assert_eq!(unusable(folder.path()), pipe);
}

#[test]
fn a_trail_that_is_not_there_is_no_intact_one() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(verify(folder.path()), Err(Fault::Empty(_))));
    assert!(matches!(verify(&folder.path().join("absent")), Err(Fault::Unreadable(..))));
    // As a gateway leaves it that was given no order.
    Audit::open(folder.path(), 9).unwrap();
    assert_eq!((intact(folder.path()).files, intact(folder.path()).last), (1, 0));
}

#[test]
fn a_folder_that_cannot_be_written_is_named_at_the_start_and_orders_go_on_afterwards() {
    let folder = tempfile::tempdir().unwrap();
    let gone = folder.path().join("gone");
    assert_eq!(unusable(&gone), gone);
    std::fs::create_dir(&gone).unwrap();
    let audit = Audit::open(&gone, 9).unwrap();
    assert_eq!(audit.ask("pause"), 1);
    assert_eq!((audit.lost(), audit.state()), (0, "ok"));
    // Every write to this device fails as on a full disk.
    audit.change_files(|files| files.write_to("/dev/full"));
    let asked = audit.ask("abort");
    assert_eq!((audit.lost(), audit.state(), audit.newest(1)[0].what.as_str()), (1, "failing", "abort"));
    let problem = "gateway: orders are carried out without a record: No space left on device (os error 28) (audit records lost so far: 1)";
    assert_eq!(audit.problems(), [problem]);
    // There is room again: the chain has a gap in its numbers and no break.
    audit.end(asked, order("abort"));
    assert_eq!((audit.lost(), audit.state(), audit.problems()), (1, "ok", vec![]));
    assert_eq!((intact(&gone).last, intact(&gone).missing), (3, 1));
}

#[test]
fn what_a_full_disk_kept_out_is_missed_also_after_the_gateway_was_killed() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    audit.ask("pause");
    audit.change_files(|files| files.write_to("/dev/full"));
    audit.ask("abort");
    drop(audit);
    let said = |found: Trail| (found.first, found.last, found.missing);
    assert_eq!(said(intact(folder.path())), (1, 1, 1));
    let audit = Audit::open(folder.path(), 9).unwrap();
    assert_eq!(audit.ask("land"), 3);
    assert_eq!(said(intact(folder.path())), (1, 3, 1));
    drop(audit);
    assert!(!intact(folder.path()).is_intact());
}

/// Three records of two days, as a gateway with `last-audit-number` leaves them, after `change` was made to the folder.
fn changed(change: impl FnOnce(&Path)) -> Trail {
    let folder = written(&["2026-01-01", "2026-01-01", "2026-01-02"], 9);
    given::GivenNumber::open(folder.path()).unwrap().0.set(3).unwrap();
    change(folder.path());
    intact(folder.path())
}

#[test]
fn records_that_are_missing_from_the_end_are_counted_or_it_is_said_that_they_cannot_be() {
    #[track_caller]
    fn check(change: impl FnOnce(&Path), missing: u64, open_end: Option<&str>) {
        let found = changed(change);
        let said = (found.missing, found.is_intact(), found.open_end.as_deref());
        assert_eq!(said, (missing, missing == 0, open_end));
    }
    let newest = |it: &Path| it.join("audit-2026-01-02.jsonl");
    let number = |it: &Path| it.join("last-audit-number");
    check(|_| (), 0, None);
    check(|it| std::fs::write(newest(it), "").unwrap(), 1, None);
    check(|it| std::fs::remove_file(newest(it)).unwrap(), 1, None);
    // All of them, and the folder as of a gateway that was given no order.
    let empty = |it: &Path| {
        std::fs::remove_file(newest(it)).unwrap();
        std::fs::write(it.join("audit-2026-01-01.jsonl"), "").unwrap();
    };
    check(empty, 3, None);
    // A line that was cut off counts as a missing record, no matter who cut it.
    let cut = |it: &Path, rest: &[u8]| {
        let text = std::fs::read(newest(it)).unwrap();
        std::fs::write(newest(it), [&text[..40], rest].concat()).unwrap();
    };
    check(|it| cut(it, b""), 1, None);
    check(|it| cut(it, b"\0\0"), 1, None);
    let begun = |it: &Path| {
        let path = it.join("audit-2026-01-01.jsonl");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(path, format!("{}\n{{", text.split_once('\n').unwrap().0)).unwrap();
        std::fs::remove_file(newest(it)).unwrap();
    };
    check(begun, 2, None);
    let gone = Some("is missing or empty, though there are records");
    check(|it| std::fs::remove_file(number(it)).unwrap(), 0, gone);
    check(|it| std::fs::write(number(it), "").unwrap(), 0, gone);
    check(|it| std::fs::write(number(it), "many").unwrap(), 0, Some("is not a number"));
    let less = Some("says 2, less than the last record's number 3");
    check(|it| std::fs::write(number(it), format!("{:020}\n", 2)).unwrap(), 0, less);
    check(|it| (empty(it), std::fs::remove_file(number(it)).unwrap()).1, 0, None);
}

#[test]
fn a_record_that_was_cut_off_is_missed_also_after_the_gateway_was_started_again() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    audit.ask("pause");
    audit.ask("abort");
    drop(audit);
    let file = folder.path().join(&names(folder.path())[0]);
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, &text[..text.len() - 3]).unwrap();
    let said = |trail: &Path| (intact(trail).last, intact(trail).missing);
    assert_eq!((said(folder.path()), said(&file)), ((1, 1), (1, 1)));
    let audit = Audit::open(folder.path(), 9).unwrap();
    assert_eq!((said(folder.path()), intact(folder.path()).open_end), ((3, 1), None));
    assert_eq!(audit.ask("land"), 4);
    assert_eq!((said(folder.path()), intact(folder.path()).torn.len()), ((4, 1), 1));
}

#[test]
fn records_that_were_lost_while_the_gateway_wrote_are_missing() {
    #[track_caller]
    fn check(next: u64, expected_missing: u64) {
        let folder = written(&["2026-01-01", "2026-01-01"], 9);
        let utc = "2026-01-01T13:00:00.000Z".to_owned();
        let mut files = DayFiles::open(folder.path(), 9, &utc, 2).unwrap();
        files.leave_part("{\"number\":\"3");
        for number in [next, next + 1] {
            files.append(&AuditRecord { utc: utc.clone(), number, ..order("land") }).unwrap();
        }
        let found = intact(folder.path());
        assert_eq!((found.last, found.missing, found.torn.len()), (next + 1, expected_missing, 1));
    }
    check(4, 1);
    check(7, 4);
}

#[test]
fn a_file_with_the_name_of_another_day_than_its_records_is_named() {
    #[track_caller]
    fn check(from: &str, to: &str, expected: &[&str]) {
        let path = |folder: &Path, day: &str| folder.join(format!("audit-2026-01-{day}.jsonl"));
        let found = changed(|it| std::fs::rename(path(it, from), path(it, to)).unwrap());
        let said: Vec<_> = found.misdated.iter().map(|it| it.day.as_str()).collect();
        assert_eq!((said.as_slice(), found.is_intact()), (expected, true));
    }
    check("01", "01", &[]);
    check("02", "05", &["2026-01-02"]);
    check("01", "00", &["2026-01-01"]);
    // The record of a line that was cut off on another day goes into the file with that line.
    let folder = written(&["2026-01-01"], 9);
    let path = folder.path().join("audit-2026-01-01.jsonl");
    std::fs::OpenOptions::new().append(true).open(&path).unwrap().write_all(b"{").unwrap();
    DayFiles::open(folder.path(), 9, "2026-01-09T12:00:00.000Z", 0).unwrap();
    assert_eq!(intact(folder.path()).misdated, []);
}

#[test]
fn one_gateway_at_a_time_writes_a_trail() {
    let folder = tempfile::tempdir().unwrap();
    let first = Audit::open(folder.path(), 9).unwrap();
    first.ask("pause");
    let refusal = Audit::open(folder.path(), 9).unwrap_err();
    assert!(matches!(refusal, OpenError::InUse(_)), "{refusal}");
    let said = format!(
        "the audit trail in {} is in use by another process: end that one, or name another access folder",
        folder.path().display()
    );
    assert_eq!(refusal.to_string(), said);
    // A mere reader is not kept away.
    assert_eq!(intact(folder.path()).last, 1);
    drop(first);
    let second = Audit::open(folder.path(), 9).unwrap();
    assert_eq!(second.ask("resume"), 2);
    assert_eq!(intact(folder.path()).last, 2);
}

#[test]
fn a_trail_that_cannot_be_locked_is_written_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("audit.lock")).unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    assert_eq!(audit.ask("pause"), 1);
    assert_eq!((audit.state(), intact(folder.path()).last), ("ok", 1));
}

#[test]
fn the_writer_notices_by_itself_that_a_file_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    assert_eq!(audit.state(), "ok");
    std::fs::remove_file(folder.path().join(&names(folder.path())[0])).unwrap();
    wait_for("the trail to fail", || (audit.state() == "failing").then_some(()));
}
