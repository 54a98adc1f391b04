//! The credentials of one end of the link between routers: its certificate, the key to it, and the certificate of the
//! authority that both ends trust.
//!
//! The only place that reads them, for the bus, which checks them before a router starts, and for `tls-link`, which
//! makes connections with them. Neither can ask the other: zenoh stands between them. What a certificate must say, and
//! for how long, is for the bus to decide; this crate knows files and TLS only.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::server::WebPkiClientVerifier;
use rustls::version::TLS13;
use rustls::{ClientConfig, RootCertStore, ServerConfig};

/// Where the credentials are, all in PEM form. They are read whenever they are asked for, so that a connection that is
/// made again uses files that have been replaced meanwhile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Credentials {
    /// The certificate of the authority that signed the other end's.
    pub authority: PathBuf,
    /// The own certificate, and those between it and the authority.
    pub certificate: PathBuf,
    /// The key to it.
    pub key: PathBuf,
}

/// Why credentials cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum InvalidCredentials {
    /// A file is missing or may not be read.
    #[error("cannot read {path}: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A file is not what its name says.
    #[error("{path} holds no {expected} in PEM form")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What should be in it.
        expected: &'static str,
    },
    /// No TLS connection can be made with them.
    #[error("{path} cannot be used: {cause}")]
    Unusable {
        /// The file.
        path: PathBuf,
        /// What the TLS library said.
        cause: String,
    },
}

/// The one crypto provider of the program.
pub fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

impl Credentials {
    /// The own certificate, and those between it and the authority; never empty.
    ///
    /// # Errors
    /// If the file cannot be read or holds no certificate.
    pub fn chain(&self) -> Result<Vec<CertificateDer<'static>>, InvalidCredentials> {
        certificates(&self.certificate)
    }

    /// The key to the certificate.
    ///
    /// # Errors
    /// If the file cannot be read or holds no key.
    pub fn private_key(&self) -> Result<PrivateKeyDer<'static>, InvalidCredentials> {
        PrivateKeyDer::from_pem_slice(&read(&self.key)?).map_err(|_| malformed(&self.key, "private key"))
    }

    /// The named authority, and no other.
    ///
    /// # Errors
    /// If the file cannot be read or holds no certificate.
    pub fn trusted(&self) -> Result<RootCertStore, InvalidCredentials> {
        let mut roots = RootCertStore::empty();
        for certificate in certificates(&self.authority)? {
            roots.add(certificate).map_err(|_| malformed(&self.authority, CERTIFICATE))?;
        }
        Ok(roots)
    }

    /// TLS for the end that calls.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn client(&self) -> Result<ClientConfig, InvalidCredentials> {
        ClientConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&TLS13])
            .map_err(|cause| unusable(&self.certificate, cause))?
            .with_root_certificates(self.trusted()?)
            .with_client_auth_cert(self.chain()?, self.private_key()?)
            .map_err(|cause| unusable(&self.certificate, cause))
    }

    /// TLS for the end that is called. It lets in only an end with a certificate of the authority.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn server(&self) -> Result<ServerConfig, InvalidCredentials> {
        let callers = WebPkiClientVerifier::builder_with_provider(self.trusted()?.into(), provider()).build();
        let mut server = ServerConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&TLS13])
            .map_err(|cause| unusable(&self.certificate, cause))?
            .with_client_cert_verifier(callers.map_err(|cause| unusable(&self.authority, cause))?)
            .with_single_cert(self.chain()?, self.private_key()?)
            .map_err(|cause| unusable(&self.certificate, cause))?;
        // Every connection begins with both certificates, so tickets for a shorter handshake would only take up the link.
        server.send_tls13_tickets = 0;
        Ok(server)
    }
}

const CERTIFICATE: &str = "certificate";

fn read(path: &Path) -> Result<Vec<u8>, InvalidCredentials> {
    std::fs::read(path).map_err(|source| InvalidCredentials::Unreadable { path: path.to_owned(), source })
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, InvalidCredentials> {
    let pem = read(path)?;
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&pem).collect();
    found.ok().filter(|it| !it.is_empty()).ok_or_else(|| malformed(path, CERTIFICATE))
}

fn malformed(path: &Path, expected: &'static str) -> InvalidCredentials {
    InvalidCredentials::Malformed { path: path.to_owned(), expected }
}

fn unusable(path: &Path, cause: impl ToString) -> InvalidCredentials {
    InvalidCredentials::Unusable { path: path.to_owned(), cause: cause.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rcgen::{CertificateParams, KeyPair};

    /// Credentials in `folder`, of a certificate that is its own authority.
    fn made_in(folder: &Path) -> Credentials {
        let made = Credentials {
            authority: folder.join("authority.pem"),
            certificate: folder.join("certificate.pem"),
            key: folder.join("key.pem"),
        };
        let key = KeyPair::generate().unwrap();
        let certificate = CertificateParams::new(vec!["router".into()]).unwrap().self_signed(&key).unwrap().pem();
        std::fs::write(&made.authority, &certificate).unwrap();
        std::fs::write(&made.certificate, certificate).unwrap();
        std::fs::write(&made.key, key.serialize_pem()).unwrap();
        made
    }

    #[test]
    fn each_bad_file_is_refused_with_its_name() {
        #[track_caller]
        fn check(file: &str, content: Option<&str>, expected: &str) {
            let folder = tempfile::tempdir().unwrap();
            let credentials = made_in(folder.path());
            assert!(credentials.client().is_ok() && credentials.server().is_ok());
            let path = folder.path().join(file);
            match content {
                Some(content) => std::fs::write(&path, content).unwrap(),
                None => std::fs::remove_file(&path).unwrap(),
            }
            for refusal in [credentials.client().unwrap_err(), credentials.server().unwrap_err()] {
                let said = refusal.to_string();
                assert!(said.contains(expected) && said.contains(file), "{said}");
            }
        }
        for (file, expected) in [("authority.pem", CERTIFICATE), ("certificate.pem", CERTIFICATE), ("key.pem", "key")] {
            check(file, None, "cannot read");
            check(file, Some(""), &format!("{expected} in PEM form"));
            check(file, Some("-----BEGIN CERTIFICATE-----\n!\n-----END CERTIFICATE-----\n"), "in PEM form");
        }
        let other = KeyPair::generate().unwrap().serialize_pem();
        let folder = tempfile::tempdir().unwrap();
        let credentials = made_in(folder.path());
        std::fs::write(&credentials.key, other).unwrap();
        assert!(credentials.client().unwrap_err().to_string().contains("certificate.pem cannot be used"));
    }
}
