//! TLS: trusted authorities, and the client's certificate.

use crate::BridgeError;
use rumqttc::TlsConfiguration;
use rustls::pki_types::pem::PemObject as _;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ClientConfig, RootCertStore};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files in PEM.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tls {
    /// The only trusted authorities; `None`: those of the system.
    pub authorities: Option<PathBuf>,
    /// The client's certificate for the broker, with the intermediate ones.
    pub certificate: Option<PathBuf>,
    /// Its private key.
    pub key: Option<PathBuf>,
}

impl Tls {
    pub(super) fn set(&mut self, key: &str, file: &str) {
        let place = match key {
            "ca" => &mut self.authorities,
            "cert" => &mut self.certificate,
            _ => &mut self.key,
        };
        *place = Some(file.into());
    }

    /// Reads the files.
    pub(super) fn configuration(&self) -> Result<TlsConfiguration, BridgeError> {
        let provider = Arc::new(rustls::crypto::ring::default_provider());
        let builder = ClientConfig::builder_with_provider(provider)
            .with_safe_default_protocol_versions()
            .map_err(|error| BridgeError::Configuration(format!("TLS: {error}")))?
            .with_root_certificates(self.roots()?);
        let configuration = match (&self.certificate, &self.key) {
            (None, None) => builder.with_no_client_auth(),
            (Some(certificate), Some(key)) => {
                let chain = certificates(certificate)?;
                let secret = PrivateKeyDer::from_pem_file(key).map_err(|error| unusable(key, &error))?;
                builder.with_client_auth_cert(chain, secret).map_err(|error| unusable(certificate, &error))?
            }
            _ => return Err(BridgeError::Configuration("`cert` and `key` go together".to_owned())),
        };
        Ok(TlsConfiguration::Rustls(Arc::new(configuration)))
    }

    fn roots(&self) -> Result<RootCertStore, BridgeError> {
        let mut roots = RootCertStore::empty();
        let found = match &self.authorities {
            Some(file) => certificates(file)?,
            None => rustls_native_certs::load_native_certs().certs,
        };
        let (added, _unusable) = roots.add_parsable_certificates(found);
        if added == 0 {
            let place =
                self.authorities.as_ref().map_or("the system".to_owned(), |file| file.display().to_string());
            return Err(BridgeError::Configuration(format!(
                "{place} has no certificate of an authority; set `ca=FILE`"
            )));
        }
        Ok(roots)
    }
}

fn certificates(file: &Path) -> Result<Vec<CertificateDer<'static>>, BridgeError> {
    let found = CertificateDer::pem_file_iter(file).map_err(|error| unusable(file, &error))?;
    found.collect::<Result<_, _>>().map_err(|error| unusable(file, &error))
}

fn unusable(file: &Path, error: &dyn std::fmt::Display) -> BridgeError {
    BridgeError::Configuration(format!("{}: {error}", file.display()))
}
