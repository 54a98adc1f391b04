//! The authority of a folder that `kittiwake certs` has made: what it has issued, and what it has revoked.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bus::link_credentials::{AUTHORITY, CERTIFICATE, KEY, REVOKED};
use rcgen::{CertificateRevocationListParams, Issuer, KeyIdMethod, KeyPair, RevokedCertParams, SerialNumber};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, CertificateRevocationListDer};
use time::{Duration, OffsetDateTime};
use x509_parser::prelude::{CertificateRevocationList, FromDer, GeneralName, X509Certificate};

use super::{AUTHORITY_FOLDER, CLOCK_SLACK, Failure, replace};

/// In the authority's folder: a copy of each certificate that it has issued, so that all of them can be revoked.
const ISSUED: &str = "issued";

/// A list says until when there will be a newer one. Routers do not mind an older one.
const NEXT_LIST: Duration = Duration::days(3650);

/// An authority and its key.
pub(super) struct Authority {
    /// The folder with a folder for it and one for each router.
    root: PathBuf,
    pub(super) issuer: Issuer<'static, KeyPair>,
    /// Its certificate.
    pub(super) pem: String,
}

/// A certificate that was issued.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Issued {
    pub(super) name: String,
    /// Host names and addresses under which it is valid.
    pub(super) hosts: Vec<String>,
    pub(super) serial: Vec<u8>,
}

impl Authority {
    /// That of the folder `root`.
    pub(super) fn open(root: &Path) -> Result<Authority, Failure> {
        let folder = root.join(AUTHORITY_FOLDER);
        let pem = read(&folder.join(CERTIFICATE))?;
        let key = KeyPair::from_pem(&read(&folder.join(KEY))?)?;
        let issuer = Issuer::from_ca_cert_pem(&pem, key)?;
        Ok(Authority { root: root.to_owned(), issuer, pem })
    }

    /// The certificate that the router `name` has now.
    pub(super) fn current(&self, name: &str) -> Result<Issued, Failure> {
        // A name is one part of a path: it comes from a command line.
        let plain = !name.is_empty() && !name.starts_with('.') && !name.contains('/');
        let path = self.root.join(name).join(CERTIFICATE);
        let known =
            || Failure::Unknown { name: name.to_owned(), root: self.root.clone(), known: self.routers().join(", ") };
        if !plain || name == AUTHORITY_FOLDER || !path.exists() {
            return Err(known());
        }
        issued(&path)
    }

    /// Those that were issued to the router `name`, the present one among them.
    pub(super) fn issued_to(&self, name: &str) -> Result<Vec<Issued>, Failure> {
        let mut found = vec![self.current(name)?];
        let folder = self.root.join(AUTHORITY_FOLDER).join(ISSUED);
        // Sets that were made before there were copies have no such folder.
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let it = issued(&entry.path())?;
            if it.name == name && !found.contains(&it) {
                found.push(it);
            }
        }
        Ok(found)
    }

    /// Keeps a copy of a certificate that it has just issued.
    pub(super) fn keep(&self, certificate: &str) -> Result<(), Failure> {
        keep(&self.root.join(AUTHORITY_FOLDER), certificate)
    }

    /// The names of the routers that have a folder.
    fn routers(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.root).into_iter().flatten().flatten();
        let routers = entries.filter(|it| it.path().join(AUTHORITY).exists());
        let mut names: Vec<_> = routers.map(|it| it.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Adds these to the list of what is revoked, and writes it beside each router's certificate; the files.
    pub(super) fn revoke(&self, certificates: &[Issued]) -> Result<Vec<PathBuf>, Failure> {
        let own = self.root.join(AUTHORITY_FOLDER).join(REVOKED);
        let (mut revoked, number) = revoked_so_far(&own)?;
        let now = OffsetDateTime::now_utc();
        for it in certificates {
            revoked.entry(it.serial.clone()).or_insert(now);
        }
        let entry = |(serial, time): (Vec<u8>, OffsetDateTime)| RevokedCertParams {
            serial_number: SerialNumber::from(serial),
            revocation_time: time,
            reason_code: None,
            invalidity_date: None,
        };
        let list = CertificateRevocationListParams {
            this_update: now - CLOCK_SLACK,
            next_update: now + NEXT_LIST,
            crl_number: SerialNumber::from(number + 1),
            issuing_distribution_point: None,
            revoked_certs: revoked.into_iter().map(entry).collect(),
            key_identifier_method: KeyIdMethod::Sha256,
        };
        let pem = list.signed_by(&self.issuer)?.pem()?;
        let routers = self.routers().into_iter().map(|it| self.root.join(it).join(REVOKED));
        let files: Vec<_> = std::iter::once(own).chain(routers).collect();
        files.iter().try_for_each(|it| replace(it, 0o644, &pem))?;
        Ok(files)
    }
}

/// Keeps a copy of a certificate in the folder of the authority that has issued it.
pub(super) fn keep(authority: &Path, certificate: &str) -> Result<(), Failure> {
    let path = authority.join(ISSUED).join("new");
    let it = parsed(&path, certificate)?;
    let serial: String = it.serial.iter().map(|byte| format!("{byte:02x}")).collect();
    replace(&path.with_file_name(format!("{}-{serial}.pem", it.name)), 0o644, certificate)
}

fn read(path: &Path) -> Result<String, Failure> {
    credentials::file::read_text(path).map_err(|cause| Failure::Read { path: path.to_owned(), cause })
}

fn issued(path: &Path) -> Result<Issued, Failure> {
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

/// Serial numbers with the time of their revocation, and the number of the list; an authority without a list has revoked
/// nothing.
fn revoked_so_far(path: &Path) -> Result<(BTreeMap<Vec<u8>, OffsetDateTime>, u64), Failure> {
    if !path.exists() {
        return Ok((BTreeMap::new(), 0));
    }
    let malformed = || Failure::Malformed { path: path.to_owned(), expected: "revocation list" };
    let der = CertificateRevocationListDer::from_pem_slice(read(path)?.as_bytes()).map_err(|_| malformed())?;
    let (_, list) = CertificateRevocationList::from_der(&der).map_err(|_| malformed())?;
    let number = list.crl_number().and_then(|it| u64::try_from(it).ok()).ok_or_else(malformed)?;
    let revoked = list.iter_revoked_certificates();
    Ok((revoked.map(|it| (it.raw_serial().to_vec(), it.revocation_date.to_datetime())).collect(), number))
}
