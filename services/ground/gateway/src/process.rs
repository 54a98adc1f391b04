//! The gateway as a process: a listener, room for its clients, and threads that answer while the node runs.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::num::NonZeroU16;
use std::sync::Arc;

use rustls::ServerConfig;
use tokio::runtime::Builder;
use tokio::sync::oneshot;

use crate::http::Api;
use crate::server::serve;
use crate::{Gateway, sockets};

/// Threads that answer requests: one is not held up by a document that the other makes.
const THREADS: usize = 2;

/// A gateway that listens and does not answer yet.
pub struct GatewayProcess {
    node: Gateway,
    api: Api,
    listener: TcpListener,
    tls: Option<Arc<ServerConfig>>,
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
        tls: Option<Arc<ServerConfig>>,
    ) -> Result<GatewayProcess, StartError> {
        let listener = TcpListener::bind(address).map_err(|cause| StartError::Listen { address, cause })?;
        listener.set_nonblocking(true)?;
        sockets::bound(&listener)?;
        let room = sockets::make_room(api.config.max_connections.get().into())?;
        let room = u16::try_from(room).ok().and_then(NonZeroU16::new);
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
        let runtime = Builder::new_multi_thread().worker_threads(THREADS).enable_all().build()?;
        let _entered = runtime.enter();
        let listener = tokio::net::TcpListener::from_std(self.listener)?;
        let (end, ended) = oneshot::channel::<()>();
        runtime.spawn(serve(listener, self.tls, self.api, async {
            let _ = ended.await;
        }));
        let result = run_node(&mut self.node);
        drop(end);
        // An open stream does not keep the process alive.
        runtime.shutdown_background();
        Ok(result)
    }
}
