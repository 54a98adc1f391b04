//! Two ends in one thread, each turn of whose loops is the test's.

use std::path::Path;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Request};
use kittiwake_proto::v1;
use node::{Effect, Token};

use super::*;
use crate::inbox::OpenQueries;
use crate::mailbox::Mailbox;
use crate::wake::Wake;

/// Listens to flags and answers requests for permissions, or does neither.
struct Listener(bool);

impl Node for Listener {
    fn name(&self) -> &'static str {
        "probe"
    }
    fn subscriptions(&self) -> &'static [Topic] {
        if self.0 { &[Topic::FlagEvent, Topic::BatteryStatus] } else { &[] }
    }
    fn serves(&self) -> &'static [Service] {
        if self.0 { &[Service::Permission] } else { &[] }
    }
    fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}
    fn deadline(&self) -> Option<Time> {
        None
    }
}

struct End {
    links: Links,
    mailbox: Mailbox,
    open: OpenQueries,
}

impl End {
    fn of(vehicle: &str, folder: &Path, listen: Option<&str>, connect: &[&str]) -> Result<End, BusError> {
        let mailbox = Mailbox::new(&Wake::new().unwrap());
        let inbox = Inbox::new(&Scope::Vehicle(vehicle.to_owned()), mailbox.clone());
        let connect = connect.iter().map(|it| (*it).to_owned()).collect();
        let direct = Direct { folder: folder.to_owned(), listen: listen.map(str::to_owned), connect };
        let open = inbox.open().clone();
        Ok(End { links: Links::open(&direct, &Listener(listen.is_some()), inbox)?, mailbox, open })
    }

    /// The answering end.
    fn far(folder: &Path) -> End {
        End::of("uav1", folder, Some("far"), &[]).unwrap()
    }

    /// The calling end.
    fn near(folder: &Path) -> End {
        End::of("uav1", folder, None, &["far"]).unwrap()
    }

    /// A turn of its loop.
    fn turn(&mut self) -> Vec<Mail> {
        self.links.call();
        self.links.read();
        let mut batch = Vec::new();
        self.mailbox.take(&mut batch);
        batch
    }

    fn ask(&mut self, call: u64) -> bool {
        let request = Request::Permission(v1::PermissionRequest { area: "A".into(), ..Default::default() });
        self.links.ask(Service::Permission, (CallId(call), 1), &[], &request.encode())
    }

    fn flag(&mut self, number: u64) {
        let flag = Message::FlagEvent(v1::FlagEvent { name: number.to_string(), ..Default::default() });
        self.links.send(Topic::FlagEvent, &attachment(number), &flag.encode());
    }
}

fn attachment(sequence: u64) -> Vec<u8> {
    v1::Attachment { sequence, publisher: 7, ..Default::default() }.encode_to_vec()
}

/// Ends that know each other.
fn linked(folder: &Path) -> (End, End) {
    let (mut far, mut near) = (End::far(folder), End::near(folder));
    greet(&mut far, &mut near);
    (far, near)
}

fn greet(far: &mut End, near: &mut End) {
    near.turn();
    far.turn();
    near.turn();
}

fn flags(mails: &[Mail]) -> Vec<String> {
    let name = |mail: &Mail| match mail {
        Mail::Event(Event::Message { message: Message::FlagEvent(it), .. }, _) => Some(it.name.clone()),
        _ => None,
    };
    mails.iter().filter_map(name).collect()
}

fn requests(mails: &[Mail]) -> Vec<Token> {
    let token = |mail: &Mail| match mail {
        Mail::Event(Event::Request { token, .. }, _) => Some(*token),
        _ => None,
    };
    mails.iter().filter_map(token).collect()
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::set_permissions(folder.path(), std::os::unix::fs::PermissionsExt::from_mode(0o700)).unwrap();
    folder
}

#[test]
fn a_message_comes_once_whichever_way_is_first() {
    let folder = folder();
    let (mut far, mut near) = linked(folder.path());
    near.flag(1);
    let (key, flag) = (Topic::FlagEvent.key(), v1::FlagEvent { name: "1".into(), ..Default::default() });
    far.links.read();
    far.links.inbox.message(Topic::FlagEvent, key, &flag.encode_to_vec(), Some(&attachment(1)));
    assert_eq!(flags(&far.turn()), ["1"], "and its copy by the router is dropped");
    near.links.send(Topic::BatteryStatus, &[], &[]);
    assert!(far.turn().is_empty(), "telemetry has another way");
}

#[test]
fn a_request_has_one_outcome() {
    /// What the far end does with the request; what the near end hears.
    #[track_caller]
    fn check(act: fn(&mut End, Token), expected: &str) {
        let folder = folder();
        let (mut far, mut near) = linked(folder.path());
        assert!(near.ask(9));
        let token = requests(&far.turn())[0];
        act(&mut far, token);
        drop(far);
        let heard: Vec<_> = near.turn().into_iter().collect();
        let heard: Vec<_> = heard
            .iter()
            .map(|it| match it {
                Mail::Answer { call: CallId(9), attempt: 1, result: Ok(Event::Reply { result: Ok(_), .. }) } => {
                    "answered"
                }
                Mail::Answer { call: CallId(9), attempt: 1, result: Err(CallError::Unanswered) } => "unanswered",
                Mail::Answer { call: CallId(9), attempt: 1, result: Err(CallError::Malformed) } => "malformed",
                Mail::Unserved { call: CallId(9), attempt: 1 } => "again",
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(heard, [expected]);
    }
    fn answer(far: &mut End, token: Token, payload: Option<&[u8]>) {
        let Some(Asker::Direct { connection, number }) = far.open.take(token) else { panic!("it waits") };
        far.links.answer(connection, number, payload);
        far.links.answer(connection, number, payload);
    }
    check(|far, token| answer(far, token, Some(&v1::PermissionReceipt::default().encode_to_vec())), "answered");
    check(|far, token| answer(far, token, Some(b"\xff\xff")), "malformed");
    check(|far, token| answer(far, token, None), "unanswered");
    // It is killed before it answers: the router carries the next try.
    check(|_, _| {}, "again");
}

#[test]
fn nobody_is_asked_who_does_not_serve_it_or_is_not_there() {
    let folder = folder();
    let mut near = End::near(folder.path());
    assert!(!near.ask(1), "nobody is there");
    let mut far = End::far(folder.path());
    near.turn();
    assert!(!near.ask(1), "who is there has not said who it is");
    greet(&mut far, &mut near);
    assert!(near.ask(1));
    assert!(!far.ask(1), "the near end serves nothing");
}

#[test]
fn a_link_is_there_again_after_the_death_of_either_end() {
    let folder = folder();
    let (far, mut near) = linked(folder.path());
    drop(far);
    near.flag(1);
    near.turn();
    assert!(!near.ask(1));
    let mut far = End::far(folder.path());
    greet(&mut far, &mut near);
    near.flag(2);
    assert!(flags(&far.turn()).is_empty(), "the one before it was lost here: both come by the router, in their order");
    let flag = |number: u64| v1::FlagEvent { name: number.to_string(), ..Default::default() }.encode_to_vec();
    for number in [1, 2] {
        far.links.inbox.message(Topic::FlagEvent, Topic::FlagEvent.key(), &flag(number), Some(&attachment(number)));
    }
    assert_eq!(flags(&far.turn()), ["1", "2"]);
    drop(near);
    far.turn();
    let mut near = End::near(folder.path());
    greet(&mut far, &mut near);
    near.flag(3);
    assert_eq!(flags(&far.turn()), ["3"]);
}

#[test]
fn a_reader_that_hangs_costs_its_sender_nothing_and_goes_on_in_order() {
    let folder = folder();
    let (mut far, mut near) = linked(folder.path());
    (1..=20_000).for_each(|number| near.flag(number));
    assert!(!near.ask(1), "full: by the router");
    let mut heard = Vec::new();
    for _ in 0..20_000 / TURN {
        heard.extend(flags(&far.turn()));
    }
    let expected: Vec<_> = (1..=heard.len()).map(|it| it.to_string()).collect();
    assert!(heard.len() < 20_000 && heard == expected, "the first {} of them", heard.len());
    assert!(near.ask(2), "there is room again");
    // Larger than the socket takes.
    near.links.send(Topic::FlagEvent, &[], &vec![0; LONGEST]);
    assert_eq!(requests(&far.turn()).len(), 1, "the link lives");
}

#[test]
fn a_sender_of_garbage_is_disconnected_and_the_others_are_not() {
    let folder = folder();
    let (mut far, mut near) = linked(folder.path());
    let garbage: [&[u8]; 4] = [b"x", &[9; 40], &[1; 64], &[0; 200]];
    for packet in garbage {
        let stranger = socket::connect(&folder.path().join("far.sock")).unwrap();
        assert_eq!(socket::send(&stranger, &[std::io::IoSlice::new(packet)]), Sent::Whole);
        assert!(far.turn().is_empty(), "{packet:?}");
        // Its own hello first, then the end.
        let mut buffer = vec![0; LONGEST];
        assert!(matches!(socket::receive(&stranger, &mut buffer), Received::Packet(_)));
        assert!(matches!(socket::receive(&stranger, &mut buffer), Received::End), "{packet:?}");
    }
    assert_eq!(usize::try_from(far.mailbox.losses().malformed).unwrap(), garbage.len());
    let _crowd: Vec<_> =
        (0..2 * MOST_CALLERS).map_while(|_| socket::connect(&folder.path().join("far.sock")).ok()).collect();
    far.turn();
    assert!(far.links.connections.len() <= MOST_CALLERS);
    near.flag(1);
    assert_eq!(flags(&far.turn()), ["1"]);
}

#[test]
fn a_process_of_another_vehicle_is_not_linked_to() {
    let folder = folder();
    let mut far = End::of("uav2", folder.path(), Some("far"), &[]).unwrap();
    let mut near = End::near(folder.path());
    for _ in 0..5 {
        greet(&mut far, &mut near);
    }
    assert!(!near.ask(1));
    assert_eq!(near.links.called[0].trouble.as_deref(), Some("it belongs to vehicle `uav2`, this process to `uav1`"));
    drop(far);
    near.turn();
    let mut far = End::far(folder.path());
    greet(&mut far, &mut near);
    assert!(near.ask(1) && near.links.called[0].trouble.is_none());
}

#[test]
fn what_stands_in_the_way_is_said() {
    #[track_caller]
    fn refused(folder: &Path, listen: &str, said: &str) {
        let refusal = End::of("uav1", folder, Some(listen), &[]).err().unwrap().to_string();
        assert!(refusal.contains(said), "{refusal}");
    }
    let folder = folder();
    std::fs::write(folder.path().join("file.sock"), "precious").unwrap();
    refused(folder.path(), "file", "exists and is not a socket: remove it");
    refused(folder.path(), &"x".repeat(120), "at most 107 are possible: choose a shorter folder");
    let _far = End::far(folder.path());
    refused(folder.path(), "far", "is in use: another process listens there");
}
