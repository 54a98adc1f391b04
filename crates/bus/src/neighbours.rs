//! The other nodes of the same process. Messages and requests are handed over to them in memory: no encoding, no socket, no waking.
//!
//! They go into the receiver's mailbox, where whatever comes over the bus goes: what one node says keeps its order, of a telemetry topic
//! only the newest waits, and a flood is bounded and counted. What is published leaves over the bus as well, for everybody else. From
//! there it never comes back, since publishers send to other sessions only, so nobody hears it twice.

use kittiwake_proto::topics::{Message, Request, Service, Topic};
use node::{Node, VehicleId};

use crate::calls::Outcome;
use crate::inbox::Inbox;

/// A node that has others beside it, as they see it.
#[derive(Clone)]
pub(crate) struct Neighbour {
    name: &'static str,
    topics: &'static [Topic],
    services: &'static [Service],
    inbox: Inbox,
}

impl Neighbour {
    /// `node`, which takes from `inbox`.
    pub(crate) fn of(node: &dyn Node, inbox: &Inbox) -> Neighbour {
        Neighbour { name: node.name(), topics: node.subscriptions(), services: node.serves(), inbox: inbox.clone() }
    }

    /// Asks it. It answers in one of its turns, like everybody who is asked.
    pub(crate) fn ask(&self, vehicle: Option<VehicleId>, request: Request, traceparent: &str, outcome: Outcome) {
        let key = self.inbox.scope().publish(vehicle.as_ref(), request.service().key());
        self.inbox.request_of_neighbour(&key, request, traceparent, outcome);
    }
}

/// The neighbours of one node, without the node itself.
#[derive(Clone, Default)]
pub(crate) struct Neighbours(Vec<Neighbour>);

impl Neighbours {
    /// All of a process but the one at `own`.
    pub(crate) fn of(all: &[Neighbour], own: usize) -> Neighbours {
        Neighbours(all.iter().enumerate().filter(|(place, _)| *place != own).map(|(_, it)| it.clone()).collect())
    }

    /// Hands a message over to each that listens to it.
    pub(crate) fn publish(&self, vehicle: Option<&VehicleId>, message: &Message, traceparent: &str) {
        let topic = message.topic();
        for Neighbour { inbox, .. } in self.0.iter().filter(|it| it.topics.contains(&topic)) {
            let vehicle = inbox.scope().vehicle_of(&inbox.scope().publish(vehicle, topic.key()));
            inbox.message_of_neighbour(vehicle, message.clone(), traceparent);
        }
    }

    /// The one that answers `service`.
    pub(crate) fn server(&self, service: Service) -> Option<&Neighbour> {
        self.0.iter().find(|it| it.services.contains(&service))
    }

    /// A node has left the process.
    pub(crate) fn leave(&mut self, name: &str) {
        self.0.retain(|it| it.name != name);
    }
}

#[cfg(test)]
mod tests {
    use domain::time::{Now, Time};
    use kittiwake_proto::topics::Response;
    use kittiwake_proto::v1;
    use node::{CallId, Effect, Event};

    use super::*;
    use crate::Scope;
    use crate::inbox::Asker;
    use crate::mailbox::{Mail, Mailbox};
    use crate::wake::Wake;

    /// Listens to flags and the battery, and answers requests for permissions, or does neither.
    struct Listener(&'static str, bool);

    impl Node for Listener {
        fn name(&self) -> &'static str {
            self.0
        }
        fn subscriptions(&self) -> &'static [Topic] {
            if self.1 { &[Topic::FlagEvent, Topic::BatteryStatus] } else { &[] }
        }
        fn serves(&self) -> &'static [Service] {
            if self.1 { &[Service::Permission] } else { &[] }
        }
        fn on(&mut self, _: Now, _: Event, _: &mut Vec<Effect>) {}
        fn deadline(&self) -> Option<Time> {
            None
        }
    }

    /// One process of three: two that listen, and one that only speaks.
    struct Three {
        inboxes: Vec<Inbox>,
        neighbours: Vec<Neighbours>,
    }

    const DEAF: usize = 2;

    impl Three {
        fn new() -> Three {
            let wake = Wake::new().unwrap();
            let nodes = [Listener("first", true), Listener("second", true), Listener("deaf", false)];
            let inbox = |_: &Listener| Inbox::new(&Scope::Vehicle("uav1".into()), Mailbox::new(&wake));
            let inboxes: Vec<Inbox> = nodes.iter().map(inbox).collect();
            let all: Vec<_> = nodes.iter().zip(&inboxes).map(|(node, inbox)| Neighbour::of(node, inbox)).collect();
            Three { inboxes, neighbours: (0..3).map(|it| Neighbours::of(&all, it)).collect() }
        }

        fn say(&self, from: usize, message: impl Into<Message>) {
            self.neighbours[from].publish(None, &message.into(), "");
        }

        /// What waits for a node, in a word each.
        fn heard(&self, at: usize) -> Vec<String> {
            let mut batch = Vec::new();
            self.inboxes[at].mailbox().take(&mut batch);
            batch.into_iter().map(word).collect()
        }

        /// `from` makes a call.
        fn ask(&self, from: usize, call: u64) {
            let request = Request::Permission(v1::PermissionRequest { area: "A".into(), ..Default::default() });
            let outcome = Outcome::new(self.inboxes[from].mailbox().clone(), CallId(call), 1, 1);
            let server = self.neighbours[from].server(Service::Permission).expect("somebody serves it");
            server.ask(None, request, "", outcome);
        }

        /// Who waits for the answer to a request that waits for a node.
        fn asker(&self, at: usize) -> Outcome {
            let mut batch = Vec::new();
            self.inboxes[at].mailbox().take(&mut batch);
            let Some(Mail::Event(Event::Request { token, .. }, _)) = batch.pop() else { panic!("a request waits") };
            let Some(Asker::Neighbour(outcome)) = self.inboxes[at].open().take(token) else { panic!("it waits") };
            outcome
        }
    }

    fn word(mail: Mail) -> String {
        match mail {
            Mail::Event(Event::Message { message: Message::FlagEvent(it), vehicle }, _) => {
                format!("{vehicle} {}", it.name)
            }
            Mail::Event(Event::Message { message: Message::BatteryStatus(it), .. }, _) => it.remaining.to_string(),
            Mail::Event(Event::Request { vehicle, .. }, _) => format!("{vehicle} asks"),
            Mail::Answer { call, result: Ok(Event::Reply { result: Ok(_), .. }), .. } => format!("{} answered", call.0),
            Mail::Answer { call, result: Err(error), .. } => format!("{} {error:?}", call.0),
            Mail::Unserved { call, .. } => format!("{} unserved", call.0),
            other => format!("{other:?}"),
        }
    }

    fn flag(name: &str) -> v1::FlagEvent {
        v1::FlagEvent { name: name.into(), ..Default::default() }
    }

    fn battery(remaining: f64) -> v1::BatteryStatus {
        v1::BatteryStatus { remaining, ..Default::default() }
    }

    #[test]
    fn each_message_is_heard_once_and_in_order_by_those_who_listen_and_never_by_who_said_it() {
        let three = Three::new();
        ["a", "b", "c"].iter().for_each(|it| three.say(0, flag(it)));
        assert_eq!(three.heard(1), ["uav1 a", "uav1 b", "uav1 c"]);
        assert!(three.heard(0).is_empty() && three.heard(DEAF).is_empty());
        assert!(three.heard(1).is_empty(), "once");
    }

    #[test]
    fn of_a_state_only_the_newest_waits() {
        let three = Three::new();
        three.say(DEAF, battery(1.0));
        three.say(DEAF, flag("a"));
        three.say(DEAF, battery(2.0));
        assert_eq!([0, 1].map(|it| three.heard(it)), [["2", "uav1 a"], ["2", "uav1 a"]]);
    }

    #[test]
    fn a_flood_is_bounded_and_counted() {
        let three = Three::new();
        (0..5000).for_each(|_| three.say(0, flag("flood")));
        assert_eq!(three.heard(1).len() as u64 + three.inboxes[1].mailbox().losses().dropped, 5000);
    }

    #[test]
    fn each_request_has_one_answer() {
        let three = Three::new();
        three.ask(DEAF, 1);
        let receipt = Response::Permission(v1::PermissionReceipt { received: true, ..Default::default() });
        three.asker(0).settle(Some(receipt));
        three.ask(DEAF, 2);
        three.asker(0).settle(None);
        assert_eq!(three.heard(DEAF), ["1 answered", "2 Unanswered"]);
        assert!(three.heard(1).is_empty(), "one is asked");
    }

    #[test]
    fn who_has_left_is_neither_told_nor_asked_and_what_it_was_asked_is_asked_again() {
        let mut three = Three::new();
        three.ask(DEAF, 1);
        drop(three.asker(0));
        assert_eq!(three.heard(DEAF), ["1 unserved"]);
        three.neighbours[DEAF].leave("first");
        three.say(DEAF, flag("a"));
        three.ask(DEAF, 2);
        assert!(three.heard(0).is_empty());
        assert_eq!(three.heard(1), ["uav1 a", "uav1 asks"]);
        three.neighbours[DEAF].leave("second");
        assert!(three.neighbours[DEAF].server(Service::Permission).is_none());
    }

    #[test]
    fn nobody_answers_itself() {
        let three = Three::new();
        three.ask(0, 1);
        assert_eq!((three.heard(0), three.heard(1)), (vec![], vec!["uav1 asks".to_owned()]));
    }
}
