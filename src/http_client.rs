//! HTTP requests to a gateway: plain, or TLS under a given authority.

use std::path::Path;
use std::time::Duration;

use reqwest::blocking::{Client, ClientBuilder};
use reqwest::redirect::Policy;
use reqwest::tls::Certificate;

/// A client for `url`. With `ca`, a PEM file, the server's certificate must be signed by one of its certificates;
/// without it, by one of the operating system's. Without `limit` a response may take any time, as an event stream does.
pub fn client(url: &str, ca: Option<&Path>, limit: Option<Duration>) -> Result<Client, String> {
    // A redirection would carry the order to another address than the one that was named.
    let builder = Client::builder().timeout(limit).redirect(Policy::none());
    trusting(builder, url, ca)?.build().map_err(|it| root_cause(&it))
}

fn trusting(builder: ClientBuilder, url: &str, ca: Option<&Path>) -> Result<ClientBuilder, String> {
    let Some(ca) = ca else {
        // Without encryption no certificate is checked, so a machine without CA certificates can be used as well.
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

/// The innermost cause of an error; the outer ones only say that something failed.
pub fn root_cause(error: &dyn std::error::Error) -> String {
    std::iter::successors(Some(error), |it| it.source()).last().map(ToString::to_string).unwrap_or_default()
}
