//! The gateway as a process: a listener, room for its clients, and threads that answer while the node runs.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::num::NonZeroU16;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, RwLock};
use std::time::{Duration, SystemTime};

use tokio::runtime::{Builder, Runtime};
use tokio::sync::oneshot;

use crate::access::utc_ms_now;
use crate::file_watch::FileWatch;
use crate::http::Api;
use crate::http::standstill::since_boot;
use crate::server::serve;
use crate::tls::Encryption;
use crate::{Gateway, sockets};

/// Threads that answer requests: one is not held up by a document that the other makes.
const THREADS: usize = 2;
/// Threads that wait for the disk, for lists and downloads of recordings. What waits for them has a share (`recording::routes`), and
/// whatever may not wait for that long has a thread of its own (`file_watch`). All are started with the gateway and none later: at
/// its limit of threads or memory it could not, and tokio would panic.
const DISK_THREADS: usize = 4;
/// How long they are waited for at the start.
const START_LIMIT: Duration = Duration::from_secs(1);
/// An idle thread is kept for the life of the process.
const KEPT: Duration = Duration::from_secs(u32::MAX as u64);

/// A gateway that listens and does not answer yet.
pub struct GatewayProcess {
    node: Gateway,
    api: Api,
    listener: TcpListener,
    tls: Option<Encryption>,
}

/// Why a gateway cannot start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The address cannot be listened on.
    #[error("cannot listen on {address}: {cause}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the operating system said.
        cause: io::Error,
    },
    /// The operating system grants no sockets or threads.
    #[error("the operating system refuses: {0}")]
    System(#[from] io::Error),
}

impl GatewayProcess {
    /// Listens on `address`; connections are encrypted with `tls`, if there is any.
    ///
    /// # Errors
    /// When the operating system refuses the address or the sockets.
    pub fn bind(
        (node, mut api): (Gateway, Api),
        address: SocketAddr,
        tls: Option<Encryption>,
    ) -> Result<GatewayProcess, StartError> {
        let listener = TcpListener::bind(address).map_err(|cause| StartError::Listen { address, cause })?;
        listener.set_nonblocking(true)?;
        sockets::bound(&listener)?;
        // From here on a client's order may wait.
        api.standstill.tick(since_boot());
        let room = sockets::make_room(api.config.max_connections.get().into())?;
        let room = u16::try_from(room).ok().and_then(NonZeroU16::new);
        api.certificate = tls.as_ref().map(|it| it.shown.clone());
        api.config.max_connections = room.ok_or_else(|| io::Error::other("it allows too few open files"))?;
        Ok(GatewayProcess { node, api, listener, tls })
    }

    /// Where clients find it, such as `http://127.0.0.1:8080`.
    ///
    /// # Errors
    /// When the operating system does not know the socket.
    pub fn url(&self) -> io::Result<String> {
        let scheme = if self.tls.is_some() { "https" } else { "http" };
        Ok(format!("{scheme}://{}", self.listener.local_addr()?))
    }

    /// Answers requests while `run_node` runs, and returns what that does.
    ///
    /// # Errors
    /// When there can be no threads.
    pub fn run<T>(mut self, run_node: impl FnOnce(&mut Gateway) -> T) -> Result<T, StartError> {
        let runtime = runtime()?;
        start_disk_threads(&runtime);
        let _watches = watch_files(&self.api)?;
        let _entered = runtime.enter();
        let listener = tokio::net::TcpListener::from_std(self.listener)?;
        let (end, ended) = oneshot::channel::<()>();
        let server = runtime.spawn(serve(
            listener,
            self.tls.map(|it| it.config),
            self.api,
            Box::pin(async {
                let _ = ended.await;
            }),
        ));
        let result = run_node(&mut self.node);
        drop(end);
        // Answers that are ready are still sent, for no longer than the server's grace period.
        let _ = runtime.block_on(server);
        // A blocked disk does not keep the process alive.
        runtime.shutdown_background();
        Ok(result)
    }
}

/// The threads that follow the files of the tokens and of the certificate.
fn watch_files(api: &Api) -> io::Result<Vec<FileWatch>> {
    let (tokens, authorities) = (api.tokens.clone(), api.authorities.clone());
    let mut watches = vec![FileWatch::start("tokens", move || {
        tokens.look();
        // Who may not command any more has command of no vehicle, so that nobody is locked out by somebody who can neither give an order
        // nor hand over.
        let (valid, utc_ms) = (tokens.get(), utc_ms_now());
        authorities.keep(|holder| valid.let_command(holder, utc_ms));
    })?];
    if let Some(shown) = api.certificate.clone() {
        #[expect(clippy::disallowed_methods, reason = "certificates expire by UTC")]
        watches.push(FileWatch::start("certificate", move || shown.look(SystemTime::now()))?);
    }
    Ok(watches)
}

fn runtime() -> io::Result<Runtime> {
    let mut builder = Builder::new_multi_thread();
    builder.worker_threads(THREADS).max_blocking_threads(DISK_THREADS).thread_keep_alive(KEPT);
    builder.enable_all().build()
}

/// Has the runtime start every thread that it may have for the disk: each waits until all of them run.
fn start_disk_threads(runtime: &Runtime) {
    let all_run = Arc::new(RwLock::new(()));
    let (started, starts) = sync_channel(DISK_THREADS);
    let held = all_run.write();
    for _ in 0..DISK_THREADS {
        let (started, all_run) = (started.clone(), all_run.clone());
        runtime.spawn_blocking(move || {
            // Fails only where it is not waited for any more.
            let _ = started.send(());
            drop(all_run.read());
        });
    }
    for _ in 0..DISK_THREADS {
        if starts.recv_timeout(START_LIMIT).is_err() {
            tracing::warn!("the operating system gives few threads: recordings are listed slowly");
            break;
        }
    }
    drop(held);
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, reason = "a test waits for what another thread does, up to a limit")]
mod tests {
    use std::net::Ipv4Addr;
    use std::os::unix::fs::PermissionsExt as _;

    use domain::time::Pace;

    use super::*;
    use crate::AccessControl;
    use crate::access::{Role, Tokens, entry};
    use crate::audit::Audit;

    const CONFIG: &str = include_str!("../tests/world/config.toml");

    #[test]
    fn an_order_that_waits_for_a_gateway_that_starts_is_known() {
        let access = AccessControl { tokens: Tokens::default(), audit: Audit::in_memory() };
        let gateway =
            Gateway::new(&toml::from_str(CONFIG).unwrap(), Pace::REAL_TIME, access, &Default::default(), || {});
        let process = GatewayProcess::bind(gateway, (Ipv4Addr::LOCALHOST, 0).into(), None).unwrap();
        let later = since_boot() + Duration::from_secs(10);
        assert!(process.api.standstill.may_have_waited(later, later).is_some());
    }

    #[test]
    fn no_thread_is_started_for_the_disk_after_the_start() {
        let runtime = runtime().unwrap();
        start_disk_threads(&runtime);
        let (started, starts) = sync_channel(2 * DISK_THREADS);
        let gate = Arc::new(RwLock::new(()));
        let held = gate.write().unwrap();
        for _ in 0..2 * DISK_THREADS {
            let (started, gate) = (started.clone(), gate.clone());
            runtime.spawn_blocking(move || {
                started.send(std::thread::current().id()).unwrap();
                drop(gate.read());
            });
        }
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..DISK_THREADS {
            seen.insert(format!("{:?}", starts.recv_timeout(START_LIMIT).unwrap()));
        }
        assert_eq!(seen.len(), DISK_THREADS);
        drop(held);
        for _ in 0..DISK_THREADS {
            assert!(seen.contains(&format!("{:?}", starts.recv_timeout(START_LIMIT).unwrap())));
        }
    }

    #[test]
    fn a_token_that_is_removed_is_noticed_although_all_threads_for_the_disk_are_busy() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens.toml");
        let [anna, ben] = ["anna", "ben"].map(|it| entry(it, &[Role::Operator], it));
        std::fs::write(&path, anna + &ben).unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o600)).unwrap();
        let access = AccessControl { tokens: Tokens::read(&path).unwrap(), audit: Audit::in_memory() };
        let gateway =
            Gateway::new(&toml::from_str(CONFIG).unwrap(), Pace::REAL_TIME, access, &Default::default(), || {});
        let process = GatewayProcess::bind(gateway, (Ipv4Addr::LOCALHOST, 0).into(), None).unwrap();
        let (tokens, authorities) = (process.api.tokens.clone(), process.api.authorities.clone());
        let now = std::time::Instant::now();
        authorities.take("uav1", &"anna".into(), now).unwrap();
        process
            .run(|_| {
                let gate = Arc::new(RwLock::new(()));
                let _held = gate.write().unwrap();
                for _ in 0..2 * DISK_THREADS {
                    let gate = gate.clone();
                    tokio::task::spawn_blocking(move || drop(gate.read()));
                }
                std::fs::write(&path, ben).unwrap();
                let has_command = || authorities.of("uav1", now).holder.is_some();
                while tokens.get().identify("anna", 0).is_some() || has_command() {
                    assert!(now.elapsed() < Duration::from_secs(20), "the token is still valid");
                    std::thread::yield_now();
                }
            })
            .unwrap();
    }
}
