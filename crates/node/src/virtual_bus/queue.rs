//! Events under way from node to node.

use std::collections::HashMap;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::{Qos, Topic};

use crate::{Event, VehicleId};

/// The index of a node.
pub(super) type Index = usize;

/// Events under way. Those of one [`Flow`] arrive in order; other flows may overtake.
#[derive(Default)]
pub(super) struct Queue {
    /// In the order in which they were sent.
    events: Vec<Queued>,
    last_arrival: HashMap<Flow, Time>,
}

struct Queued {
    to: Index,
    arrives: Time,
    event: Event,
}

/// Sender (`None`: from outside), receiver and class.
type Flow = (Option<Index>, Index, Class);

/// What has a priority, and so a queue, of its own on the real bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Class {
    Topic(Qos),
    Request,
    Reply,
    Peer,
}

/// What a mailbox keeps only the newest of.
#[derive(PartialEq)]
enum State<'a> {
    Sample(&'a VehicleId, Topic),
    Peer(&'a VehicleId, &'a str, &'a str),
}

impl Queue {
    /// Sends `event`, which arrives after `delay`, or when the event before it in its flow arrives.
    pub(super) fn send(&mut self, from: Option<Index>, to: Index, event: Event, now: Time, delay: Duration) {
        let last = self.last_arrival.entry((from, to, Class::of(&event))).or_insert(Time::ZERO);
        let arrives = (now + delay).max(*last);
        *last = arrives;
        self.events.push(Queued { to, arrives, event });
    }

    /// When a node can next take in an event, and which node: none before its time in `free_from`.
    pub(super) fn next(&self, free_from: impl Fn(Index) -> Time) -> Option<(Time, Index)> {
        self.events.iter().map(|it| (it.arrives.max(free_from(it.to)), it.to)).min_by_key(|(at, _)| *at)
    }

    /// Takes out what has arrived at `node`, as its mailbox has it: of each state only the newest, in the place of the
    /// first.
    pub(super) fn take(&mut self, node: Index, now: Time) -> Vec<Event> {
        let has_arrived = |it: &mut Queued| it.to == node && it.arrives <= now;
        let mut arrived: Vec<Queued> = self.events.extract_if(.., has_arrived).collect();
        arrived.sort_by_key(|it| it.arrives);
        let mut mailbox: Vec<Event> = Vec::new();
        for Queued { event, .. } in arrived {
            let older = state(&event).and_then(|new| mailbox.iter().position(|old| state(old).as_ref() == Some(&new)));
            match older {
                Some(position) => mailbox[position] = event,
                None => mailbox.push(event),
            }
        }
        mailbox
    }

    /// Drops what is under way to `node`.
    pub(super) fn drop_all(&mut self, node: Index) {
        self.events.retain(|it| it.to != node);
    }
}

impl Class {
    fn of(event: &Event) -> Class {
        match event {
            Event::Message { message, .. } => Class::Topic(message.topic().qos()),
            Event::Request { .. } => Class::Request,
            Event::Reply { .. } => Class::Reply,
            Event::Peer { .. } => Class::Peer,
        }
    }
}

fn state(event: &Event) -> Option<State<'_>> {
    match event {
        Event::Message { vehicle, message } if message.topic().qos().keeps_newest_only() => {
            Some(State::Sample(vehicle, message.topic()))
        }
        Event::Peer { vehicle, service, instance, .. } => Some(State::Peer(vehicle, service, instance)),
        Event::Message { .. } | Event::Request { .. } | Event::Reply { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::topics::Message;
    use kittiwake_proto::v1;

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    fn flag(name: &str) -> Event {
        let message = v1::FlagEvent { name: name.into(), ..Default::default() }.into();
        Event::Message { vehicle: "uav1".into(), message }
    }

    fn battery(vehicle: &str, remaining: f64) -> Event {
        let message = v1::BatteryStatus { remaining, ..Default::default() }.into();
        Event::Message { vehicle: vehicle.into(), message }
    }

    fn peer(instance: &str, alive: bool) -> Event {
        Event::Peer { vehicle: "uav1".into(), service: "mcm".into(), instance: instance.into(), alive }
    }

    fn texts(events: &[Event]) -> Vec<String> {
        let text = |event: &Event| match event {
            Event::Message { message: Message::FlagEvent(flag), .. } => flag.name.clone(),
            Event::Message { vehicle, message: Message::BatteryStatus(battery) } => {
                format!("{vehicle} {}", battery.remaining)
            }
            Event::Peer { instance, alive, .. } => format!("{instance} {alive}"),
            other => format!("{other:?}"),
        };
        events.iter().map(text).collect()
    }

    #[test]
    fn one_flow_keeps_its_order_and_others_overtake_it() {
        let mut queue = Queue::default();
        queue.send(Some(0), 1, flag("first"), Time::ZERO, ms(30));
        queue.send(Some(0), 1, flag("second"), Time::ZERO, ms(10));
        queue.send(Some(2), 1, flag("other"), Time::ZERO, ms(20));
        queue.send(Some(0), 1, battery("uav1", 0.5), Time::ZERO, ms(5));
        assert_eq!(queue.next(|_| Time::ZERO), Some((Time::ZERO + ms(5), 1)));
        assert_eq!(queue.next(|_| Time::ZERO + ms(9)), Some((Time::ZERO + ms(9), 1)), "not before it is free");
        assert_eq!(texts(&queue.take(1, Time::ZERO + ms(25))), ["uav1 0.5", "other"]);
        assert_eq!(texts(&queue.take(1, Time::ZERO + ms(30))), ["first", "second"]);
        assert_eq!(queue.next(|_| Time::ZERO), None);
    }

    #[test]
    fn of_a_state_the_newest_is_kept_in_the_place_of_the_first() {
        #[track_caller]
        fn check(events: &[Event], expected: &[&str]) {
            let mut queue = Queue::default();
            for event in events {
                queue.send(Some(0), 1, event.clone(), Time::ZERO, Duration::ZERO);
            }
            assert_eq!(texts(&queue.take(1, Time::ZERO)), expected);
        }
        let (old, new) = (battery("uav1", 0.9), battery("uav1", 0.8));
        check(&[old.clone(), flag("f"), new.clone(), flag("f")], &["uav1 0.8", "f", "f"]);
        check(&[old, battery("uav2", 0.7), new], &["uav1 0.8", "uav2 0.7"]);
        check(&[peer("1", true), peer("2", true), peer("1", false)], &["1 false", "2 true"]);
    }
}
