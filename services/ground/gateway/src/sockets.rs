//! Limits on what the gateway's clients take of the machine: how many sockets, and how much memory each.

use std::io;
use std::net::TcpListener;
use std::os::fd::AsFd;

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::sys::socket::{setsockopt, sockopt};

/// Bytes buffered for one client: several status events. The system reserves twice this size; its default would hold
/// megabytes for a client that does not read.
const SEND_BUFFER: usize = 128 * 1024;
/// Files and connections besides event streams.
const OTHERS: u64 = 256;

/// Raises this process's limit of open files so that it can hold `streams` event streams, as far as the system
/// allows: a process often starts with a limit of a thousand files and may ask for more.
///
/// # Errors
/// When the limit cannot be read or raised.
pub fn make_room(streams: u64) -> io::Result<()> {
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE)?;
    let wanted = (streams + OTHERS).min(hard);
    if soft < wanted {
        setrlimit(Resource::RLIMIT_NOFILE, wanted, hard)?;
    }
    if wanted < streams + OTHERS {
        tracing::warn!(streams, files = hard, "the system allows fewer files than there may be event streams");
    }
    Ok(())
}

/// Bounds the memory that the system holds for each client of `listener`.
///
/// # Errors
/// When the system does not take the option.
pub(crate) fn bound(listener: &TcpListener) -> io::Result<()> {
    // Accepted sockets inherit it.
    Ok(setsockopt(&listener.as_fd(), sockopt::SndBuf, &SEND_BUFFER)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::sys::socket::getsockopt;

    #[test]
    fn the_memory_of_each_client_is_bounded() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        bound(&listener).unwrap();
        let _client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (served, _) = listener.accept().unwrap();
        let buffer = getsockopt(&served.as_fd(), sockopt::SndBuf).unwrap();
        assert!(SEND_BUFFER <= buffer && buffer <= 2 * SEND_BUFFER, "{buffer}");
    }

    #[test]
    fn the_limit_of_open_files_is_raised_as_far_as_the_system_allows() {
        make_room(2000).unwrap();
        let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        assert!((2000 + OTHERS).min(hard) <= soft);
    }
}
