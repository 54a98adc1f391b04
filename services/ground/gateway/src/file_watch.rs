//! Looks at files that are followed, each in a thread of its own: a disk that hangs delays no request, and no number of requests that wait
//! for the disk delays that a token is taken from somebody.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};

use crate::access::LOOK_PERIOD;

/// Looks while the value lives, for the first time at once.
pub(crate) struct FileWatch {
    /// Nothing is ever sent.
    _watching: SyncSender<()>,
}

impl FileWatch {
    /// Starts the thread. It is not waited for at the end, since the disk may hang.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub(crate) fn start(name: &str, mut look: impl FnMut() + Send + 'static) -> io::Result<FileWatch> {
        let (watching, ended) = sync_channel::<()>(0);
        std::thread::Builder::new().name(name.into()).spawn(move || {
            loop {
                // Fails only if looking panics, and the next look may not.
                let _ = catch_unwind(AssertUnwindSafe(&mut look));
                let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(LOOK_PERIOD) else { return };
            }
        })?;
        Ok(FileWatch { _watching: watching })
    }
}
