//! The audit trail on a disk that takes nothing for a while and reports no error.

use std::sync::mpsc::sync_channel;

use serde_json::Value;

use super::super::full_pipe::{FullPipe, wait_for};
use super::super::orders::{MAX_ORDERS, MAX_WAITING};
use super::super::writer::Job;
use super::super::*;
use super::{block_on, intact, order};

/// An audit trail whose disk has just begun to hang: its files are a full pipe.
fn hanging(folder: &Path) -> (Audit, FullPipe) {
    let audit = Audit::open(folder, 9).unwrap();
    let pipe = FullPipe::new(folder);
    let path = pipe.path.to_str().unwrap().to_owned();
    audit.change_files(move |files| files.write_to(&path));
    (audit, pipe)
}

fn texts(records: &[Value], member: &str) -> Vec<String> {
    records.iter().map(|it| it[member].as_str().unwrap_or_default().to_owned()).collect()
}

#[test]
fn a_disk_that_hangs_holds_no_order_up_and_takes_what_waited_in_order_when_it_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let (audit, mut pipe) = hanging(folder.path());
    assert_eq!((audit.state(), audit.problems()), ("ok", vec![]));
    let asked = block_on(audit.asked(&order("pause")));
    assert_eq!((asked, audit.state(), audit.newest(1)[0].what.as_str()), (1, "failing", "pause"));
    let problems = audit.problems();
    assert!(problems.len() == 1 && problems[0].contains("the disk of the audit trail has not answered for"));
    assert!(problems[0].ends_with("(records that wait for it: 1)"), "{problems:?}");
    // From then on nothing waits for it: these would take minutes.
    for n in 2..=500 {
        assert_eq!(block_on(audit.asked(&order("abort"))), n);
    }
    audit.refusals.record(Default::default());
    assert_eq!((audit.newest(1)[0].number, audit.lost(), audit.state()), (500, 0, "failing"));
    let goes_on = utc();
    let lines = pipe.lines(500);
    assert_eq!(texts(&lines, "number"), (1..=500).map(|n| n.to_string()).collect::<Vec<_>>());
    assert_eq!(texts(&lines[..2], "what"), ["pause", "abort"]);
    assert!(texts(&lines, "utc").into_iter().all(|utc| utc <= goes_on), "each has the time at which it was asked");
    wait_for("the trail to be well", || (audit.state() == "ok").then_some(()));
    assert_eq!((audit.problems(), audit.lost()), (vec![], 0));
    // And a client that waits for a record gets its number again.
    assert_eq!(audit.ask("land"), 501);
    assert_eq!(texts(&pipe.lines(501)[500..], "what"), ["land"]);
}

#[test]
fn what_has_no_room_to_wait_for_the_disk_is_lost_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let (audit, mut pipe) = hanging(folder.path());
    block_on(audit.asked(&order("pause")));
    // One is being written.
    let fits = 1 + MAX_WAITING;
    for _ in 1..fits + 7 {
        block_on(audit.asked(&order("abort")));
    }
    assert_eq!((audit.lost(), audit.state(), audit.newest(MAX_ORDERS).len()), (7, "failing", MAX_ORDERS));
    let full = "orders are carried out without a record: 1024 records wait for the disk already (audit records lost so far: 7)";
    assert!(audit.problems()[0].ends_with(full), "{:?}", audit.problems());
    assert_eq!(pipe.lines(fits).len(), fits);
    wait_for("the trail to be well", || (audit.state() == "ok").then_some(()));
    // The numbers go on after those that are lost, also if no order follows.
    let given = || given::in_folder(folder.path()).unwrap();
    wait_for("the number that was given last", || (given() == Given::Number(fits as u64 + 7)).then_some(()));
}

#[test]
fn a_gateway_whose_disk_hangs_ends_and_keeps_others_away_until_its_records_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let (audit, mut pipe) = hanging(folder.path());
    block_on(audit.asked(&order("pause")));
    block_on(audit.asked(&order("abort")));
    drop(audit);
    assert!(matches!(Audit::open(folder.path(), 9), Err(OpenError::InUse(_))));
    assert_eq!(texts(&pipe.lines(2), "what"), ["pause", "abort"]);
    wait_for("the lock", || Audit::open(folder.path(), 9).ok());
}

#[test]
fn what_waits_when_the_gateway_ends_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let audit = Audit::open(folder.path(), 9).unwrap();
    let (go_on, gate) = sync_channel::<()>(0);
    let (done, _) = sync_channel(1);
    let hang = move |_: &mut DayFiles| assert!(gate.recv().is_err());
    audit.lock().queue.as_ref().unwrap().hand_over(Job::Change(Box::new(hang), done)).unwrap();
    block_on(audit.asked(&order("pause")));
    block_on(audit.asked(&order("abort")));
    assert_eq!(intact(folder.path()).last, 0);
    drop(go_on);
    audit.close();
    assert_eq!((intact(folder.path()).last, intact(folder.path()).missing), (2, 0));
}

/// Over HTTP, where two threads answer all requests.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn orders_and_health_are_answered_while_the_disk_hangs() {
    use axum::body::Body;
    use axum::http::Request;
    use domain::file::Source;
    use domain::time::{Now, Pace};
    use node::{Event, Node as _};
    use tower::ServiceExt as _;

    use crate::access::{Role, Tokens, entry};
    use crate::{AccessControl, Gateway};

    let folder = tempfile::tempdir().unwrap();
    let (audit, mut pipe) = hanging(folder.path());
    let tokens = Source { path: "tokens".into(), text: entry("anna", &[Role::Operator], "token") };
    let access = AccessControl { tokens: Tokens::parse(&tokens).unwrap(), audit };
    let config = toml::from_str(include_str!("../../../tests/world/config.toml")).unwrap();
    let (mut gateway, api) = Gateway::new(&config, Pace::REAL_TIME, access, &Default::default(), || {});
    let status = kittiwake_proto::v1::VehicleStatus::default().into();
    gateway.on(Now::default(), Event::Message { vehicle: "uav1".into(), message: status }, &mut Vec::new());
    gateway.act(Now::default(), &mut Vec::new());
    let (_closing, closed) = tokio::sync::watch::channel(());
    let router = crate::http::router(api.clone(), closed);
    let send = async |method: &str, path: &str, token: &str| {
        let request = Request::builder().method(method).uri(path).header("authorization", format!("Bearer {token}"));
        let request = request.header("idempotency-key", "k").body(Body::empty()).unwrap();
        router.clone().oneshot(request).await.unwrap().status().as_u16()
    };
    for _ in 0..20 {
        assert_eq!(send("POST", "/api/v1/vehicles/uav1/command/take", "token").await, 200);
        assert_eq!(send("POST", "/api/v1/vehicles/uav1/command/take", "strange").await, 401);
        assert_eq!(send("GET", "/healthz", "").await, 200);
        assert_eq!(send("GET", "/metrics", "token").await, 200);
    }
    assert_eq!(api.audit.state(), "failing");
    assert_eq!(texts(&pipe.lines(40)[..2], "stage"), ["AUDIT_STAGE_ASKED", "AUDIT_STAGE_ENDED"]);
}

#[test]
fn a_disk_that_hangs_when_the_files_are_opened_is_given_up_and_what_it_opens_later_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    let (path, (go_on, hangs)) = (folder.path().to_owned(), sync_channel::<()>(0));
    let open = move || {
        let _ = hangs.recv();
        Audit::open(&path, 9)
    };
    let refused = within(Duration::from_millis(1), folder.path(), open).map(drop).unwrap_err().to_string();
    assert!(refused.ends_with("the disk does not answer"), "{refused}");
    go_on.send(()).unwrap();
    wait_for("the lock to be free again", || in_use::check_free(folder.path()).ok());
    let audit = wait_for("another to be opened", || Audit::open_within(folder.path(), 9, Duration::from_secs(20)).ok());
    assert_eq!((audit.state(), audit.problems()), ("ok", vec![]));
}
