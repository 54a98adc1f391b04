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
    /// By receiver: what waits for a node that hangs is looked at by nobody until that node goes on.
    lanes: Vec<Lane>,
    /// Events sent so far.
    sent: u64,
    last_arrival: HashMap<Flow, Time>,
}

/// What is under way to one node.
#[derive(Default)]
struct Lane {
    /// In the order in which they were sent.
    events: Vec<Queued>,
    /// The earliest arrival among them.
    first_arrival: Option<Time>,
}

struct Queued {
    /// Counts up over all lanes.
    number: u64,
    arrives: Time,
    /// On the heap: it is moved from list to list, and some events are large.
    event: Box<Event>,
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
        if self.lanes.len() <= to {
            self.lanes.resize_with(to + 1, Lane::default);
        }
        self.sent += 1;
        let lane = &mut self.lanes[to];
        lane.first_arrival = Some(lane.first_arrival.map_or(arrives, |first| first.min(arrives)));
        lane.events.push(Queued { number: self.sent, arrives, event: Box::new(event) });
    }

    /// When a node can next take in an event, and which node: none before its time in `free_from`. Of several nodes that can at the
    /// same moment, the one to which an event was sent first.
    pub(super) fn next(&self, free_from: impl Fn(Index) -> Time) -> Option<(Time, Index)> {
        let turn = |(node, lane): (Index, &Lane)| Some((lane.first_arrival?.max(free_from(node)), node));
        let turns = || self.lanes.iter().enumerate().filter_map(turn);
        let (at, first) = turns().min_by_key(|(at, _)| *at)?;
        let mut alike = turns().filter(|(other, _)| *other == at);
        if alike.nth(1).is_none() {
            return Some((at, first));
        }
        let alike = turns().filter(|(other, _)| *other == at);
        alike.min_by_key(|(_, node)| self.lanes[*node].first_number(at))
    }

    /// Takes out what has arrived at `node`, as its mailbox has it: of each state only the newest, in the place of the
    /// first, and of the orders only the first.
    #[expect(clippy::vec_box, reason = "events are moved from list to list as they are, and some are large")]
    pub(super) fn take(&mut self, node: Index, now: Time) -> Vec<Box<Event>> {
        let Some(lane) = self.lanes.get_mut(node) else { return Vec::new() };
        let mut arrived: Vec<Queued> = lane.events.extract_if(.., |it| it.arrives <= now).collect();
        arrived.sort_by_key(|it| it.arrives);
        let mut has_order = false;
        let waits = |it: &mut Queued| is_order(&it.event) && std::mem::replace(&mut has_order, true);
        lane.events.extend(arrived.extract_if(.., waits));
        lane.events.sort_by_key(|it| it.number);
        lane.first_arrival = lane.events.iter().map(|it| it.arrives).min();
        let mut mailbox: Vec<Box<Event>> = Vec::new();
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
        if let Some(lane) = self.lanes.get_mut(node) {
            *lane = Lane::default();
        }
    }
}

impl Lane {
    /// The number of the event that was sent first, of those that have arrived at this time.
    fn first_number(&self, at: Time) -> Option<u64> {
        self.events.iter().find(|it| it.arrives <= at).map(|it| it.number)
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

fn is_order(event: &Event) -> bool {
    matches!(event, Event::Request { request, .. } if request.service().is_order())
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
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{RngCore, SeedableRng};

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

    fn texts(events: &[Box<Event>]) -> Vec<String> {
        let text = |event: &Event| match event {
            Event::Message { message: Message::FlagEvent(flag), .. } => flag.name.clone(),
            Event::Message { vehicle, message: Message::BatteryStatus(battery) } => {
                format!("{vehicle} {}", battery.remaining)
            }
            Event::Peer { instance, alive, .. } => format!("{instance} {alive}"),
            other => format!("{other:?}"),
        };
        events.iter().map(|it| text(it)).collect()
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

    #[test]
    fn of_nodes_that_are_free_at_one_moment_the_one_that_was_sent_to_first_comes_first() {
        let mut queue = Queue::default();
        queue.send(Some(0), 2, flag("early"), Time::ZERO, ms(10));
        queue.send(Some(0), 1, flag("late"), Time::ZERO, ms(5));
        assert_eq!(queue.next(|_| Time::ZERO), Some((Time::ZERO + ms(5), 1)), "by arrival");
        assert_eq!(queue.next(|_| Time::ZERO + ms(20)), Some((Time::ZERO + ms(20), 2)), "both are there: as sent");
        let busy = |node: Index| Time::ZERO + ms(if node == 2 { 30 } else { 20 });
        assert_eq!(queue.next(busy), Some((Time::ZERO + ms(20), 1)), "one hangs");
        queue.drop_all(1);
        assert_eq!(queue.next(busy), Some((Time::ZERO + ms(30), 2)));
        assert_eq!(texts(&queue.take(2, Time::ZERO + ms(30))), ["early"]);
        assert_eq!(queue.next(busy), None);
    }

    #[test]
    fn the_order_is_that_of_one_list_of_all_events() {
        for seed in 0..50 {
            let mut dice = ChaCha8Rng::seed_from_u64(seed);
            let mut below = |limit: u32| dice.next_u32() % limit;
            let (mut queue, mut now, mut free_from) = (Queue::default(), Time::ZERO, [Time::ZERO; 4]);
            // Receiver, arrival and name, in the order in which they were sent.
            let mut list: Vec<(Index, Time, String)> = Vec::new();
            let mut last_arrival: HashMap<(Index, Index), Time> = HashMap::new();
            for number in 0..300 {
                if below(3) < 2 {
                    let (from, to, delay) = (below(4) as Index, below(4) as Index, ms(below(20).into()));
                    let name = format!("event {number}");
                    queue.send(Some(from), to, flag(&name), now, delay);
                    let last = last_arrival.entry((from, to)).or_insert(Time::ZERO);
                    *last = (now + delay).max(*last);
                    list.push((to, *last, name));
                    continue;
                }
                let turns = list.iter().map(|(to, arrives, _)| ((*arrives).max(free_from[*to]), *to));
                let next = turns.min_by_key(|(at, _)| *at);
                assert_eq!(queue.next(|node| free_from[node]), next, "seed {seed}");
                let Some((at, node)) = next else { continue };
                now = now.max(at);
                let has_arrived = |(to, arrives, _): &mut (Index, Time, String)| *to == node && *arrives <= now;
                let mut arrived: Vec<_> = list.extract_if(.., has_arrived).collect();
                arrived.sort_by_key(|(_, arrives, _)| *arrives);
                let expected: Vec<String> = arrived.into_iter().map(|(_, _, name)| name).collect();
                assert_eq!(texts(&queue.take(node, now)), expected, "seed {seed}");
                free_from[node] = now + ms(below(30).into());
            }
        }
    }
}
