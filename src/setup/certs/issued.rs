//! The certificates that an authority has issued. It keeps a copy of each, so that all of them can be revoked: also those whose router
//! is gone with its folder.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use x509_parser::prelude::{FromDer, GeneralName, X509Certificate};

use super::authority::read;
use super::{Failure, replace};

/// In the authority's folder: the copies, as `NAME-SERIAL.pem`.
const ISSUED: &str = "issued";
const SUFFIX: &str = "pem";
/// A copy that was not finished, because its command was killed or the disk was full. No router was given that certificate.
const UNFINISHED: &str = "part";

/// The most bytes of a serial number (RFC 5280).
const LARGEST_SERIAL: usize = 20;

/// A certificate that was issued.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Issued {
    pub(super) name: String,
    /// Host names and addresses under which it is valid.
    pub(super) hosts: Vec<String>,
    pub(super) serial: Vec<u8>,
}

/// Keeps a copy of a certificate in the folder of the authority that has issued it, and clears away unfinished ones.
pub(super) fn keep(authority: &Path, certificate: &str) -> Result<(), Failure> {
    let folder = authority.join(ISSUED);
    for unfinished in files(&folder, UNFINISHED)? {
        // One that stays does no harm.
        let _ = std::fs::remove_file(unfinished);
    }
    let it = parsed(&folder, certificate)?;
    let serial = digits(&it.serial);
    replace(&folder.join(format!("{}-{serial}.{SUFFIX}", it.name)), 0o644, certificate)
}

/// A copy's file, and its certificate, or why it holds none.
pub(super) type Found = (PathBuf, Result<Issued, Failure>);

/// Each copy.
///
/// # Errors
/// If the folder cannot be read: nobody knows then what is missing.
pub(super) fn copies(authority: &Path) -> Result<Vec<Found>, Failure> {
    let files = files(&authority.join(ISSUED), SUFFIX)?.into_iter();
    Ok(files.map(|path| (path.clone(), of_file(&path))).collect())
}

/// A serial number as in the name of a copy.
pub(super) fn digits(serial: &[u8]) -> String {
    serial.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// What the name of a file says, whatever it holds. `None`: it is not named for a copy of a certificate of the router `name`; otherwise
/// the serial number in it, or `Some(None)` if no certificate can have that number. Names of routers have dashes too.
pub(super) fn named_for(path: &Path, name: &str) -> Option<Option<Vec<u8>>> {
    let stem = path.file_stem()?.to_str()?;
    stem.rsplit_once('-').filter(|(of, _)| *of == name).map(|(_, digits)| serial(digits))
}

fn serial(digits: &str) -> Option<Vec<u8>> {
    // With a number that no certificate can have, routers could refuse the whole list.
    let plain = digits.bytes().all(|it| it.is_ascii_hexdigit()) && digits.len().is_multiple_of(2);
    let fits = (1..=LARGEST_SERIAL).contains(&(digits.len() / 2));
    let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).ok();
    (plain && fits).then(|| (0..digits.len()).step_by(2).map(byte).collect()).flatten()
}

/// Those with this extension. Sets that were made before there were copies have no such folder.
fn files(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, Failure> {
    let failed = |cause| Failure::Read { path: folder.to_owned(), cause };
    let entries = match std::fs::read_dir(folder) {
        Err(cause) if cause.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(failed)?,
    };
    let paths = entries.map(|it| it.map(|it| it.path())).collect::<Result<Vec<_>, _>>().map_err(failed)?;
    Ok(paths.into_iter().filter(|it| it.extension().is_some_and(|it| it == extension)).collect())
}

/// The certificate in a file.
pub(super) fn of_file(path: &Path) -> Result<Issued, Failure> {
    parsed(path, &read(path)?)
}

fn parsed(path: &Path, pem: &str) -> Result<Issued, Failure> {
    let malformed = || Failure::Malformed { path: path.to_owned(), expected: "certificate" };
    let der = CertificateDer::from_pem_slice(pem.as_bytes()).map_err(|_| malformed())?;
    let (_, it) = X509Certificate::from_der(&der).map_err(|_| malformed())?;
    let name = it.subject().iter_common_name().next().and_then(|it| it.as_str().ok()).ok_or_else(malformed)?.to_owned();
    let names = it.subject_alternative_name().map_err(|_| malformed())?;
    let names = names.map(|it| it.value.general_names.as_slice()).unwrap_or_default();
    Ok(Issued { name, hosts: names.iter().filter_map(host).collect(), serial: it.raw_serial().to_vec() })
}

fn host(name: &GeneralName) -> Option<String> {
    match name {
        GeneralName::DNSName(name) => Some((*name).to_owned()),
        GeneralName::IPAddress(bytes) => match (<[u8; 4]>::try_from(*bytes), <[u8; 16]>::try_from(*bytes)) {
            (Ok(it), _) => Some(std::net::IpAddr::from(it).to_string()),
            (_, Ok(it)) => Some(std::net::IpAddr::from(it).to_string()),
            _ => None,
        },
        _ => None,
    }
}
