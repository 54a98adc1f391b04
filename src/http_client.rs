//! HTTP requests to a gateway: plain, or TLS under a given authority.

use std::net::IpAddr;
use std::path::Path;
use std::time::Duration;

use reqwest::Url;
use reqwest::blocking::{Client, ClientBuilder};
use reqwest::header::{AUTHORIZATION, HeaderMap, HeaderValue};
use reqwest::redirect::Policy;
use reqwest::tls::Certificate;

/// The address of a gateway, or of a document there.
///
/// # Errors
/// If it is not one.
pub fn parse(url: &str) -> Result<Url, String> {
    let parsed = Url::parse(url).ok().filter(|it| !it.cannot_be_a_base());
    parsed.ok_or_else(|| format!("found `{url}`, expected a URL like http://127.0.0.1:8080"))
}

/// A connection that was idle for longer is not used again: a gateway closes one after its `head_timeout_s`, perhaps while a request is on
/// its way.
const IDLE: Duration = Duration::from_secs(5);

/// A client for `url`, which sends `token` with each request, unless it is empty. With `ca`, a PEM file, the server's certificate must be
/// signed by one of its certificates; without it, by one of the operating system's. Without `limit` a response may take any time, as an
/// event stream does.
///
/// # Errors
/// If the CA cannot be used, or the token would leave this machine without encryption.
pub fn client(url: &Url, token: &str, ca: Option<&Path>, limit: Option<Duration>) -> Result<Client, String> {
    let (is_plain, is_local) = (url.scheme() != "https", is_loopback(url));
    // A redirection would carry the order to another address than the one that was named.
    let mut builder = Client::builder().timeout(limit).redirect(Policy::none()).pool_idle_timeout(IDLE);
    if is_local {
        // A proxy of the environment reaches another loopback than ours, and would read the token.
        builder = builder.no_proxy();
    }
    if !token.is_empty() {
        if is_plain && !is_local {
            return Err(format!(
                "no token is sent to {url} without encryption, where others could read it: use https://"
            ));
        }
        builder = builder.default_headers(HeaderMap::from_iter([(AUTHORIZATION, bearer(token)?)]));
    }
    trusting(builder, is_plain, ca)?.build().map_err(|it| root_cause(&it))
}

/// Whether what is sent there stays on this machine. A gateway that listens on each address is reached by the unspecified one.
fn is_loopback(url: &Url) -> bool {
    let host = url.host_str().unwrap_or_default().trim_matches(['[', ']']);
    let address = host.parse().map(|it: IpAddr| it.to_canonical());
    host == "localhost" || address.is_ok_and(|it| it.is_loopback() || it.is_unspecified())
}

fn bearer(token: &str) -> Result<HeaderValue, String> {
    let value = HeaderValue::from_str(&format!("Bearer {token}"));
    let mut value = value.map_err(|_| "the token has characters that no token has, expected printable ones")?;
    value.set_sensitive(true);
    Ok(value)
}

fn trusting(builder: ClientBuilder, is_plain: bool, ca: Option<&Path>) -> Result<ClientBuilder, String> {
    let Some(ca) = ca else {
        // Without encryption no certificate is checked, so a machine without CA certificates can be used as well.
        return Ok(if is_plain { builder.tls_certs_only([]) } else { builder });
    };
    let pem = regular_file::read(ca).map_err(|cause| format!("{}: cannot be read: {cause}", ca.display()))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_goes_over_plain_http_to_this_machine_only() {
        #[track_caller]
        fn check(url: &str, is_sent: bool) {
            // Fails if another test was quicker.
            let _ = rustls::crypto::ring::default_provider().install_default();
            let url = parse(url).unwrap();
            assert_eq!(client(&url, "secret", None, None).is_ok(), is_sent, "{url}");
            assert!(client(&url, "", None, None).is_ok(), "{url}");
        }
        for local in [
            "127.0.0.1:8080",
            "127.9.9.9",
            "127.1",
            "[::1]:8080",
            "[::ffff:127.0.0.1]",
            "localhost:8080",
            "0.0.0.0:8080",
        ] {
            check(&format!("http://{local}"), true);
        }
        for far in ["ground:8080", "10.0.0.1", "[fe80::1]", "localhost.example", "127.0.0.1.example"] {
            check(&format!("http://{far}"), false);
        }
        check("HTTP://ground", false);
    }
}
