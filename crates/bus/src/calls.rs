//! Calls under way: sent, repeated while nobody serves them, ended by their deadline at the latest.

#![expect(clippy::disallowed_methods, reason = "calls have deadlines on the wall clock")]

use std::collections::HashMap;
use std::time::{Duration, Instant};

use kittiwake_proto::topics::{Request, Response, Service};
use kittiwake_proto::v1::Attachment;
use node::{CallError, CallId, Event, VehicleId};
use prost::Message as _;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, Querier, QueryTarget};
use zenoh::{Session, Wait};

use crate::clock::monotonic_ns;
use crate::direct::Links;
use crate::inbox::{LATE, SharedClocks};
use crate::mailbox::{Mail, Mailbox};
use crate::neighbours::Neighbours;
use crate::{BusError, Scope, trace};

/// How soon a request that nobody served is sent again.
const AGAIN: Duration = Duration::from_millis(20);

pub(crate) struct Calls<'a> {
    session: &'a Session,
    scope: &'a Scope,
    mailbox: Mailbox,
    clocks: SharedClocks,
    /// How a request leaves, unless it goes directly.
    routed: HashMap<(Option<VehicleId>, Service), Querier<'a>>,
    open: HashMap<CallId, Open>,
}

struct Open {
    vehicle: Option<VehicleId>,
    request: Request,
    traceparent: String,
    /// When it was first sent, by the machine's monotonic clock: sent again it is as old as it is.
    said_ns: u64,
    deadline: Instant,
    attempt: u32,
    /// When to send it again, while it is not on its way.
    again: Option<Instant>,
}

impl<'a> Calls<'a> {
    pub(crate) fn new(session: &'a Session, scope: &'a Scope, mailbox: Mailbox, clocks: SharedClocks) -> Calls<'a> {
        Calls { session, scope, mailbox, clocks, routed: HashMap::new(), open: HashMap::new() }
    }

    /// Sends a request; its outcome comes through the mailbox, exactly once.
    pub(crate) fn call(
        &mut self,
        call: CallId,
        vehicle: Option<VehicleId>,
        request: Request,
        deadline: Instant,
        links: &mut Links,
        neighbours: &Neighbours,
    ) -> Result<(), BusError> {
        let (traceparent, said_ns) = (trace::current().unwrap_or_default(), monotonic_ns());
        self.open.insert(call, Open { vehicle, request, traceparent, said_ns, deadline, attempt: 0, again: None });
        self.send(call, links, neighbours)
    }

    /// When [`Calls::tend`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.open.values().map(|it| it.again.map_or(it.deadline, |again| again.min(it.deadline))).min()
    }

    /// Sends again what is due; what is past its deadline ends as an event for the node.
    pub(crate) fn tend(
        &mut self,
        now: Instant,
        events: &mut Vec<Event>,
        links: &mut Links,
        neighbours: &Neighbours,
    ) -> Result<(), BusError> {
        let mut due: Vec<_> =
            self.open.iter().filter(|(_, it)| it.again.is_some_and(|at| at <= now)).map(|(id, _)| *id).collect();
        let mut late: Vec<_> = self.open.iter().filter(|(_, it)| it.deadline <= now).map(|(id, _)| *id).collect();
        due.sort();
        late.sort();
        for call in late {
            if let Some(open) = self.open.remove(&call) {
                let error = if open.again.is_some() { CallError::Unavailable } else { CallError::Unanswered };
                events.push(Event::Reply { call, result: Err(error) });
            }
        }
        due.into_iter().try_for_each(|call| self.send(call, links, neighbours))
    }

    /// The event for an answer that arrived; `None` if the call has already ended.
    pub(crate) fn answered(&mut self, call: CallId, attempt: u32, result: Result<Event, CallError>) -> Option<Event> {
        self.open.get(&call).filter(|it| it.attempt == attempt)?;
        self.open.remove(&call);
        Some(result.unwrap_or_else(|error| Event::Reply { call, result: Err(error) }))
    }

    /// Nobody served the attempt: it is repeated a little later.
    pub(crate) fn unserved(&mut self, call: CallId, attempt: u32, now: Instant) {
        if let Some(open) = self.open.get_mut(&call)
            && open.attempt == attempt
        {
            open.again = Some(now + AGAIN);
        }
    }

    /// To a node of this process, if one serves it. Otherwise the first time directly, where somebody serves it there; what did not arrive so
    /// is sent by the router the next time.
    fn send(&mut self, call: CallId, links: &mut Links, neighbours: &Neighbours) -> Result<(), BusError> {
        let Some(open) = self.open.get_mut(&call) else { return Ok(()) };
        open.attempt += 1;
        open.again = None;
        let (vehicle, service, attempt) = (open.vehicle.clone(), open.request.service(), open.attempt);
        if let Some(server) = neighbours.server(service) {
            let outcome = Outcome::new(self.mailbox.clone(), call, attempt, 1);
            server.ask(vehicle, open.request.clone(), &open.traceparent, outcome);
            return Ok(());
        }
        let said_receiver_monotonic_ns = match (&vehicle, self.scope) {
            (Some(vehicle), Scope::Fleet) => match self.clocks.theirs(vehicle, open.said_ns) {
                Some(said) => said,
                // Not heard (yet): nobody there to serve it.
                None => {
                    open.again = Some(Instant::now() + AGAIN);
                    return Ok(());
                }
            },
            _ => 0,
        };
        // From the ground a vehicle is asked over both connections of the link. Without a link there is one answer, and one
        // that is late counts as unknown: this end cannot tell.
        let copies = if matches!((self.scope, &vehicle), (Scope::Fleet, Some(_))) { 2 } else { 1 };
        let traceparent = open.traceparent.clone();
        let key = self.scope.publish(vehicle.as_ref(), service.key());
        let whole = self.scope.whole(&key);
        let attachment = Attachment { traceparent, said_receiver_monotonic_ns, key: whole, ..Default::default() };
        let (attachment, payload) = (attachment.encode_to_vec(), open.request.encode());
        if attempt == 1 && links.ask(service, (call, attempt), &attachment, &payload) {
            return Ok(());
        }
        let querier = match self.routed.entry((vehicle, service)) {
            std::collections::hash_map::Entry::Occupied(it) => it.into_mut(),
            std::collections::hash_map::Entry::Vacant(it) => {
                let target = if copies == 2 { QueryTarget::All } else { QueryTarget::BestMatching };
                it.insert(declare(self.session, &key, target)?)
            }
        };
        let mut outcome = Outcome::new(self.mailbox.clone(), call, attempt, copies);
        let sent = querier
            .get()
            .payload(payload)
            .attachment(attachment)
            .callback_mut(move |reply| match reply.result() {
                Ok(sample) => outcome.answer(match Response::decode(service, &sample.payload().to_bytes()) {
                    Ok(response) => Ok(Event::Reply { call, result: Ok(response) }),
                    Err(_) => Err(CallError::Malformed),
                }),
                Err(refusal) if refusal.payload().to_bytes().starts_with(LATE.as_bytes()) => outcome.refused += 1,
                // Our own refusals of malformed requests, requests that the node left without a reply, and zenoh's time-outs.
                Err(_) => outcome.answer(Err(CallError::Unanswered)),
            })
            .wait();
        if let Err(cause) = sent {
            tracing::warn!(service = service.key(), %cause, "request not sent");
        }
        Ok(())
    }
}

fn declare<'a>(session: &'a Session, key: &str, target: QueryTarget) -> Result<Querier<'a>, BusError> {
    session
        .declare_querier(key.to_owned())
        .target(target)
        // Each answer as it comes.
        .consolidation(ConsolidationMode::None)
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::InteractiveHigh)
        // Not express: each express message takes one of the two batches of its queue, and of a burst of requests the third would be
        // lost to a link that is busy for a millisecond, and known to be lost only when zenoh gives it up.
        .express(false)
        .wait()
        .map_err(|cause| BusError::Declare { key: key.to_owned(), cause: cause.to_string() })
}

/// Lives in the query's callback, or with the node of this process that was asked. What counts is the first answer. That the request came too
/// late counts only when zenoh drops this, since no answer comes any more, and only if every copy was too late: else one may have been
/// obeyed, and its answer lost. Dropped with neither, nobody served the query.
pub(crate) struct Outcome {
    mailbox: Mailbox,
    call: CallId,
    attempt: u32,
    /// Ways that the request goes.
    copies: u32,
    /// Copies that were refused because they were too old.
    refused: u32,
    answered: bool,
}

impl Outcome {
    /// Nothing has come yet of the request, which goes `copies` ways.
    pub(crate) fn new(mailbox: Mailbox, call: CallId, attempt: u32, copies: u32) -> Outcome {
        Outcome { mailbox, call, attempt, copies, refused: 0, answered: false }
    }

    /// The node that was asked has answered; `None`: it has left the request without an answer.
    pub(crate) fn settle(mut self, response: Option<Response>) {
        let call = self.call;
        self.answer(match response {
            Some(response) => Ok(Event::Reply { call, result: Ok(response) }),
            None => Err(CallError::Unanswered),
        });
    }

    fn answer(&mut self, result: Result<Event, CallError>) {
        if !std::mem::replace(&mut self.answered, true) {
            self.mailbox.push(Mail::Answer { call: self.call, attempt: self.attempt, result });
        }
    }
}

impl Drop for Outcome {
    fn drop(&mut self) {
        match self.refused {
            0 if !self.answered => {
                self.mailbox.push(Mail::Unserved { call: self.call, attempt: self.attempt });
            }
            refused if self.copies <= refused => self.answer(Err(CallError::Late)),
            _ => self.answer(Err(CallError::Unanswered)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wake::Wake;

    /// What the loop hears of a request that went `copies` ways, of which `refused` were too late.
    #[track_caller]
    fn check(copies: u32, refused: u32, answer: Option<Result<Event, CallError>>, expected: &str) {
        let mailbox = Mailbox::new(&Wake::new().unwrap());
        let mut outcome = Outcome::new(mailbox.clone(), CallId(1), 1, copies);
        outcome.refused = refused;
        answer.into_iter().for_each(|it| outcome.answer(it));
        drop(outcome);
        let mut heard = Vec::new();
        mailbox.take(&mut heard);
        let heard: Vec<_> = heard
            .iter()
            .map(|it| match it {
                Mail::Answer { result: Ok(_), .. } => "answered".to_owned(),
                Mail::Answer { result: Err(error), .. } => format!("{error:?}"),
                Mail::Unserved { .. } => "Unserved".to_owned(),
                Mail::Event(..) | Mail::Said(..) => unreachable!("nothing else is put in"),
            })
            .collect();
        assert_eq!(heard, [expected]);
    }

    #[test]
    fn a_request_is_late_only_if_every_copy_was() {
        let reply = || {
            let response = Response::Permission(kittiwake_proto::v1::PermissionReceipt::default());
            Some(Ok(Event::Reply { call: CallId(1), result: Ok(response) }))
        };
        check(1, 0, None, "Unserved");
        check(1, 1, None, "Late");
        check(2, 2, None, "Late");
        check(2, 1, None, "Unanswered");
        check(2, 1, reply(), "answered");
        check(2, 0, reply(), "answered");
    }
}
