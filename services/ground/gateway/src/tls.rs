//! TLS towards operators: a certificate and its key from files, which are followed while the gateway runs.
//!
//! What clients would refuse later, and what would let others read the traffic, is refused where a human starts the system, with
//! one sentence: a file that is absent or of another kind, a certificate that is not valid now, a key that belongs to another
//! certificate. A gateway that is started again meanwhile comes back all the same, and tells what is wrong: see [`Demand`].

use std::fmt;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use rustls::ServerConfig;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::sign::CertifiedKey;
use x509_parser::prelude::{FromDer, Validity, X509Certificate};
use x509_parser::time::ASN1Time;

use crate::config::Config;

mod shown;

pub use shown::ShownCertificate;

/// What is asked of the files at a start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demand {
    /// That clients accept them now: a human starts a simulation, and can get others.
    Valid,
    /// That connections can be made with them; a wrong date is only reported: a human starts what may be in the air,
    /// and may know that the date is wrong.
    Usable,
    /// Nothing: the gateway may have run before, and something may fly. Where the files cannot be used no client gets a connection until they can.
    Nothing,
}

/// Why the gateway does not listen, or what is wrong with its files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The file at fault, if a file is.
    pub path: Option<PathBuf>,
    /// What is wrong, and what to do about it.
    pub message: String,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => write!(f, "{}: {}", path.display(), self.message),
            None => f.write_str(&self.message),
        }
    }
}

impl std::error::Error for Refusal {}

/// What connections are encrypted with.
pub struct Encryption {
    /// For the server.
    pub config: Arc<ServerConfig>,
    /// The certificate that it shows.
    pub shown: Arc<ShownCertificate>,
}

/// What connections to `address` are encrypted with. `None` for plain HTTP, which is allowed on the loopback
/// only, or where the configuration says so.
///
/// # Errors
/// What is wrong with the files, if it is more than `demand` allows, or that others could read the traffic.
pub fn encryption(
    config: &Config,
    address: SocketAddr,
    demand: Demand,
    now: SystemTime,
) -> Result<Option<Encryption>, Refusal> {
    let refusal = |message: String| Refusal { path: None, message };
    match (&config.tls_certificate, &config.tls_key) {
        (Some(certificate), Some(key)) => {
            let files = Files { certificate: certificate.clone(), key: key.clone() };
            ShownCertificate::read(files, demand, now).and_then(|shown| server(Arc::new(shown))).map(Some)
        }
        (None, None) if address.ip().is_loopback() || config.plain_http_beyond_loopback => Ok(None),
        (None, None) => Err(refusal(format!(
            "the gateway would listen on {address} without TLS, where others can read tokens: set `tls_certificate` \
             and `tls_key`, or allow it with `plain_http_beyond_loopback`"
        ))),
        (Some(_), None) => Err(refusal("`tls_certificate` is given without `tls_key`".to_owned())),
        (None, Some(_)) => Err(refusal("`tls_key` is given without `tls_certificate`".to_owned())),
    }
}

fn server(shown: Arc<ShownCertificate>) -> Result<Encryption, Refusal> {
    let builder = ServerConfig::builder_with_provider(credentials::provider()).with_safe_default_protocol_versions();
    let builder = builder.map_err(|cause| Refusal { path: None, message: format!("there can be no TLS: {cause}") })?;
    let mut config = builder.with_no_client_auth().with_cert_resolver(shown.clone());
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(Encryption { config: Arc::new(config), shown })
}

/// A certificate, those between it and its authority, and the key to it.
struct Files {
    certificate: PathBuf,
    key: PathBuf,
}

/// What is in them.
#[derive(Clone, PartialEq, Eq)]
struct Texts {
    certificate: Vec<u8>,
    key: Vec<u8>,
}

/// What handshakes are made with.
struct Pair {
    key: Arc<CertifiedKey>,
    validity: Validity,
}

impl Files {
    fn read(&self) -> Result<Texts, Refusal> {
        let certificate = read(&self.certificate)?;
        check_closed(&self.key)?;
        Ok(Texts { certificate, key: read(&self.key)? })
    }

    fn parse(&self, texts: &Texts) -> Result<Pair, Refusal> {
        let (chain, validity) = parse_chain(&self.certificate, &texts.certificate)?;
        let key = PrivateKeyDer::from_pem_slice(&texts.key)
            .map_err(|cause| about(&self.key, format!("holds no private key in PEM: {cause}")))?;
        let certified = CertifiedKey::from_der(chain, key, &credentials::provider()).map_err(|cause| match cause {
            rustls::Error::InconsistentKeys(_) => {
                about(&self.key, format!("is not the key of the certificate in {}", self.certificate.display()))
            }
            cause => about(&self.certificate, format!("cannot be used with {}: {cause}", self.key.display())),
        })?;
        Ok(Pair { key: Arc::new(certified), validity })
    }

    /// What clients say against the date.
    fn out_of_date(&self, pair: &Pair, now: SystemTime) -> Option<Refusal> {
        let (from, until) = (pair.validity.not_before, pair.validity.not_after);
        let now_s = now.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs() as i64);
        if until.timestamp() < now_s {
            return Some(about(&self.certificate, format!("the certificate expired at {}; renew it", utc(until))));
        }
        let is_early = now_s < from.timestamp();
        let message = || format!("the certificate is valid only from {}; check the clock", utc(from));
        is_early.then(|| about(&self.certificate, message()))
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Refusal> {
    regular_file::read(path).map_err(|cause| unreadable(path, &cause))
}

/// The server's own certificate first, as TLS requires, and when that is valid.
fn parse_chain(path: &Path, text: &[u8]) -> Result<(Vec<CertificateDer<'static>>, Validity), Refusal> {
    let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(text).collect();
    let chain = chain.map_err(|cause| about(path, format!("holds no certificate in PEM: {cause}")))?;
    let first = chain.first().ok_or_else(|| about(path, "holds no certificate in PEM"))?;
    let (_, parsed) = X509Certificate::from_der(first).map_err(|_| about(path, "holds no valid X.509 certificate"))?;
    let validity = parsed.validity().clone();
    Ok((chain, validity))
}

fn check_closed(path: &Path) -> Result<(), Refusal> {
    use std::os::unix::fs::PermissionsExt;
    let mode = std::fs::metadata(path).map_err(|cause| unreadable(path, &cause))?.permissions().mode() & 0o7777;
    if mode & 0o007 != 0 {
        return Err(about(path, format!("its mode is {mode:04o}; others may not have access (chmod 600)")));
    }
    Ok(())
}

fn unreadable(path: &Path, cause: &std::io::Error) -> Refusal {
    about(path, format!("cannot be read: {cause}"))
}

fn about(path: &Path, message: impl Into<String>) -> Refusal {
    Refusal { path: Some(path.to_owned()), message: message.into() }
}

fn utc(moment: ASN1Time) -> String {
    let seconds = Duration::from_secs(u64::try_from(moment.timestamp()).unwrap_or(0));
    humantime::format_rfc3339_seconds(SystemTime::UNIX_EPOCH + seconds).to_string()
}
