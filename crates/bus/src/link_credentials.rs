//! What a router shows at the link, checked before it starts: its certificate, the key to it, and the
//! certificate of the authority that both sides trust.
//!
//! Zenoh would take a bad certificate and fail at every handshake. Here it is refused with one sentence.

use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use credentials::{Credentials, End, InvalidCredentials, provider};
use rustls::CertificateError;
use rustls::pki_types::{CertificateDer, ServerName};
use rustls::sign::CertifiedKey;
use x509_parser::prelude::{FromDer, X509Certificate};

use crate::crossing::Side;

/// In a router's folder: the certificate of the authority.
pub const AUTHORITY: &str = "authority.pem";
/// Its own certificate.
pub const CERTIFICATE: &str = "certificate.pem";
/// The key to it.
pub const KEY: &str = "key.pem";

pub use credentials::REVOKED;

/// Why a router's certificate is not accepted.
#[derive(Debug, thiserror::Error)]
pub enum InvalidLinkCredentials {
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
    /// The authority has revoked it.
    #[error("{path} is revoked, as {REVOKED} beside it says: get another, which `kittiwake certs renew` makes")]
    Revoked {
        /// The file.
        path: PathBuf,
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

/// Checks the credentials in `folder` of the router called `name`, which stands on `side`.
///
/// # Errors
/// With what is wrong first; what forbids no link only if nothing else is wrong.
pub fn check(folder: &Path, name: &str, side: Side) -> Result<(), InvalidLinkCredentials> {
    let credentials = in_folder(folder);
    let path = credentials.certificate.clone();
    // First, so that a file that is missing is named.
    credentials.trusted()?;
    let chain = credentials.chain()?;
    let [own, ..] = chain.as_slice() else { return Err(no_certificate(&path)) };
    check_name_and_time(&path, own, name)?;
    check_key(&credentials, &chain)?;
    let refused = |cause: String| InvalidLinkCredentials::Refused { path: path.clone(), cause };
    // The aircraft calls, the ground answers the call.
    let end = match side {
        Side::Aircraft => End::Caller,
        Side::Ground => End::Called(ServerName::try_from(name.to_owned()).map_err(|cause| refused(cause.to_string()))?),
    };
    credentials.accepts(&chain, &end)?.map_err(|error| match error {
        rustls::Error::InvalidCertificate(CertificateError::Revoked) => {
            InvalidLinkCredentials::Revoked { path: path.clone() }
        }
        other => refused(words(&other)),
    })?;
    // Last: it forbids no link, and must not hide what does.
    check_mode(&credentials.key)
}

impl InvalidLinkCredentials {
    /// Whether a router on `side` does not start with such credentials. One on board always starts: whether it is started again in
    /// flight nobody can tell it, and while files are copied, or after that went wrong, those on board must have their bus. On the ground
    /// only what comes about, or passes, with time alone and without anybody's mistake keeps it from nothing.
    pub fn refuses(&self, side: Side) -> bool {
        let comes_with_time =
            matches!(self, InvalidLinkCredentials::OutOfDate { .. } | InvalidLinkCredentials::Revoked { .. });
        side == Side::Ground && !comes_with_time
    }

    /// Whether no link can be made with them for now, as far as this end can tell.
    pub fn forbids_link(&self) -> bool {
        !matches!(self, InvalidLinkCredentials::OpenKey { .. })
    }
}

/// The credentials in a folder.
pub(crate) fn in_folder(folder: &Path) -> Credentials {
    Credentials { authority: folder.join(AUTHORITY), certificate: folder.join(CERTIFICATE), key: folder.join(KEY) }
}

impl From<InvalidCredentials> for InvalidLinkCredentials {
    fn from(invalid: InvalidCredentials) -> InvalidLinkCredentials {
        match invalid {
            InvalidCredentials::Unreadable { .. } => InvalidLinkCredentials::Unreadable(invalid),
            InvalidCredentials::Malformed { .. } | InvalidCredentials::Unusable { .. } => {
                InvalidLinkCredentials::Invalid(invalid)
            }
        }
    }
}

fn no_certificate(path: &Path) -> InvalidLinkCredentials {
    InvalidCredentials::Malformed { path: path.to_owned(), expected: "certificate" }.into()
}

fn check_name_and_time(path: &Path, der: &CertificateDer, name: &str) -> Result<(), InvalidLinkCredentials> {
    let Ok((_, certificate)) = X509Certificate::from_der(der) else { return Err(no_certificate(path)) };
    let found = certificate.subject().iter_common_name().next().and_then(|it| it.as_str().ok()).unwrap_or_default();
    if found != name {
        let (found, expected) = (found.to_owned(), name.to_owned());
        return Err(InvalidLinkCredentials::OtherName { path: path.to_owned(), found, expected });
    }
    let validity = certificate.validity();
    if validity.is_valid() {
        return Ok(());
    }
    let now = x509_parser::time::ASN1Time::now().to_string();
    let (from, until) = (validity.not_before.to_string(), validity.not_after.to_string());
    Err(InvalidLinkCredentials::OutOfDate { path: path.to_owned(), from, until, now })
}

fn check_key(credentials: &Credentials, chain: &[CertificateDer<'static>]) -> Result<(), InvalidLinkCredentials> {
    let path = &credentials.key;
    let key = credentials.private_key()?;
    let no_key = |_| InvalidCredentials::Malformed { path: path.to_owned(), expected: "private key" };
    let key = provider().key_provider.load_private_key(key).map_err(no_key)?;
    let certified = CertifiedKey::new(chain.to_vec(), key);
    certified.keys_match().map_err(|_| InvalidLinkCredentials::OtherKey { path: path.to_owned() })
}

fn check_mode(path: &Path) -> Result<(), InvalidLinkCredentials> {
    let mode = std::fs::metadata(path).map(|it| it.mode() & 0o777);
    let mode = mode.map_err(|source| InvalidCredentials::Unreadable { path: path.to_owned(), source })?;
    match mode & 0o077 {
        0 => Ok(()),
        _ => Err(InvalidLinkCredentials::OpenKey { path: path.to_owned(), mode }),
    }
}

fn words(error: &rustls::Error) -> String {
    match error {
        rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer | CertificateError::BadSignature) => {
            format!("`{AUTHORITY}` beside it has not signed it")
        }
        other => other.to_string(),
    }
}
