//! The end of a process: by a signal, or with its parent.

#![expect(clippy::disallowed_methods, reason = "a process that does not stop gets some time on the wall clock")]

use std::io::Read;
use std::sync::mpsc::sync_channel;
use std::thread::Builder;
use std::time::Duration;

use bus::Stop;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::outcome::Outcome;
use crate::output;

/// A process that was asked to end and has not ended after this time exits by itself.
const STOP_LIMIT: Duration = Duration::from_secs(2);

/// Calls `on_signal` on every Ctrl-C and SIGTERM, and when the terminal is closed (SIGHUP), from a thread of its own. `nohup` has the last one
/// ignored, and so it stays. A closed terminal counts as one request, although SIGHUP often comes twice: from the kernel and from the shell.
pub fn on_signal(mut on_signal: impl FnMut() + Send + 'static) -> std::io::Result<()> {
    let hang_up = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    let mut signals = Signals::new([SIGINT, SIGTERM].into_iter().chain(hang_up))?;
    let mut was_asked = false;
    let each = move || {
        for signal in signals.forever() {
            if signal != SIGHUP || !was_asked {
                on_signal();
            }
            was_asked = true;
        }
    };
    Builder::new().name("signals".into()).spawn(each).map(drop)
}

/// Whether this process was started with `signal` ignored: bit N - 1 of `SigIgn` in proc_pid_status(5). Unreadable, it is not.
pub fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|it| it.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|it| u64::from_str_radix(it.trim(), 16).ok()).unwrap_or(0);
    mask >> (signal - 1) & 1 == 1
}

/// Stops on a signal and, if `with_parent`, when standard input ends: its other end is held by the
/// launcher and by nobody else, so it ends even when the launcher is killed. One that is stopped (SIGSTOP) at that moment reads nothing: it
/// is woken by the operating system, no matter who inherits it.
///
/// Every thread that the end needs is started here: a process at its limit of threads or memory gets no more of them, and must
/// be able to end.
pub fn stop_on_end(stop: &Stop, with_parent: bool) -> std::io::Result<()> {
    let (asked, end) = sync_channel(1);
    let limit = move || {
        if end.recv().is_ok() {
            std::thread::sleep(STOP_LIMIT);
            output::error_line(format_args!("did not stop within {STOP_LIMIT:?}"));
            output::finish();
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
        nix::sys::prctl::set_pdeathsig(nix::sys::signal::Signal::SIGCONT)?;
        Builder::new().name("parent".into()).spawn(move || {
            let mut byte = [0];
            while std::io::stdin().read(&mut byte).is_ok_and(|it| it > 0) {}
            on_parent.stop();
        })?;
    }
    let stop = stop.clone();
    on_signal(move || stop.stop())
}
