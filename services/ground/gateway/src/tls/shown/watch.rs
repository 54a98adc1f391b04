//! Follows the files of the certificate in a thread of its own: a disk that hangs delays no request, and nobody whose token is taken away.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::SystemTime;

use super::ShownCertificate;
use crate::access::LOOK_PERIOD;

/// Looks at the files while the value lives, for the first time at once.
pub(crate) struct CertificateWatch {
    /// Nothing is ever sent.
    _watching: SyncSender<()>,
}

impl CertificateWatch {
    /// Starts the thread. It is not waited for at the end, since the disk may hang.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub(crate) fn start(shown: Arc<ShownCertificate>) -> io::Result<CertificateWatch> {
        let (watching, ended) = sync_channel::<()>(0);
        std::thread::Builder::new().name("certificate".into()).spawn(move || {
            look(&shown);
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(LOOK_PERIOD) {
                look(&shown);
            }
        })?;
        Ok(CertificateWatch { _watching: watching })
    }
}

#[expect(clippy::disallowed_methods, reason = "certificates expire by UTC")]
fn look(shown: &ShownCertificate) {
    // Fails only if looking panics, and the next look may not.
    let _ = catch_unwind(AssertUnwindSafe(|| shown.look(SystemTime::now())));
}
