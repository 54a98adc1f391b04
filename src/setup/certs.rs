//! `kittiwake certs`: an authority and a certificate for each router; later on, revoking and renewing them.
//!
//! One folder for each machine, to be copied there whole. The authority's key stays where it was made: it can sign a
//! certificate for any of them. Routers notice files that are replaced, so nothing is started again.

use std::io::Write;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
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
    #[error("cannot read {path}: {cause}")]
    Read { path: PathBuf, cause: std::io::Error },
    #[error("{path} holds no {expected} in PEM form")]
    Malformed { path: PathBuf, expected: &'static str },
    #[error("no router `{name}` in {root}; there are: {known}")]
    Unknown { name: String, root: PathBuf, known: String },
    #[error("`{name}` has no certificate but the present one: renew it first, or leave out --former")]
    NoFormer { name: String },
    #[error("cannot write {path}: {cause}")]
    Write { path: PathBuf, cause: std::io::Error },
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
    let missing = files.iter().filter(|it| !it.exists()).count();
    if args.keep && missing == 0 {
        // A set that was made before there was such a key gets one.
        tower_key::in_folders(&towers[0], &towers[1])?;
        return Ok([vec![authority_folder], folders, towers.into()].concat());
    }
    // An empty folder is accepted: it may be a volume that was mounted for it.
    if let Some(path) = files.into_iter().find(|it| it.exists()) {
        return Err(Failure::Exists { path });
    }
    let (authority, issuer, key) = authority()?;
    write(&authority_folder, CERTIFICATE, 0o644, &authority)?;
    write(&authority_folder, KEY, 0o600, &key)?;
    for (router, folder) in routers.iter().zip(&folders) {
        let (certificate, key) = signed(router, args.days, &issuer)?;
        write(folder, AUTHORITY, 0o644, &authority)?;
        write(folder, CERTIFICATE, 0o644, &certificate)?;
        write(folder, KEY, 0o600, &key)?;
        authority::keep(&authority_folder, &certificate)?;
    }
    tower_key::in_folders(&towers[0], &towers[1])?;
    Ok([vec![authority_folder], folders, towers.into()].concat())
}

/// Has a router cut off, and anybody else who has one of its certificates and the key to it.
fn revoke(args: &RevokeArgs) -> Result<Vec<PathBuf>, Failure> {
    let authority = Authority::open(&args.folder)?;
    let mut certificates = authority.issued_to(&args.name)?;
    if args.former {
        let current = authority.current(&args.name)?;
        certificates.retain(|it| *it != current);
        if certificates.is_empty() {
            return Err(Failure::NoFormer { name: args.name.clone() });
        }
    }
    authority.revoke(&certificates)
}

/// Renews a router's certificate and key, for the same name and hosts.
fn renew(args: &RenewArgs) -> Result<Vec<PathBuf>, Failure> {
    let authority = Authority::open(&args.folder)?;
    let current = authority.current(&args.name)?;
    let router = Router { name: current.name, hosts: current.hosts };
    let (certificate, key) = signed(&router, args.days, &authority.issuer)?;
    authority.keep(&certificate)?;
    let folder = args.folder.join(&args.name);
    // A router that reads in between finds a key of another certificate, and goes on with the ones of before.
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

fn write(folder: &Path, name: &str, mode: u32, text: &str) -> Result<(), Failure> {
    let path = folder.join(name);
    let failed = |cause| Failure::Write { path: path.clone(), cause };
    std::fs::DirBuilder::new().recursive(true).mode(0o700).create(folder).map_err(failed)?;
    let file = std::fs::OpenOptions::new().write(true).create_new(true).mode(mode).open(&path);
    file.and_then(|mut it| it.write_all(text.as_bytes())).map_err(failed)
}

/// Replaces a file at once: a reader finds the old one or the new one.
fn replace(path: &Path, mode: u32, text: &str) -> Result<(), Failure> {
    let failed = |cause| Failure::Write { path: path.to_owned(), cause };
    let (folder, name) = (path.parent().unwrap_or(Path::new(".")), path.file_name().unwrap_or_default());
    let unfinished = format!("{}.part", name.to_string_lossy());
    // Left behind by a command that was killed.
    let _ = std::fs::remove_file(folder.join(&unfinished));
    write(folder, &unfinished, mode, text)?;
    std::fs::rename(folder.join(unfinished), path).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use bus::crossing::Side;
    use bus::link_credentials::REVOKED;
    use bus::link_credentials::check;
    use clap::Parser;

    fn run(folder: &Path, more: &[&str]) -> Result<Vec<PathBuf>, Failure> {
        let folder = folder.to_string_lossy();
        let args = [&["kittiwake", "certs", &folder, "--vehicle", "uav1", "--vehicle", "uav2"], more].concat();
        let Some(Command::Certs(args)) = Cli::parse_from(args).command else { panic!("not `certs`") };
        make(args.folder.as_deref().unwrap(), &args)
    }

    /// `kittiwake certs revoke` or `renew` with this folder and these further arguments.
    fn change(command: &str, folder: &Path, more: &[&str]) -> Result<Vec<PathBuf>, Failure> {
        let folder = folder.to_string_lossy();
        let Some(Command::Certs(args)) =
            Cli::parse_from([&["kittiwake", "certs", command, &folder], more].concat()).command
        else {
            panic!("not `certs`")
        };
        match args.command.unwrap() {
            CertsCommand::Revoke(it) => revoke(&it),
            CertsCommand::Renew(it) => renew(&it),
        }
    }

    #[test]
    fn a_revoked_router_is_refused_until_it_is_renewed() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        run(root, &["--ground-host", "ground.example", "--ground-host", "10.0.0.1", "--ground-host", "2001:db8::1"])
            .unwrap();
        let accepted = |name: &str, side| check(&root.join(name), name, side).map_err(|it| it.to_string());
        for (name, other, side, other_side) in [
            ("uav1-router", "ground-router", Side::Aircraft, Side::Ground),
            ("ground-router", "uav1-router", Side::Ground, Side::Aircraft),
        ] {
            // Twice renewed: all three are revoked together.
            change("renew", root, &[name]).unwrap();
            let former = std::fs::read(root.join(name).join(CERTIFICATE)).unwrap();
            change("renew", root, &[name]).unwrap();
            accepted(name, side).unwrap();
            let lists = change("revoke", root, &[name]).unwrap();
            assert_eq!(lists.len(), 4, "the authority's and three routers': {lists:?}");
            let refusal = accepted(name, side).unwrap_err();
            assert!(refusal.contains("is revoked"), "{refusal}");
            accepted(other, other_side).unwrap();
            change("renew", root, &[name, "--days", "3"]).unwrap();
            accepted(name, side).unwrap();
            change("revoke", root, &[name, "--former"]).unwrap();
            accepted(name, side).unwrap();
            std::fs::write(root.join(name).join("old.pem"), former).unwrap();
            assert_eq!(Authority::open(root).unwrap().issued_to(name).unwrap().len(), 4);
        }
        let hosts = Authority::open(root).unwrap().current("ground-router").unwrap().hosts;
        let expected = ["ground-router", "localhost", "127.0.0.1", "ground.example", "10.0.0.1", "2001:db8::1"];
        assert_eq!(hosts, expected, "a renewed certificate is for the same hosts");
    }

    #[test]
    fn what_cannot_be_revoked_or_renewed_is_said() {
        #[track_caller]
        fn refused(result: Result<Vec<PathBuf>, Failure>, said: &str) {
            let refusal = result.unwrap_err().to_string();
            assert!(refusal.contains(said), "{refusal}");
        }
        let root = tempfile::tempdir().unwrap();
        refused(change("revoke", root.path(), &["uav1-router"]), "cannot read");
        run(root.path(), &[]).unwrap();
        for name in ["uav9-router", "authority", "../authority", "", "."] {
            refused(change("revoke", root.path(), &[name]), "there are: ground-router, uav1-router, uav2-router");
            refused(change("renew", root.path(), &[name]), "there are: ground-router");
        }
        refused(change("revoke", root.path(), &["uav1-router", "--former"]), "renew it first");
        std::fs::write(root.path().join("authority").join(REVOKED), "garbage").unwrap();
        refused(change("revoke", root.path(), &["uav1-router"]), "holds no revocation list");
    }

    #[test]
    fn each_router_gets_credentials_that_it_may_use() {
        let folder = tempfile::tempdir().unwrap();
        run(folder.path(), &[]).unwrap();
        for (name, side) in
            [("ground-router", Side::Ground), ("uav1-router", Side::Aircraft), ("uav2-router", Side::Aircraft)]
        {
            check(&folder.path().join(name), name, side).unwrap_or_else(|bad| panic!("{bad}"));
        }
        let before = std::fs::read(folder.path().join("uav1-router/key.pem")).unwrap();
        assert!(run(folder.path(), &[]).unwrap_err().to_string().contains("is there already"));
        run(folder.path(), &["--keep"]).unwrap();
        assert_eq!(std::fs::read(folder.path().join("uav1-router/key.pem")).unwrap(), before);
        std::fs::remove_file(folder.path().join("uav2-router/key.pem")).unwrap();
        assert!(
            run(folder.path(), &["--keep"]).unwrap_err().to_string().contains("is there already"),
            "it is not whole"
        );
    }

    #[test]
    fn empty_folders_are_filled() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["authority", "ground-router", "uav1-router", "uav2-router"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        run(folder.path(), &["--keep"]).unwrap();
        check(&folder.path().join("uav2-router"), "uav2-router", Side::Aircraft).unwrap_or_else(|bad| panic!("{bad}"));
    }

    #[test]
    fn credentials_that_would_fail_at_the_link_are_refused_at_once() {
        /// Makes credentials, damages them, and expects a refusal.
        #[track_caller]
        fn spoiled(more: &[&str], spoil: impl FnOnce(&Path), said: &str) {
            let folder = tempfile::tempdir().unwrap();
            run(folder.path(), more).unwrap();
            spoil(folder.path());
            let refused = check(&folder.path().join("uav1-router"), "uav1-router", Side::Aircraft).unwrap_err();
            assert!(refused.to_string().contains(said), "{refused}");
        }
        let copy = |from: &'static str, to: &'static str| {
            move |folder: &Path| {
                std::fs::copy(folder.join(from), folder.join(to)).unwrap();
            }
        };
        let text = |file: &'static str| move |folder: &Path| std::fs::write(folder.join(file), "nonsense").unwrap();
        spoiled(&[], |folder| std::fs::remove_file(folder.join("uav1-router/key.pem")).unwrap(), "cannot read");
        spoiled(&[], text("uav1-router/certificate.pem"), "holds no certificate");
        spoiled(&[], text("uav1-router/authority.pem"), "holds no certificate");
        spoiled(&[], text("uav1-router/key.pem"), "holds no private key");
        spoiled(&[], copy("uav2-router/key.pem", "uav1-router/key.pem"), "is not the key");
        let other = copy("uav2-router/certificate.pem", "uav1-router/certificate.pem");
        spoiled(&[], other, "is the certificate of `uav2-router`, expected that of `uav1-router`");
        spoiled(&["--days=-1"], |_| (), "is valid from");
        let open = |folder: &Path| {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::Permissions::from_mode(0o644);
            std::fs::set_permissions(folder.join("uav1-router/key.pem"), mode).unwrap();
        };
        spoiled(&[], open, "may be read by others");
        let foreign = |folder: &Path| {
            let elsewhere = tempfile::tempdir().unwrap();
            run(elsewhere.path(), &[]).unwrap();
            std::fs::copy(elsewhere.path().join("uav1-router/authority.pem"), folder.join("uav1-router/authority.pem"))
                .unwrap();
        };
        spoiled(&[], foreign, "has not signed it");
    }
}
