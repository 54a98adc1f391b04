//! Calls under way: sent, repeated while nobody serves them, ended by their deadline at the latest.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use kittiwake_proto::topics::{Request, Response, Service};
use kittiwake_proto::v1::Attachment;
use node::{CallError, CallId, Event, VehicleId};
use prost::Message as _;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Querier;
use zenoh::{Session, Wait};

use crate::mailbox::{Mail, Mailbox};
use crate::{BusError, Scope, trace};

/// How soon a request that nobody served is sent again.
const AGAIN: Duration = Duration::from_millis(20);

pub(crate) struct Calls<'a> {
    session: &'a Session,
    scope: &'a Scope,
    mailbox: Mailbox,
    queriers: HashMap<(Option<VehicleId>, Service), Querier<'a>>,
    open: HashMap<CallId, Open>,
}

struct Open {
    vehicle: Option<VehicleId>,
    service: Service,
    payload: Vec<u8>,
    attachment: Vec<u8>,
    deadline: Instant,
    attempt: u32,
    /// When to send it again, while it is not on its way.
    again: Option<Instant>,
}

impl<'a> Calls<'a> {
    pub(crate) fn new(session: &'a Session, scope: &'a Scope, mailbox: Mailbox) -> Calls<'a> {
        Calls { session, scope, mailbox, queriers: HashMap::new(), open: HashMap::new() }
    }

    /// Sends a request; its outcome comes through the mailbox, exactly once.
    pub(crate) fn call(
        &mut self,
        call: CallId,
        vehicle: Option<VehicleId>,
        request: &Request,
        deadline: Instant,
    ) -> Result<(), BusError> {
        let traceparent = trace::current().unwrap_or_default();
        let attachment = Attachment { traceparent, ..Default::default() }.encode_to_vec();
        let (service, payload) = (request.service(), request.encode());
        self.open.insert(call, Open { vehicle, service, payload, attachment, deadline, attempt: 0, again: None });
        self.send(call)
    }

    /// When [`Calls::tend`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.open.values().map(|it| it.again.map_or(it.deadline, |again| again.min(it.deadline))).min()
    }

    /// Sends again what is due; what is past its deadline ends as an event for the node.
    pub(crate) fn tend(&mut self, now: Instant, events: &mut Vec<Event>) -> Result<(), BusError> {
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
        due.into_iter().try_for_each(|call| self.send(call))
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

    fn send(&mut self, call: CallId) -> Result<(), BusError> {
        let Some(open) = self.open.get_mut(&call) else { return Ok(()) };
        open.attempt += 1;
        open.again = None;
        let (vehicle, service, attempt) = (open.vehicle.clone(), open.service, open.attempt);
        let querier = match self.queriers.entry((vehicle.clone(), service)) {
            std::collections::hash_map::Entry::Occupied(it) => it.into_mut(),
            std::collections::hash_map::Entry::Vacant(it) => {
                it.insert(declare(self.session, self.scope, vehicle.as_ref(), service)?)
            }
        };
        let mut outcome = Outcome { mailbox: self.mailbox.clone(), call, attempt, answered: false };
        let sent = querier
            .get()
            .payload(open.payload.clone())
            .attachment(open.attachment.clone())
            .callback_mut(move |reply| {
                let result = match reply.result() {
                    Ok(sample) => match Response::decode(service, &sample.payload().to_bytes()) {
                        Ok(response) => Ok(Event::Reply { call, result: Ok(response) }),
                        Err(_) => Err(CallError::Malformed),
                    },
                    // Our own refusals of malformed requests, and zenoh's time-outs.
                    Err(_) => Err(CallError::Unanswered),
                };
                outcome.answer(result);
            })
            .wait();
        if let Err(cause) = sent {
            tracing::warn!(service = service.key(), %cause, "request not sent");
        }
        Ok(())
    }
}

fn declare<'a>(
    session: &'a Session,
    scope: &Scope,
    vehicle: Option<&VehicleId>,
    service: Service,
) -> Result<Querier<'a>, BusError> {
    let key = scope.publish(vehicle, service.key());
    session
        .declare_querier(key.clone())
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::InteractiveHigh)
        .express(true)
        .wait()
        .map_err(|cause| BusError::Declare { key, cause: cause.to_string() })
}

/// Lives in the query's callback: when zenoh drops it without an answer, nobody served the query.
struct Outcome {
    mailbox: Mailbox,
    call: CallId,
    attempt: u32,
    answered: bool,
}

impl Outcome {
    fn answer(&mut self, result: Result<Event, CallError>) {
        if !std::mem::replace(&mut self.answered, true) {
            self.mailbox.push(Mail::Answer { call: self.call, attempt: self.attempt, result });
        }
    }
}

impl Drop for Outcome {
    fn drop(&mut self) {
        if !self.answered {
            self.mailbox.push(Mail::Unserved { call: self.call, attempt: self.attempt });
        }
    }
}
