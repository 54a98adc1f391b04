//! Wake-ups: an event ticks the tree at once, and a waiting tree costs nothing.

#![expect(clippy::disallowed_methods, reason = "the threads of a test hold no more than it sends")]

use std::sync::mpsc;
use std::task::Waker;
use std::time::Duration;

use behavior_tree::{Leaf, LeafResult, Library, Ports, Registry, Status, WakeSignal};

use crate::stories::support::check;

/// Waits for a number from another thread.
struct FromThread {
    receiver: Option<mpsc::Receiver<i32>>,
}

/// Hands the leaf's channel and waker to the thread that replies.
type Requests = mpsc::Sender<(mpsc::Sender<i32>, Waker)>;

impl Leaf<Requests> for FromThread {
    fn start(&mut self, requests: &mut Requests, ports: &mut Ports<'_>) -> LeafResult {
        let (sender, receiver) = mpsc::channel();
        self.receiver = Some(receiver);
        requests.send((sender, ports.waker().clone()))?;
        Ok(Status::Running)
    }

    fn tick(&mut self, _: &mut Requests, _: &mut Ports<'_>) -> LeafResult {
        let receiver = self.receiver.as_ref().ok_or("not started")?;
        Ok(receiver.try_recv().map_or(Status::Running, |number| Status::from_bool(number == 42)))
    }
}

#[test]
fn a_leaf_wakes_the_caller_that_ticks_its_tree() {
    let mut registry = Registry::new();
    registry.action("Ask", [], |_| Ok(FromThread { receiver: None }));
    let xml = crate::stories::support::file("<Ask/>", "");
    let library = Library::load(&registry, [("test.xml", xml)]).unwrap_or_else(|errors| panic!("{errors}"));
    let mut tree = library.instantiate("m", &[]).expect("no parameters");
    let signal = WakeSignal::new();
    tree.set_waker(signal.waker());

    let (mut requests, served) = mpsc::channel::<(mpsc::Sender<i32>, Waker)>();
    let server = std::thread::spawn(move || {
        for (reply, waker) in served {
            reply.send(42).expect("the leaf waits");
            waker.wake();
        }
    });
    assert_eq!(tree.tick_once(Duration::ZERO, &mut requests), Status::Running);
    signal.wait();
    assert_eq!(tree.tick_once(Duration::ZERO, &mut requests), Status::Success);
    drop(requests);
    server.join().expect("the thread ends");
}

#[test]
fn wake_ups_count_as_one_until_the_signal_is_taken() {
    let signal = WakeSignal::new();
    assert!(!signal.take());
    signal.waker().wake();
    signal.waker().wake_by_ref();
    assert!(signal.take());
    assert!(!signal.take());
}

#[test]
fn a_wake_up_completes_a_future() {
    let signal = WakeSignal::new();
    let task = WakeSignal::new();
    let mut woken = Box::pin(signal.woken());
    let waker = task.waker();
    let mut context = std::task::Context::from_waker(&waker);
    assert!(woken.as_mut().poll(&mut context).is_pending());
    signal.waker().wake();
    assert!(task.take(), "the waiting task was woken");
    assert!(woken.as_mut().poll(&mut context).is_ready());
}

#[test]
fn tick_once_ticks_until_no_node_asks_for_more() {
    check(r#"<L id="1" s="AAR"/>"#, "oo", "s1r1r1 R[R], r1r1r1 R[R]");
    check(r#"<L id="1" s="AAR"/>"#, "t", "s1 R[R]");
}
