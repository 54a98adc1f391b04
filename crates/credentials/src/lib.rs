//! The credentials of one end of the link between routers: its certificate, the key to it, and the certificate of the
//! authority that both ends trust.
//!
//! The only place that reads them, for the bus, which checks them before a router starts, and for `tls-link`, which
//! makes connections with them. Neither can ask the other: zenoh stands between them. What a certificate must say, and
//! for how long, is for the bus to decide; this crate knows files and TLS only.

mod stamp;

pub use stamp::Stamp;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use regular_file::Unusable;
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::ServerCertVerifier;
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, CertificateRevocationListDer, PrivateKeyDer, ServerName, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::server::danger::ClientCertVerifier;
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

/// What the authority has revoked, beside its certificate, in PEM form. An authority without a list in it, and a machine
/// without the file, count as if nothing were revoked. How old a list is does not matter: a machine that gets no new one, such
/// as an aircraft far out, keeps its link.
pub const REVOKED: &str = "revoked.pem";

/// In the endpoint that zenoh calls: the common name of who calls. With the certificate of another one no call is made.
pub const CALLER: &str = "caller";

/// Which end of a connection shows a certificate.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// The one that called.
    Caller,
    /// The one that was called, by this name.
    Called(ServerName<'static>),
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

/// For credentials that are followed by their [`Stamp`]: what stood in the way of reading, such as a limit of open files, may pass
/// without a trace in the files.
impl From<InvalidCredentials> for Unusable<String> {
    fn from(invalid: InvalidCredentials) -> Unusable<String> {
        let why = invalid.to_string();
        match invalid {
            InvalidCredentials::Unreadable { .. } => Unusable::Now(why),
            InvalidCredentials::Malformed { .. } | InvalidCredentials::Unusable { .. } => Unusable::Content(why),
        }
    }
}

/// The name or address for which the router at `HOST:PORT` must show a certificate. An IPv6 address is written in brackets
/// there, and without them in the certificate.
///
/// # Errors
/// With the host, if it is neither a name nor an address.
pub fn called_at(address: &str) -> Result<ServerName<'static>, String> {
    let host = address.rsplit_once(':').map_or(address, |(host, _)| host);
    let bare = host.strip_prefix('[').and_then(|it| it.strip_suffix(']')).unwrap_or(host);
    ServerName::try_from(bare.to_owned()).map_err(|_| format!("`{host}` is not a host name"))
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

    /// Where the list of what the authority has revoked is, if there is one.
    pub fn revoked(&self) -> PathBuf {
        self.authority.with_file_name(REVOKED)
    }

    /// What the files are like now.
    pub fn stamp(&self) -> Stamp {
        Stamp::of([&self.authority, &self.certificate, &self.key, &self.revoked()])
    }

    /// Whether `chain`, shown by that end, is accepted now: signed by the authority, in date and not revoked.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn accepts(
        &self,
        chain: &[CertificateDer],
        end: &End,
    ) -> Result<Result<(), rustls::Error>, InvalidCredentials> {
        let [own, intermediates @ ..] = chain else { return Ok(Err(rustls::Error::NoCertificatesPresented)) };
        let now = UnixTime::now();
        Ok(match end {
            End::Caller => self.callers()?.verify_client_cert(own, intermediates, now).map(drop),
            End::Called(host) => self.called()?.verify_server_cert(own, intermediates, host, &[], now).map(drop),
        })
    }

    /// TLS for the end that calls.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn client(&self) -> Result<ClientConfig, InvalidCredentials> {
        self.client_with(self.chain()?)
    }

    /// The same with this chain, which was looked at after it was read: the file may be another one by now.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn client_with(&self, chain: Vec<CertificateDer<'static>>) -> Result<ClientConfig, InvalidCredentials> {
        ClientConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&TLS13])
            .map_err(|cause| unusable(&self.certificate, cause))?
            .with_webpki_verifier(self.called()?)
            .with_client_auth_cert(chain, self.private_key()?)
            .map_err(|cause| unusable(&self.certificate, cause))
    }

    /// TLS for the end that is called. It lets in only an end with a certificate of the authority.
    ///
    /// # Errors
    /// If a file cannot be used.
    pub fn server(&self) -> Result<ServerConfig, InvalidCredentials> {
        let mut server = ServerConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&TLS13])
            .map_err(|cause| unusable(&self.certificate, cause))?
            .with_client_cert_verifier(self.callers()?)
            .with_single_cert(self.chain()?, self.private_key()?)
            .map_err(|cause| unusable(&self.certificate, cause))?;
        // Every connection begins with both certificates, so tickets for a shorter handshake would only take up the link.
        server.send_tls13_tickets = 0;
        Ok(server)
    }

    /// Checks those who call.
    fn callers(&self) -> Result<Arc<dyn ClientCertVerifier>, InvalidCredentials> {
        let builder = WebPkiClientVerifier::builder_with_provider(self.trusted()?.into(), provider());
        let builder = builder.with_crls(self.revocation_lists()?).allow_unknown_revocation_status();
        builder.build().map_err(|cause| unusable(&self.authority, cause))
    }

    /// Checks those who are called.
    fn called(&self) -> Result<Arc<WebPkiServerVerifier>, InvalidCredentials> {
        let builder = WebPkiServerVerifier::builder_with_provider(self.trusted()?.into(), provider());
        let builder = builder.with_crls(self.revocation_lists()?).allow_unknown_revocation_status();
        builder.build().map_err(|cause| unusable(&self.authority, cause))
    }

    fn revocation_lists(&self) -> Result<Vec<CertificateRevocationListDer<'static>>, InvalidCredentials> {
        let path = self.revoked();
        let pem = match read(&path) {
            Err(InvalidCredentials::Unreadable { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Vec::new());
            }
            pem => pem?,
        };
        let found: Result<Vec<_>, _> = CertificateRevocationListDer::pem_slice_iter(&pem).collect();
        found.ok().filter(|it| !it.is_empty()).ok_or_else(|| malformed(&path, "revocation list"))
    }
}

const CERTIFICATE: &str = "certificate";

fn read(path: &Path) -> Result<Vec<u8>, InvalidCredentials> {
    regular_file::read(path).map_err(|source| InvalidCredentials::Unreadable { path: path.to_owned(), source })
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
    use rcgen::{
        BasicConstraints, CertificateParams, CertificateRevocationListParams, IsCa, Issuer, KeyIdMethod, KeyPair,
        KeyUsagePurpose, RevokedCertParams, SerialNumber, date_time_ymd,
    };

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

    /// What `folder`, in which an authority has made a certificate for `router` and may have revoked it, says about that.
    fn made_by_authority(revoke: bool) -> (tempfile::TempDir, Credentials) {
        let folder = tempfile::tempdir().unwrap();
        let made = made_in(folder.path());
        let (key, own) = (KeyPair::generate().unwrap(), KeyPair::generate().unwrap());
        let mut params = CertificateParams::new(Vec::new()).unwrap();
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
        std::fs::write(&made.authority, params.self_signed(&key).unwrap().pem()).unwrap();
        let issuer = Issuer::new(params, key);
        let mut params = CertificateParams::new(vec!["router".into()]).unwrap();
        params.serial_number = Some(SerialNumber::from(77));
        std::fs::write(&made.certificate, params.signed_by(&own, &issuer).unwrap().pem()).unwrap();
        std::fs::write(&made.key, own.serialize_pem()).unwrap();
        let revoked = |serial: u64| RevokedCertParams {
            serial_number: SerialNumber::from(serial),
            revocation_time: date_time_ymd(2026, 1, 1),
            reason_code: None,
            invalidity_date: None,
        };
        // A list that is old: it counts all the same.
        let list = CertificateRevocationListParams {
            this_update: date_time_ymd(2026, 1, 1),
            next_update: date_time_ymd(2026, 1, 2),
            crl_number: SerialNumber::from(1),
            issuing_distribution_point: None,
            revoked_certs: vec![revoked(if revoke { 77 } else { 78 })],
            key_identifier_method: KeyIdMethod::Sha256,
        };
        std::fs::write(made.revoked(), list.signed_by(&issuer).unwrap().pem().unwrap()).unwrap();
        (folder, made)
    }

    #[test]
    fn a_revoked_certificate_is_accepted_at_neither_end() {
        #[track_caller]
        fn check(revoke: bool) {
            let (_folder, credentials) = made_by_authority(revoke);
            for end in [End::Caller, End::Called("router".try_into().unwrap())] {
                let accepted = credentials.accepts(&credentials.chain().unwrap(), &end).unwrap();
                let refusal = Err(rustls::Error::InvalidCertificate(rustls::CertificateError::Revoked));
                assert_eq!(accepted, if revoke { refusal } else { Ok(()) }, "{end:?}");
            }
        }
        check(true);
        check(false);
    }

    #[test]
    fn who_is_called_shows_a_certificate_for_the_host_alone() {
        #[track_caller]
        fn check(address: &str, expected: Result<&str, &str>) {
            let found = called_at(address).map(|it| it.to_str().into_owned());
            assert_eq!(found.as_deref().map_err(String::as_str), expected);
        }
        check("ground.example:7448", Ok("ground.example"));
        check("10.0.0.1:7448", Ok("10.0.0.1"));
        check("[::1]:7448", Ok("::1"));
        check("[fe80::2]:7448", Ok("fe80::2"));
        check("no host:7448", Err("`no host` is not a host name"));
        check("[ground]x:7448", Err("`[ground]x` is not a host name"));
    }

    #[test]
    fn a_list_that_is_none_is_refused_and_a_replaced_one_is_noticed() {
        let (_folder, credentials) = made_by_authority(false);
        let before = credentials.stamp();
        assert_eq!(before, credentials.stamp());
        std::fs::write(credentials.revoked(), "garbage").unwrap();
        assert_ne!(before, credentials.stamp());
        let said = credentials.server().unwrap_err().to_string();
        assert!(said.contains(REVOKED) && said.contains("holds no revocation list"), "{said}");
        std::fs::remove_file(credentials.revoked()).unwrap();
        assert!(credentials.server().is_ok() && credentials.client().is_ok());
    }
}
