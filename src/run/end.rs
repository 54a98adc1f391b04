//! The end of a process: by a signal, or with its parent.

#![expect(clippy::disallowed_methods, reason = "a process that does not stop gets some time on the wall clock")]

use std::io::Read;
use std::sync::mpsc::sync_channel;
use std::thread::Builder;
use std::time::Duration;

use bus::Stop;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::outcome::Outcome;
use crate::output;

/// A process that was asked to end and has not ended after this time exits by itself.
const STOP_LIMIT: Duration = Duration::from_secs(2);

/// Calls `on_signal` on every Ctrl-C and SIGTERM, from a thread of its own.
pub fn on_signal(mut on_signal: impl FnMut() + Send + 'static) -> std::io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    let each = move || signals.forever().for_each(|_| on_signal());
    Builder::new().name("signals".into()).spawn(each).map(drop)
}

/// Stops on a signal and, if `with_parent`, when standard input ends: its other end is held by the
/// launcher and by nobody else, so it ends even when the launcher is killed.
///
/// Every thread that the end needs is started here: a process at its limit of threads or memory gets no more of them, and must
/// be able to end.
pub fn stop_on_end(stop: &Stop, with_parent: bool) -> std::io::Result<()> {
    let (asked, end) = sync_channel(1);
    let limit = move || {
        if end.recv().is_ok() {
            std::thread::sleep(STOP_LIMIT);
            output::error_line(format_args!("did not stop within {STOP_LIMIT:?}"));
            std::process::exit(u8::from(Outcome::NotKeptUp).into());
        }
    };
    Builder::new().name("end".into()).spawn(limit)?;
    stop.on_stop(move || {
        // Its thread waits for nothing else.
        let _ = asked.try_send(());
    });
    let on_parent = stop.clone();
    if with_parent {
        Builder::new().name("parent".into()).spawn(move || {
            let mut byte = [0];
            while std::io::stdin().read(&mut byte).is_ok_and(|it| it > 0) {}
            on_parent.stop();
        })?;
    }
    let stop = stop.clone();
    on_signal(move || stop.stop())
}
