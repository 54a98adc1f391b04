//! One connection.

#![expect(clippy::disallowed_methods, reason = "a certificate expires by UTC, and files are looked at now and then")]

use std::net::{Shutdown, SocketAddr};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, SystemTime};

use credentials::{Credentials, End, Stamp};
use regular_file::Followed;
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

use crate::{LOG, TLS_LOCATOR_PREFIX};

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
    chain: Vec<CertificateDer<'static>>,
    /// Why its other end is not accepted any more.
    rejected: OnceLock<String>,
}

/// How often it is looked whether the authority, or its list of what is revoked, has been replaced.
const LOOK: Duration = Duration::from_secs(1);

impl TlsLink {
    /// Over a connection, with the addresses of its ends.
    pub(crate) fn over(stream: TlsStream<TcpStream>, own: SocketAddr, other: SocketAddr) -> ZResult<TlsLink> {
        let (tcp, connection) = stream.get_ref();
        let Some(chain @ [leaf, ..]) = connection.peer_certificates() else { bail!("{other} shows no certificate") };
        let peer = LinkAuthId::Tls(Some(common_name(leaf)?));
        let chain = chain.iter().map(|it| it.clone().into_owned()).collect::<Vec<_>>();
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
            chain,
            rejected: OnceLock::new(),
        })
    }

    /// Closes the link as soon as its other end, `end`, would not be let in any more, by `credentials` as they are from now
    /// on; `seen` is what they were like before the handshake. Files that cannot be used change nothing: what is being copied
    /// is not whole for a moment, and a link in flight must not end by that.
    pub(crate) fn keep_checking(self: &Arc<TlsLink>, credentials: Credentials, seen: Stamp, end: End) {
        let link = Arc::downgrade(self);
        let mut accepted: Followed<_, _, String> = Followed::new(seen, Ok(()));
        tokio::spawn(async move {
            loop {
                tokio::time::sleep(LOOK).await;
                let Some(link) = link.upgrade() else { return };
                match accepted.look(credentials.stamp(), |_, _| Ok(credentials.accepts(&link.chain, &end)?)) {
                    None | Some(Ok(Ok(()))) => {}
                    Some(Ok(Err(refusal))) => return link.reject(refusal),
                    Some(Err(unusable)) => {
                        tracing::warn!(target: LOG, %unusable, "the link goes on with the previous credentials");
                    }
                }
            }
        });
    }

    fn reject(&self, refusal: &rustls::Error) {
        let who = self.peer.get_cert_common_name().unwrap_or_default();
        tracing::warn!(target: LOG, who, other = %self.other, %refusal, "its certificate is accepted no more: the link is closed");
        let _ = self.rejected.set(refusal.to_string());
        if let Err(cause) = self.shut() {
            tracing::warn!(target: LOG, other = %self.other, %cause, "not closed");
        }
    }

    fn shut(&self) -> ZResult<()> {
        // What waits in the kernel is thrown away: it would hold up the next call, and arrive late.
        self.socket.set_linger(Some(Duration::ZERO)).map_err(|cause| self.failed("close", cause))?;
        // One that the other end has ended already is what is wanted.
        let _ = self.socket.shutdown(Shutdown::Both);
        Ok(())
    }

    fn failed(&self, what: &str, cause: std::io::Error) -> zenoh_result::Error {
        zerror!("{what} {} => {}: {cause}", self.own, self.other).into()
    }

    fn is_accepted(&self) -> ZResult<()> {
        if let Some(refusal) = self.rejected.get() {
            bail!("{}: {refusal}", self.other);
        }
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
        self.is_accepted()?;
        read.map_err(|cause| self.failed("read", cause))
    }

    async fn read_exact(&self, buffer: &mut [u8], _: Option<Priority>) -> ZResult<()> {
        let read = self.reader.lock().await.read_exact(buffer).await;
        self.is_accepted()?;
        read.map(drop).map_err(|cause| self.failed("read", cause))
    }

    /// A read or write of this moment ends: the connection is over.
    async fn close(&self) -> ZResult<()> {
        self.shut()
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

pub(crate) fn common_name(certificate: &CertificateDer) -> ZResult<String> {
    let certificate = parsed(certificate)?;
    let name = certificate.subject().iter_common_name().next().and_then(|it| it.as_str().ok());
    Ok(name.ok_or_else(|| zerror!("a certificate without a common name"))?.to_owned())
}

fn end_of(certificate: &CertificateDer) -> ZResult<SystemTime> {
    let seconds = parsed(certificate)?.validity().not_after.timestamp();
    Ok(SystemTime::UNIX_EPOCH + Duration::from_secs(u64::try_from(seconds).unwrap_or(0)))
}
