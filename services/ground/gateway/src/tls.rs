//! TLS towards operators: a certificate and its key from files, checked before the gateway listens.
//!
//! What clients would refuse later, and what would let others read the traffic, is refused at the start with
//! one sentence: a file that is absent or of another kind, a certificate that is not valid now, a key that
//! belongs to another certificate.

use std::fmt;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use rustls::ServerConfig;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use x509_parser::prelude::{FromDer, X509Certificate};
use x509_parser::time::ASN1Time;

use crate::config::Config;

/// Why the gateway does not listen.
#[derive(Debug, PartialEq, Eq)]
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

/// What connections to `address` are encrypted with. `None` for plain HTTP, which is allowed on the loopback
/// only, or where the configuration says so.
///
/// # Errors
/// What is wrong with the files, or that others could read the traffic.
pub fn server_config(
    config: &Config,
    address: SocketAddr,
    now: SystemTime,
) -> Result<Option<Arc<ServerConfig>>, Refusal> {
    let refusal = |message: String| Refusal { path: None, message };
    match (&config.tls_certificate, &config.tls_key) {
        (Some(certificate), Some(key)) => server(certificate, key, now).map(|config| Some(Arc::new(config))),
        (None, None) if address.ip().is_loopback() || config.plain_http_beyond_loopback => Ok(None),
        (None, None) => Err(refusal(format!(
            "the gateway would listen on {address} without TLS, where others can read tokens: set `tls_certificate` \
             and `tls_key`, or allow it with `plain_http_beyond_loopback`"
        ))),
        (Some(_), None) => Err(refusal("`tls_certificate` is given without `tls_key`".to_owned())),
        (None, Some(_)) => Err(refusal("`tls_key` is given without `tls_certificate`".to_owned())),
    }
}

fn server(certificate: &Path, key: &Path, now: SystemTime) -> Result<ServerConfig, Refusal> {
    let chain = read_chain(certificate, now)?;
    let secret = read_key(key)?;
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = ServerConfig::builder_with_provider(provider).with_safe_default_protocol_versions();
    let built = builder.and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, secret));
    let mut config = built.map_err(|cause| match cause {
        rustls::Error::InconsistentKeys(_) => {
            about(key, format!("is not the key of the certificate in {}", certificate.display()))
        }
        cause => about(certificate, format!("cannot be used with {}: {cause}", key.display())),
    })?;
    config.alpn_protocols = vec![b"http/1.1".to_vec()];
    Ok(config)
}

/// The server's own certificate first, as TLS requires.
fn read_chain(path: &Path, now: SystemTime) -> Result<Vec<CertificateDer<'static>>, Refusal> {
    let bytes = credentials::file::read(path).map_err(|cause| about(path, format!("cannot be read: {cause}")))?;
    let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&bytes).collect();
    let chain = chain.map_err(|cause| about(path, format!("holds no certificate in PEM: {cause}")))?;
    let first = chain.first().ok_or_else(|| about(path, "holds no certificate in PEM"))?;
    let (_, parsed) = X509Certificate::from_der(first).map_err(|_| about(path, "holds no valid X.509 certificate"))?;
    let validity = parsed.validity();
    let now_s = now.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs() as i64);
    if validity.not_after.timestamp() < now_s {
        return Err(about(path, format!("the certificate expired at {}; renew it", utc(validity.not_after))));
    }
    if now_s < validity.not_before.timestamp() {
        let from = utc(validity.not_before);
        return Err(about(path, format!("the certificate is valid only from {from}; check the clock")));
    }
    Ok(chain)
}

fn read_key(path: &Path) -> Result<PrivateKeyDer<'static>, Refusal> {
    use std::os::unix::fs::PermissionsExt;
    let unreadable = |cause: std::io::Error| about(path, format!("cannot be read: {cause}"));
    let mode = std::fs::metadata(path).map_err(unreadable)?.permissions().mode() & 0o7777;
    if mode & 0o007 != 0 {
        return Err(about(path, format!("its mode is {mode:04o}; others may not have access (chmod 600)")));
    }
    let bytes = credentials::file::read(path).map_err(unreadable)?;
    PrivateKeyDer::from_pem_slice(&bytes).map_err(|cause| about(path, format!("holds no private key in PEM: {cause}")))
}

fn about(path: &Path, message: impl Into<String>) -> Refusal {
    Refusal { path: Some(path.to_owned()), message: message.into() }
}

fn utc(moment: ASN1Time) -> String {
    let seconds = Duration::from_secs(u64::try_from(moment.timestamp()).unwrap_or(0));
    humantime::format_rfc3339_seconds(SystemTime::UNIX_EPOCH + seconds).to_string()
}
