//! The program's own way to a gateway: plain, or TLS under a CA that one trusts.

use std::path::Path;
use std::time::Duration;

use reqwest::blocking::{Client, ClientBuilder};
use reqwest::redirect::Policy;
use reqwest::tls::Certificate;

/// A client for `url`. `ca` is a PEM file with whose certificates the server's is checked, and with no
/// others; without it those of the operating system count. No `limit` is for what goes on until it is ended.
pub fn client(url: &str, ca: Option<&Path>, limit: Option<Duration>) -> Result<Client, String> {
    // A redirection would carry the order somewhere that nobody has named.
    let builder = Client::builder().timeout(limit).redirect(Policy::none());
    trusting(builder, url, ca)?.build().map_err(|it| root_cause(&it))
}

fn trusting(builder: ClientBuilder, url: &str, ca: Option<&Path>) -> Result<ClientBuilder, String> {
    let Some(ca) = ca else {
        // Where nothing is encrypted nothing is checked, and a machine without CA certificates is as good as any.
        let is_plain = url.starts_with("http://");
        return Ok(if is_plain { builder.tls_certs_only([]) } else { builder });
    };
    let pem = std::fs::read(ca).map_err(|cause| format!("{}: cannot be read: {cause}", ca.display()))?;
    let certificates = Certificate::from_pem_bundle(&pem).unwrap_or_default();
    if certificates.is_empty() {
        return Err(format!("{}: holds no certificate, expected PEM", ca.display()));
    }
    Ok(builder.tls_certs_only(certificates))
}

/// What lies at the bottom of an error; the layers above only say that something failed.
pub fn root_cause(error: &dyn std::error::Error) -> String {
    std::iter::successors(Some(error), |it| it.source()).last().map(ToString::to_string).unwrap_or_default()
}
