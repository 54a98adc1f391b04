//! One connection.

#![expect(clippy::disallowed_methods, reason = "a certificate expires by UTC")]

use std::net::{Shutdown, SocketAddr};
use std::time::{Duration, SystemTime};

use rustls::pki_types::CertificateDer;
use socket2::{SockRef, Socket};
use tokio::io::{AsyncReadExt, AsyncWriteExt, ReadHalf, WriteHalf};
use tokio::net::TcpStream;
use tokio::sync::Mutex;
use tokio_rustls::TlsStream;
use x509_parser::prelude::{FromDer, X509Certificate};
use zenoh_link_commons::{LinkAuthId, LinkUnicastTrait, get_ip_interface_names};
use zenoh_protocol::core::{Locator, Priority};
use zenoh_protocol::transport::BatchSize;
use zenoh_result::{ZResult, bail, zerror};

use crate::TLS_LOCATOR_PREFIX;

/// A connection whose handshake is done.
pub(crate) struct TlsLink {
    // The halves share the connection under a lock that each holds while it makes a step and never while it
    // waits. The locks around them keep apart those who read, and those who write.
    reader: Mutex<ReadHalf<TlsStream<TcpStream>>>,
    writer: Mutex<WriteHalf<TlsStream<TcpStream>>>,
    /// The same socket again, to end it while a task waits for it.
    socket: Socket,
    own: Locator,
    other: Locator,
    interfaces: Vec<String>,
    peer: LinkAuthId,
    /// When the first certificate in the other end's chain runs out.
    until: SystemTime,
}

impl TlsLink {
    /// Over a connection, with the addresses of its ends.
    pub(crate) fn over(stream: TlsStream<TcpStream>, own: SocketAddr, other: SocketAddr) -> ZResult<TlsLink> {
        let (tcp, connection) = stream.get_ref();
        let Some(chain @ [leaf, ..]) = connection.peer_certificates() else { bail!("{other} shows no certificate") };
        let peer = LinkAuthId::Tls(Some(common_name(leaf)?));
        let until = chain.iter().map(end_of).collect::<ZResult<Vec<_>>>()?.into_iter().min();
        let until = until.unwrap_or(SystemTime::UNIX_EPOCH);
        tcp.set_nodelay(true)?;
        let socket = SockRef::from(tcp).try_clone()?;
        let (reader, writer) = tokio::io::split(stream);
        Ok(TlsLink {
            reader: Mutex::new(reader),
            writer: Mutex::new(writer),
            socket,
            own: locator(own)?,
            other: locator(other)?,
            interfaces: get_ip_interface_names(&own),
            peer,
            until,
        })
    }

    fn failed(&self, what: &str, cause: std::io::Error) -> zenoh_result::Error {
        zerror!("{what} {} => {}: {cause}", self.own, self.other).into()
    }

    fn in_date(&self) -> ZResult<()> {
        if self.until <= SystemTime::now() {
            bail!("{}: the certificate of the other end has run out", self.other);
        }
        Ok(())
    }
}

#[async_trait::async_trait]
impl LinkUnicastTrait for TlsLink {
    async fn write(&self, bytes: &[u8], priority: Option<Priority>) -> ZResult<usize> {
        self.write_all(bytes, priority).await.map(|()| bytes.len())
    }

    async fn write_all(&self, bytes: &[u8], _: Option<Priority>) -> ZResult<()> {
        let mut writer = self.writer.lock().await;
        writer.write_all(bytes).await.map_err(|cause| self.failed("write", cause))?;
        // Without this it would wait in the connection's buffer, out of reach of what is more urgent.
        writer.flush().await.map_err(|cause| self.failed("write", cause))
    }

    async fn read(&self, buffer: &mut [u8], _: Option<Priority>) -> ZResult<usize> {
        let read = self.reader.lock().await.read(buffer).await;
        self.in_date()?;
        read.map_err(|cause| self.failed("read", cause))
    }

    async fn read_exact(&self, buffer: &mut [u8], _: Option<Priority>) -> ZResult<()> {
        let read = self.reader.lock().await.read_exact(buffer).await;
        self.in_date()?;
        read.map(drop).map_err(|cause| self.failed("read", cause))
    }

    /// A read or write of this moment ends: the connection is over.
    async fn close(&self) -> ZResult<()> {
        // What waits in the kernel is thrown away: it would hold up the next call, and arrive late.
        self.socket.set_linger(Some(Duration::ZERO)).map_err(|cause| self.failed("close", cause))?;
        // One that the other end has ended already is what is wanted.
        let _ = self.socket.shutdown(Shutdown::Both);
        Ok(())
    }

    fn get_mtu(&self) -> BatchSize {
        // The length of a batch goes before it, in two bytes.
        BatchSize::MAX
    }

    fn get_src(&self) -> &Locator {
        &self.own
    }

    fn get_dst(&self) -> &Locator {
        &self.other
    }

    fn is_reliable(&self) -> bool {
        true
    }

    fn is_streamed(&self) -> bool {
        true
    }

    fn get_interface_names(&self) -> Vec<String> {
        self.interfaces.clone()
    }

    fn get_auth_id(&self) -> &LinkAuthId {
        &self.peer
    }
}

fn locator(address: SocketAddr) -> ZResult<Locator> {
    Locator::new(TLS_LOCATOR_PREFIX, address.to_string(), "")
}

fn parsed<'a>(certificate: &'a CertificateDer) -> ZResult<X509Certificate<'a>> {
    let (_, parsed) = X509Certificate::from_der(certificate).map_err(|cause| zerror!("a certificate: {cause}"))?;
    Ok(parsed)
}

fn common_name(certificate: &CertificateDer) -> ZResult<String> {
    let certificate = parsed(certificate)?;
    let name = certificate.subject().iter_common_name().next().and_then(|it| it.as_str().ok());
    Ok(name.ok_or_else(|| zerror!("a certificate without a common name"))?.to_owned())
}

fn end_of(certificate: &CertificateDer) -> ZResult<SystemTime> {
    let seconds = parsed(certificate)?.validity().not_after.timestamp();
    Ok(SystemTime::UNIX_EPOCH + Duration::from_secs(u64::try_from(seconds).unwrap_or(0)))
}
