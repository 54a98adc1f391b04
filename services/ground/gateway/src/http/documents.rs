//! Documents that can be large: tracks, and lists of decisions, orders, refusals and recordings. Each costs as much time as hundreds of
//! orders, and who only watches may ask for many in a second.
//!
//! So they are made in a thread of their own, one after the other: the threads that answer take orders meanwhile. Clients take turns, so
//! that one who asks for many delays the others by no more than one of them.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::Builder;

use axum::http::StatusCode;
use prost::{Message, Name};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

use crate::access::Identity;
use crate::http::answer::{Answer, document};
use crate::http::problem::Problem;

type Job = Box<dyn FnOnce() + Send>;

/// Where they are made.
#[derive(Debug)]
pub(crate) struct Documents {
    /// To the thread; absent where the system has given none.
    thread: Option<SyncSender<Job>>,
    /// Whose document is made has it.
    turn: Arc<Semaphore>,
    /// Of each client that waits or has its turn: which of its own requests is next.
    own: Mutex<BTreeMap<Arc<str>, Arc<Semaphore>>>,
}

impl Documents {
    /// Starts the thread. It ends with the value.
    pub(crate) fn start() -> Documents {
        // Whose turn is over has given it back a moment before the thread takes what is next.
        let (thread, jobs) = sync_channel::<Job>(1);
        let started = Builder::new().name("documents".into()).spawn(move || {
            for job in jobs {
                // A document that cannot be made is no reason to make no other.
                let _ = catch_unwind(AssertUnwindSafe(job));
            }
        });
        if let Err(cause) = &started {
            tracing::warn!(%cause, "large documents are made by the threads that take orders");
        }
        Documents {
            thread: started.is_ok().then_some(thread),
            turn: Arc::new(Semaphore::new(1)),
            own: Mutex::default(),
        }
    }

    /// The answer with the message that `make` returns, which is called when it is the turn of `who`: until then it should hold nothing
    /// that is large, or a share of a limited resource.
    pub(crate) async fn make<M: Message + Name>(
        &self,
        who: &Identity,
        make: impl FnOnce() -> Result<M, Problem> + Send + 'static,
    ) -> Answer {
        let turn = self.turn_of(&who.name).await;
        let (done, made) = oneshot::channel();
        self.run(Box::new(move || {
            let answer = make().map(|it| document(&it));
            drop(turn);
            // Fails if the client has left.
            let _ = done.send(answer);
        }));
        let failed = |_| Err(Problem::new(StatusCode::INTERNAL_SERVER_ERROR, "the document could not be made"));
        made.await.unwrap_or_else(failed)
    }

    /// Waits for the turn of `who`. First come, first served, with one request of each client: its others wait until that has its answer.
    async fn turn_of(&self, who: &Arc<str>) -> [Option<OwnedSemaphorePermit>; 2] {
        // Neither is ever closed.
        let own = self.own(who).acquire_owned().await.ok();
        [own, self.turn.clone().acquire_owned().await.ok()]
    }

    fn own(&self, who: &Arc<str>) -> Arc<Semaphore> {
        // The data are whole even if a thread panicked while it held the lock.
        let mut own = self.own.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        own.retain(|_, it| 1 < Arc::strong_count(it));
        own.entry(who.clone()).or_insert_with(|| Arc::new(Semaphore::new(1))).clone()
    }

    fn run(&self, job: Job) {
        let left = match &self.thread {
            None => Some(job),
            Some(thread) => thread.try_send(job).err().map(|it| match it {
                TrySendError::Full(job) | TrySendError::Disconnected(job) => job,
            }),
        };
        // Nobody else does it.
        if let Some(job) = left {
            job();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;
    use std::time::Duration;

    use axum::response::Response;
    use futures_util::FutureExt as _;
    use kittiwake_proto::v1;
    use tokio::task::JoinHandle;

    use super::*;
    use crate::http::served::{OPERATOR, Served, WATCHER};

    /// Longer than anything takes on a busy machine.
    const LIMIT: Duration = Duration::from_secs(20);

    /// A document that is being made until the sender is dropped.
    async fn busy(documents: &Arc<Documents>, who: &Identity) -> (SyncSender<()>, JoinHandle<Answer>) {
        let (free, is_free) = sync_channel(0);
        let (begun, has_begun) = oneshot::channel();
        let (documents, who) = (documents.clone(), who.clone());
        let making = tokio::spawn(async move {
            let make = move || {
                begun.send(()).unwrap();
                let _ = is_free.recv_timeout(LIMIT);
                Ok(v1::Track::default())
            };
            documents.make(&who, make).await
        });
        has_begun.await.unwrap();
        (free, making)
    }

    /// In one thread: if a document were made where requests are answered, nothing would be.
    #[tokio::test]
    async fn while_a_document_is_made_others_wait_for_it_and_whatever_else_is_asked_for_is_answered() {
        let served = Served::new(&[]);
        let (free, making) = busy(&served.api.documents, &served.identity(WATCHER)).await;
        let uav = "/api/v1/vehicles/uav1";
        let large = [&format!("{uav}/track"), &format!("{uav}/decisions"), "/api/v1/audit", "/api/v1/audit/refusals"];
        let large = [&large[..], &["/api/v1/recordings"]].concat();
        for path in &large {
            assert!(served.get(path, OPERATOR).now_or_never().is_none(), "{path}");
        }
        for path in [uav, "/api/v1/vehicles", "/api/v1/session", "/healthz", "/metrics"] {
            let answer = served.get(path, WATCHER).now_or_never();
            assert_eq!(answer.map(|it| it.status()), Some(StatusCode::OK), "{path}");
        }
        let taken = served.send("POST", &format!("{uav}/command/take"), OPERATOR).await;
        assert_eq!((taken.status(), making.is_finished()), (StatusCode::OK, false));
        drop(free);
        assert!(making.await.unwrap().is_ok());
        for path in large {
            assert_eq!(served.get(path, OPERATOR).await.status(), StatusCode::OK, "{path}");
        }
    }

    /// With one thread for all disk work, so that a later task there ends after all earlier ones.
    #[test]
    fn recordings_that_were_read_have_their_share_until_it_is_their_turn() {
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().max_blocking_threads(1).build().unwrap();
        runtime.block_on(async {
            let folder = tempfile::tempdir().unwrap();
            let recorded = format!("[recording]\nfolder = {:?}", folder.path());
            let served = Served::new(&[("[recording]", &recorded)]);
            let (free, making) = busy(&served.api.documents, &served.identity(OPERATOR)).await;
            // As many as one token may have, which wait after they were read.
            let mut waiting = [(); 2].map(|()| Box::pin(served.get("/api/v1/recordings", WATCHER)));
            for _ in 0..2 {
                assert!(waiting.iter_mut().all(|it| it.as_mut().now_or_never().is_none()));
                tokio::task::spawn_blocking(|| ()).await.unwrap();
            }
            let status = |it: Response| it.status();
            let one_more = served.get("/api/v1/recordings", WATCHER).now_or_never();
            assert_eq!(one_more.map(status), Some(StatusCode::TOO_MANY_REQUESTS));
            drop(free);
            assert!(making.await.unwrap().is_ok());
            for it in waiting {
                assert_eq!(it.await.status(), StatusCode::OK);
            }
            assert_eq!(served.get("/api/v1/recordings", WATCHER).await.status(), StatusCode::OK);
        });
    }

    #[tokio::test]
    async fn one_is_made_at_a_time_and_clients_take_turns() {
        let served = Served::new(&[]);
        let (eve, anna) = (served.identity(WATCHER), served.identity(OPERATOR));
        let documents = served.api.documents.clone();
        let made: Arc<Mutex<Vec<&str>>> = Arc::default();
        let (done, is_done) = sync_channel(0);
        let is_done = Arc::new(Mutex::new(is_done));
        let (free, making) = busy(&documents, &eve).await;
        let ask = |who, name| {
            let (documents, made, is_done) = (&documents, made.clone(), is_done.clone());
            let mut asked = Box::pin(documents.make(who, move || {
                made.lock().unwrap().push(name);
                let _ = is_done.lock().unwrap().recv_timeout(LIMIT);
                Ok(v1::Track::default())
            }));
            assert!(asked.as_mut().now_or_never().is_none(), "{name}");
            asked
        };
        let of_eve = [ask(&eve, "first of eve"), ask(&eve, "second of eve")];
        let of_anna = [ask(&anna, "first of anna"), ask(&anna, "second of anna")];
        assert!(made.lock().unwrap().is_empty());
        drop(free);
        let [eve_1, eve_2] = of_eve;
        let [anna_1, anna_2] = of_anna;
        let mut all = Box::pin(async { tokio::join!(biased; eve_1, eve_2, anna_1, anna_2, making) });
        let expected = ["first of anna", "first of eve", "second of anna", "second of eve"];
        for number in 1..=expected.len() {
            while made.lock().unwrap().len() < number {
                assert!(all.as_mut().now_or_never().is_none());
                tokio::task::yield_now().await;
            }
            // Who may wait for a turn by now does so before this one is done.
            assert!(all.as_mut().now_or_never().is_none());
            done.send(()).unwrap();
        }
        let (a, b, c, d, e) = all.await;
        assert!([a, b, c, d, e.unwrap()].iter().all(Result::is_ok));
        assert_eq!(*made.lock().unwrap(), expected);
    }

    #[tokio::test]
    async fn one_that_fails_or_whose_client_has_left_keeps_no_other_from_being_made() {
        let served = Served::new(&[]);
        let (eve, documents) = (served.identity(WATCHER), &served.api.documents);
        let failed = documents.make(&eve, || -> Result<v1::Track, Problem> { panic!("a mistake") }).await;
        assert_eq!(failed.unwrap_err().detail(), "the document could not be made");
        let (free, making) = busy(documents, &eve).await;
        making.abort();
        assert!(documents.make(&eve, || Ok(v1::Track::default())).now_or_never().is_none());
        drop(free);
        assert!(documents.make(&eve, || Ok(v1::Track::default())).await.is_ok());
    }

    #[tokio::test]
    async fn without_a_thread_they_are_made_all_the_same() {
        let served = Served::new(&[]);
        let documents = Documents { thread: None, ..Documents::start() };
        assert!(documents.make(&served.identity(WATCHER), || Ok(v1::Track::default())).await.is_ok());
    }
}
