//! Follows the file of the tokens in a thread of its own: a disk that hangs delays no request, and no number of requests that wait
//! for the disk delays that a token is taken from somebody.

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};

use crate::access::{CurrentTokens, LOOK_PERIOD, utc_ms_now};
use crate::http::command_authority::CommandAuthorities;

/// Looks at the file while the value lives.
pub(crate) struct TokenWatch {
    /// Nothing is ever sent.
    _watching: SyncSender<()>,
}

impl TokenWatch {
    /// Starts the thread. It is not waited for at the end, since the disk may hang.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub(crate) fn start(tokens: Arc<CurrentTokens>, authorities: Arc<CommandAuthorities>) -> io::Result<TokenWatch> {
        let (watching, ended) = sync_channel(0);
        std::thread::Builder::new().name("tokens".into()).spawn(move || follow(&tokens, &authorities, &ended))?;
        Ok(TokenWatch { _watching: watching })
    }
}

/// Who may not command any more has command of no vehicle, so that nobody is locked out by somebody who can neither give an order
/// nor hand over.
fn follow(tokens: &CurrentTokens, authorities: &CommandAuthorities, ended: &Receiver<()>) {
    while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(LOOK_PERIOD) {
        // Fails only if looking panics, and the next look may not.
        let _ = catch_unwind(AssertUnwindSafe(|| tokens.look()));
        let (valid, utc_ms) = (tokens.get(), utc_ms_now());
        authorities.keep(|holder| valid.let_command(holder, utc_ms));
    }
}
