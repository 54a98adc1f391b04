//! Events on their way from node to node.

use std::collections::HashMap;
use std::time::Duration;

use domain::time::Time;
use kittiwake_proto::topics::{Qos, Topic};

use crate::Event;

/// Events on their way; what one node sends another in the same way arrives in order, and nothing else need.
#[derive(Default)]
pub(super) struct Post {
    /// In the order in which they were sent.
    letters: Vec<Letter>,
    last_arrival: HashMap<Lane, Time>,
}

struct Letter {
    to: usize,
    arrives: Time,
    event: Event,
}

/// From whom (nobody: from outside), to whom, and how.
type Lane = (Option<usize>, usize, Way);

/// What has a priority, and so a queue, of its own on the real bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Way {
    Topic(Qos),
    Request,
    Reply,
    Peer,
}

impl Post {
    /// Sends `event`, which takes `delay`; when it arrives.
    pub(super) fn send(&mut self, from: Option<usize>, to: usize, event: Event, now: Time, delay: Duration) -> Time {
        let last = self.last_arrival.entry((from, to, way(&event))).or_insert(Time::ZERO);
        let arrives = (now + delay).max(*last);
        *last = arrives;
        self.letters.push(Letter { to, arrives, event });
        arrives
    }

    /// When a node can next take in an event, and which one: nobody before `free_from` of it.
    pub(super) fn next(&self, free_from: &[Time]) -> Option<(Time, usize)> {
        self.letters.iter().map(|it| (it.arrives.max(free_from[it.to]), it.to)).min_by_key(|(at, _)| *at)
    }

    /// Everything that has arrived at `node`, as its mailbox has it: of telemetry and states the newest only, in the
    /// place of the first.
    pub(super) fn collect(&mut self, node: usize, now: Time) -> Vec<Event> {
        let is_there = |it: &mut Letter| it.to == node && it.arrives <= now;
        let mut arrived: Vec<Letter> = self.letters.extract_if(.., is_there).collect();
        arrived.sort_by_key(|it| it.arrives);
        let mut mailbox: Vec<Event> = Vec::new();
        for Letter { event, .. } in arrived {
            let older =
                newest_only(&event).and_then(|topic| mailbox.iter_mut().find(|it| newest_only(it) == Some(topic)));
            match older {
                Some(older) => *older = event,
                None => mailbox.push(event),
            }
        }
        mailbox
    }
}

fn newest_only(event: &Event) -> Option<Topic> {
    match event {
        Event::Message { message, .. } => Some(message.topic()).filter(|it| it.qos().keeps_newest_only()),
        _ => None,
    }
}

fn way(event: &Event) -> Way {
    match event {
        Event::Message { message, .. } => Way::Topic(message.topic().qos()),
        Event::Request { .. } => Way::Request,
        Event::Reply { .. } => Way::Reply,
        Event::Peer { .. } => Way::Peer,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kittiwake_proto::topics::Message;
    use kittiwake_proto::v1;

    fn flag(name: &str) -> Event {
        let message = v1::FlagEvent { name: name.into(), ..Default::default() }.into();
        Event::Message { vehicle: "uav1".into(), message }
    }

    fn battery(remaining: f64) -> Event {
        let message = v1::BatteryStatus { remaining, ..Default::default() }.into();
        Event::Message { vehicle: "uav1".into(), message }
    }

    fn told(events: &[Event]) -> Vec<String> {
        let word = |it: &Event| match it {
            Event::Message { message: Message::FlagEvent(it), .. } => it.name.clone(),
            Event::Message { message: Message::BatteryStatus(it), .. } => it.remaining.to_string(),
            other => format!("{other:?}"),
        };
        events.iter().map(word).collect()
    }

    #[test]
    fn what_goes_the_same_way_keeps_its_order_and_others_overtake_it() {
        let (mut post, ms) = (Post::default(), Duration::from_millis);
        post.send(Some(0), 1, flag("first"), Time::ZERO, ms(30));
        post.send(Some(0), 1, flag("second"), Time::ZERO, ms(10));
        post.send(Some(2), 1, flag("other"), Time::ZERO, ms(20));
        post.send(Some(0), 1, battery(0.5), Time::ZERO, ms(5));
        assert_eq!(post.next(&[Time::ZERO; 2]), Some((Time::ZERO + ms(5), 1)));
        assert_eq!(
            post.next(&[Time::ZERO, Time::ZERO + ms(9)]),
            Some((Time::ZERO + ms(9), 1)),
            "not before it is free"
        );
        assert_eq!(told(&post.collect(1, Time::ZERO + ms(25))), ["0.5", "other"]);
        assert_eq!(told(&post.collect(1, Time::ZERO + ms(30))), ["first", "second"]);
        assert_eq!(post.next(&[Time::ZERO; 2]), None);
    }

    #[test]
    fn of_telemetry_the_newest_is_there_in_the_place_of_the_first() {
        let mut post = Post::default();
        for event in [battery(0.9), flag("f"), battery(0.8), flag("f")] {
            post.send(Some(0), 1, event, Time::ZERO, Duration::ZERO);
        }
        assert_eq!(told(&post.collect(1, Time::ZERO)), ["0.8", "f", "f"]);
    }
}
