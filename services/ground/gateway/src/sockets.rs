//! Limits on what the gateway's clients take of the machine: how many sockets, and how much memory each.

use std::io;
use std::net::TcpListener;
use std::os::fd::AsFd;

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::sys::socket::{Backlog, listen, setsockopt, sockopt};

/// Bytes that the system buffers for one client in each direction: a status event. It reserves twice this size, which counts
/// as this process's memory in a container; its default would be megabytes for a client that does not read.
const BUFFER: usize = 16 * 1024;
/// Connections that wait to be accepted; the standard library has room for 128. Of more clients that come at once to a busy machine the system
/// resets some after a minute. (Linux grants `net.core.somaxconn`, 4096, at most.)
const WAITING: i32 = 1024;
/// Files, and connections to the bus.
const OTHERS: u64 = 256;

/// Raises this process's limit of open files so that it can hold `connections`, as far as the system allows: a process
/// often starts with a limit of a thousand files and may ask for more. Returns the number of connections that it can hold.
///
/// # Errors
/// When the limit cannot be read or raised.
pub fn make_room(connections: u64) -> io::Result<u64> {
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE)?;
    let wanted = (connections + OTHERS).min(hard);
    if soft < wanted {
        setrlimit(Resource::RLIMIT_NOFILE, wanted, hard)?;
    }
    if wanted < connections + OTHERS {
        tracing::warn!(connections, files = hard, "the system allows fewer files than there may be connections");
    }
    Ok(wanted.max(soft).saturating_sub(OTHERS).min(connections))
}

/// Bounds the memory that the system holds for each client of `listener`, and has it keep more clients waiting than usual.
///
/// # Errors
/// When the system does not take an option.
pub(crate) fn bound(listener: &TcpListener) -> io::Result<()> {
    // Accepted sockets inherit both.
    setsockopt(&listener.as_fd(), sockopt::SndBuf, &BUFFER)?;
    setsockopt(&listener.as_fd(), sockopt::RcvBuf, &BUFFER)?;
    // Once more, for the longer queue.
    Ok(listen(listener, Backlog::new(WAITING)?)?)
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
        let sent = getsockopt(&served.as_fd(), sockopt::SndBuf).unwrap();
        let received = getsockopt(&served.as_fd(), sockopt::RcvBuf).unwrap();
        for buffer in [sent, received] {
            assert!(BUFFER <= buffer && buffer <= 2 * BUFFER, "{buffer}");
        }
    }

    #[test]
    fn the_limit_of_open_files_is_raised_as_far_as_the_system_allows() {
        let room = make_room(2000).unwrap();
        let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        assert!((2000 + OTHERS).min(hard) <= soft);
        assert!(room <= 2000 && room + OTHERS <= soft.max(OTHERS));
    }
}
