//! Where zenoh's threads leave what arrived and the loop picks it up.
//!
//! Of a telemetry topic, and of the liveliness of a process, only the newest is kept; everything else queues in order up
//! to a bound, beyond which it is dropped and counted, since a blocked callback would stall the link. Liveliness is
//! said once: if it were dropped, a process would count as there, or as gone, until it is started again.
//!
//! Orders wait apart, since they come one at a time: people ask for as much work as they please, and a flight must not wait for it.

#![expect(clippy::disallowed_methods, reason = "losses are counted by the wall clock")]

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Instant;

use kittiwake_proto::topics::{Request, Topic};
use node::{CallError, CallId, Event, VehicleId};

use crate::losses::{Loss, Losses, Report, Totals};
use crate::trace::Parent;
use crate::wake::Wake;

/// More than arrives in any burst that a healthy process lets pile up.
const CAPACITY: usize = 4096;
/// The part that one sender may take: its flood drops no message of the others.
const SHARE: usize = CAPACITY / 4;
/// The most slots with unread mail, since anybody on the bus can make up names of vehicles and processes. Samples may take half of them,
/// so that there is room for liveliness, which is said only once. (ENG: twice the samples of 64 vehicles with eight topics each.)
const MOST_NEWEST: usize = CAPACITY / 2;
/// Large messages that may wait: with those of 8 MiB that bounds the memory.
const MOST_LARGE: usize = 16;
/// Orders that may wait. (ENG: more than are answered before the last of them is too old to be obeyed.)
const MOST_ORDERS: usize = 64;
/// Of them: texts of large missions. With those of 5 MiB that bounds the memory to 20 MiB.
const MOST_LARGE_ORDERS: usize = 4;
/// A mission whose text has more bytes is large.
const LARGE_TEXT: usize = 256 * 1024;

/// Something for the loop.
#[derive(Debug)]
pub(crate) enum Mail {
    /// An event for the node, and the trace it belongs to.
    Event(Event, Option<Parent>),
    /// The same, from the ground, which said it at that moment of our clock: it may get too old while it waits here.
    Said(u64, Event, Option<Parent>),
    /// A call of this process was answered, or failed.
    Answer { call: CallId, attempt: u32, result: Result<Event, CallError> },
    /// A query ended without any reply: nobody serves it at the moment.
    Unserved { call: CallId, attempt: u32 },
}

impl Mail {
    /// An operator's command to the vehicle, such as an abort.
    fn is_command(&self) -> bool {
        let (Mail::Event(event, _) | Mail::Said(_, event, _)) = self else { return false };
        matches!(event, Event::Request { request: Request::OperatorCommand(_), .. })
    }

    /// The text of a large mission.
    fn is_large_text(&self) -> bool {
        use kittiwake_proto::v1::mission_request::Request as Ask;
        let (Mail::Event(event, _) | Mail::Said(_, event, _)) = self else { return false };
        let Event::Request { request: Request::Mission(it), .. } = event else { return false };
        matches!(
            &it.request,
            Some(Ask::Validate(it) | Ask::Upload(it) | Ask::ValidateAirspace(it) | Ask::AdoptAirspace(it))
                if LARGE_TEXT < it.text.len()
        )
    }
}

#[derive(Clone)]
pub(crate) struct Mailbox(Arc<Shared>);

struct Shared {
    inner: Mutex<Inner>,
    wake: Wake,
}

#[derive(Default)]
struct Inner {
    queue: VecDeque<Entry>,
    orders: VecDeque<Mail>,
    newest: HashMap<Slot, Mail>,
    /// Messages that wait, by their key.
    waiting: HashMap<String, usize>,
    /// Large messages that came in since the loop took everything.
    large: usize,
    losses: Losses,
    nudged: bool,
}

enum Entry {
    Mail(Mail),
    /// Stands for the newest of a slot, in the place of the first unread one.
    Newest(Slot),
}

/// What only the newest is kept of.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Slot {
    /// Samples of a topic about a vehicle.
    Sample(VehicleId, Topic),
    /// Whether one start of a process is there.
    Peer { vehicle: VehicleId, service: String, instance: String },
}

impl Mailbox {
    /// An empty one, of a node whose loop sleeps on `wake`.
    pub(crate) fn new(wake: &Wake) -> Mailbox {
        Mailbox(Arc::new(Shared { inner: Mutex::default(), wake: wake.clone() }))
    }

    /// Queues what this process waits for itself; false, and counted, if there is no room.
    pub(crate) fn push(&self, mail: Mail) -> bool {
        let mut inner = self.lock();
        if CAPACITY <= inner.queue.len() {
            inner.losses.count(Loss::Dropped, "(answers)", Instant::now());
            return false;
        }
        inner.queue.push_back(Entry::Mail(mail));
        drop(inner);
        self.0.wake.wake();
        true
    }

    /// Queues what came in with the key `sender`; false if there is no room, or the sender has used its share.
    pub(crate) fn push_from(&self, sender: &str, mail: Mail) -> bool {
        let mut inner = self.lock();
        if SHARE <= inner.waiting.get(sender).copied().unwrap_or(0) || CAPACITY <= inner.queue.len() {
            return false;
        }
        match inner.waiting.get_mut(sender) {
            Some(count) => *count += 1,
            None => drop(inner.waiting.insert(sender.to_owned(), 1)),
        }
        inner.queue.push_back(Entry::Mail(mail));
        drop(inner);
        self.0.wake.wake();
        true
    }

    /// Queues an order. Returns false if the queue is full.
    pub(crate) fn push_order(&self, mail: Mail) -> bool {
        let mut inner = self.lock();
        // Those who try out missions leave room for who commands.
        if MOST_ORDERS <= inner.orders.iter().filter(|it| it.is_command() == mail.is_command()).count() {
            return false;
        }
        if mail.is_large_text() && MOST_LARGE_ORDERS <= inner.orders.iter().filter(|it| it.is_large_text()).count() {
            return false;
        }
        inner.orders.push_back(mail);
        drop(inner);
        self.0.wake.wake();
        true
    }

    /// As [`Mailbox::push_from`], for a large message: there is room for few of them.
    pub(crate) fn push_large_from(&self, sender: &str, mail: Mail) -> bool {
        let mut inner = self.lock();
        if MOST_LARGE <= inner.large {
            return false;
        }
        inner.large += 1;
        drop(inner);
        self.push_from(sender, mail)
    }

    /// Keeps `mail` as the newest of `slot`, in place of an unread older one; false if there is no room for one more slot.
    pub(crate) fn push_newest(&self, slot: Slot, mail: Mail) -> bool {
        let mut inner = self.lock();
        let most = match slot {
            Slot::Sample(..) => MOST_NEWEST / 2,
            Slot::Peer { .. } => MOST_NEWEST,
        };
        if most <= inner.newest.len() && !inner.newest.contains_key(&slot) {
            return false;
        }
        if inner.newest.insert(slot.clone(), mail).is_none() {
            inner.queue.push_back(Entry::Newest(slot));
            drop(inner);
            self.0.wake.wake();
        }
        true
    }

    /// Counts something of `sender` that does not get through; with what is to be logged about it, if anything.
    pub(crate) fn lose(&self, loss: Loss, sender: &str) -> Option<Report> {
        self.lock().losses.count(loss, sender, Instant::now())
    }

    /// What did not get through so far.
    pub(crate) fn losses(&self) -> Totals {
        self.lock().losses.totals()
    }

    /// Has the node act, at once.
    pub(crate) fn nudge(&self) {
        self.lock().nudged = true;
        self.0.wake.wake();
    }

    /// Whether the node has something to do, besides orders.
    pub(crate) fn has_mail(&self) -> bool {
        let inner = self.lock();
        !inner.queue.is_empty() || inner.nudged
    }

    /// Whether an order waits.
    pub(crate) fn has_order(&self) -> bool {
        !self.lock().orders.is_empty()
    }

    /// Takes out the order that has waited longest: a command to the vehicle first.
    pub(crate) fn take_order(&self) -> Option<Mail> {
        let orders = &mut self.lock().orders;
        let first = orders.iter().position(Mail::is_command).unwrap_or(0);
        orders.remove(first)
    }

    /// Moves everything that has arrived into `batch`, but for the orders.
    pub(crate) fn take(&self, batch: &mut Vec<Mail>) {
        let mut inner = self.lock();
        inner.nudged = false;
        inner.waiting.clear();
        inner.large = 0;
        while let Some(entry) = inner.queue.pop_front() {
            match entry {
                Entry::Mail(mail) => batch.push(mail),
                Entry::Newest(slot) => batch.extend(inner.newest.remove(&slot)),
            }
        }
    }

    /// A thread that panicked while it held the lock left plain data behind: go on with it.
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.inner.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mailbox() -> Mailbox {
        Mailbox::new(&Wake::new().unwrap())
    }

    fn peer(name: &str) -> Mail {
        let event = Event::Peer { vehicle: "uav1".into(), service: name.into(), instance: "1".into(), alive: true };
        Mail::Event(event, None)
    }

    fn names(mailbox: &Mailbox) -> Vec<String> {
        let mut batch = Vec::new();
        mailbox.take(&mut batch);
        batch
            .into_iter()
            .map(|mail| match mail {
                Mail::Event(Event::Peer { service, .. }, _) => service,
                other => panic!("not what was put in: {other:?}"),
            })
            .collect()
    }

    fn battery(vehicle: &str) -> Slot {
        Slot::Sample(vehicle.into(), Topic::BatteryStatus)
    }

    fn instance(name: &str) -> Slot {
        Slot::Peer { vehicle: "uav1".into(), service: "mcm".into(), instance: name.into() }
    }

    #[test]
    fn of_a_slot_only_the_newest_is_kept_in_the_place_of_the_first() {
        #[track_caller]
        fn check(first: Slot, second: Slot, expected: &[&str]) {
            let mailbox = mailbox();
            mailbox.push_newest(first, peer("old"));
            mailbox.push(peer("event"));
            mailbox.push_newest(second, peer("new"));
            assert_eq!(names(&mailbox), expected);
            assert!(names(&mailbox).is_empty());
        }
        check(battery("uav1"), battery("uav1"), &["new", "event"]);
        check(battery("uav1"), battery("uav2"), &["old", "event", "new"]);
        check(instance("1"), instance("1"), &["new", "event"]);
        check(instance("1"), instance("2"), &["old", "event", "new"]);
    }

    #[test]
    fn a_flood_of_one_sender_takes_its_share_and_no_more() {
        let mailbox = mailbox();
        (0..SHARE).for_each(|_| assert!(mailbox.push_from("kw/uav2/flood", peer("flood"))));
        assert!(!mailbox.push_from("kw/uav2/flood", peer("one too many")));
        assert!(mailbox.push_from("kw/uav1/event", peer("of another")));
        assert!(mailbox.push(peer("an answer")));
        assert_eq!(names(&mailbox)[SHARE..], ["of another", "an answer"]);
        assert!(mailbox.push_from("kw/uav2/flood", peer("after it")), "what was taken out leaves room");
    }

    #[test]
    fn few_large_messages_wait() {
        let mailbox = mailbox();
        (0..MOST_LARGE).for_each(|number| assert!(mailbox.push_large_from(&number.to_string(), peer("large"))));
        assert!(!mailbox.push_large_from("another", peer("one too many")));
        assert!(mailbox.push_from("another", peer("small")));
        assert_eq!(names(&mailbox)[MOST_LARGE..], ["small"]);
        assert!(mailbox.push_large_from("another", peer("after it")), "what was taken out leaves room");
    }

    #[test]
    fn a_full_queue_drops_and_still_takes_in_who_is_there() {
        let mailbox = mailbox();
        for number in 0..CAPACITY {
            assert!(mailbox.push_from(&(number / SHARE).to_string(), peer("x")));
        }
        assert!(!mailbox.push_from("another", peer("one too many")) && !mailbox.push(peer("one too many")));
        mailbox.push_newest(instance("1"), peer("who is there"));
        mailbox.push_newest(battery("uav1"), peer("sample"));
        assert_eq!(names(&mailbox)[CAPACITY..], ["who is there", "sample"]);
    }

    #[test]
    fn invented_names_take_no_more_than_their_room_and_leave_some_for_who_is_there() {
        let mailbox = mailbox();
        let taken = |slots: &mut dyn Iterator<Item = Slot>| {
            slots.filter(|it| mailbox.push_newest(it.clone(), peer("x"))).count()
        };
        assert_eq!(taken(&mut (0..2 * MOST_NEWEST).map(|it| battery(&it.to_string()))), MOST_NEWEST / 2);
        assert_eq!(taken(&mut (0..2 * MOST_NEWEST).map(|it| instance(&it.to_string()))), MOST_NEWEST / 2);
        assert_eq!(
            taken(&mut [battery("0"), instance("0"), battery("another")].into_iter()),
            2,
            "newer ones of the same"
        );
        assert_eq!(names(&mailbox).len(), MOST_NEWEST);
        assert_eq!(taken(&mut [battery("another")].into_iter()), 1, "what was taken out leaves room");
    }

    #[test]
    fn orders_wait_apart_and_few_of_them() {
        let mailbox = mailbox();
        (0..MOST_ORDERS).for_each(|_| assert!(mailbox.push_order(peer("order"))));
        assert!(!mailbox.push_order(peer("one too many")));
        assert!(mailbox.push(peer("event")));
        assert_eq!(names(&mailbox), ["event"]);
        assert!(mailbox.has_order() && !mailbox.has_mail());
        assert_eq!(std::iter::from_fn(|| mailbox.take_order()).count(), MOST_ORDERS);
        assert!(!mailbox.has_order() && mailbox.push_order(peer("after it")));
    }

    #[test]
    fn few_large_missions_wait() {
        use kittiwake_proto::v1;
        let mailbox = mailbox();
        let upload = |bytes: usize| {
            let text = v1::MissionText { text: "x".repeat(bytes), wind: None };
            let request = Some(v1::mission_request::Request::Upload(text));
            let request = Request::Mission(v1::MissionRequest { request, ..Default::default() });
            Mail::Event(Event::Request { vehicle: "uav1".into(), token: node::Token(1), request }, None)
        };
        (0..MOST_LARGE_ORDERS).for_each(|_| assert!(mailbox.push_order(upload(LARGE_TEXT + 1))));
        assert!(!mailbox.push_order(upload(LARGE_TEXT + 1)));
        assert!(mailbox.push_order(upload(LARGE_TEXT)), "a small one has room");
        assert!(mailbox.take_order().is_some() && mailbox.push_order(upload(LARGE_TEXT + 1)), "one was taken out");
    }

    #[test]
    fn a_command_to_the_vehicle_waits_for_no_tried_out_mission() {
        let mailbox = mailbox();
        while mailbox.push_order(peer("mission")) {}
        let request = Request::OperatorCommand(kittiwake_proto::v1::OperatorCommand::default());
        let command = Event::Request { vehicle: "uav1".into(), token: node::Token(1), request };
        assert!(mailbox.push_order(Mail::Event(command, None)));
        assert!(mailbox.take_order().is_some_and(|it| it.is_command()));
        assert!(mailbox.take_order().is_some_and(|it| !it.is_command()));
    }

    #[test]
    fn what_is_lost_is_counted() {
        let mailbox = mailbox();
        assert!(mailbox.lose(Loss::Dropped, "kw/uav1/event").is_some());
        assert!(mailbox.lose(Loss::Dropped, "kw/uav1/event").is_none(), "it has just been logged");
        assert_eq!(mailbox.losses().dropped, 2);
    }

    #[test]
    fn a_nudge_is_something_to_do_once() {
        let mailbox = mailbox();
        mailbox.nudge();
        assert!(mailbox.has_mail());
        assert!(names(&mailbox).is_empty() && !mailbox.has_mail());
    }

    #[test]
    fn mail_for_any_node_of_a_loop_wakes_it() {
        let far = || Instant::now() + std::time::Duration::from_secs(3600);
        let wake = Wake::new().unwrap();
        let mailboxes = [Mailbox::new(&wake), Mailbox::new(&wake)];
        for mailbox in mailboxes.clone() {
            let sender = std::thread::spawn(move || assert!(mailbox.push(peer("event"))));
            let mut found = 0;
            while found == 0 {
                let next = || if mailboxes.iter().any(Mailbox::has_mail) { Instant::now() } else { far() };
                wake.wait(next, std::iter::empty());
                found = mailboxes.iter().map(|it| names(it).len()).sum();
            }
            sender.join().unwrap();
        }
    }
}
