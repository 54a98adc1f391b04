//! What each mission manager answered last about its mission, for everybody who reads it.
//!
//! A reading is a call over the vehicle's radio link, with the priority of an order. So clients share it: all who read
//! within a second get the same answer, and nobody asks while the manager is asked. A failure is shared only with those
//! who waited for it. A client that has ordered something gets an answer that was asked for afterwards, and waits for
//! no other.

#![expect(clippy::disallowed_methods, reason = "what readers share is as old as their clock says")]

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use kittiwake_proto::topics::{Request, Response as Reply};
use kittiwake_proto::v1;
use node::VehicleId;
use v1::mission_request::Request as MissionCall;

use super::answers::{busy, invalid_reply, no_reply};
use crate::http::answer::{Answer, dated_document};
use crate::http::guard::AuthorizedRequest;
use crate::http::site::Site;
use crate::orders::CallResult;

/// How long an answer is shared.
const SHARED_FOR: Duration = Duration::from_secs(1);

/// The last reading of each vehicle since the last order that may have changed its mission. Only vehicles that were seen are read, so there
/// are few.
#[derive(Debug, Default)]
pub(crate) struct Missions(Mutex<BTreeMap<VehicleId, Last>>);

/// Locked while the manager is asked.
type Last = Arc<tokio::sync::Mutex<Option<Known>>>;

#[derive(Debug)]
struct Known {
    reading: Arc<Reading>,
    at: Instant,
}

/// What came of a call to the manager, and when.
#[derive(Debug)]
struct Reading {
    /// `None` if too many orders waited.
    result: Option<CallResult>,
    mission_time_s: Option<f64>,
    utc_ms: i64,
}

impl Missions {
    /// The vehicle's mission may have changed: what was read before is not shared any more, and nobody waits for what is being read.
    pub(crate) fn may_have_changed(&self, vehicle: &VehicleId) {
        self.lock().remove(vehicle);
    }

    /// What the manager answered to others, or answers to `ask`; `None` if asking failed.
    async fn read(
        &self,
        vehicle: &VehicleId,
        now: Instant,
        ask: impl Future<Output = Reading> + Send + 'static,
    ) -> Option<Arc<Reading>> {
        let of_vehicle = self.lock().entry(vehicle.clone()).or_default().clone();
        let mut last = of_vehicle.lock_owned().await;
        if let Some(known) = last.as_ref().filter(|it| it.is_for_one_who_came(now)) {
            return Some(known.reading.clone());
        }
        // In a task of its own: a client that leaves is no reason to ask again.
        let asking = tokio::spawn(async move {
            let reading = Arc::new(ask.await);
            *last = reading.was_asked().then(|| Known { reading: reading.clone(), at: Instant::now() });
            reading
        });
        asking.await.ok()
    }

    /// The data are whole even if a thread panicked while it held the lock.
    fn lock(&self) -> MutexGuard<'_, BTreeMap<VehicleId, Last>> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Known {
    /// Whether it is shared with one who came at that time.
    fn is_for_one_who_came(&self, then: Instant) -> bool {
        let has_waited = then <= self.at;
        has_waited || self.reading.is_good() && then.saturating_duration_since(self.at) < SHARED_FOR
    }
}

impl Reading {
    /// Whether the manager was asked at all.
    fn was_asked(&self) -> bool {
        self.result.is_some()
    }

    /// Whether the manager has told its mission.
    fn is_good(&self) -> bool {
        matches!(self.result, Some(Ok(Reply::Mission(v1::MissionReply { status: Some(_), .. }))))
    }
}

impl Site {
    /// The vehicle's mission, as the mission manager itself told it less than a second ago.
    pub(super) async fn read_mission(&self, request: &AuthorizedRequest) -> Answer {
        let vehicle = request.vehicle()?;
        let call = v1::MissionRequest { request: Some(MissionCall::Read(v1::ReadMission {})), ..Default::default() };
        let call = Request::Mission(call);
        let service = call.service().key();
        let ask = ask(self.clone(), vehicle.clone(), call, request.trace.clone());
        let reading = self.missions.read(vehicle, Instant::now(), ask).await.ok_or_else(busy)?;
        match reading.result.as_ref().ok_or_else(busy)? {
            Ok(Reply::Mission(v1::MissionReply { status: Some(status), .. })) => {
                Ok(dated_document(reading.mission_time_s, reading.utc_ms, status))
            }
            Ok(_) => Err(invalid_reply(request)),
            Err(error) => Err(no_reply(service, *error, false)),
        }
    }
}

async fn ask(site: Site, vehicle: VehicleId, call: Request, trace: String) -> Reading {
    let result = site.api.orders.call(&vehicle, call, trace).await;
    let snapshot = site.snapshot();
    Reading { result, mission_time_s: snapshot.mission_time_s(&vehicle), utc_ms: snapshot.now.utc_ms }
}

#[cfg(test)]
mod tests {
    use futures_util::FutureExt as _;
    use node::CallError;
    use tokio::sync::oneshot;

    use super::*;

    /// The time in what the manager tells now, as opposed to what was read before.
    const NOW: i64 = 7;

    /// What was read at that time.
    fn reading(result: Option<CallResult>, utc_ms: i64) -> Reading {
        Reading { result, mission_time_s: None, utc_ms }
    }

    /// The mission, told at that time.
    fn told(utc_ms: i64) -> Reading {
        let reply = v1::MissionReply { status: Some(v1::MissionStatus::default()), ..Default::default() };
        reading(Some(Ok(Reply::Mission(reply))), utc_ms)
    }

    /// When that was told which one reads who came then.
    async fn read(missions: &Missions, vehicle: &str, came: Instant) -> i64 {
        missions.read(&vehicle.into(), came, async { told(NOW) }).await.unwrap().utc_ms
    }

    /// Begins to read, and leaves. The answer may come later.
    fn begin(missions: &Missions, came: Instant) -> oneshot::Sender<Reading> {
        let (answer, answered) = oneshot::channel();
        let first = missions.read(&"uav1".into(), came, async { answered.await.unwrap() }).now_or_never();
        assert!(first.is_none());
        answer
    }

    #[tokio::test]
    async fn an_answer_is_shared_for_a_second_and_until_something_is_ordered() {
        let missions = Missions::default();
        let answer = async || {
            missions.read(&"uav1".into(), Instant::now() + SHARED_FOR, async { told(1) }).await.unwrap();
            Instant::now()
        };
        let now = answer().await;
        assert_eq!(read(&missions, "uav1", now).await, 1);
        assert_eq!(read(&missions, "uav2", now).await, NOW, "another vehicle");
        assert_eq!(read(&missions, "uav1", now + SHARED_FOR).await, NOW, "a second later");
        let now = answer().await;
        missions.may_have_changed(&"uav2".into());
        assert_eq!(read(&missions, "uav1", now).await, 1, "another vehicle's");
        missions.may_have_changed(&"uav1".into());
        assert_eq!(read(&missions, "uav1", now).await, NOW);
    }

    #[tokio::test]
    async fn nobody_asks_while_the_manager_is_asked_although_the_client_of_that_call_has_left() {
        let (missions, now) = (Missions::default(), Instant::now());
        let answer = begin(&missions, now);
        let mut second = std::pin::pin!(read(&missions, "uav1", now));
        assert!(second.as_mut().now_or_never().is_none());
        answer.send(told(1)).unwrap();
        assert_eq!(second.await, 1);
    }

    #[tokio::test]
    async fn after_an_order_nobody_waits_for_what_was_asked_before_it_or_gets_that() {
        let (missions, now) = (Missions::default(), Instant::now());
        let answer = begin(&missions, now);
        missions.may_have_changed(&"uav1".into());
        assert_eq!(read(&missions, "uav1", now).await, NOW);
        answer.send(told(1)).unwrap();
        tokio::task::yield_now().await;
        assert_eq!(read(&missions, "uav1", now).await, NOW);
    }

    /// When that was told which one reads who waited while this was read, and one who came just afterwards.
    async fn read_beside(result: Option<CallResult>) -> (i64, i64) {
        let (missions, now) = (Missions::default(), Instant::now());
        let answer = begin(&missions, now);
        let mut waits = std::pin::pin!(read(&missions, "uav1", now));
        assert!(waits.as_mut().now_or_never().is_none());
        answer.send(reading(result, 1)).unwrap();
        let waited = waits.await;
        (waited, read(&missions, "uav1", Instant::now() + SHARED_FOR / 2).await)
    }

    #[tokio::test]
    async fn what_is_no_answer_is_shared_only_with_those_who_waited_for_it() {
        assert_eq!(read_beside(told(1).result).await, (1, 1));
        assert_eq!(read_beside(Some(Err(CallError::Late))).await, (1, NOW));
        let without_mission = Reply::Mission(v1::MissionReply::default());
        assert_eq!(read_beside(Some(Ok(without_mission))).await, (1, NOW));
        // Too many orders: nobody was asked.
        assert_eq!(read_beside(None).await, (NOW, NOW));
    }
}
