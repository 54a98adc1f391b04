//! `kittiwake certs`: an authority and a certificate for each router; later on, revoking and renewing them.
//!
//! One folder for each machine, to be copied there whole. The authority's key stays where it was made: it can sign a
//! certificate for any of them. Routers notice files that are replaced, so nothing is started again.

use std::fs::File;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};

use bus::crossing::aircraft_name;
use bus::link_credentials::{AUTHORITY, CERTIFICATE, KEY};
use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair, KeyUsagePurpose,
};
use time::{Duration, OffsetDateTime};

use crate::cli::{CertsArgs, CertsCommand, RenewArgs, RevokeArgs};
use crate::outcome::Outcome;
use crate::output;
use crate::run::tower_key;
use authority::Authority;

mod authority;
mod issued;
mod one_at_a_time;
#[cfg(test)]
mod tests;
mod whole;

/// The authority's own folder.
const AUTHORITY_FOLDER: &str = "authority";
/// The folder with the key with which the control tower signs permissions, and that with its public half for vehicles.
const TOWER_FOLDER: &str = "control-tower";
const FOR_VEHICLES: &str = "for-vehicles";
/// How long before now they become valid: the clocks of two machines differ.
const CLOCK_SLACK: Duration = Duration::hours(1);
/// The authority stays valid longer than the certificates it signs.
const AUTHORITY_DAYS: f64 = 3650.0;

/// Why there is no certificate.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error("{path} is there already: nothing was changed; name another folder, or remove it")]
    Exists { path: PathBuf },
    #[error("not a whole set, so nothing was kept or changed: {wrong}: {remedy}")]
    NotWhole { wrong: String, remedy: String },
    #[error("cannot read {path}: {cause}")]
    Read { path: PathBuf, cause: std::io::Error },
    #[error("{path} holds no {expected} in PEM form")]
    Malformed { path: PathBuf, expected: &'static str },
    #[error("no router `{name}` in {root}; there are: {known}")]
    Unknown { name: String, root: PathBuf, known: String },
    #[error("`{name}` has no certificate but the present one: renew it first, or leave out --former")]
    NoFormer { name: String },
    #[error(
        "which certificate `{name}` has now is not known, as {path} holds none: put it back, or leave out --former"
    )]
    NoPresent { name: String, path: PathBuf },
    #[error("cannot write {path}: {cause}")]
    Write { path: PathBuf, cause: std::io::Error },
    #[error(
        "revoked, and not every router has the list that says so: {failures}; routers that have it: {given}; see that these \
         files can be written, and revoke it again"
    )]
    NotGiven { failures: String, given: String },
    #[error(transparent)]
    TowerKey(#[from] tower_key::Failure),
    #[error("cannot make a certificate: {0}")]
    Make(#[from] rcgen::Error),
}

/// Makes all certificates, or none; or revokes or renews those of one router. Prints what was written.
pub fn certs(args: &CertsArgs) -> Outcome {
    let written = match (&args.command, &args.folder) {
        (Some(CertsCommand::Revoke(it)), _) => revoke(it),
        (Some(CertsCommand::Renew(it)), _) => renew(it),
        (None, Some(folder)) => make(folder, args),
        // The command line requires the folder.
        (None, None) => Ok(Vec::new()),
    };
    match written {
        Ok(folders) => {
            folders.iter().for_each(|it| output::line(it.display()));
            Outcome::Success
        }
        Err(failure) => {
            output::error_line(format_args!("certs: {failure}"));
            Outcome::BadInput
        }
    }
}

/// A certificate to be made.
struct Router {
    name: String,
    hosts: Vec<String>,
}

fn make(root: &Path, args: &CertsArgs) -> Result<Vec<PathBuf>, Failure> {
    let ground = [args.ground_name.clone(), "localhost".into(), "127.0.0.1".into()];
    let ground = Router { name: args.ground_name.clone(), hosts: [&ground[..], &args.ground_host].concat() };
    let aircraft = args.vehicle.iter().map(|it| aircraft_name(it.as_str()));
    let mut routers: Vec<_> = aircraft.map(|name| Router { hosts: vec![name.clone()], name }).collect();
    routers.insert(0, ground);
    let folders: Vec<_> = routers.iter().map(|it| root.join(&it.name)).collect();
    let authority_folder = root.join(AUTHORITY_FOLDER);
    let towers = [root.join(TOWER_FOLDER), root.join(FOR_VEHICLES)];
    let files = all_files(&authority_folder, &folders);
    let there = || files.iter().find(|it| it.exists()).cloned();
    // An empty folder is accepted: it may be a volume that was mounted for it.
    if let (false, Some(path)) = (args.keep, there()) {
        return Err(Failure::Exists { path });
    }
    private_folder(&authority_folder).map_err(|cause| Failure::Write { path: authority_folder.clone(), cause })?;
    // Of two that make a set at once, the second finds that of the first.
    let _lock = one_at_a_time::lock(&authority_folder)?;
    match there() {
        Some(path) if !args.keep => return Err(Failure::Exists { path }),
        Some(_) => whole::check(root, &routers)?,
        None => make_all(&authority_folder, &routers, &folders, args.days)?,
    }
    // A set that was made before there was such a key gets one.
    tower_key::in_folders(&towers[0], &towers[1])?;
    Ok([vec![authority_folder], folders, towers.into()].concat())
}

/// Each file is on the disk before the next one is begun: a power loss leaves whole files, and at worst not all of them.
fn make_all(authority_folder: &Path, routers: &[Router], folders: &[PathBuf], days: f64) -> Result<(), Failure> {
    let (authority, issuer, key) = authority()?;
    replace(&authority_folder.join(KEY), 0o600, &key)?;
    replace(&authority_folder.join(CERTIFICATE), 0o644, &authority)?;
    for (router, folder) in routers.iter().zip(folders) {
        let (certificate, key) = signed(router, days, &issuer)?;
        // First, as when it is renewed: what has no copy is not revoked later.
        issued::keep(authority_folder, &certificate)?;
        replace(&folder.join(AUTHORITY), 0o644, &authority)?;
        replace(&folder.join(KEY), 0o600, &key)?;
        replace(&folder.join(CERTIFICATE), 0o644, &certificate)?;
    }
    Ok(())
}

/// Has a router cut off, and anybody else who has one of its certificates and the key to it.
fn revoke(args: &RevokeArgs) -> Result<Vec<PathBuf>, Failure> {
    let authority = Authority::open(&args.folder)?;
    let found = authority.issued_to(&args.name)?;
    for (unreadable, serial) in &found.unreadable {
        let serial = issued::digits(serial);
        output::error_line(format_args!(
            "certs: warning: {unreadable}: the serial number in its name is taken, {serial}"
        ));
    }
    for unusable in &found.unusable {
        output::error_line(format_args!("certs: warning: {unusable}: skipped, and what was in it is not revoked"));
    }
    let name = args.name.clone();
    let former = found.former.into_iter().map(|it| it.serial);
    let mut serials: Vec<_> = former.chain(found.unreadable.into_iter().map(|(_, serial)| serial)).collect();
    match (args.former, found.present) {
        (true, None) => return Err(Failure::NoPresent { path: args.folder.join(&name).join(CERTIFICATE), name }),
        (true, Some(_)) if serials.is_empty() => return Err(Failure::NoFormer { name }),
        (true, Some(_)) => {}
        (false, present) => serials.extend(present.map(|it| it.serial)),
    }
    authority.revoke(serials)
}

/// Renews a router's certificate and key, for the same name and hosts.
fn renew(args: &RenewArgs) -> Result<Vec<PathBuf>, Failure> {
    let authority = Authority::open(&args.folder)?;
    let found = authority.issued_to(&args.name)?;
    // Its folder may have been moved to its machine, or be spoiled: all its certificates are for the same hosts.
    let known = found.present.into_iter().chain(found.former).next().ok_or_else(|| {
        let why = found.unreadable.into_iter().map(|(why, _)| why).chain(found.unusable).next();
        why.unwrap_or_else(|| authority.unknown(&args.name))
    })?;
    let router = Router { name: known.name, hosts: known.hosts };
    let (certificate, key) = signed(&router, args.days, &authority.issuer)?;
    authority.keep(&certificate)?;
    let folder = args.folder.join(&args.name);
    authority.give_list(&folder)?;
    // A router that reads in between finds a key of another certificate, and goes on with the previous files.
    replace(&folder.join(KEY), 0o600, &key)?;
    replace(&folder.join(CERTIFICATE), 0o644, &certificate)?;
    replace(&folder.join(AUTHORITY), 0o644, &authority.pem)?;
    Ok(vec![folder])
}

fn all_files(authority: &Path, routers: &[PathBuf]) -> Vec<PathBuf> {
    let of_authority = [CERTIFICATE, KEY].map(|it| authority.join(it));
    let of_routers = routers.iter().flat_map(|folder| [AUTHORITY, CERTIFICATE, KEY].map(|it| folder.join(it)));
    of_authority.into_iter().chain(of_routers).collect()
}

/// Its certificate, itself, and its key.
fn authority() -> Result<(String, Issuer<'static, KeyPair>, String), Failure> {
    let key = KeyPair::generate()?;
    // Of two authorities of one name, the list of one would be looked up for certificates of the other.
    let number: String = key.public_key_raw().iter().rev().take(4).map(|it| format!("{it:02x}")).collect();
    let mut params = params(&format!("kittiwake demonstration authority {number}"), &[], AUTHORITY_DAYS)?;
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    let certificate = params.self_signed(&key)?.pem();
    let pem = key.serialize_pem();
    Ok((certificate, Issuer::new(params, key), pem))
}

fn signed(router: &Router, days: f64, issuer: &Issuer<'static, KeyPair>) -> Result<(String, String), Failure> {
    let mut params = params(&router.name, &router.hosts, days)?;
    params.use_authority_key_identifier_extension = true;
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
    let key = KeyPair::generate()?;
    Ok((params.signed_by(&key, issuer)?.pem(), key.serialize_pem()))
}

fn params(name: &str, hosts: &[String], days: f64) -> Result<CertificateParams, Failure> {
    let mut params = CertificateParams::new(hosts.to_vec())?;
    params.distinguished_name.push(DnType::CommonName, name);
    let now = OffsetDateTime::now_utc();
    let until = now + Duration::days(1) * days;
    (params.not_before, params.not_after) = ((now - CLOCK_SLACK).min(until - CLOCK_SLACK), until);
    Ok(params)
}

/// Replaces a file at once and for good: success is reported only when a power loss takes nothing back.
fn replace(path: &Path, mode: u32, text: &str) -> Result<(), Failure> {
    let made = path.parent().map_or(Ok(()), private_folder);
    let replaced = made.and_then(|()| regular_file::replace(path, mode, text.as_bytes()));
    replaced.map_err(|cause| Failure::Write { path: path.to_owned(), cause })
}

/// Makes a folder, and those above it, for good: a power loss could take a folder away whose own files are on the disk.
fn private_folder(folder: &Path) -> std::io::Result<()> {
    if folder.as_os_str().is_empty() || folder.is_dir() {
        return Ok(());
    }
    let above = folder.parent().filter(|it| !it.as_os_str().is_empty()).unwrap_or(Path::new("."));
    private_folder(above)?;
    // Recursive, as it may have been made meanwhile.
    std::fs::DirBuilder::new().recursive(true).mode(0o700).create(folder)?;
    File::open(above)?.sync_all()
}
