//! What the gateway's clients may take of the machine: how many, and how much for each of them.

use std::io;
use std::net::TcpListener;
use std::os::fd::AsFd;

use nix::sys::resource::{Resource, getrlimit, setrlimit};
use nix::sys::socket::{setsockopt, sockopt};

/// Bytes on their way to one client, of which the system sets aside twice as many. Some status events;
/// left to itself the system holds megabytes for a client that does not read.
const SEND_BUFFER: usize = 128 * 1024;
/// Files and connections besides event streams.
const OTHERS: u64 = 256;

/// Lets this process hold so many event streams, as far as the system allows: a process is often
/// given a thousand files, and may ask for more.
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

/// Bounds what is held for each client of `listener`.
pub fn bound(listener: &TcpListener) -> io::Result<()> {
    // Those that are accepted inherit it.
    Ok(setsockopt(&listener.as_fd(), sockopt::SndBuf, &SEND_BUFFER)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nix::sys::socket::getsockopt;

    #[test]
    fn each_client_is_bounded() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        bound(&listener).unwrap();
        let _client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (served, _) = listener.accept().unwrap();
        let buffer = getsockopt(&served.as_fd(), sockopt::SndBuf).unwrap();
        assert!(SEND_BUFFER <= buffer && buffer <= 2 * SEND_BUFFER, "{buffer}");
    }

    #[test]
    fn there_is_room_for_what_is_asked_as_far_as_the_system_allows() {
        make_room(2000).unwrap();
        let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        assert!((2000 + OTHERS).min(hard) <= soft);
    }
}
