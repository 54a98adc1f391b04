//! The audit trail over days, restarts, a full disk and hands that change it.

use std::io::Write as _;

use super::verify::{Fault, Intact, verify};
use super::*;

fn order(what: &str) -> AuditRecord {
    AuditRecord { who: Some("anna".into()), what: what.into(), ..Default::default() }
}

/// A folder with files of one line for each of `days`.
fn written(days: &[&str], most: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut number = 0;
    for day in days {
        let utc = format!("{day}T12:00:00.000Z");
        // As a gateway that is started again each time.
        let mut files = DayFiles::open(folder.path(), most, &utc).unwrap();
        number = number.max(files.newest_number()) + 1;
        files.append(&AuditRecord { utc, number, ..order("pause") }).unwrap();
    }
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let name = |it: PathBuf| it.file_name().unwrap().to_string_lossy().into_owned();
    day_files::list(folder).unwrap().into_iter().map(name).collect()
}

fn intact(path: &Path) -> Intact {
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
        let asked = audit.asked(&order(&n.to_string()));
        audit.ended(asked, AuditRecord { status: 200, ..order(&n.to_string()) });
    }
    let under_way = audit.asked(&order("abort"));
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
    assert_eq!((found.files, found.first, found.last, found.unwritten, found.torn.len()), (3, 1, 4, 0, 0));
    let folder = written(&days, 2);
    assert_eq!(names(folder.path()), ["audit-2026-01-02.jsonl", "audit-2026-01-05.jsonl"]);
    assert_eq!((intact(folder.path()).first, intact(folder.path()).last), (3, 4));
    // Any of the files alone, too.
    assert_eq!(intact(&folder.path().join("audit-2026-01-05.jsonl")).first, 4);
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
        let asked = audit.asked(&order("pause"));
        audit.ended(asked, order("pause"));
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
        let mut files = DayFiles::open(folder.path(), 9, &utc).unwrap();
        let number = files.newest_number() + 1;
        files.append(&AuditRecord { utc, number, ..order("resume") }).unwrap();
        let found = intact(folder.path());
        assert_eq!(
            (found.torn.len(), found.unfinished, found.unwritten),
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
    assert_eq!(intact(folder.path()).unfinished.map(|it| it.line), Some(2));
    let mut files = DayFiles::open(folder.path(), 9, "2026-01-01T13:00:00.000Z").unwrap();
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
    let unsaid = "it is no record, and audit-2026-01-02.jsonl:2 does not say that it was cut off";
    check_broken(|it| it[0].truncate(20), &format!("audit-2026-01-02.jsonl:1: {unsaid}"));
    check_broken(|it| it[0] = "{}".into(), "audit-2026-01-02.jsonl:1: it is no record");
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
    let mut files = DayFiles::open(folder.path(), 9, &utc).unwrap();
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
    check_end(|text| format!("{}\n", &text[..text.len() - 10]), ":2: it is no record, and not cut off");
    check_end(|text| format!("{text}\0\0\0\n"), ":3: it is no record, and not cut off");
    check_end(|text| format!("{text}{{}}\n"), ":3: it is no record");
    // No beginning of a record is whole JSON.
    check_end(|text| format!("{text}{{}}"), ":3: it is no record");
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
    let mut files = DayFiles::open(folder.path(), 9, &utc).unwrap();
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
        audit.asked(&order("pause"));
        audit.asked(&order("resume"));
        assert_eq!((audit.state(), audit.problem()), ("ok", None));
        let file = folder.path().join(&names(folder.path())[0]);
        change(&file);
        assert_eq!(audit.state(), "failing", "it is known before the next order");
        assert_eq!(audit.asked(&order("abort")), 3);
        assert_eq!((audit.lost(), audit.state()), after);
        let said = audit.problem().is_some_and(|it| it.contains(&*file.to_string_lossy()));
        assert_eq!(said, after.0 == 0);
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
    check(|file| again(file, 20), (0, "ok"), Err(":2: it is no record"));
    check(|file| std::fs::remove_dir_all(file.parent().unwrap()).unwrap(), (1, "failing"), Err("No such file"));
    check(
        |file| {
            std::fs::remove_file(file).unwrap();
            std::fs::create_dir(file).unwrap();
        },
        (1, "failing"),
        Err("is no regular file"),
    );
}

#[test]
fn a_pipe_or_a_device_is_no_audit_trail_and_holds_nothing_up() {
    assert!(verify(Path::new("/dev/zero")).unwrap_err().to_string().contains("is no regular file"));
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("audit-2026-01-01.jsonl");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for trail in [folder.path(), &pipe] {
        assert!(verify(trail).unwrap_err().to_string().contains("is no regular file"));
    }
    assert_eq!(Audit::open(folder.path(), 9).unwrap_err().0, pipe);
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
    assert_eq!(Audit::open(&gone, 9).unwrap_err().0, gone);
    std::fs::create_dir(&gone).unwrap();
    let audit = Audit::open(&gone, 9).unwrap();
    assert_eq!(audit.asked(&order("pause")), 1);
    assert_eq!((audit.lost(), audit.state()), (0, "ok"));
    // Every write to this device fails as on a full disk.
    audit.lock().files.as_mut().unwrap().write_to("/dev/full");
    let asked = audit.asked(&order("abort"));
    assert_eq!((audit.lost(), audit.state(), audit.newest(1)[0].what.as_str()), (1, "failing", "abort"));
    // There is room again: the chain has a gap in its numbers and no break.
    audit.ended(asked, order("abort"));
    assert_eq!((audit.lost(), audit.state()), (1, "ok"));
    assert_eq!((intact(&gone).last, intact(&gone).unwritten), (3, 1));
}
