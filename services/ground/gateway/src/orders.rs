//! The way from HTTP to the bus: wishes go to the gateway's node through a bounded channel, which
//! makes calls of them and hands each answer back.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use kittiwake_proto::topics::{Message, Request, Response};
use node::{CallError, CallId, Effect, VehicleId};
use tokio::sync::{mpsc, oneshot};

/// Wishes on their way: far more than operators have at a time. Beyond it they are refused.
const CAPACITY: usize = 256;

/// What HTTP wants of the node.
// Rare, and passed on one at a time: nothing is gained by boxing the large variant.
#[allow(clippy::large_enum_variant)]
#[derive(Debug)]
pub(crate) enum Wish {
    /// Ask a vehicle's service.
    Call { vehicle: VehicleId, request: Request, trace: String, answer: oneshot::Sender<Answer> },
    /// Publish for a vehicle.
    Publish { vehicle: VehicleId, message: Message },
    /// Add a line to a vehicle's history.
    Tell { vehicle: VehicleId, kind: &'static str, record: serde_json::Value },
}

pub(crate) type Answer = Result<Response, CallError>;

/// The HTTP side's end.
#[derive(Clone)]
pub(crate) struct Orders {
    wishes: mpsc::Sender<Wish>,
    wake: Arc<dyn Fn() + Send + Sync>,
}

impl std::fmt::Debug for Orders {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Orders").finish_non_exhaustive()
    }
}

/// The node's end.
pub(crate) struct Desk {
    wishes: mpsc::Receiver<Wish>,
    open: BTreeMap<CallId, oneshot::Sender<Answer>>,
    last_call: u64,
    patience: Duration,
}

/// The two ends. `wake` has the node act; a call is given up after `patience` of mission time.
pub(crate) fn channel(patience: Duration, wake: impl Fn() + Send + Sync + 'static) -> (Orders, Desk) {
    let (sender, wishes) = mpsc::channel(CAPACITY);
    (Orders { wishes: sender, wake: Arc::new(wake) }, Desk { wishes, open: BTreeMap::new(), last_call: 0, patience })
}

impl Orders {
    /// Asks; `None` when too much is asked at once, or the node is gone.
    pub(crate) async fn call(&self, vehicle: &VehicleId, request: Request, trace: String) -> Option<Answer> {
        let (answer, answered) = oneshot::channel();
        self.send(Wish::Call { vehicle: vehicle.clone(), request, trace, answer }).then_some(())?;
        answered.await.ok()
    }

    /// Passes a wish on; false when too much is asked at once, or the node is gone.
    pub(crate) fn send(&self, wish: Wish) -> bool {
        let sent = self.wishes.try_send(wish).is_ok();
        (self.wake)();
        sent
    }
}

impl Desk {
    /// The wish that came first.
    pub(crate) fn next(&mut self) -> Option<Wish> {
        self.wishes.try_recv().ok()
    }

    /// Makes a call.
    pub(crate) fn call(
        &mut self,
        vehicle: VehicleId,
        request: Request,
        trace: String,
        answer: oneshot::Sender<Answer>,
    ) -> Effect {
        self.last_call += 1;
        let call = CallId(self.last_call);
        self.open.insert(call, answer);
        Effect::Call { call, vehicle: Some(vehicle), trace: Some(trace), request, timeout: self.patience }
    }

    /// Hands an answer to whoever waits for it; one who has left does not mind.
    pub(crate) fn answered(&mut self, call: CallId, answer: Answer) {
        if let Some(waiting) = self.open.remove(&call) {
            let _ = waiting.send(answer);
        }
    }
}
