//! What a router shows at the link, checked before it starts: its certificate, the key to it, and the
//! certificate of the authority that both sides trust.
//!
//! Zenoh would take a bad certificate and fail at every handshake. Here it is refused with one sentence.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use credentials::{Credentials, InvalidCredentials, provider};
use rustls::CertificateError;
use rustls::client::WebPkiServerVerifier;
use rustls::client::danger::ServerCertVerifier;
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::sign::CertifiedKey;
use x509_parser::prelude::{FromDer, X509Certificate};

use crate::crossing::Side;

/// In a router's folder: the certificate of the authority.
pub const AUTHORITY: &str = "authority.pem";
/// Its own certificate.
pub const CERTIFICATE: &str = "certificate.pem";
/// The key to it.
pub const KEY: &str = "key.pem";

/// Why a router's certificate is not accepted.
#[derive(Debug, thiserror::Error)]
pub enum BadPapers {
    /// A file is missing or may not be read.
    #[error("{0}; `kittiwake certs` makes a set for a demonstration")]
    Unreadable(InvalidCredentials),
    /// A file is not what its name says.
    #[error(transparent)]
    Invalid(InvalidCredentials),
    /// Others may read the key.
    #[error("{path} may be read by others (mode {mode:o}): `chmod 600` it, and make another if it was seen")]
    OpenKey {
        /// The file.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// The key belongs to another certificate.
    #[error("{path} is not the key to the certificate beside it")]
    OtherKey {
        /// The file.
        path: PathBuf,
    },
    /// Its time is over, or has not come.
    #[error("{path} is valid from {from} to {until}, and now is {now}: get another, or set the clock")]
    OutOfDate {
        /// The file.
        path: PathBuf,
        /// From when.
        from: String,
        /// Until when.
        until: String,
        /// What the clock says.
        now: String,
    },
    /// It is somebody else's.
    #[error("{path} is the certificate of `{found}`, expected that of `{expected}`")]
    OtherName {
        /// The file.
        path: PathBuf,
        /// Its common name.
        found: String,
        /// Whose it should be.
        expected: String,
    },
    /// It was not signed by the authority, or not for this purpose.
    #[error("{path} is not accepted: {cause}")]
    Refused {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: String,
    },
}

/// Checks the papers in `folder` of the router called `name`, which stands on `side`.
///
/// # Errors
/// With what is wrong first.
pub fn check(folder: &Path, name: &str, side: Side) -> Result<(), BadPapers> {
    let credentials = in_folder(folder);
    let path = credentials.certificate.clone();
    let roots = Arc::new(credentials.trusted()?);
    let chain = credentials.chain()?;
    let [own, intermediates @ ..] = chain.as_slice() else { return Err(no_certificate(&path)) };
    check_name_and_time(&path, own, name)?;
    check_key(&credentials, &chain)?;
    let refused = |cause: String| BadPapers::Refused { path: path.clone(), cause };
    let now = UnixTime::now();
    // The aircraft calls, the ground answers the call.
    let checked = match side {
        Side::Aircraft => WebPkiClientVerifier::builder_with_provider(roots, provider())
            .build()
            .map_err(|cause| refused(cause.to_string()))?
            .verify_client_cert(own, intermediates, now)
            .map(|_| ()),
        Side::Ground => {
            let host = ServerName::try_from(name.to_owned()).map_err(|cause| refused(cause.to_string()))?;
            WebPkiServerVerifier::builder_with_provider(roots, provider())
                .build()
                .map_err(|cause| refused(cause.to_string()))?
                .verify_server_cert(own, intermediates, &host, &[], now)
                .map(|_| ())
        }
    };
    checked.map_err(|error| refused(words(&error)))
}

/// The credentials in a folder.
pub(crate) fn in_folder(folder: &Path) -> Credentials {
    Credentials { authority: folder.join(AUTHORITY), certificate: folder.join(CERTIFICATE), key: folder.join(KEY) }
}

impl From<InvalidCredentials> for BadPapers {
    fn from(invalid: InvalidCredentials) -> BadPapers {
        match invalid {
            InvalidCredentials::Unreadable { .. } => BadPapers::Unreadable(invalid),
            InvalidCredentials::Malformed { .. } | InvalidCredentials::Unusable { .. } => BadPapers::Invalid(invalid),
        }
    }
}

fn no_certificate(path: &Path) -> BadPapers {
    InvalidCredentials::Malformed { path: path.to_owned(), expected: "certificate" }.into()
}

fn check_name_and_time(path: &Path, der: &CertificateDer, name: &str) -> Result<(), BadPapers> {
    let Ok((_, certificate)) = X509Certificate::from_der(der) else { return Err(no_certificate(path)) };
    let found = certificate.subject().iter_common_name().next().and_then(|it| it.as_str().ok()).unwrap_or_default();
    if found != name {
        let (found, expected) = (found.to_owned(), name.to_owned());
        return Err(BadPapers::OtherName { path: path.to_owned(), found, expected });
    }
    let validity = certificate.validity();
    if validity.is_valid() {
        return Ok(());
    }
    let now = x509_parser::time::ASN1Time::now().to_string();
    let (from, until) = (validity.not_before.to_string(), validity.not_after.to_string());
    Err(BadPapers::OutOfDate { path: path.to_owned(), from, until, now })
}

fn check_key(credentials: &Credentials, chain: &[CertificateDer<'static>]) -> Result<(), BadPapers> {
    let path = &credentials.key;
    let key = credentials.private_key()?;
    let mode = std::fs::metadata(path).map(|it| it.mode() & 0o777);
    let mode = mode.map_err(|source| InvalidCredentials::Unreadable { path: path.to_owned(), source })?;
    if mode & 0o077 != 0 {
        return Err(BadPapers::OpenKey { path: path.to_owned(), mode });
    }
    let no_key = |_| InvalidCredentials::Malformed { path: path.to_owned(), expected: "private key" };
    let key = provider().key_provider.load_private_key(key).map_err(no_key)?;
    let certified = CertifiedKey::new(chain.to_vec(), key);
    certified.keys_match().map_err(|_| BadPapers::OtherKey { path: path.to_owned() })
}

fn words(error: &rustls::Error) -> String {
    match error {
        rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer | CertificateError::BadSignature) => {
            format!("`{AUTHORITY}` beside it has not signed it")
        }
        other => other.to_string(),
    }
}
