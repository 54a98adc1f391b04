//! What zenoh's configuration says about the link. What it says about certificates are paths; `credentials` reads them.

use std::path::PathBuf;

use credentials::{CALLER, Credentials, InvalidCredentials};
use rustls::ClientConfig;
use zenoh_link_commons::tcp::TcpSocketConfig;
use zenoh_link_commons::tls::config::*;
use zenoh_link_commons::{ConfigurationInspector, TCP_SO_RCV_BUF, TCP_SO_SND_BUF};
use zenoh_protocol::core::{endpoint, parameters};
use zenoh_result::{ZResult, bail, zerror};

use crate::link::common_name;

/// Takes from zenoh's configuration what every locator of this link gets to know.
#[derive(Debug, Default, Clone, Copy)]
pub struct TlsConfigurator;

impl ConfigurationInspector<zenoh_config::Config> for TlsConfigurator {
    fn inspect_config(&self, config: &zenoh_config::Config) -> ZResult<String> {
        let tls = config.transport().link().tls();
        let always = [
            (TLS_ENABLE_MTLS, tls.enable_mtls()),
            (TLS_VERIFY_NAME_ON_CONNECT, tls.verify_name_on_connect()),
            (TLS_CLOSE_LINK_ON_EXPIRATION, tls.close_link_on_expiration()),
        ];
        if let Some((name, _)) = always.iter().find(|(_, set)| **set == Some(false)) {
            bail!("`{name}` cannot be turned off");
        }
        let inline = [
            tls.root_ca_certificate_base64(),
            tls.listen_certificate_base64(),
            tls.listen_private_key_base64(),
            tls.connect_certificate_base64(),
            tls.connect_private_key_base64(),
        ];
        if inline.iter().any(|it| it.is_some()) {
            bail!("certificates and keys are taken from files only");
        }
        let (send, receive) = (tls.so_sndbuf().map(|it| it.to_string()), tls.so_rcvbuf().map(|it| it.to_string()));
        let set = [
            (TLS_ROOT_CA_CERTIFICATE_FILE, tls.root_ca_certificate()),
            (TLS_LISTEN_CERTIFICATE_FILE, tls.listen_certificate()),
            (TLS_LISTEN_PRIVATE_KEY_FILE, tls.listen_private_key()),
            (TLS_CONNECT_CERTIFICATE_FILE, tls.connect_certificate()),
            (TLS_CONNECT_PRIVATE_KEY_FILE, tls.connect_private_key()),
            (TCP_SO_SND_BUF, &send),
            (TCP_SO_RCV_BUF, &receive),
        ];
        Ok(parameters::from_iter(set.iter().filter_map(|(name, value)| Some((*name, value.as_deref()?)))))
    }
}

/// Options of the socket: how much the kernel holds back.
pub(crate) fn socket<'a>(config: &endpoint::Config) -> ZResult<TcpSocketConfig<'a>> {
    let bytes = |name| {
        let value =
            config.get(name).map(|it| it.parse::<u32>().map_err(|_| zerror!("`{name}`: found `{it}`, expected bytes")));
        value.transpose()
    };
    Ok(TcpSocketConfig::new(bytes(TCP_SO_SND_BUF)?, bytes(TCP_SO_RCV_BUF)?, None, None, None))
}

/// The credentials of the end that is called.
pub(crate) fn of_listener(config: &endpoint::Config) -> ZResult<Credentials> {
    named(config, TLS_LISTEN_CERTIFICATE_FILE, TLS_LISTEN_PRIVATE_KEY_FILE)
}

/// The end that calls.
pub(crate) fn of_caller(config: &endpoint::Config) -> ZResult<Caller> {
    let credentials = named(config, TLS_CONNECT_CERTIFICATE_FILE, TLS_CONNECT_PRIVATE_KEY_FILE)?;
    Ok(Caller { credentials, name: config.get(CALLER).map(str::to_owned) })
}

/// Who calls.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Caller {
    pub(crate) credentials: Credentials,
    /// What its certificate must bear; anything without.
    name: Option<String>,
}

impl Caller {
    /// TLS by the files as they are now. The certificate of another one is refused here, where it would be shown: at any earlier
    /// moment it may not be there yet, and with it this end would pass for the other one.
    pub(crate) fn client(&self) -> Result<ClientConfig, InvalidCredentials> {
        let chain = self.credentials.chain()?;
        let found = chain.first().and_then(|it| common_name(it).ok()).unwrap_or_default();
        match &self.name {
            Some(expected) if found != *expected => Err(InvalidCredentials::Unusable {
                path: self.credentials.certificate.clone(),
                cause: format!("it is the certificate of `{found}`, expected that of `{expected}`"),
            }),
            _ => self.credentials.client_with(chain),
        }
    }
}

fn named(config: &endpoint::Config, certificate: &str, key: &str) -> ZResult<Credentials> {
    let file = |name: &str| config.get(name).map(PathBuf::from).ok_or_else(|| zerror!("`{name}` is not set"));
    Ok(Credentials { authority: file(TLS_ROOT_CA_CERTIFICATE_FILE)?, certificate: file(certificate)?, key: file(key)? })
}
