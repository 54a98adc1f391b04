//! The rate of the introspection.

use std::cell::RefCell;
use std::time::Duration;

use domain::time::{Pace, Time};
use kittiwake_proto::topics::Message;
use node::Scope;
use node::virtual_bus::{Machine, VirtualBus};

use crate::stories::rig::{Rig, monitor, s, shipped};

#[test]
fn a_hundred_a_second_of_wall_time_exactly() {
    #[track_caller]
    fn check(speed: f64, period_ms: u64, expected: usize) {
        let times = RefCell::new(Vec::new());
        let mut bus = VirtualBus::new(Machine::Ideal);
        bus.tap(|at, message| {
            if matches!(message, Message::Introspection(_)) {
                times.borrow_mut().push(at);
            }
        });
        bus.add(Scope::Vehicle("uav1".into()), monitor(&shipped(), Pace::new(speed).unwrap()));
        bus.run_until(Duration::from_secs(10), || false);
        // One at time zero and one at the very end.
        let expected: Vec<_> =
            (0..=expected as u64).map(|n| Time::after(Duration::from_millis(n * period_ms))).collect();
        assert_eq!(*times.borrow(), expected);
    }
    check(1.0, 10, 1000);
    check(20.0, 200, 50);
}

#[test]
fn samples_do_not_disturb_the_rate() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    rig.wait(s(0.0035));
    rig.fly(10.0);
    let late = rig.introspections().filter(|(at, _)| at.since_start().as_nanos() % 10_000_000 != 0).count();
    assert_eq!((rig.introspections().count(), late), (1001, 0));
}

#[test]
fn missed_introspections_are_skipped() {
    let mut rig = Rig::with(&shipped(), Pace::REAL_TIME);
    rig.wait(s(1.0));
    let before = rig.introspections().count();
    rig.stall(s(0.5055));
    rig.wait(s(0.0));
    assert_eq!(rig.introspections().count(), before + 1);
    rig.wait(s(0.0045));
    assert_eq!(rig.introspections().count(), before + 2);
    assert_eq!(rig.introspections().last().unwrap().0, rig.now());
}
