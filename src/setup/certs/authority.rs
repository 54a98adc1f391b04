//! The authority of a folder that `kittiwake certs` has made: whom it knows, and what it has revoked.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};

use bus::link_credentials::{AUTHORITY, CERTIFICATE, KEY, REVOKED};
use rcgen::{CertificateRevocationListParams, Issuer, KeyIdMethod, KeyPair, RevokedCertParams, SerialNumber};
use rustls::pki_types::CertificateRevocationListDer;
use rustls::pki_types::pem::PemObject;
use time::{Duration, OffsetDateTime};
use x509_parser::prelude::{CertificateRevocationList, FromDer};

use super::issued::{self, Issued};
use super::{AUTHORITY_FOLDER, CLOCK_SLACK, Failure, one_at_a_time, replace};

/// A list says until when there will be a newer one. Routers do not mind an older one.
const NEXT_LIST: Duration = Duration::days(3650);

/// An authority and its key.
pub(super) struct Authority {
    /// The folder with a folder for it and one for each router.
    root: PathBuf,
    pub(super) issuer: Issuer<'static, KeyPair>,
    /// Its certificate.
    pub(super) pem: String,
    /// No other command changes the same folder until this is dropped.
    _lock: File,
}

/// The certificates of a router.
#[derive(Debug)]
pub(super) struct OfRouter {
    /// The one in its folder, if that is still there: it may have been moved to its machine.
    pub(super) present: Option<Issued>,
    /// All others; with no present one, that one is among them.
    pub(super) former: Vec<Issued>,
    /// The serial numbers of others, by the names of the files that must hold them, and why these do not.
    pub(super) unreadable: Vec<(Failure, Vec<u8>)>,
    /// Why other files that must be its certificates are invalid.
    pub(super) unusable: Vec<Failure>,
}

impl Authority {
    /// That of the folder `root`. Waits until no other command uses it.
    pub(super) fn open(root: &Path) -> Result<Authority, Failure> {
        let folder = root.join(AUTHORITY_FOLDER);
        let pem = read(&folder.join(CERTIFICATE))?;
        let key = KeyPair::from_pem(&read(&folder.join(KEY))?)?;
        let issuer = Issuer::from_ca_cert_pem(&pem, key)?;
        Ok(Authority { root: root.to_owned(), issuer, pem, _lock: one_at_a_time::lock(&folder)? })
    }

    fn folder(&self) -> PathBuf {
        self.root.join(AUTHORITY_FOLDER)
    }

    /// The certificates that the router `name` has had. What a command that was killed has left behind keeps none of them from being
    /// found.
    ///
    /// # Errors
    /// If there are none.
    pub(super) fn issued_to(&self, name: &str) -> Result<OfRouter, Failure> {
        let (mut former, mut unreadable, mut unusable) = (Vec::new(), Vec::new(), Vec::new());
        let present = self.present(name).unwrap_or_else(|bad| {
            unusable.push(bad);
            None
        });
        for (path, copy) in issued::copies(&self.folder())? {
            match copy {
                Ok(it) if it.name == name && Some(&it) != present.as_ref() => former.push(it),
                Ok(_) => {}
                Err(bad) => match issued::named_for(&path, name) {
                    // It is known what is in the copy of the present one.
                    Some(Some(serial)) if present.as_ref().is_some_and(|it| it.serial == serial) => {}
                    Some(Some(serial)) => unreadable.push((bad, serial)),
                    Some(None) => unusable.push(bad),
                    None => {}
                },
            }
        }
        if present.is_none() && former.is_empty() && unreadable.is_empty() {
            return Err(unusable.into_iter().next().unwrap_or_else(|| self.unknown(name)));
        }
        Ok(OfRouter { present, former, unreadable, unusable })
    }

    /// The certificate that the router `name` has now, if its folder is here.
    fn present(&self, name: &str) -> Result<Option<Issued>, Failure> {
        // A name is one part of a path: it comes from a command line.
        let plain = !name.is_empty() && !name.starts_with('.') && !name.contains('/');
        let path = self.root.join(name).join(CERTIFICATE);
        if !plain || name == AUTHORITY_FOLDER || !path.exists() {
            return Ok(None);
        }
        issued::of_file(&path).map(Some)
    }

    /// That there is no router `name`, and which there are.
    pub(super) fn unknown(&self, name: &str) -> Failure {
        let copies = issued::copies(&self.folder()).unwrap_or_default();
        let without_folder = copies.into_iter().filter_map(|(_, copy)| Some(copy.ok()?.name));
        let known: BTreeSet<String> = self.routers().into_iter().chain(without_folder).collect();
        let known = known.into_iter().collect::<Vec<_>>().join(", ");
        Failure::Unknown { name: name.to_owned(), root: self.root.clone(), known }
    }

    /// Keeps a copy of a certificate that it has just issued.
    pub(super) fn keep(&self, certificate: &str) -> Result<(), Failure> {
        issued::keep(&self.folder(), certificate)
    }

    /// The names of the routers that have a folder.
    fn routers(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.root).into_iter().flatten().flatten();
        let routers = entries.filter(|it| it.path().join(AUTHORITY).exists());
        let mut names: Vec<_> = routers.map(|it| it.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Puts the list of what is revoked into a router's folder that has none: without it the router would count nothing as revoked.
    pub(super) fn give_list(&self, router: &Path) -> Result<(), Failure> {
        let (own, given) = (self.folder().join(REVOKED), router.join(REVOKED));
        if given.exists() || !own.exists() {
            return Ok(());
        }
        // A router does not start with a file that holds no list.
        revoked_so_far(&own)?;
        replace(&given, 0o644, &read(&own)?)
    }

    /// Adds the certificates with these serial numbers to the list of what is revoked, and writes it beside each router's certificate; the files.
    /// Its own comes first, and no router gets what it could not keep: the next list is made of that one.
    ///
    /// # Errors
    /// If its own list cannot be made, and then nothing is changed; or if a router's cannot be written, and then all others are.
    pub(super) fn revoke(&self, serials: Vec<Vec<u8>>) -> Result<Vec<PathBuf>, Failure> {
        let own = self.folder().join(REVOKED);
        let (mut revoked, number) = revoked_so_far(&own)?;
        let now = OffsetDateTime::now_utc();
        for serial in serials {
            revoked.entry(serial).or_insert(now);
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
        replace(&own, 0o644, &pem)?;
        Ok([vec![own], self.give_to_each(&pem)?].concat())
    }

    /// Writes the list beside each router's certificate; the files. One that cannot be written does not keep it from the other routers.
    fn give_to_each(&self, list: &str) -> Result<Vec<PathBuf>, Failure> {
        let (mut files, mut given, mut failures) = (Vec::new(), Vec::new(), Vec::new());
        for name in self.routers() {
            let file = self.root.join(&name).join(REVOKED);
            match replace(&file, 0o644, list) {
                Ok(()) => {
                    files.push(file);
                    given.push(name);
                }
                Err(failure) => failures.push(failure.to_string()),
            }
        }
        if failures.is_empty() {
            return Ok(files);
        }
        let given = if given.is_empty() { "none".to_owned() } else { given.join(", ") };
        Err(Failure::NotGiven { failures: failures.join("; "), given })
    }
}

pub(super) fn read(path: &Path) -> Result<String, Failure> {
    regular_file::read_text(path).map_err(|cause| Failure::Read { path: path.to_owned(), cause })
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
