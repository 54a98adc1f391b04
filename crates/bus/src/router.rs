//! The router that every process of a side connects to.

use std::sync::mpsc;

use zenoh::Wait;

use crate::session::{config, set};
use crate::{BusError, Stop};

/// Routes between the processes that connect, until stopped. `ready` is told the locators that
/// were really bound: port 0 becomes a free one.
pub fn run_router(listen: &[String], stop: &Stop, ready: impl FnOnce(&[String])) -> Result<(), BusError> {
    let listening = |cause: String| BusError::Listen { locators: listen.join(", "), cause };
    let mut config = config("router")?;
    let endpoints = listen.iter().map(|it| format!("\"{it}\"")).collect::<Vec<_>>().join(",");
    set(&mut config, "listen/endpoints", &format!("[{endpoints}]"))?;
    // Fail instead of running without being reachable, and do not wait for peers that never come.
    set(&mut config, "listen/exit_on_failure", "true")?;
    set(&mut config, "scouting/delay", "0")?;
    let session = zenoh::open(config).wait().map_err(|cause| listening(cause.to_string()))?;
    let bound: Vec<String> = session.info().locators().wait().iter().map(|it| it.to_string()).collect();
    if bound.is_empty() {
        return Err(listening("nothing was bound".into()));
    }
    ready(&bound);
    let (ended, end) = mpsc::channel::<()>();
    stop.on_stop(move || drop(ended));
    // The channel never carries anything: it ends when the stop drops its sender.
    let _ = end.recv();
    let _ = session.close().wait();
    Ok(())
}
