//! What the link is told by zenoh's configuration, and what follows for TLS.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::crypto::ring;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::server::WebPkiClientVerifier;
use rustls::version::TLS13;
use rustls::{ClientConfig, RootCertStore, ServerConfig};
use zenoh_link_commons::tcp::TcpSocketConfig;
use zenoh_link_commons::tls::config::*;
use zenoh_link_commons::{ConfigurationInspector, TCP_SO_RCV_BUF, TCP_SO_SND_BUF};
use zenoh_protocol::core::{endpoint, parameters};
use zenoh_result::{ZResult, bail, zerror};

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

/// Where the certificates are: what one end shows, and whom it trusts. All in PEM form.
#[derive(Debug, Clone)]
pub struct Papers {
    /// The certificate of the authority that signed the other end's.
    pub authority: PathBuf,
    /// The own certificate, and those between it and the authority.
    pub certificate: PathBuf,
    /// The key to it.
    pub key: PathBuf,
}

impl Papers {
    /// Of the end that is called.
    pub(crate) fn of_listener(config: &endpoint::Config) -> ZResult<Papers> {
        Papers::named(config, TLS_LISTEN_CERTIFICATE_FILE, TLS_LISTEN_PRIVATE_KEY_FILE)
    }

    /// Of the end that calls.
    pub(crate) fn of_caller(config: &endpoint::Config) -> ZResult<Papers> {
        Papers::named(config, TLS_CONNECT_CERTIFICATE_FILE, TLS_CONNECT_PRIVATE_KEY_FILE)
    }

    fn named(config: &endpoint::Config, certificate: &str, key: &str) -> ZResult<Papers> {
        let file = |name: &str| config.get(name).map(PathBuf::from).ok_or_else(|| zerror!("`{name}` is not set"));
        Ok(Papers { authority: file(TLS_ROOT_CA_CERTIFICATE_FILE)?, certificate: file(certificate)?, key: file(key)? })
    }

    /// For who calls.
    ///
    /// # Errors
    /// In words, when a file cannot be used.
    pub fn client(&self) -> Result<ClientConfig, String> {
        let (chain, key) = self.shown()?;
        ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
            .with_protocol_versions(&[&TLS13])
            .map_err(|cause| cause.to_string())?
            .with_root_certificates(self.trusted()?)
            .with_client_auth_cert(chain, key)
            .map_err(|cause| format!("{}: {cause}", self.certificate.display()))
    }

    /// For who is called.
    ///
    /// # Errors
    /// In words, when a file cannot be used.
    pub fn server(&self) -> Result<ServerConfig, String> {
        let (chain, key) = self.shown()?;
        let provider = Arc::new(ring::default_provider());
        let callers = WebPkiClientVerifier::builder_with_provider(self.trusted()?.into(), provider.clone()).build();
        let mut server = ServerConfig::builder_with_provider(provider)
            .with_protocol_versions(&[&TLS13])
            .map_err(|cause| cause.to_string())?
            .with_client_cert_verifier(callers.map_err(|cause| format!("{}: {cause}", self.authority.display()))?)
            .with_single_cert(chain, key)
            .map_err(|cause| format!("{}: {cause}", self.certificate.display()))?;
        // Every connection begins with both certificates, so tickets to a shorter way would only take up the link.
        server.send_tls13_tickets = 0;
        Ok(server)
    }

    fn shown(&self) -> Result<(Vec<CertificateDer<'static>>, PrivateKeyDer<'static>), String> {
        let key =
            PrivateKeyDer::from_pem_file(&self.key).map_err(|cause| format!("{}: {cause}", self.key.display()))?;
        Ok((certificates(&self.certificate)?, key))
    }

    fn trusted(&self) -> Result<RootCertStore, String> {
        let mut roots = RootCertStore::empty();
        for it in certificates(&self.authority)? {
            roots.add(it).map_err(|cause| format!("{}: {cause}", self.authority.display()))?;
        }
        Ok(roots)
    }
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, String> {
    let found = CertificateDer::pem_file_iter(path).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    found.map_err(|cause| format!("{}: {cause}", path.display()))
}
