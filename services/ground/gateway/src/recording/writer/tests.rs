//! What is written into the folder, and what the index shows.

use std::hash::{BuildHasher as _, BuildHasherDefault, DefaultHasher};
use std::path::Path;

use domain::time::Now;
use kittiwake_proto::json::to_json;
use kittiwake_proto::topics::Message;
use kittiwake_proto::v1;
use serde_json::{Value, json};

use super::*;
use crate::recording::index::RecordingIndex;

const NO_LIMITS: Limits = Limits { files: 99, total: u64::MAX, each: u64::MAX };
const FLUSH: Duration = Duration::from_secs(1);
/// 2026-01-01.
const BEGAN: i64 = 1_767_225_600_000;

fn header(number: u64) -> Arc<RecordingHeader> {
    let began = Now { utc_ms: BEGAN + 1000 * number as i64, ..Now::default() };
    Arc::new(RecordingHeader { number, vehicle: "uav1".into(), began, speed: 1.0 })
}

fn message(header: &Arc<RecordingHeader>, message: impl Into<Message>) -> WriteJob {
    let message = message.into();
    let (topic, bytes) = (message.topic(), message.encode());
    WriteJob::Message(header.clone(), RecordedMessage { topic, utc_ms: header.began.utc_ms + 500, bytes })
}

fn decision(header: &Arc<RecordingHeader>, text: &str) -> WriteJob {
    message(header, v1::DecisionRecord { text: text.into(), ..Default::default() })
}

fn writer(folder: &Path, limits: Limits) -> (Writer, Arc<WriterStatus>) {
    let status = Arc::new(WriterStatus::default());
    (Writer::new(folder.to_owned(), limits, FLUSH, status.clone()), status)
}

fn recording(folder: &Path, id: &str) -> Value {
    to_json(&RecordingIndex::new(folder.to_owned()).recording(&id.parse().unwrap()).unwrap())
}

/// Each recording's name without what they share, its state and its outcome.
#[track_caller]
fn check(folder: &Path, expected: &[(&str, &str, Value)]) {
    let list = RecordingIndex::new(folder.to_owned()).list().unwrap();
    let shown = list.iter().map(|it| {
        let outcome = to_json(it).get("outcome").cloned().unwrap_or_default();
        (it.id.replace("20260101T0000", "").replace("000Z-uav1", ""), it.state.clone(), outcome)
    });
    let expected = expected.iter().map(|(id, state, outcome)| (id.to_string(), state.to_string(), outcome.clone()));
    assert_eq!(shown.collect::<Vec<_>>(), expected.collect::<Vec<_>>(), "{list:#?}");
}

#[test]
fn a_recording_is_live_while_it_is_written_and_complete_with_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, status) = writer(folder.path(), NO_LIMITS);
    let (now, first) = (Instant::now(), header(1));
    check(folder.path(), &[]);
    writer.on(message(&first, v1::MissionStatus { mission: "reference".into(), ..Default::default() }), now);
    writer.on(decision(&first, "takeoff"), now);
    writer.flush_due(now + FLUSH);
    check(folder.path(), &[("01", "recording", Value::Null)]);
    let report = v1::MissionReport { outcome: v1::MissionOutcome::Success.into(), ..Default::default() };
    writer.on(message(&first, v1::McmStatus { report: Some(report), ..Default::default() }), now);
    writer.on(WriteJob::End(first.clone()), now);
    check(folder.path(), &[("01", "complete", json!("MISSION_OUTCOME_SUCCESS"))]);
    // The same moment again gets another name.
    writer.on(decision(&first, "again"), now);
    check(folder.path(), &[("01-2", "recording", Value::Null), ("01", "complete", json!("MISSION_OUTCOME_SUCCESS"))]);
    assert_eq!((status.dropped(), status.problem()), (0, None));
}

#[test]
fn the_recording_of_a_killed_gateway_is_read_and_shown_as_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, _) = writer(folder.path(), NO_LIMITS);
    let (now, first) = (Instant::now(), header(1));
    writer.on(decision(&first, "takeoff"), now);
    writer.flush_due(now + FLUSH);
    writer.on(decision(&first, "lost"), now);
    // The state after a kill: the collected bytes and the lock are gone.
    drop(writer);
    let summary = recording(folder.path(), "20260101T000001000Z-uav1");
    assert_eq!(summary["state"], "damaged");
    assert!(summary["problem"].as_str().unwrap().starts_with("the file ends early"), "{summary}");
    assert_eq!((&summary["vehicle"], &summary["decisions"][0]["text"]), (&json!("uav1"), &json!("Takeoff.")));
    assert_eq!(summary["decisions"].as_array().unwrap().len(), 1);
}

#[test]
fn the_folder_stays_within_its_limits_and_files_of_others_stay() {
    let folder = tempfile::tempdir().unwrap();
    for mine in ["flight.mcap", "notes.txt"] {
        std::fs::write(folder.path().join(mine), "mine").unwrap();
    }
    let (mut writer, _) = writer(folder.path(), Limits { files: 2, ..NO_LIMITS });
    for number in 1..=4 {
        writer.on(decision(&header(number), "x"), Instant::now());
        writer.on(WriteJob::End(header(number)), Instant::now());
    }
    check(
        folder.path(),
        &[("flight", "damaged", Value::Null), ("04", "complete", Value::Null), ("03", "complete", Value::Null)],
    );
    assert!(folder.path().join("notes.txt").exists());
}

#[test]
fn a_flight_that_has_just_ended_outlasts_older_ones_although_the_clock_stands_in_the_past() {
    let folder = tempfile::tempdir().unwrap();
    for earlier in ["20300101T000000000Z-uav1.mcap", "20310101T000000000Z-uav1.mcap"] {
        std::fs::write(folder.path().join(earlier), "flown while the clock was right").unwrap();
    }
    let (mut writer, _) = writer(folder.path(), Limits { files: 2, ..NO_LIMITS });
    for number in 1..=3 {
        writer.on(decision(&header(number), "x"), Instant::now());
        writer.on(WriteJob::End(header(number)), Instant::now());
    }
    check(folder.path(), &[("03", "complete", Value::Null), ("02", "complete", Value::Null)]);
    assert_eq!(writer.begun.len(), 2, "those that were removed are forgotten");
}

#[test]
fn a_recording_that_is_too_long_ends_and_takes_no_more_messages() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, status) = writer(folder.path(), Limits { each: 150_000, ..NO_LIMITS });
    let mut now = Instant::now();
    for number in 0..200_u64 {
        // Random figures, which compression does not make much shorter than half.
        let random = |at: u64| format!("{:016x}", BuildHasherDefault::<DefaultHasher>::new().hash_one((number, at)));
        writer.on(decision(&header(1), &(0..125).map(random).collect::<String>()), now);
        now += FLUSH;
        writer.flush_due(now);
    }
    check(folder.path(), &[("01", "complete", Value::Null)]);
    let size = std::fs::metadata(folder.path().join("20260101T000001000Z-uav1.mcap")).unwrap().len();
    assert!(150_000 < size && size < 250_000, "{size}");
    let recorded = recording(folder.path(), "20260101T000001000Z-uav1")["messages"].as_u64().unwrap();
    assert!(50 < recorded, "{recorded}");
    assert_eq!(recorded + status.dropped(), 200);
    // The next mission is recorded again.
    writer.on(WriteJob::End(header(1)), now);
    writer.on(decision(&header(2), "x"), now);
    writer.on(WriteJob::End(header(2)), now);
    check(folder.path(), &[("02", "complete", Value::Null), ("01", "complete", Value::Null)]);
}

#[test]
fn what_cannot_be_written_is_counted_reported_and_tried_again() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("recordings");
    std::fs::write(&folder, "a file where the folder should be").unwrap();
    let (mut writer, status) = writer(&folder, NO_LIMITS);
    let (mut now, first) = (Instant::now(), header(1));
    (0..3).for_each(|_| writer.on(decision(&first, "lost"), now));
    assert_eq!(status.dropped(), 3);
    assert!(status.problem().is_some());
    std::fs::remove_file(&folder).unwrap();
    now += Duration::from_secs(60);
    writer.on(decision(&first, "recorded"), now);
    writer.flush_due(now + FLUSH);
    assert_eq!((status.dropped(), status.problem()), (3, None));
    writer.on(WriteJob::End(first), now);
    check(&folder, &[("01", "complete", Value::Null)]);
}

#[test]
fn a_recording_that_is_gone_is_begun_again_and_that_is_said() {
    #[track_caller]
    fn case(change: impl FnOnce(&Path)) {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("recordings");
        let (mut writer, status) = writer(&folder, NO_LIMITS);
        let (mut now, first) = (Instant::now(), header(1));
        writer.on(decision(&first, "takeoff"), now);
        now += FLUSH;
        writer.flush_due(now);
        change(&folder);
        writer.on(decision(&first, "lost"), now);
        now += FLUSH;
        writer.flush_due(now);
        assert!(status.problem().is_some_and(|it| it.contains("was removed, renamed or replaced")));
        writer.on(decision(&first, "land"), now);
        now += FLUSH;
        writer.flush_due(now);
        assert_eq!(status.problem(), None);
        writer.on(WriteJob::End(first), now);
        check(&folder, &[("01", "complete", Value::Null)]);
        let recorded = recording(&folder, "20260101T000001000Z-uav1");
        assert_eq!(recorded["decisions"][0]["text"], "Land.");
    }
    case(|folder| std::fs::remove_dir_all(folder).unwrap());
    case(|folder| std::fs::remove_file(folder.join("20260101T000001000Z-uav1.mcap")).unwrap());
    case(|folder| std::fs::rename(folder, folder.with_extension("old")).unwrap());
}

#[test]
fn the_end_of_a_recording_that_is_gone_is_said_too() {
    let folder = tempfile::tempdir().unwrap();
    let (mut writer, status) = writer(folder.path(), NO_LIMITS);
    let (now, first) = (Instant::now(), header(1));
    writer.on(decision(&first, "takeoff"), now);
    std::fs::remove_file(folder.path().join("20260101T000001000Z-uav1.mcap")).unwrap();
    writer.on(WriteJob::End(first), now);
    assert!(status.problem().is_some());
}
