//! Why a link does not come up: calls the other side as zenoh would, and tells what stands in the way.
//!
//! Zenoh tries again and again and keeps the reason to itself.

use std::io::{ErrorKind, Read};
use std::net::{TcpStream, ToSocketAddrs};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rustls::pki_types::ServerName;
use rustls::{ClientConnection, Stream};

use crate::papers;

/// For each step. Whatever takes longer is too slow for the link as well.
const LIMIT: Duration = Duration::from_secs(2);
/// A refusal of our certificate comes after our part of the handshake is done.
const SECOND_THOUGHTS: Duration = Duration::from_millis(500);

/// Calls `address`, such as `ground-router:7448`, with the papers in `folder`; what went wrong, in words.
pub(super) fn obstacle(folder: &Path, address: &str) -> Option<String> {
    call(folder, address).err()
}

fn call(folder: &Path, address: &str) -> Result<(), String> {
    let name = address.rsplit_once(':').map_or(address, |(host, _)| host);
    let host = ServerName::try_from(name.to_owned()).map_err(|_| format!("`{name}` is no host name"))?;
    let mut found = address.to_socket_addrs().map_err(|cause| format!("`{name}` is not found: {cause}"))?;
    let target = found.next().ok_or_else(|| format!("`{name}` is not found"))?;
    let mut stream =
        TcpStream::connect_timeout(&target, LIMIT).map_err(|cause| format!("{address} does not answer: {cause}"))?;
    let limit = |it: &TcpStream, limit| it.set_read_timeout(Some(limit)).map_err(|cause| cause.to_string());
    limit(&stream, LIMIT)?;
    let client = papers::in_folder(folder).client().map_err(|invalid| invalid.to_string())?;
    let mut connection = ClientConnection::new(Arc::new(client), host).map_err(|cause| cause.to_string())?;
    while connection.is_handshaking() {
        connection.complete_io(&mut stream).map_err(|cause| words(&cause))?;
    }
    limit(&stream, SECOND_THOUGHTS)?;
    match Stream::new(&mut connection, &mut stream).read(&mut [0]) {
        Err(cause) if !silent(&cause) => Err(words(&cause)),
        // It waits for zenoh's first word.
        _ => Ok(()),
    }
}

fn silent(cause: &std::io::Error) -> bool {
    matches!(cause.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}

fn words(cause: &std::io::Error) -> String {
    match cause.get_ref().and_then(|it| it.downcast_ref::<rustls::Error>()) {
        Some(rustls::Error::AlertReceived(alert)) => format!("it does not accept our certificate ({alert:?})"),
        Some(error @ rustls::Error::InvalidCertificate(_)) => format!("its certificate is not accepted: {error}"),
        Some(error) => format!("no encrypted connection: {error}"),
        None if silent(cause) => format!("it takes the call, and then says nothing for {LIMIT:?}"),
        None => format!("the connection broke off: {cause}"),
    }
}
