//! The way from HTTP to the bus: orders go to the gateway's node through a bounded channel; the node
//! makes calls of them and hands each reply back.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use kittiwake_proto::topics::{Message, Request, Response};
use node::{CallError, CallId, Effect, VehicleId};
use tokio::sync::{mpsc, oneshot};

use crate::fleet::occurrence::Occurrence;

/// Orders that may wait for the node: far more than operators give at a time. More are refused.
const CAPACITY: usize = 256;

/// What HTTP demands of the node.
#[derive(Debug)]
pub(crate) enum Order {
    /// Call a vehicle's service.
    Call { vehicle: VehicleId, request: Request, trace: String, reply_to: oneshot::Sender<CallResult> },
    /// Publish a message for a vehicle.
    Publish { vehicle: VehicleId, message: Message },
    /// Add an event to a vehicle's journal.
    Journal { vehicle: VehicleId, occurrence: Occurrence },
}

pub(crate) type CallResult = Result<Response, CallError>;

/// The end of the HTTP half.
#[derive(Clone)]
pub(crate) struct OrderSender {
    orders: mpsc::Sender<Order>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl std::fmt::Debug for OrderSender {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OrderSender").finish_non_exhaustive()
    }
}

/// The node's end, with the calls that wait for their replies.
pub(crate) struct OrderReceiver {
    orders: mpsc::Receiver<Order>,
    open_calls: BTreeMap<CallId, oneshot::Sender<CallResult>>,
    last_call: u64,
    call_timeout: Duration,
}

/// The two ends. `wake` makes the node handle its orders; a call fails after `call_timeout` of mission time.
pub(crate) fn channel(call_timeout: Duration, wake: impl Fn() + Send + Sync + 'static) -> (OrderSender, OrderReceiver) {
    let (sender, orders) = mpsc::channel(CAPACITY);
    let receiver = OrderReceiver { orders, open_calls: BTreeMap::new(), last_call: 0, call_timeout };
    (OrderSender { orders: sender, wake: Arc::new(wake) }, receiver)
}

impl OrderSender {
    /// Calls a service; `None` when too many orders wait, or the node is gone.
    pub(crate) async fn call(&self, vehicle: &VehicleId, request: Request, trace: String) -> Option<CallResult> {
        let (reply_to, reply) = oneshot::channel();
        self.send(Order::Call { vehicle: vehicle.clone(), request, trace, reply_to }).then_some(())?;
        reply.await.ok()
    }

    /// Passes an order on; false when too many orders wait, or the node is gone.
    pub(crate) fn send(&self, order: Order) -> bool {
        let sent = self.orders.try_send(order).is_ok();
        (self.wake)();
        sent
    }
}

impl OrderReceiver {
    /// The oldest order that waits.
    pub(crate) fn next(&mut self) -> Option<Order> {
        self.orders.try_recv().ok()
    }

    /// The effect that makes the call; its reply goes to `reply_to`.
    pub(crate) fn call(
        &mut self,
        vehicle: VehicleId,
        request: Request,
        trace: String,
        reply_to: oneshot::Sender<CallResult>,
    ) -> Effect {
        self.last_call += 1;
        let call = CallId(self.last_call);
        self.open_calls.insert(call, reply_to);
        Effect::Call { call, vehicle: Some(vehicle), trace: Some(trace), request, timeout: self.call_timeout }
    }

    /// Hands a reply to the request that waits for it, if its client has not left.
    pub(crate) fn replied(&mut self, call: CallId, result: CallResult) {
        if let Some(reply_to) = self.open_calls.remove(&call) {
            let _ = reply_to.send(result);
        }
    }
}
