//! Whether a set that is there already is whole. A power loss, a full disk or somebody's hand may have left files empty, or taken them
//! away: a set that is kept like that keeps the link down for ever.
//!
//! It mends nothing: replacing an authority unasked cuts off every router that trusts the previous one. Nor does it
//! look at what time and revocations do to a certificate: the routers report that.

use std::path::Path;

use bus::crossing::Side;
use bus::link_credentials::{self, AUTHORITY, CERTIFICATE, InvalidLinkCredentials, KEY};
use rustls::pki_types::PrivateKeyDer;
use rustls::pki_types::pem::PemObject;

use super::authority::read;
use super::{AUTHORITY_FOLDER, Failure, Router, issued};

/// Checks that the set in `root` has all files of the authority and of these routers, and that each can be used.
///
/// # Errors
/// If it is not whole: what is wrong with which files, and what to do.
pub(super) fn check(root: &Path, routers: &[Router]) -> Result<(), Failure> {
    let folder = root.join(AUTHORITY_FOLDER);
    let of_authority = said([certificate(&folder.join(CERTIFICATE)), key(&folder.join(KEY))]);
    let of_routers = routers.iter().map(|it| (it.name.as_str(), of_router(root, &it.name)));
    let of_routers: Vec<_> = of_routers.filter(|(_, wrong)| !wrong.is_empty()).collect();
    if of_authority.is_empty() && of_routers.is_empty() {
        return Ok(());
    }
    let names: Vec<_> = of_routers.iter().map(|(name, _)| *name).collect();
    let remedy = remedy(root, of_authority.is_empty(), &names);
    let wrong: Vec<_> = of_authority.into_iter().chain(of_routers.into_iter().flat_map(|(_, wrong)| wrong)).collect();
    Err(Failure::NotWhole { wrong: wrong.join("; "), remedy })
}

/// What is wrong with a router's files.
fn of_router(root: &Path, name: &str) -> Vec<String> {
    let folder = root.join(name);
    let wrong =
        said([certificate(&folder.join(AUTHORITY)), certificate(&folder.join(CERTIFICATE)), key(&folder.join(KEY))]);
    if !wrong.is_empty() {
        return wrong;
    }
    // A renewal that was cut short leaves the key of another certificate. Which side it is on does not matter for that.
    match link_credentials::check(&folder, name, Side::Aircraft) {
        Err(it @ InvalidLinkCredentials::OtherKey { .. }) => vec![it.to_string()],
        _ => Vec::new(),
    }
}

/// What puts it right. A router is renewed under its authority if it is known for which hosts.
fn remedy(root: &Path, has_authority: bool, spoiled: &[&str]) -> String {
    let copies = issued::copies(&root.join(AUTHORITY_FOLDER)).unwrap_or_default();
    let issued: Vec<_> = copies.into_iter().filter_map(|(_, copy)| copy.ok()).collect();
    let is_known = |name: &str| {
        issued.iter().any(|it| it.name == name) || issued::of_file(&root.join(name).join(CERTIFICATE)).is_ok()
    };
    let at = root.display();
    if has_authority && spoiled.iter().all(|it| is_known(it)) {
        let commands: Vec<_> = spoiled.iter().map(|it| format!("`kittiwake certs renew {at} {it}`")).collect();
        return format!("run {}, then this again", commands.join(" and "));
    }
    format!(
        "put these files back; or remove what is in the folders of the authority and of the routers in {at} and run this \
         again, which makes another authority: each router then needs its new files"
    )
}

fn said<const N: usize>(files: [Result<(), Failure>; N]) -> Vec<String> {
    files.into_iter().filter_map(Result::err).map(|it| it.to_string()).collect()
}

fn certificate(path: &Path) -> Result<(), Failure> {
    issued::of_file(path).map(drop)
}

fn key(path: &Path) -> Result<(), Failure> {
    let key = PrivateKeyDer::from_pem_slice(read(path)?.as_bytes());
    key.map(drop).map_err(|_| Failure::Malformed { path: path.to_owned(), expected: "private key" })
}
