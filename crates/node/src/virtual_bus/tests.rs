//! Heartbeats, and nodes that hang.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use domain::time::{Now, Time};
use kittiwake_proto::topics::{Message, Topic};
use kittiwake_proto::v1;

use super::{Machine, VirtualBus};
use crate::{Effect, Event, Node, Scope};

/// When something was heard, in milliseconds, and what.
type Heard = Rc<RefCell<Vec<(u128, String)>>>;

struct Listener {
    name: &'static str,
    heard: Heard,
}

impl Node for Listener {
    fn name(&self) -> &'static str {
        self.name
    }

    fn subscriptions(&self) -> &'static [Topic] {
        &[Topic::Heartbeat, Topic::BatteryStatus, Topic::FlagEvent]
    }

    fn on(&mut self, now: Now, event: Event, _: &mut Vec<Effect>) {
        let Event::Message { message, .. } = event else { return };
        let what = match message {
            Message::Heartbeat(heartbeat) => heartbeat.service,
            Message::BatteryStatus(battery) => format!("{}", battery.remaining),
            Message::FlagEvent(flag) => flag.name,
            _ => return,
        };
        self.heard.borrow_mut().push((now.time.since_start().as_millis(), what));
    }

    fn deadline(&self) -> Option<Time> {
        None
    }
}

#[test]
fn a_node_that_hangs_takes_in_nothing_and_sends_nothing_until_it_goes_on() {
    let mut bus = VirtualBus::new(Machine::Ideal);
    let [hung, other] = ["hung", "other"].map(|name| {
        let heard = Heard::default();
        bus.add(Scope::Vehicle("uav1".into()), Listener { name, heard: heard.clone() });
        heard
    });
    bus.run_until(Duration::from_millis(600), || false);
    bus.freeze("hung", Duration::from_millis(1000));
    let battery = |remaining| v1::BatteryStatus { remaining, ..Default::default() };
    let flag = |name: &str| v1::FlagEvent { name: name.into(), ..Default::default() };
    bus.publish("uav1", battery(0.9));
    bus.publish("uav1", flag("first"));
    bus.publish("uav1", battery(0.8));
    bus.publish("uav1", flag("second"));
    bus.run_until(Duration::from_millis(1300), || false);

    let beats: Vec<_> = other.borrow().iter().filter(|(_, what)| what == "hung").map(|(at, _)| *at).collect();
    assert_eq!(beats, [0, 250, 500, 1600, 1850], "four a second, but for those it did not send");
    let late: Vec<_> = hung.borrow().iter().filter(|(at, what)| 600 < *at && what != "other").cloned().collect();
    let at_once = |what: &str| (1600, what.to_owned());
    assert_eq!(late, ["0.8", "first", "second"].map(at_once), "of a state the newest, of events each");
}
